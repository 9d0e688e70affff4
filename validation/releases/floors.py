"""Noise floors of changes between releases.

Cells whose values changed between two releases run again on both, from starts moved by units in the last place. A pile,
or a break with many contacts, ends elsewhere after such a move too: a change by a release counts only beyond that
(`validation.judging.comparison`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from validation.cells import Slot, slot_from_dict
from validation.judging.comparison import Kind
from validation.releases.history import Told, steps

#: Moves of the start, in units in the last place, for the noise floor of a row.
MOVES = (1, 2)


def moved_starts(releases: Sequence[Told]) -> dict[str, list[Slot]]:
    """By release: the cells whose values changed from or to it, each with its moved starts."""
    wanted: dict[str, dict[Slot, None]] = {}
    for step in steps(releases):
        cells = (slot_from_dict(change.slot) for change in step.family.changes if change.kind is Kind.ERROR)
        starts = {replace(cell, ulp=ulp): None for cell in cells for ulp in MOVES}
        for version in (step.before, step.after):
            wanted.setdefault(version, {}).update(starts)
    return {version: list(starts) for version, starts in wanted.items() if starts}
