"""Noise floors of what moved: whether a release changed a number, or any change would have.

Cells whose values moved between two releases are asked again on both, from starts moved by units in the last place. A
pile, or a break with many contacts, ends elsewhere after that, too: what a release does there to a value is no step of
it unless it is more than that (`validation.judging.comparison`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from validation.cells import Slot, slot_from_dict
from validation.judging.comparison import Kind
from validation.releases.history import Told, steps

#: Moves of the start, in units in the last place, that give a row its noise floor.
MOVES = (1, 2)


def moved_starts(releases: Sequence[Told]) -> dict[str, list[Slot]]:
    """By release: the cells whose values moved from it or to it, each from its moved starts."""
    wanted: dict[str, dict[Slot, None]] = {}
    for step in steps(releases):
        cells = (slot_from_dict(change.slot) for change in step.family.changes if change.kind is Kind.ERROR)
        starts = {replace(cell, ulp=ulp): None for cell in cells for ulp in MOVES}
        for version in (step.before, step.after):
            wanted.setdefault(version, {}).update(starts)
    return {version: list(starts) for version, starts in wanted.items() if starts}
