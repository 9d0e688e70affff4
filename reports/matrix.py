"""The verdict matrix: scenes x engines x profiles, one mark and a count per field.

A profile is judged by the rows at its own iteration count; rows at other counts show the effect of more or fewer
iterations and are counted separately.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from adapters.engine import ROLES
from adapters.registry import facts, is_ranked
from reports.findings import ALARMING
from reports.wording import FEW, LABELS, MARKS, STATUS, called, mark_of, word_of
from validation.cells import ALONE
from validation.judging.verdicts import NOT_JUDGED
from validation.metrics import NEWER, OUT_OF_PLANE

#: Colours; they support the words and never replace them.
STYLES = {"pass": "green", "explained": "cyan", "known": "yellow", "fail": "red", "unsupported": "dim"}
ALARM = "bold white on red"
#: Space before a scene [columns]: one of padding, and the box's divider.
GAP = 2
#: Marks of rows without a verdict.
UNJUDGED = ("unsupported", "declined", "none", "not_installed")


@dataclass(frozen=True)
class Field:
    """One field of the matrix: the marks of its rows."""

    marks: Counter[str]

    @property
    def mark(self) -> str:
        """The most serious mark, see `reports.wording.MARKS`."""
        return next((mark for mark in MARKS if self.marks[mark]), next(iter(self.marks), "none"))

    @property
    def judged(self) -> int:
        """Number of rows with a verdict."""
        return sum(n for mark, n in self.marks.items() if mark not in UNJUDGED)

    @property
    def missed(self) -> int:
        """Number of those that do not pass."""
        return self.judged - self.marks["pass"]

    @property
    def text(self) -> str:
        """``40 pass``, ``3 of 24 fail``, ``3 of 24 fail, 2 new`` where some are unexpected; ``-`` if it cannot run."""
        if self.mark not in MARKS:
            return LABELS[self.mark]
        unexpected = [f", {self.marks[mark]} {STATUS[mark]}" for mark in ALARMING if self.marks[mark]]
        counted = f"{self.missed} of {self.judged} fail" if self.missed else f"{self.judged} pass"
        declined = f", {self.marks['declined']} refused" if self.marks["declined"] else ""
        return counted + "".join(unexpected) + declined

    @property
    def short(self) -> str:
        """Short form: ``3/24 fail``."""
        return self.text.replace(" of ", "/", 1)


@dataclass(frozen=True)
class Matrix:
    """Fields by (scene, dimension) and (engine, profile), both in the order of the rows.

    Parameters
    ----------
    fields
        Rows at the profile's own iteration count.
    swept
        Rows at other iteration counts.
    counts
        Those iteration counts by scene.
    """

    lines: tuple[tuple[str, int], ...]
    columns: tuple[tuple[str, str], ...]
    fields: Mapping[tuple[tuple[str, int], tuple[str, str]], Field]
    swept: Mapping[tuple[tuple[str, int], tuple[str, str]], Field] = field(default_factory=dict)
    counts: Mapping[str, tuple[int, ...]] = field(default_factory=dict)


def matrix_of(rows: Iterable[Mapping[str, Any]]) -> Matrix:
    """Count marks per field."""
    own: dict[Any, Counter[str]] = defaultdict(Counter)
    swept: dict[Any, Counter[str]] = defaultdict(Counter)
    counts: dict[str, set[int]] = defaultdict(set)
    lines: dict[tuple[str, int], None] = {}
    columns: dict[tuple[str, str], None] = {}
    for row in rows:
        line, column = (row["scene"], row["dimension"]), (row["engine"], row["profile"])
        lines[line] = columns[column] = None
        if row["iterations"] is None:
            own[line, column][mark_of(row)] += 1
        else:
            swept[line, column][mark_of(row)] += 1
            counts[row["scene"]].add(row["iterations"])
    fields, sweeps = ({key: Field(counter) for key, counter in marks.items()} for marks in (own, swept))
    return Matrix(tuple(lines), tuple(columns), fields, sweeps, {k: tuple(sorted(v)) for k, v in counts.items()})


def unranked(columns: Iterable[tuple[str, str]]) -> list[str]:
    """One line for each profile that is shown but not ranked: its meaning."""
    lines = []
    for engine, profile in columns:
        known = facts(engine)
        if known is not None and not is_ranked(engine, profile):
            lines.append(f"{engine}/{profile}: {ROLES[known.roles[profile]]}")
    return lines


def leaving(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Profiles whose planar scenes leave the plane, number of cases, and the worst; one line, or none.

    All other rows of such a case measure the motion in the plane only, even if they pass.
    """
    cells: dict[tuple[str, str], list[tuple[bool, float, str]]] = defaultdict(list)
    for row in rows:
        if row["metric"] == OUT_OF_PLANE and row["iterations"] is None and row["value"] is not None:
            found = row["physics"] == "fail", row["value"], row["scene"]
            cells[row["engine"], row["profile"]].append(found)
    counts = []
    for (engine, profile), of_it in cells.items():
        outside = sorted(each for each in of_it if each[0])
        if outside:
            _, most, scene = outside[-1]
            counts.append(f"{engine}/{profile} {len(outside)} of {len(of_it)} (farthest in {scene}: {most:.2g} m)")
    return [f"2-D scenes that leave their plane in a 3-D engine: {', '.join(counts)}"] if counts else []


def unjudged(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """How many checks did not exist when the run was made, and how many are not judged for another reason."""
    reasons = [row["reason"] for row in rows if row["physics"] is None]
    count = reasons.count(NEWER)
    said = [f"{count} of the checks are newer than this run: without a value, not judged."] if count else []
    others = Counter(reason for reason in reasons if reason.startswith(NOT_JUDGED))
    return said + [f"{count} of the checks {'is' if count == 1 else 'are'} {why}." for why, count in others.items()]


def repeated(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Cases that ended a process which had run others, and do not end one of their own; one line, or none."""
    alone = (row for row in rows if ALONE in row["reason"])
    named = list(dict.fromkeys("{engine}/{profile} {scene} {dimension}-D".format(**row) for row in alone))
    more = f" and {len(named) - FEW} more" * (len(named) > FEW)
    said = f"Ended a process that had run other cases; {ALONE}: {', '.join(named[:FEW])}{more} (why: explain)"
    return [said] if named else []


def tables_of(matrix: Matrix, versions: Mapping[str, str], width: int, roles: bool = False) -> list[Table]:
    """Terminal tables of a matrix for ``width`` columns: a line per engine and profile, a column per scene.

    Equal fields of both dimensions share a line. Scenes that do not fit beside each other make a further table. A
    profile with a user's own settings has a line for each of them if its name leaves no room for a scene. With
    ``roles`` the role of a profile follows its first line, unless its name says it.
    """
    scenes = list(dict.fromkeys(scene for scene, _ in matrix.lines))
    names = list(called(scenes).values())
    body = list(_body(matrix, scenes, versions, roles))
    texts, wide = _texts(names, body, short=False)
    if max((len(label) for label, _ in body), default=0) + sum(wide) + GAP * len(wide) > width:
        texts, wide = _texts(names, body, short=True)
    most = width - max(wide, default=0) - GAP
    body = [(label if len(label) <= most else label.replace("+", "\n    +"), fields) for label, fields in body]
    first = max((len(line) for label, _ in body for line in label.splitlines()), default=0)
    return [_table(names, chosen, body, texts, first) for chosen in _chunks(wide, width - first)]


def _texts(scenes: Sequence[str], body: Sequence[Line], short: bool) -> tuple[list[list[Text]], list[int]]:
    """Texts of the fields of each line, and the width of each scene's column."""
    texts = [[_styled(field, short) for field in fields] for _, fields in body]
    return texts, [max([len(scene), *(len(row[k]) for row in texts if row)]) for k, scene in enumerate(scenes)]


def _chunks(widths: Sequence[int], room: int) -> Iterator[list[int]]:
    """Indices of scenes that fit beside each other, each with its `GAP`, so that no count is cut."""
    chosen: list[int] = []
    for k, wide in enumerate(widths):
        if chosen and sum(widths[j] + GAP for j in chosen) + wide + GAP > room:
            yield chosen
            chosen = []
        chosen.append(k)
    if chosen:
        yield chosen


def _table(
    scenes: Sequence[str], chosen: Sequence[int], body: Sequence[tuple[str, Any]], texts: Sequence[Any], first: int
) -> Table:
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0))
    table.add_column("engine, profile", no_wrap=True, min_width=first)
    for k in chosen:
        table.add_column(scenes[k], no_wrap=True)
    for (label, fields), row in zip(body, texts, strict=True):
        head = Text(label, style="" if label.startswith(" ") else "bold")
        table.add_row(head, *(row[k] for k in chosen if fields))
    return table


#: Label of a line and its fields, one per scene; none for the line with an engine's name.
Line = tuple[str, tuple[Field | None, ...]]


def _body(matrix: Matrix, scenes: Sequence[str], versions: Mapping[str, str], roles: bool) -> Iterator[Line]:
    for engine in dict.fromkeys(engine for engine, _ in matrix.columns):
        yield f"{engine} {_version(versions.get(engine, ''))}".strip(), ()
        profiles = [profile for name, profile in matrix.columns if name == engine]
        refused = _never_asked(matrix, engine)
        for profile in profiles:
            dimensions = [d for d in sorted({d for _, d in matrix.lines}) if d not in refused]
            role = f" ({word_of(engine, profile)})" if roles and word_of(engine, profile) else ""
            for label, fields in _lines(matrix.fields, scenes, (engine, profile), dimensions, f"  {profile}"):
                yield label + role, fields
                role = ""
        for dimension in refused:
            yield from _lines(matrix.fields, scenes, (engine, profiles[0]), [dimension], "  every profile")


def _never_asked(matrix: Matrix, engine: str) -> list[int]:
    """Dimensions in which an engine can run no scene."""
    found = []
    for dimension in sorted({d for _, d in matrix.lines}):
        own = [f for (line, column), f in matrix.fields.items() if line[1] == dimension and column[0] == engine]
        if own and all(set(field.marks) == {"unsupported"} for field in own):
            found.append(dimension)
    return found


def _lines(
    fields: Mapping[Any, Field], scenes: Sequence[str], column: tuple[str, str], dimensions: Sequence[int], label: str
) -> Iterator[Line]:
    """One line per group of dimensions with equal fields."""
    groups: dict[tuple[Any, ...], list[int]] = defaultdict(list)
    found: dict[tuple[Any, ...], tuple[Field | None, ...]] = {}
    for dimension in dimensions:
        row = tuple(fields.get(((scene, dimension), column)) for scene in scenes)
        if any(row):
            key = tuple(field and tuple(sorted(field.marks.items())) for field in row)
            groups[key].append(dimension)
            found[key] = row
    for key, same in groups.items():
        yield f"{label} {' '.join(f'{d}-D' for d in same)}", found[key]


def _version(version: str) -> str:
    """Version without the digits of a local build."""
    return version.partition("+")[0]


def _styled(field: Field | None, short: bool) -> Text:
    if field is None:
        return Text("")
    alarming = field.mark in ALARMING
    return Text(field.short if short else field.text, style=ALARM if alarming else STYLES.get(field.mark, ""))


def sweeps_of(matrix: Matrix) -> list[str]:
    """One line per scene with other iteration counts: failed of judged checks, by profile."""
    found = []
    for scene, counts in matrix.counts.items():
        said = []
        for engine, profile in matrix.columns:
            shares: dict[str, list[int]] = defaultdict(list)
            for (line, column), own in matrix.swept.items():
                if line[0] == scene and column == (engine, profile) and own.judged:
                    shares[f"{own.missed} of {own.judged}"].append(line[1])
            alone = len(shares) == 1
            parts = [share if alone else f"{share} {' '.join(f'{d}-D' for d in ds)}" for share, ds in shares.items()]
            if parts:
                said.append(f"{engine}/{profile} {' and '.join(parts)}")
        asked = ", ".join(map(str, counts))
        found.append(f"{scene} at {asked} iterations instead of the profile's own, failed checks: {'; '.join(said)}")
    return found


def legend(matrix: Matrix) -> str:
    """Explanation of the numbers and of the words that occur."""
    marks = {mark for field in matrix.fields.values() for mark in field.marks}
    said = ["A check is one measured quantity of one case; it fails outside its tolerance."]
    if "invalid" in marks:
        said.append("INVALID: the measurement contradicts itself and says nothing about the engine.")
    if marks & {"refused", "declined"}:
        said.append("REFUSED: a solver that certifies its answers gives none here.")
    if "unsupported" in marks:
        said.append("A dash: the engine cannot run the scene.")
    return " ".join(said)


#: Meaning of the less obvious words of `reports.wording.STATUS`.
MEANT = {
    "known": "cause on record",
    "explained": "the engine's contact model predicts them",
    "invalid": "the measurement contradicts itself",
    "refused": "not certified",
    "drifted": "value differs from the record",
}


def status_of(matrix: Matrix) -> str:
    """Regression status: numbers of expected failures by reason, and of unexpected ones; empty if none fails."""
    marks: Counter[str] = Counter()
    for own in (*matrix.fields.values(), *matrix.swept.values()):
        marks.update(own.marks)
    parts = [
        f"{marks[mark]} {word}" + (f" ({MEANT[mark]})" if mark in MEANT else "")
        for mark, word in STATUS.items() if marks[mark]
    ]  # fmt: skip
    return f"Regression status of what fails: {', '.join(parts)}." if parts else ""


def versions_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Engine -> version of the run."""
    return {row["engine"]: row["engine_version"] for row in rows if row["engine_version"]}
