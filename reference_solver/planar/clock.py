"""How many events a step may have before what is left of it goes by the fixed-step law (E28); for both dimensions."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar.state import EVENTS, HELD, LEFT, PATIENCE, SOFT
from reference_solver.tally import EVENTS_LOCATED, STEPS_HELD

#: Events located in one step, and as many more per body.
MOST_EVENTS = 64
EVENTS_PER_BODY = 4
#: Soft events located in a step, and one more per body: ends of slides, impacts no faster than what loads do in a step.
#: A pile of bodies that jam has no end of them, each smaller than the one before.
MOST_SOFT = 16


@inner_kernel
def open_step(clock: Array, bodies: int, dt: float) -> None:
    """Start the clock of a step: half the patience after one that was held, twice as much after any other (E28)."""
    most = MOST_SOFT + bodies
    if clock[PATIENCE] == 0.0:
        clock[PATIENCE] = most
    elif clock[HELD] > 0.0:
        clock[PATIENCE] = max(0.5 * clock[PATIENCE], 1.0)
    else:
        clock[PATIENCE] = min(2.0 * clock[PATIENCE], most)
    clock[LEFT] = dt
    clock[EVENTS] = clock[SOFT] = clock[HELD] = 0.0


@inner_kernel
def most_events(bodies: int) -> int:
    """Events that are located in one step."""
    return MOST_EVENTS + EVENTS_PER_BODY * bodies


@inner_kernel
def count_event(clock: Array, bodies: int, tally: Array) -> None:
    """Enter an event, soft until its impact proves to be hard; where there are too many the step is held from here."""
    clock[EVENTS] += 1.0
    clock[SOFT] += 1.0
    tally[EVENTS_LOCATED] += 1.0
    if clock[HELD] == 0.0 and (clock[SOFT] > clock[PATIENCE] or clock[EVENTS] >= most_events(bodies)):
        clock[HELD] = 1.0
        tally[STEPS_HELD] += 1.0


@inner_kernel
def uncount_soft(clock: Array) -> None:
    """The event that led here was a hard one."""
    clock[SOFT] = max(clock[SOFT] - 1.0, 0.0)
