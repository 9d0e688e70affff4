"""Verdicts of a run while it goes on: a line for each scene on an engine, as soon as its last case has ended.

A line has the words and numbers of the matrix at the end (`reports.summary`), for both dimensions together.
"""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from reports.findings import ALARMING
from reports.matrix import ALARM, STYLES, Field, matrix_of
from reports.wording import MARKS, called
from validation.cells import Observation, Slot
from validation.judging.rows import Row, in_order, rows_of
from validation.posed import is_file
from validation.records.store import Run

#: Columns of a terminal that has room for three profiles below each other.
ALIGNED = 100
#: Columns of ``113 of 113 fail`` with a space before and two behind it.
COUNT = 18
HEAD = "engine", "scene"


class Verdicts:
    """Judges each scene on an engine when all its cases have ended, and prints a line for it.

    Parameters
    ----------
    plan
        All cases of the run. A plan of a single scene gets no lines: its matrix says the same.
    """

    def __init__(self, plan: Sequence[Slot], console: Console) -> None:
        self._plan, self._console = plan, console
        self._shown = len({slot.scene for slot in plan}) > 1
        self._found: dict[tuple[str, str], dict[Slot, Observation | None]] = {}
        for slot in plan:
            self._found.setdefault(_key(slot), {})[slot] = None
        self._names = called(slot.scene for slot in plan)
        shown = ((engine, self._names[scene]) for engine, scene in self._found)
        self._wide = [max(map(len, names)) + 2 for names in zip(HEAD, *shown, strict=True)]
        self._rows: list[Row] = []

    def add(self, run: Run, observation: Observation) -> None:
        """Take the result of a case of the plan."""
        key = _key(observation.slot)
        self._found[key][observation.slot] = observation
        keys = self._together(key)
        if not any(None in self._found[each].values() for each in keys):
            self._judge(run, keys)

    def rows(self, run: Run) -> list[Row]:
        """Rows of all cases, in the order of the plan; cases without a result are missing."""
        while self._found:
            self._judge(run, self._together(next(iter(self._found))))
        return in_order(self._rows, self._plan)

    def _together(self, key: tuple[str, str]) -> list[tuple[str, str]]:
        """What is judged together: our own run of a scene from a file says of all engines what has two answers."""
        return [each for each in self._found if each[1] == key[1]] if is_file(key[1]) else [key]

    def _judge(self, run: Run, keys: Sequence[tuple[str, str]]) -> None:
        found = {slot: each for key in keys for slot, each in self._found.pop(key).items()}
        judged = rows_of(run.id, [each for each in found.values() if each is not None], found)
        for key in keys:
            first = not self._rows
            rows = [row for row in judged if (row.engine, row.scene) == key]
            self._rows += rows
            matrix = matrix_of({**vars(row), "dimension": 0} for row in rows)
            fields = {profile: field for (_, (_, profile)), field in matrix.fields.items() if field.mark in MARKS}
            if self._shown and first:
                self._console.print(self._line(HEAD) + Text("checks by profile"), style="dim")
            if self._shown and fields:
                line = self._line((key[0], self._names[key[1]])) + self._counts(fields)
                self._console.print(line, soft_wrap=True, highlight=False)

    def _line(self, names: Sequence[str]) -> Text:
        return Text("".join(f"{name:<{wide}}" for name, wide in zip(names, self._wide, strict=True)))

    def _counts(self, fields: dict[str, Field]) -> Text:
        """``default 60 of 85 fail, tuned 85 pass``, below each other where there is room."""
        aligned = self._console.width >= ALIGNED
        found = []
        for profile, field in fields.items():
            style = ALARM if field.mark in ALARMING else STYLES.get(field.mark, "")
            found.append(Text.assemble(f"{profile} ", (field.text if aligned else field.short, style)))
            if aligned and len(found) < len(fields):
                found[-1].pad_right(max(2, len(profile) + COUNT - found[-1].cell_len))
        return Text("" if aligned else ", ").join(found)


def _key(slot: Slot) -> tuple[str, str]:
    return slot.engine, slot.scene
