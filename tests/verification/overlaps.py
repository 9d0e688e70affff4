"""Gates of overlaps: what each way to correct positions makes of one, in the first step (E15, E16)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from reference_solver.settings import PositionCorrection, Settings
from tests.verification.gate import Gate
from tests.verification.space import GRAVITY, SPACES, Space

#: Step [s], overlap of a ball of half a metre and a floor [m], and the share of it beyond the slop [m] that goes.
DT, OVERLAP, BETA, SLOP = 1 / 240, 0.01, 0.2, 0.001
#: Some hundred roundings of the largest number at hand, a speed of a metre a second, and a place of half a metre.
ROUND_OFF = 1e-14


def gates() -> Iterator[Gate]:
    """Yield every row of overlaps."""
    for space in SPACES:
        yield from corrected(space, "baumgarte", BETA * (OVERLAP - SLOP) / DT, BETA * (OVERLAP - SLOP))
        yield from corrected(space, "split", 0.0, BETA * (OVERLAP - SLOP))
        yield from corrected(space, "none", 0.0, 0.0)


def corrected(space: Space, correction: PositionCorrection, speed: float, rise: float) -> Iterator[Gate]:
    """What a resting ball that is too deep is left with: Baumgarte's bias becomes a speed, split impulse only a way."""
    settings = dataclasses.replace(
        Settings.classical(DT), position_correction=correction, beta=BETA, slop=SLOP, warm_starting=False
    )
    simulation = space.simulation([space.floor(), space.ball(0.0, 0.5 - OVERLAP)], settings, GRAVITY)
    simulation.advance(1)
    name = f"{correction}, {space.name}"
    parts = float(simulation.twist[1, space.up]) - speed
    yield Gate.at_most("overlap: speed left [m/s]", f"{OVERLAP:g} m deep, one step", abs(parts), ROUND_OFF, name)
    moved = float(simulation.pose[1, space.up]) - (0.5 - OVERLAP) - rise
    yield Gate.at_most("overlap: way out [m]", f"{OVERLAP:g} m deep, one step", abs(moved), ROUND_OFF, name)
