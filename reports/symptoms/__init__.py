"""Finds what shows a symptom in somebody's own words: a full-text search in a table of the package.

``table.json`` is made of the scenes, known reports, fixes, published results, the docs' pages and ``words.toml``
(`reports.symptoms.making`), so that a question imports neither scenes nor engines. SQLite's FTS5 brings stems (Porter
1980) and ranking (BM25, Robertson and Zaragoza 2009). `reports.symptoms.answers` makes an answer of what is found.
"""

from __future__ import annotations

import json
import math
import re
import sqlite3
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

TABLE = Path(__file__).parent / "table.json"
#: What is known of a scene or topic, with its weight in a rank. Physics: law, metrics, and their words.
COLUMNS = {"title": 2.0, "symptoms": 1.0, "reports": 0.7, "physics": 0.3}
#: Share of the nearest line in a rank; the rest is that of all that is known of a scene.
LINE = 0.5
#: Power, in the rank of a line, of the share of it that the question has: a jittering capsule is about capsules.
OWN = 0.5
#: Name of what is out of scope, and its weight in a rank: a rope or a camera says more than the verbs beside it.
OUTSIDE, APART = "outside", 1.5
#: Weight of the other topics, which no scene shows.
TOPIC = 0.8
#: Weight of a word that nothing has; one that a single scene has weighs 4.5.
UNKNOWN = 1.5
#: A match is clear if its nearest line has this share of the question, by weight, if it is nearly the first both as a
#: whole and by its nearest line, and if the next has at most this share of its rank.
SAID, NEARLY, NEXT = 0.55, 0.9, 0.8
#: Share of the question below which nothing shows it.
LEAST = 0.25
#: What may stand beside a word.
MARKS = ".,;:?!()\"'"
#: Most words of a phrase in `words.toml`.
PHRASE = 5
#: Stems that no phrase needs: "restitution is zero" is "restitution zero".
LITTLE = frozenset(("a", "an", "the", "i", "is", "are", "wa", "were", "be", "it", "my", "of"))


class NoSearch(ModuleNotFoundError):
    """SQLite of this Python has no full-text search."""


@dataclass(frozen=True)
class Match:
    """A scene or topic that may show a symptom.

    Parameters
    ----------
    name
        Of the scene or topic.
    rank
        Larger is better; at most 1.
    known, said
        Share of the question that it has, by weight; ``said``: that its nearest line has.
    is_first
        Whether it is nearly the first both as a whole and by its nearest line.
    is_exact
        Whether it alone has a line of just these words.
    line
        The line that is nearest to the question: a symptom, a title or a known report; empty if none is.
    """

    name: str
    rank: float
    known: float
    said: float
    is_first: bool
    is_exact: bool
    line: str


@dataclass(frozen=True)
class Found:
    """What a question leads to.

    Parameters
    ----------
    matches
        Scenes and topics, the best first.
    terms
        The question's words, those that mean the same as one.
    missed
        Its words that nothing has.
    engines
        Engines that it names, by our names; ``strangers`` have no adapter.
    """

    matches: Sequence[Match]
    terms: Sequence[str]
    missed: Sequence[str]
    engines: Sequence[str]
    strangers: Sequence[str]

    @property
    def is_shown(self) -> bool:
        """Whether any scene or topic shows it."""
        return bool(self.matches) and self.matches[0].known >= LEAST

    @property
    def is_clear(self) -> bool:
        """Whether the first match is the answer."""
        first, *others = self.matches or (None,)
        if first is None or first.is_exact:
            return first is not None
        return first.said >= SAID and first.is_first and all(each.rank <= NEXT * first.rank for each in others)


@cache
def table() -> dict[str, Any]:
    """All that is kept; `reports.symptoms.making` says what."""
    kept: dict[str, Any] = json.loads(TABLE.read_text(encoding="utf-8"))
    return kept


def search(question: str) -> Found:
    """Find what shows a symptom.

    Raises
    ------
    NoSearch
        If this Python's SQLite has no FTS5.
    """
    kept = table()
    readable = question.encode("utf-8", "replace").decode()  # bytes of a shell may be no text
    words, engines, strangers = _without_names(readable, kept["names"])
    database = opened()
    try:
        pairs = [(stem, word) for word, own in zip(words, stems(words, database), strict=True) for stem in own]
        asked = list(dict.fromkeys(terms([stem for stem, _ in pairs], kept["same"], kept["idle"])))
        matches, missed = _ranked(asked, kept["rows"], kept["topics"], database) if asked else ([], [])
    finally:
        database.close()
    word_of = {stem: word.strip(MARKS) for stem, word in pairs}
    return Found(matches, asked, [word_of.get(term, term) for term in missed], engines, strangers)


def opened() -> sqlite3.Connection:
    """A database in memory that makes stems.

    Raises
    ------
    NoSearch
        If this Python's SQLite has no FTS5.
    """
    database = sqlite3.connect(":memory:")
    try:
        database.execute("CREATE VIRTUAL TABLE words USING fts5(text, tokenize = 'porter unicode61')")
    except sqlite3.OperationalError:
        raise NoSearch(
            name=f"SQLite's full-text search FTS5, which ask needs (SQLite {sqlite3.sqlite_version})"
        ) from None
    database.execute("CREATE VIRTUAL TABLE instances USING fts5vocab(words, instance)")
    return database


def stems(texts: Iterable[str], database: sqlite3.Connection) -> list[list[str]]:
    """Stems of the words of each text, in their order; an apostrophe divides no word, and a point no number."""
    plain = [re.sub("['\N{RIGHT SINGLE QUOTATION MARK}]", "", text) for text in texts]
    plain = [re.sub(r"(?<=\d)\.(?=\d)", "p", text) for text in plain]
    database.execute("DELETE FROM words")
    database.executemany("INSERT INTO words(rowid, text) VALUES (?, ?)", enumerate(plain))
    found: list[list[str]] = [[] for _ in plain]
    for row, stem in database.execute("SELECT doc, term FROM instances ORDER BY doc, offset"):
        found[row].append(stem)
    return found


def terms(stemmed: Sequence[str], same: Mapping[str, str], idle: Collection[str]) -> list[str]:
    """Terms of a text: words and phrases that mean the same are one, the longest first; numbers are none."""
    found = []
    rest = [stem for stem in stemmed if stem not in LITTLE]
    while rest:
        length = next((n for n in range(PHRASE, 0, -1) if " ".join(rest[:n]) in same), 1)
        word = " ".join(rest[:length])
        if word in same or not (word in idle or word.isdigit()):
            found.append(same.get(word, word))
        rest = rest[length:]
    return found


def _without_names(question: str, names: Mapping[str, str]) -> tuple[list[str], list[str], list[str]]:
    """Words of a question without engines; the engines, ours and others. A name after an article is a thing."""
    words, engines, strangers = list[str](), list[str](), list[str]()
    for word in question.split():
        plain = word.lower().strip(MARKS)
        if plain not in names or (words and words[-1].lower() in ("a", "an", "the", "my", "each", "every")):
            words.append(word)
        elif names[plain]:
            engines.append(names[plain])
        else:
            strangers.append(word)
    return words, list(dict.fromkeys(engines)), list(dict.fromkeys(strangers))


def _ranked(
    asked: Sequence[str], rows: Sequence[Sequence[str]], topics: Collection[str], database: sqlite3.Connection
) -> tuple[list[Match], list[str]]:
    """Matches for some terms, the best first, and the terms that nothing has."""
    known: dict[str, set[str]] = {term: set() for term in asked}
    for name, _, _, text in rows:
        for term in text.split():
            known.setdefault(term, set()).add(name)
    count = len({name for name, *_ in rows})
    weight = {term: math.log(1.0 + count / len(has)) if has else UNKNOWN for term, has in known.items()}
    total = sum(weight[term] for term in asked)
    exact = {name for name, _, line, text in rows if line and set(text.split()) == set(asked)}
    whole, lines = _ranks(asked, rows, weight, database)
    most, longest = max(whole.values(), default=1.0), max((rank for rank, *_ in lines.values()), default=1.0)
    found = []
    for name, rank in whole.items():
        near, line, text = lines.get(name, (0.0, "", ""))
        share = sum(weight[term] for term in asked if name in known[term]) / total
        said = sum(weight[term] for term in asked if f" {term} " in f" {text} ") / total
        joint = (1.0 - LINE) * rank / most + LINE * near / longest
        joint *= APART if name.startswith(f"{OUTSIDE}/") else TOPIC if name in topics else 1.0
        is_first = rank >= NEARLY * most and near >= NEARLY * longest
        found.append(Match(name, joint * share, share, said, is_first, exact == {name}, line))
    found.sort(key=lambda match: (not match.is_exact, -match.rank))
    return found, [term for term in asked if not known[term]]


def _ranks(
    asked: Sequence[str], rows: Sequence[Sequence[str]], weight: Mapping[str, float], database: sqlite3.Connection
) -> tuple[dict[str, float], dict[str, tuple[float, str, str]]]:
    """BM25 of all that is known of each scene and topic, and of its nearest line, with that line and its terms."""
    database.execute(f"CREATE VIRTUAL TABLE whole USING fts5(name UNINDEXED, {', '.join(COLUMNS)})")
    database.execute("CREATE VIRTUAL TABLE lines USING fts5(name UNINDEXED, shown UNINDEXED, text)")
    texts: dict[str, dict[str, list[str]]] = {}
    for name, column, _, text in rows:
        texts.setdefault(name, {each: [] for each in COLUMNS})[column].append(text)
    database.executemany(
        f"INSERT INTO whole VALUES (?{', ?' * len(COLUMNS)})",
        ((name, *map(" ".join, own.values())) for name, own in texts.items()),
    )
    shown = ((name, line, text) for name, _, line, text in rows if line)
    database.executemany("INSERT INTO lines VALUES (?, ?, ?)", shown)
    anything = (" OR ".join(f'"{term}"' for term in asked),)
    bm25 = f"-bm25(whole, 0, {', '.join(map(str, COLUMNS.values()))})"
    whole = dict(database.execute(f"SELECT name, {bm25} FROM whole WHERE whole MATCH ?", anything))
    lines: dict[str, tuple[float, str, str]] = {}
    ordered = "SELECT name, -bm25(lines), shown, text FROM lines WHERE lines MATCH ? ORDER BY rank"
    for name, rank, line, text in database.execute(ordered, anything):
        own = {term: weight[term] for term in text.split()}
        share = sum(own[term] for term in asked if term in own) / sum(own.values())
        lines[name] = max(lines.get(name, (0.0, "", "")), (rank * share**OWN, line, text), key=lambda each: each[0])
    return whole, lines
