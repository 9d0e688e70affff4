"""Verdicts for the page: lines of the matrix, the checks of each scene, every value of every check."""

from __future__ import annotations

import hashlib
import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Any

from reports.findings import ALARMING, ORDER
from reports.matrix import UNJUDGED, Field, Matrix
from reports.overview import share
from reports.page.source import Source
from reports.wording import MARKS, NEVER, mark_of, measured, number, params_text, reproduce
from validation.cells import format_dt

Plain = Mapping[str, Any]
#: Mark -> sign and word in a field of the page, so that no meaning depends on colour.
SAID = {
    "pass": ("✓", "pass"),
    "explained": ("✗", "explained"),
    "known": ("✗", "known"),
    "fail": ("✗", "FAIL"),
    "new": ("✗", "NEW"),
    "drifted": ("✗", "CHANGED"),
    "diverged": ("✗", "DIVERGED"),
    "invalid": ("!", "INVALID"),
    "refused": ("!", "REFUSED"),
    "declined": ("–", "refused"),
    "crashed": ("!", "CRASHED"),
    "timed_out": ("!", "TIMED OUT"),
    "missing": ("!", "MISSING"),
    "unsupported": ("–", "n/a"),
    "not_installed": ("–", "not installed"),
    "none": ("–", "no value"),
}
#: Mark -> class of a value's background: one letter, because tables of every value contain it thousands of times.
GROUNDS = {"explained": "e", "known": "k", "fail": "f", "diverged": "f"} | dict.fromkeys(ALARMING, "a")
#: Meaning of the words, for the legend.
MEANINGS = {
    "pass": "within the stated tolerance of the truth",
    "explained": "fails as the engine's contact model predicts",
    "known": "fails; cause and value are on record",
    "fail": "fails; nothing is on record for this engine, or only for the standard suite",
    "new": "fails or has no value; not on record",
    "drifted": "another value than is on record or predicted",
    "diverged": "the state exploded or stopped being finite",
    "invalid": "the measurement contradicts itself, so that nothing is judged",
    "refused": "a solver that certifies its answers gives none here",
    "declined": "a solver that certifies its answers gives none here",
    "crashed": "the engine raised an error or killed its process",
    "timed_out": "no answer in time",
    "missing": "planned, but the run has nothing of it",
    "unsupported": "not supported by this engine",
    "not_installed": "the engine is not installed here",
    "none": "not measured, or without a tolerance",
}


def slug(*parts: Any) -> str:
    """Anchor from any names; distinct for names that differ in any character.

    Names with other characters than small letters, digits, dashes and underscores lose them here, so their hash is
    added.
    """
    raw = "-".join(map(str, parts))
    plain = re.sub(r"[^a-z0-9_]+", "-", raw.lower()).strip("-")
    return plain if plain == raw else f"{plain or 'x'}-{hashlib.sha256(raw.encode()).hexdigest()[:8]}"


def family_of(metric: str) -> str:
    """``apex`` of ``apex[3]``."""
    return metric.partition("[")[0]


def ratio_of(row: Plain) -> float | None:
    """|error| in units of the tolerance; None without an error or a tolerance."""
    if row["error"] is None or not row["tolerance"]:
        return None
    return abs(float(row["error"])) / float(row["tolerance"])


def severity(row: Plain) -> tuple[int, float]:
    """Sort key of rows, larger for more serious ones."""
    mark = mark_of(row)
    rank = len(MARKS) - MARKS.index(mark) if mark in MARKS else 0
    return rank, ratio_of(row) or 0.0


def times(ratio: float | None) -> str:
    """Ratio as text: ``0.3``, ``1.2e+4``."""
    return "" if ratio is None else number(ratio, 2)


@dataclass(frozen=True)
class Mark:
    """A field: mark, words after it, link, longer text, and share of failed checks."""

    mark: str
    text: str
    href: str = ""
    title: str = ""
    share: float = 0.0

    @property
    def twentieths(self) -> int:
        """The share, rounded up: the page has a class for each shade, because its policy forbids inline styles."""
        return math.ceil(20.0 * self.share)

    @property
    def percent(self) -> str:
        """The share in per cent for a field of the matrix; a dash if nothing was judged."""
        return share(self.share, 1.0) if self.text else SAID[self.mark][0]

    @property
    def sign(self) -> str:
        """Sign and word."""
        return " ".join(SAID[self.mark])


@dataclass(frozen=True)
class MatrixLine:
    """A line of the matrix: its scene, its dimension and whether it is swept, its anchor, a mark per column."""

    scene: str
    kind: str
    anchor: str
    marks: list[Mark]


def matrix_lines(source: Source, found: Matrix, wanted: Sequence[tuple[str, int]]) -> list[MatrixLine]:
    """Lines of the verdict matrix: one per scene and dimension, and one for its sweep over iterations, if any."""
    lines = []
    for line in wanted:
        scene, dimension = line
        for fields, label in ((found.fields, ""), (found.swept, ", swept")):
            own = [fields.get((line, column)) for column in source.columns]
            if any(own) or not label:
                marks = [family_mark(f, slug(*line, *c)) for f, c in zip(own, source.columns, strict=True)]
                lines.append(MatrixLine(scene, f"{dimension}-D{label}", slug(*line), marks))
    return lines


def family_mark(field: Field | None, anchor: str) -> Mark:
    """A field of the matrix: its worst mark, the number of rows that do not pass, and its link."""
    if field is None or field.mark in ("unsupported", "declined", "not_installed"):
        return Mark(field.mark if field else "unsupported", "")
    text = "" if not field.judged else f"{field.missed}/{field.judged}" if field.missed else str(field.judged)
    said = ", ".join(f"{n} {SAID[m][1]}" for m, n in field.marks.most_common())
    share = field.missed / field.judged if field.judged else 0.0
    return Mark(field.mark, text, "#" + anchor, said if len(field.marks) > 1 else "", share)


@dataclass(frozen=True)
class Worst:
    """The worst row of one engine and profile in one check."""

    engine: str
    profile: str
    mark: Mark
    row: Plain
    where: str
    value: str
    truth: str
    tolerance: str
    ratio: str
    passing: str
    why: str
    skill: str
    command: str


@dataclass(frozen=True)
class GridLine:
    """One parameter set of a check: truth and tolerance once, then the error of each engine and profile.

    ``options`` are its own words of the command; None if they equal its label.
    """

    label: str
    truth: str
    tolerance: str
    options: str | None
    cells: list[tuple[str, str]]


@dataclass(frozen=True)
class CheckBlock:
    """Everything about one kind of check in one scene and dimension."""

    anchor: str
    family: str
    unit: str
    becauses: list[str]
    sources: list[str]
    marks: Mapping[tuple[str, str], Mark]
    worst: list[Worst]
    command: tuple[str, str]
    grid: list[GridLine]


@dataclass(frozen=True)
class SceneVerdicts:
    """Checks of a scene in one dimension: its worst mark, an overview (engines x checks) and a block per check.

    ``nulls`` are lines of the overview for trivial answers, with their worst errors in units of the tolerance.
    """

    scene: str
    dimension: int
    anchor: str
    mark: Mark
    asked: list[tuple[str, str]]
    refused: str
    overview: list[tuple[tuple[str, str], str, list[Mark]]]
    blocks: list[CheckBlock]
    nulls: list[tuple[str, list[str]]]


def scene_verdicts(source: Source, scene: str, dimension: int) -> SceneVerdicts:
    """Overview and blocks of one scene and dimension."""
    rows = source.of(scene=scene, dimension=dimension)
    seen: dict[tuple[str, str], bool] = {}
    for row in rows:
        column = row["engine"], row["profile"]
        seen[column] = seen.get(column, False) or mark_of(row) not in ("unsupported", "declined", "not_installed")
    asked = [column for column in source.columns if seen.get(column)]
    refused = dict.fromkeys(engine for engine, profile in seen if not any(c[0] == engine for c in asked))
    families: dict[str, list[Plain]] = defaultdict(list)
    for row in rows:
        families[family_of(row["metric"])].append(row)
    blocks = [_block(asked, scene, dimension, name, group) for name, group in families.items()]
    overview = []
    for column in asked:
        own = [block.marks.get(column) for block in blocks]
        if any(mark is not None for mark in own):
            marks = [mark or Mark("unsupported", "") for mark in own]
            overview.append((column, slug(scene, dimension, *column), marks))
    anchor = slug(scene, dimension)
    guesses = _trivial_answers(source, scene, dimension, [block.family for block in blocks])
    return SceneVerdicts(
        scene, dimension, anchor, _scene_mark(rows), asked, ", ".join(refused), overview, blocks, guesses
    )


def _trivial_answers(
    source: Source, scene: str, dimension: int, families: Sequence[str]
) -> list[tuple[str, list[str]]]:
    """Per trivial answer and kind of check the largest error in units of the tolerance; a dash if it has none."""
    worst: dict[str, dict[str, float]] = defaultdict(dict)
    for row in source.nulls:
        if (row["scene"], row["dimension"]) == (scene, dimension):
            family, ratio = family_of(row["metric"]), ratio_of(row)
            known = worst[row["profile"]]
            if ratio is not None:
                known[family] = max(ratio, known.get(family, 0.0))
    return [
        (name, [("✓ " if known[f] <= 1.0 else "✗ ") + times(known[f]) if f in known else "–" for f in families])
        for name, known in worst.items()
    ]


def _scene_mark(rows: Sequence[Plain]) -> Mark:
    """Worst mark at the profiles' own iteration counts, and the number of profiles that pass everything."""
    own: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for row in rows:
        if row["iterations"] is None and mark_of(row) not in UNJUDGED:
            own[row["engine"], row["profile"]][mark_of(row)] += 1
    if not own:
        return Mark("unsupported", "not judged")
    good = sum(set(marks) == {"pass"} for marks in own.values())
    return Mark(Field(sum(own.values(), Counter())).mark, f"{good} of {len(own)} profiles pass")


def _block(
    columns: Sequence[tuple[str, str]], scene: str, dimension: int, family: str, rows: Sequence[Plain]
) -> CheckBlock:
    by_column: dict[tuple[str, str], list[Plain]] = defaultdict(list)
    for row in rows:
        by_column[row["engine"], row["profile"]].append(row)
    worst = [_worst(column, by_column[column]) for column in columns if by_column[column]]
    anchor = slug(scene, dimension, "check", family)
    command, lines = grid(columns, rows)
    units = dict.fromkeys(row["unit"] for row in rows)
    becauses = dict.fromkeys(row["because"] for row in rows)
    return CheckBlock(
        anchor,
        family,
        " / ".join(unit_text(unit) for unit in units),
        list(becauses)[:4] + ([f"and {len(becauses) - 4} more, each beside its row"] if len(becauses) > 4 else []),
        [text for text in dict.fromkeys(row["source"] for row in rows) if text],
        {(w.engine, w.profile): Mark(w.mark.mark, w.ratio, "#" + anchor) for w in worst},
        [w for w in worst if w.mark.mark not in ("pass", "unsupported", "declined", "not_installed")],
        command,
        lines,
    )


def _worst(column: tuple[str, str], rows: Sequence[Plain]) -> Worst:
    row = max(rows, key=severity)
    mark, ratio = mark_of(row), ratio_of(row)
    judged = [r for r in rows if r["physics"]]
    index = row["metric"].partition("[")[2]
    where = params_text(row["params"] and varied(row)) + (f" [{index}" if index else "")
    own = f" it={row['iterations']}" if row["iterations"] is not None else ""
    return Worst(
        *column,
        Mark(mark, times(ratio)),
        row,
        (where.strip() or "defaults") + own,
        NEVER if measured(row) == NEVER else number(row["value"], 6),
        number(row["truth"], 6),
        number(row["tolerance"], 2),
        times(ratio),
        f"{sum(r['physics'] == 'pass' for r in judged)}/{len(judged)}" if judged else "",
        why_anchor(mark, row["engine"], row["profile"], row["reason"]) if mark in ORDER and row["reason"] else "",
        times(row["skill"]) if mark != "pass" else "",
        reproduce(row["slot"]),
    )


def why_anchor(mark: str, engine: str, profile: str, reason: str) -> str:
    """Anchor of a reason among the findings: the same for all rows of an engine and profile with the same reason."""
    said = "|".join((mark, engine, profile, without_prediction(reason)))
    return f"why-{hashlib.sha256(said.encode()).hexdigest()[:8]}"


def without_prediction(reason: str) -> str:
    """A law's reason without the numbers of one row."""
    return re.sub(r" \(predicted [^()]*\)", "", reason)


def unit_text(unit: str) -> str:
    """The unit in words if it is ``1``."""
    return "dimensionless" if unit == "1" else unit


def varied(row: Plain) -> dict[str, float]:
    """Parameters that were set, without those at their defaults."""
    return dict(row["slot"]["params"])


def grid(columns: Sequence[tuple[str, str]], rows: Iterable[Plain]) -> tuple[tuple[str, str], list[GridLine]]:
    """One line per parameter set, step, iteration count and index; one error per engine and profile.

    Before the lines comes the common begin and end of all their commands; a line's ``options`` are between the two.
    """
    rows = list(rows)
    names = list(dict.fromkeys(name for row in rows for name in row["slot"]["params"]))
    steps = {row["dt"] for row in rows}
    table: dict[tuple[Any, ...], dict[tuple[str, str], Plain]] = defaultdict(dict)
    for row in rows:
        shown = tuple((name, row["params"][name]) for name in names if name in row["params"])
        key = (shown, row["dt"], row["iterations"], row["metric"].partition("[")[2])
        table[key][row["engine"], row["profile"]] = row
    lines, commands = [], []
    for (shown, dt, iterations, index), found in table.items():
        first = next(iter(found.values()))
        label = params_text(dict(shown)) + (f" [{index}" if index else "")
        label += f" dt={format_dt(dt)}" if len(steps) > 1 else ""
        label += f" it={iterations}" if iterations is not None else ""
        cells = [_cell(found.get(column)) for column in columns]
        commands.append(reproduce({**first["slot"], "engine": "@", "profile": "@"}).split(" "))
        lines.append(GridLine(label.strip(), number(first["truth"], 6), number(first["tolerance"], 2), None, cells))
    head = _shared(commands)
    tail = _shared([words[len(head) :][::-1] for words in commands])[::-1]
    said = [" ".join(words[len(head) :][: -len(tail) or None]) for words in commands]
    labels = [" --param ".join(line.label.split()) for line in lines]
    own = [None if text == label else text for text, label in zip(said, labels, strict=True)]
    lines = [replace(line, options=options) for line, options in zip(lines, own, strict=True)]
    return (" ".join(head), " ".join(tail)), lines


def _shared(lists: Sequence[Sequence[str]]) -> list[str]:
    """Words with which all lists begin."""
    return [words[0] for words in takewhile(lambda words: len(set(words)) == 1, zip(*lists, strict=False))]


def _cell(row: Plain | None) -> tuple[str, str]:
    """Mark and error; the word if there is no error."""
    if row is None:
        return "", ""
    mark = mark_of(row)
    return mark, SAID[mark][1] if row["error"] is None else number(row["error"], 2)
