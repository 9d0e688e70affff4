"""Switch one setting: run a cell with one or more settings of its profile replaced, on any engine.

Used by tuning, proofs of causes and fixes. An experiment is a slot like any other (it runs in the same workers), whose
`Slot.switched` lists the changes. It is never listed and never shown as the profile's result.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from validation.canonical import Check
from validation.cells import Observation, Outcome, Slot, checks_of
from validation.workers import run_cells


@dataclass(frozen=True)
class Reading:
    """One check of one cell: its value, or why there is none.

    ``badness`` is the error over the tolerance: above 1 is a FAIL; infinite without a value.
    """

    slot: Slot
    check: Check
    value: float | None
    reason: str

    @property
    def error(self) -> float | None:
        """Distance from the truth, in the metric's unit."""
        if self.value is None or self.check.truth is None:
            return None
        return abs(self.value - self.check.truth)

    @property
    def badness(self) -> float:
        """Error over tolerance."""
        if self.error is None or not self.check.bound:
            return float("inf")
        return self.error / self.check.bound


def switched(slot: Slot, changes: Mapping[str, Any]) -> Slot:
    """Return the slot with further settings replaced; without changes the slot itself.

    ``iterations`` sets the slot's own field, as a user does.
    """
    changes = dict(changes)
    iterations = changes.pop("iterations", slot.iterations)
    both = dict(slot.switched) | changes
    return replace(slot, iterations=iterations, switched=tuple(sorted(both.items())))


def observe(slots: Iterable[Slot], jobs: int = 1) -> dict[Slot, Observation]:
    """Run cells in worker processes; each slot once. Cells whose engine hangs count as unfinished."""
    found: dict[Slot, Observation] = {}

    def left(slot: Slot, reason: str) -> None:
        found[slot] = Observation(slot, "", 0, "", Outcome.TIMED_OUT, reason)

    found |= {observation.slot: observation for observation in run_cells(list(dict.fromkeys(slots)), jobs, leave=left)}
    return found


def readings(observation: Observation) -> list[Reading]:
    """All judged checks of an observation; without values for a cell without a result."""
    slot = observation.slot
    found = []
    for check in checks_of(observation)[1]:
        if check.truth is None or check.bound is None:
            continue
        value, reason = observation.metrics.get(check.metric, (None, "was not measured"))
        if observation.outcome is not Outcome.OK:
            value, reason = None, f"{observation.outcome.value}: {observation.reason}"
        found.append(Reading(slot, check, value, reason))
    return found


def reading(observation: Observation, metric: str) -> Reading:
    """One check of an observation.

    Raises
    ------
    KeyError
        If the scene has no such check.
    """
    for found in readings(observation):
        if found.check.metric == metric:
            return found
    raise KeyError(metric)


def side_by_side(slot: Slot, changes: Sequence[Mapping[str, Any]], jobs: int = 1) -> list[Observation]:
    """Observations of a slot unchanged, and with each of ``changes``, in this order."""
    slots = [slot, *(switched(slot, change) for change in changes)]
    found = observe(slots, jobs)
    return [found[each] for each in slots]
