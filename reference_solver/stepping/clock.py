"""Time left in a step, and how many events it may have before what is left of it is not located any more (E28)."""

from __future__ import annotations

import math

from reference_solver.compilation import kernel
from reference_solver.model import Array
from reference_solver.stepping.noise import EVENT_BUDGET
from reference_solver.tally import EVENTS_LOCATED, EXHAUSTED, STEPS_HELD

#: Entries of a clock: what is left of the step [s] (0: a new one begins), events located in it, how many of them were
#: soft, how many soft ones it may have, 1 where what is left of it goes at impulse level (E28; UNTIL_REST: one
#: sub-step only), what the last phase of turning rows was, and the length of a sub-step at impulse level that is yet to
#: be settled [s].
LEFT, EVENTS, SOFT, PATIENCE, HELD, OUTCOME, UNSETTLED = 0, 1, 2, 3, 4, 5, 6
#: 1 where bodies may not leave their bounds in the step, and 1 where one has.
CONFINED, ESCAPED = 7, 8
#: 1 where the island is jammed at the start of its step.
JAMMED = 9
#: What the last event counted.
WEIGHT = 10
#: 1 in a sub-step at whose end bodies that rock have come to rest on each other (E22), and what HELD shall be in the
#: next such one.
ROCKING, ROCKS = 11, 12
#: Length of the next sub-step, as a share of the step, where it is so short that nothing but a jam happens in it; and
#: what it is where no phase is found once more.
BRIEF, LONGER_BRIEF = 13, 14
#: What events count that follow each other within a thousandth of a step, where each is dear.
CHAIN = 15
#: Impacts of the present instant that have been made; 1 where the instant came within a thousandth of a step of the
#: event before; 1 where round-off decides which of its impacts comes first (E21).
BLOWS, SOON, UNORDERED = 16, 17, 18
#: When the last series of rebounds that is taken to end in the sub-step does, and when bodies meet, so that one that
#: lasts until then is followed (E22); counted from the start of the sub-step [s].
SERIES, MEETING = 19, 20
CLOCK_SIZE = 21

#: Value of HELD in a sub-step at whose end bodies that rock have come to rest on each other, where rows turn.
UNTIL_REST = 0.5

#: Length of such a sub-step, as a share of a step, in which bodies go nowhere; by what longer the next one is where
#: loads did no more in it than residuals leave and no phase is found after it, and up to which share; how many times
#: what loads do in it velocities change in a jam.
INSTANT, LONGER, NO_INSTANT, JUMP = 1e-8, 1e2, 1e-3, 1e3

#: Soft events located in a step, and one more per body. Of 16 two discs that bounce on each other and the floor used up
#: half in a step of 1/60 s, and the series that was held then was 1e-6 m off.
MOST_SOFT = 128
#: The same in space, where an event of bodies with faces costs a hundred times as much: with 128 two random scenes of
#: 120 fewer fall back, and 20 spheres that settle take a third longer.
MOST_SOFT_IN_SPACE = 64
#: Free bodies of a cluster from which on it may jam, and soft events that are located in a step of one that is.
JAM_BODIES, JAM_PATIENCE = 4, 2
#: Free bodies from which on a cluster jams that has more meetings than bodies, however few its rows.
MANY_BODIES = 8
#: What a soft rebound counts: a step in which a series with e = .8 ends to within 1e-12 of its end has 60 of them.
REBOUND = 0.25
#: What a soft event counts that follows within a thousandth of a step: such ones come in crowds.
HASTE = 4.0
#: What a phase counts that its error cut to less than a thousandth of a step: a slip that turns while it ends has some
#: fifty; and what a hop of noise counts, of which each is a share of the one before.
CRAWL = 0.1
#: What a chain of events may count that each follow within a thousandth of the step: bodies that jam hit one another
#: again and again within 1e-6 of it, and get nowhere. In space 20 contacts have 16 such events in a row, 50 have 5.
LONGEST_CHAIN = 64.0


@kernel
def open_step(clock: Array, bodies: int, dt: float, patience: int) -> None:
    """Start the clock of a step.

    Soft events, which are ends of slides and impacts no faster than what loads do in a step, try its patience: a pile
    of bodies that jam has no end of them, each smaller than the one before. Nothing is known of the step before.
    """
    clock[LEFT] = dt
    clock[PATIENCE] = patience + bodies
    clock[EVENTS] = clock[SOFT] = clock[HELD] = clock[JAMMED] = clock[WEIGHT] = 0.0
    clock[ROCKING] = clock[ROCKS] = clock[BRIEF] = clock[CHAIN] = clock[BLOWS] = 0.0
    clock[MEETING] = math.inf
    clock[LONGER_BRIEF] = INSTANT


@kernel
def opens_step(clock: Array, dt: float) -> bool:
    """Whether nothing of the step has been made, and what jams has not been weighed."""
    return bool(clock[LEFT] == dt and clock[JAMMED] == 0.0 and clock[HELD] == 0.0)


@kernel
def jams(rows: int, freedoms: int, bodies: int, meetings: int) -> bool:
    """Whether a cluster of bodies that touch jams: it has more rows than freedoms.

    Then whatever moves in it moves what it touches, and events have no end. So do many bodies that meet in loops: with
    more ``meetings``, pairs that touch, than bodies. A stack that leans has none, and ends of its slides are few.
    """
    return (bodies >= MANY_BODIES and meetings > bodies) or (bodies >= JAM_BODIES and rows > freedoms)


@kernel
def hurry(clock: Array) -> None:
    """Locate few soft events in the step of an island that jams."""
    clock[JAMMED], clock[PATIENCE] = 1.0, JAM_PATIENCE


@kernel
def count_event(clock: Array, tally: Array, hasty: bool, shortened: bool, price: float) -> None:
    """Enter an event, as a soft one until its impact is weighed; too many of them, and the step is held from here.

    ``hasty``: it follows within a thousandth of the step; ``shortened``: the error of a phase cut it; ``price``: what a
    phase costs. Too many events of all kinds, and the run ends.
    """
    clock[WEIGHT] = (CRAWL * price if shortened else HASTE) if hasty else 1.0
    clock[SOON] = 1.0 if hasty else 0.0
    clock[EVENTS] += 1.0
    clock[SOFT] += clock[WEIGHT]
    if not shortened:
        clock[CHAIN] = clock[CHAIN] + price - 1.0 if hasty else 0.0
    tally[EVENTS_LOCATED] += 1.0
    if clock[HELD] == 0.0 and (clock[SOFT] > clock[PATIENCE] or clock[CHAIN] > LONGEST_CHAIN):
        hold_rest(clock, tally)
    if clock[EVENTS] > EVENT_BUDGET:
        tally[EXHAUSTED] += 1.0


@kernel
def count_blow(clock: Array, tally: Array) -> None:
    """Enter an impact that another one follows at once; too many of them, and the run ends."""
    clock[BLOWS] += 1.0
    clock[EVENTS] += 1.0
    tally[EVENTS_LOCATED] += 1.0
    if clock[EVENTS] > EVENT_BUDGET:
        tally[EXHAUSTED] += 1.0


@kernel
def is_patient(clock: Array) -> bool:
    """Whether half of the soft events that the step may have are left."""
    return bool(clock[HELD] == 0.0 and clock[JAMMED] == 0.0 and clock[SOFT] < 0.5 * clock[PATIENCE])


@kernel
def hold_rest(clock: Array, tally: Array) -> None:
    """Let what is left of the step go by the impulse-level scheme."""
    clock[HELD] = 1.0
    tally[STEPS_HELD] += 1.0


@kernel
def give_up_phase(clock: Array, tally: Array) -> None:
    """No phase is found: look for a jam first (E54), then let what is left of the step go by the impulse-level scheme.

    A slip that no force can stand against ends at once, by impulses without a collision: those of the impulse-level
    solve E19 for a sub-step of no length. After it a phase may be found: if not, a longer one is tried.
    """
    if clock[BRIEF] == 0.0 and clock[JAMMED] == 0.0 and clock[LONGER_BRIEF] <= NO_INSTANT:
        clock[BRIEF] = clock[LONGER_BRIEF]
    else:
        clock[BRIEF] = 0.0
        hold_rest(clock, tally)


@kernel
def end_instant(clock: Array, gained: float, loaded: float) -> None:
    """Whether a jam was found: velocities gained far more than what loads do; else the next such sub-step is longer."""
    clock[LONGER_BRIEF] = INSTANT if gained > JUMP * loaded else LONGER * clock[BRIEF]
    clock[BRIEF] = 0.0


@kernel
def weigh_event(clock: Array, weight: float) -> None:
    """What led here turned out to be a soft rebound, or a hard impact (weight 0)."""
    clock[SOFT] = max(clock[SOFT] - max(clock[WEIGHT] - weight, 0.0), 0.0)
    clock[WEIGHT] = weight


@kernel
def end_settling(clock: Array) -> None:
    """What the impulse-level scheme left is taken out; rocking that has ended is behind."""
    clock[UNSETTLED] = 0.0
    if clock[HELD] == UNTIL_REST:
        clock[HELD] = 0.0
