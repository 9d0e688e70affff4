"""One raw timing, as the store keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from validation.cells import Slot, slot_from_dict

#: Why something was timed: a point of a work-precision plot; the binding's own cost (empty scene, one free body);
#: cost against the number of bodies; cost against the number of iterations.
Purpose = Literal["work", "overhead", "bodies", "iterations"]


@dataclass(frozen=True)
class Timing:
    """One execution of a timed unit.

    Parameters
    ----------
    slot
        What was timed: scene, parameters, engine, profile, step, iterations. ``empty`` and ``flight`` are
        scenes of the bench, see `validation.bench.units`.
    cell
        Cell of the catalogue whose error this is; empty for the bench's own scenes.
    bodies
        Free bodies in the scene.
    opponent
        ``engine/profile`` that shares the round and that ratios are taken against.
    round, order, process
        Round of the lane, position within it, and which process of the lane it was; all from 0.
    sampled
        Whether poses and twists were read after each step, and lowered where the scene was lifted.
    worlds, threads, kernel
        Worlds per call, threads, and the variant of a kernel where an engine names one.
    steps
        Steps in the timed call.
    seconds, wall_seconds
        CPU time of the process and wall time of the timed call [s].
    state_hash
        Over the bits of the poses and twists at the end of the timed call.
    error
        Primary error of what was timed (see `validation.canonical.Primary`); None where there is no such thing.
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
    worlds: int = 1
    threads: int = 1
    kernel: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain data that `timing_from_dict` reads back."""
        return {**asdict(self), "slot": self.slot.as_dict()}


def timing_from_dict(data: Mapping[str, Any]) -> Timing:
    """Inverse of `Timing.as_dict`."""
    return Timing(**{**data, "slot": slot_from_dict(data["slot"])})
