"""The verdict matrix: scenes x engines x profiles, one mark and a count per field."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.table import Table
from rich.text import Text

from reports.findings import ALARMING
from reports.wording import LABELS, MARKS, mark_of

#: Colours support the words, they never replace them.
STYLES = {"pass": "green", "explained": "cyan", "known": "yellow", "fail": "red", "unsupported": "dim"}
ALARM = "bold white on red"


@dataclass(frozen=True)
class Field:
    """One field of the matrix: the marks of its rows."""

    marks: Counter[str]

    @property
    def mark(self) -> str:
        """The most serious mark, see `reports.wording.MARKS`."""
        return next((mark for mark in MARKS if self.marks[mark]), next(iter(self.marks), "none"))

    @property
    def text(self) -> str:
        """``pass 24`` or ``FAIL known 3/24`` (rows with that mark or a worse one, of the judged)."""
        judged = sum(n for mark, n in self.marks.items() if mark not in ("unsupported", "none"))
        if self.mark not in MARKS:
            return LABELS[self.mark]
        if self.mark == "pass":
            return f"pass {self.marks['pass']}"
        return f"{LABELS[self.mark]} {judged - self.marks['pass']}/{judged}"


@dataclass(frozen=True)
class Matrix:
    """Fields by (scene, dimension) and (engine, profile), both in the order of the rows."""

    lines: tuple[tuple[str, int], ...]
    columns: tuple[tuple[str, str], ...]
    fields: Mapping[tuple[tuple[str, int], tuple[str, str]], Field]


def matrix_of(rows: Iterable[Mapping[str, Any]]) -> Matrix:
    """Count marks per field."""
    marks: dict[Any, Counter[str]] = defaultdict(Counter)
    lines: dict[tuple[str, int], None] = {}
    columns: dict[tuple[str, str], None] = {}
    for row in rows:
        line, column = (row["scene"], row["dimension"]), (row["engine"], row["profile"])
        lines[line] = columns[column] = None
        marks[line, column][mark_of(row)] += 1
    fields = {key: Field(counter) for key, counter in marks.items()}
    return Matrix(tuple(lines), tuple(columns), fields)


def table_of(matrix: Matrix, versions: Mapping[str, str]) -> Table:
    """Terminal table of a matrix: a line per engine, profile and dimension, a column per scene (fits 80 columns)."""
    scenes = list(dict.fromkeys(scene for scene, _ in matrix.lines))
    dimensions = sorted({dimension for _, dimension in matrix.lines})
    table = Table(title="Verdicts: worst mark, rows that do not pass / rows judged", title_justify="left")
    table.add_column("engine, profile", no_wrap=True)
    for scene in scenes:
        table.add_column(scene)
    last = ""
    for engine, profile in matrix.columns:
        if last not in ("", engine):
            table.add_section()
        if engine != last:
            table.add_row(Text(f"{engine} {versions.get(engine, '')}", style="bold"))
        last = engine
        for dimension in dimensions:
            fields = [matrix.fields.get(((scene, dimension), (engine, profile))) for scene in scenes]
            if any(fields):
                table.add_row(f"  {profile} {dimension}-D", *(_styled(field) for field in fields))
    return table


def _styled(field: Field | None) -> Text:
    if field is None:
        return Text("")
    alarming = field.mark in ALARMING
    return Text(field.text, style=ALARM if alarming else STYLES.get(field.mark, ""))


def legend() -> str:
    """What the marks mean, in one line each."""
    return (
        "pass: within the stated tolerance | FAIL expl.: off as a law of the engine predicts | "
        "FAIL known: listed with a reason | FAIL new, drifted: not listed so | -: cannot be asked of this engine"
    )


def versions_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Engine -> version that ran."""
    return {row["engine"]: row["engine_version"] for row in rows if row["engine_version"]}
