"""One raw timing, as stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from adapters.plain import plain
from validation.cells import Slot, slot_from_dict

#: Purpose of a timing: a point of a work-precision plot; cost of the binding (empty scene, one free body); cost over
#: the number of bodies; cost over the number of iterations.
Purpose = Literal["work", "overhead", "bodies", "iterations"]

#: Fields of stored timings that are not read any more; they were the same in all.
GONE = ("worlds", "threads", "kernel")


@dataclass(frozen=True)
class Timing:
    """One execution of a timed unit.

    Parameters
    ----------
    slot
        Scene, parameters, engine, profile, step, iterations. ``empty`` and ``free`` are scenes of the bench, see
        `validation.bench.units`.
    cell
        Case of the catalogue with this error; empty for scenes of the bench.
    bodies
        Free bodies in the scene.
    opponent
        ``engine/profile`` in the same round against which ratios are taken.
    round, order, process
        Round, position within it, and number of the timing process; all from 0.
    sampled
        Whether poses and twists were read after each step, and converted to the plane if the scene was embedded in 3-D.
    steps
        Steps in the timed call.
    seconds, wall_seconds
        CPU time of the process and wall time of the timed call [s].
    state_hash
        Over the bits of the poses and twists at the end of the timed call.
    error
        Headline error of the timed case (see `validation.canonical.Primary`); None if it has none.
    void
        Why this timing must not be used; empty if it may.
    """

    purpose: Purpose
    slot: Slot
    cell: str
    engine_version: str
    bodies: int
    opponent: str
    round: int
    order: int
    process: int
    sampled: bool
    steps: int
    seconds: float
    wall_seconds: float
    state_hash: str
    error: float | None
    void: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain data that `timing_from_dict` reads back."""
        return {**asdict(self), "slot": self.slot.as_dict()}


def timing_from_dict(data: Mapping[str, Any]) -> Timing:
    """Inverse of `Timing.as_dict`; texts are cleaned."""
    kept = {name: value for name, value in plain(data).items() if name not in GONE}
    return Timing(**{**kept, "slot": slot_from_dict(data["slot"])})
