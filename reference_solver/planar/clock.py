"""How many events a step may have before what is left of it goes by the fixed-step law (E28); for both dimensions."""

from __future__ import annotations

from reference_solver.compilation import kernel
from reference_solver.model import Array
from reference_solver.planar.state import EVENTS, HELD, LEFT, PATIENCE, SOFT
from reference_solver.tally import EVENTS_LOCATED, STEPS_HELD

#: Events located in one step, and as many more per body.
MOST_EVENTS = 64
EVENTS_PER_BODY = 4
#: Soft events located in a step, and one more per body.
MOST_SOFT = 16
#: What a soft rebound counts: a step in which a series with e = .8 ends to within 1e-12 of its end has 60 of them.
REBOUND = 0.25


@kernel
def open_step(clock: Array, bodies: int, dt: float) -> None:
    """Start the clock of a step: half the patience after one that was held, twice as much after a calm one (E28).

    Soft events, which are ends of slides and impacts no faster than what loads do in a step, try it: a pile of bodies
    that jam has no end of them, each smaller than the one before. A step is calm that used at most half of it.
    """
    most = MOST_SOFT + bodies
    if clock[PATIENCE] == 0.0:
        clock[PATIENCE] = most
    elif clock[HELD] > 0.0:
        clock[PATIENCE] = max(0.5 * clock[PATIENCE], 1.0)
    elif 2.0 * clock[SOFT] <= clock[PATIENCE]:
        clock[PATIENCE] = min(2.0 * clock[PATIENCE], most)
    clock[LEFT] = dt
    clock[EVENTS] = clock[SOFT] = clock[HELD] = 0.0


@kernel
def most_events(bodies: int) -> int:
    """Events that are located in one step."""
    return MOST_EVENTS + EVENTS_PER_BODY * bodies


@kernel
def count_event(clock: Array, bodies: int, tally: Array) -> None:
    """Enter an event, as a soft one until its impact is weighed; too many of them, and the step is held from here."""
    clock[EVENTS] += 1.0
    clock[SOFT] += 1.0
    tally[EVENTS_LOCATED] += 1.0
    if clock[HELD] == 0.0 and (clock[SOFT] > clock[PATIENCE] or clock[EVENTS] >= most_events(bodies)):
        clock[HELD] = 1.0
        tally[STEPS_HELD] += 1.0


@kernel
def weigh_event(clock: Array, weight: float) -> None:
    """What led here turned out to be a soft rebound, or a hard impact (weight 0)."""
    clock[SOFT] = max(clock[SOFT] - (1.0 - weight), 0.0)
