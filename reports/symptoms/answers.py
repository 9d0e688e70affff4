"""The answer to a symptom, as plain data: from what was found to scenes, engines that pass or fail, and fixes."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

from reports.symptoms import OUTSIDE, Found, Match, search, table

#: What an answer is, beside `OUTSIDE`: one scene, another command, several scenes, a page of the docs, or nothing.
SCENE, COMMAND, SEVERAL, PAGE, NOTHING = "scene", "command", "several", "page", "nothing"
#: Candidates where no match is clear, and lines about what an engine does where nothing is set.
CANDIDATES, LINES = 3, 4
#: Share of a word that another one has at least, where that one may be meant: four letters of five.
ALIKE = 0.8

Plain = dict[str, Any]


def answer(question: str) -> Plain:
    """Answer a question: the name of a scene, the number of a known report, or a symptom.

    Returns
    -------
    ``answer``, which of the kinds above it is, and what belongs to it; empty where it does not apply.

    Raises
    ------
    NoSearch
        If this Python's SQLite has no FTS5.
    """
    found = search(question)
    kept = table()
    told: Plain = {
        "answer": NOTHING, "scene": "", "title": "", "law": "", "line": "", "says": "", "command": "", "report": {},
        "candidates": [], "missed": list(found.missed), "asked": list(found.engines),
        "strangers": list(found.strangers), "engines": [], "passes": [], "fails": [], "fixed": [], "page": "",
        "unset": {},
    }  # fmt: skip
    named = [source for source in kept["reports"] if any(_is_number(word, source) for word in question.split())]
    name = "_".join(word for word in question.lower().split() if kept["names"].get(word) is None)
    if named:
        report = kept["reports"][named[0]]
        told["missed"], told["asked"] = [], told["asked"] or report["engines"][:1]
        return told | _of_scene(report["scene"], told["asked"], found, named[0])
    if name in kept["scenes"]:
        return told | {"missed": []} | _of_scene(name, found.engines, found)
    if not found.is_shown:
        return told | {"candidates": _candidates(found)[:1]}
    first = found.matches[0]
    if first.name.startswith(f"{OUTSIDE}/"):
        near = [each for each in _candidates(found) if each["scene"]]
        return told | _of_topic(OUTSIDE, ()) | {"answer": OUTSIDE, "missed": [], "candidates": near[:1]}
    own = kept["topics"].get(first.name, {"terms": ()})["terms"] if found.is_clear else ()
    unset = {engine: _unset(engine, found, own) for engine in found.engines}
    if candidates := [] if found.is_clear else _candidates(found):
        return told | {"answer": SEVERAL, "candidates": candidates, "unset": unset}
    if first.name in kept["scenes"]:
        return told | _of_scene(first.name, found.engines, found)
    if first.name in kept["topics"]:
        return told | _of_topic(first.name, found.engines) | {"answer": COMMAND, "missed": [], "unset": unset}
    return told | {"answer": PAGE, "title": first.line, "page": f"{first.name}.md"}


def near(words: Sequence[str]) -> dict[str, str]:
    """Of words that nothing has those that may be a misspelt engine, scene or topic, each with that name."""
    known = [name for kind in ("names", "scenes", "topics") for name in table()[kind]]
    close = {word: difflib.get_close_matches(word.lower(), known, n=1, cutoff=ALIKE) for word in words}
    return {word: found[0] for word, found in close.items() if found}


def _is_number(word: str, source: str) -> bool:
    return "#" in word and source.lower().endswith(word.lower().strip(".,;:?!()"))


def _candidates(found: Found) -> list[Plain]:
    """The first scenes and topics, each once: a scene with verdicts of engines asked for, a topic with a command."""
    kept = table()
    told: dict[str, Plain] = {}
    for name in (match.name.partition("/")[0] for match in found.matches):
        if name in kept["scenes"]:
            verdicts = {engine: said for engine in found.engines if (said := _verdict(kept["engines"][engine], name))}
            told.setdefault(name, {"scene": name, "title": kept["scenes"][name]["title"], "command": ""})
            told[name]["verdicts"] = verdicts
        elif name in kept["topics"] and name != OUTSIDE:
            topic = _of_topic(name, found.engines)
            told.setdefault(name, {"scene": "", "title": topic["says"], "command": topic["command"], "verdicts": {}})
        if len(told) == CANDIDATES:
            break
    return list(told.values())


def _verdict(engine: Mapping[str, Any], scene: str) -> str:
    """In a word; empty where no result is on record yet."""
    rows = engine["scenes"].get(scene, ())
    if not rows:
        return "does not run it" if scene in engine["refused"] else ""
    return "fails" if any(row[1] for row in rows) else "passes"


def _of_topic(name: str, asked: Sequence[str]) -> Plain:
    topic = table()["topics"][name]
    command = topic["command"].replace("ENGINE", next(iter(asked), "ENGINE"))
    near = topic["near"]
    nearest = {"scene": near, "title": table()["scenes"][near]["title"]} if near else {}
    return {"says": topic["says"], "command": command} | nearest


def _of_scene(name: str, asked: Sequence[str], found: Found, source: str = "") -> Plain:
    """The answer that one scene is, for some engines; without any, for those with a fix."""
    kept = table()
    scene, fixes = kept["scenes"][name], {fix["engine"]: fix for fix in kept["fixes"].get(name, ())}
    # Newton's cradle is no question about Newton.
    asked = [engine for engine in asked if engine not in scene["title"].lower()]
    match = next((match for match in found.matches if match.name == name), Match(name, 0.0, 0.0, 0.0, False, False, ""))
    by_engine = {engine: _of_engine(engine, name, found, fixes.get(engine)) for engine in kept["engines"]}
    return {
        "answer": SCENE, "scene": name, "title": scene["title"], "law": scene["law"],
        "line": match.line if match.line != scene["title"] else "",
        "says": kept["right"].get(match.line, ""), "report": _report(name, source, match.line, asked),
        "engines": [by_engine[engine] for engine in asked],
        "passes": [engine for engine, told in by_engine.items() if told["judged"] and not told["failed"]],
        "fails": [engine for engine, told in by_engine.items() if told["failed"]],
        "fixed": [engine for engine, fix in fixes.items() if fix["helps"]],
    }  # fmt: skip


def _report(scene: str, source: str, line: str, asked: Sequence[str]) -> Plain:
    """The known report that was named, or whose symptom is nearest: none about other engines than those asked for."""
    for each, report in table()["reports"].items():
        is_meant = each == source if source else report["symptom"] == line and report["scene"] == scene
        if is_meant and (source or not asked or set(asked) & set(report["engines"])):
            return {"source": each, "symptom": report["symptom"]}
    return {}


def _of_engine(engine: str, scene: str, found: Found, fix: Mapping[str, Any] | None) -> Plain:
    """What is on record of one engine on a scene: failed checks, a profile that passes, its fix, its defaults."""
    kept = table()["engines"][engine]
    rows = kept["scenes"].get(scene, [])
    failed, judged = sum(row[1] for row in rows), sum(row[2] for row in rows)
    return {
        "engine": engine, "release": kept["release"], "suite": kept["suite"], "failed": failed, "judged": judged,
        "refused": kept["refused"].get(scene, ""),
        "known": any(scene in each["scenes"] for each in table()["engines"].values()),
        "where": [f"{dimension}-D" for dimension, wrong, *_ in rows if wrong],
        "better": kept["better"] if rows and all(row[3] == 0 for row in rows) else "",
        "fix": dict(fix or {}),
        "others": [
            {"source": source, "metric": each["metric"], "cure": each["cure"]}
            for source, each in table()["reports"].items()
            if each["scene"] == scene and each["engines"][0] == engine and each["cure"] and fix
            and each["cure"] not in fix["text"]
        ],
        "unset": _unset(engine, found, table()["scenes"][scene]["terms"]),
    }  # fmt: skip


def _unset(engine: str, found: Found, own: Sequence[str] = ()) -> list[Plain]:
    """What the engine does where nothing is set, as far as the question or ``own`` terms of its answer are about it."""
    rows, asked = table()["engines"][engine]["unset"], set(found.terms)
    near = sorted(
        (-2 * len(asked & set(terms)) - len(set(own) & set(terms)), k) for k, (_, _, terms) in enumerate(rows)
    )
    chosen = sorted(k for score, k in near[:LINES] if score < 0)
    return [{"what": rows[k][0], "how": rows[k][1]} for k in chosen]
