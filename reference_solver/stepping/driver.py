"""The step that is cut where bodies meet and where slides end, and the loop over such steps (E19 to E34).

sub-step:  find what touches -> impacts -> force phase up to the first end of a slide -> next impact -> move

What is left of the step after a cut is the next sub-step. A step without events is one sub-step. What is asked of a
dimension on the way stands in `stepping.operations`; an *island* is a dimension's bodies that can meet within the step,
with all that their step works on.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.journal import keep_state
from reference_solver.stepping.accounting import go_back, keep
from reference_solver.stepping.chains import open_instant, strikes_again
from reference_solver.stepping.clock import (
    BLOWS,
    BRIEF,
    CONFINED,
    ESCAPED,
    HELD,
    INSTANT,
    LEFT,
    LONGER_BRIEF,
    MEETING,
    OUTCOME,
    REBOUND,
    ROCKING,
    ROCKS,
    SERIES,
    UNSETTLED,
    UNTIL_REST,
    count_blow,
    count_event,
    end_instant,
    end_settling,
    give_up_phase,
    open_step,
    opens_step,
    weigh_event,
)
from reference_solver.stepping.impacts import LANDED, NO_IMPACT, REBOUNDED, SERIES_PASSES, STRUCK
from reference_solver.stepping.midpoint import CLOSINGS, PUSHED_INTO
from reference_solver.stepping.noise import NOTHING_LEFT, SHORT
from reference_solver.stepping.operations import (
    Island,
    begin_solve,
    close_gaps,
    collide_now,
    deepest_overlap,
    end_blow,
    end_rocking,
    end_series,
    end_solve,
    enter_path,
    enter_settled,
    find_loaded,
    find_touching,
    follow_path,
    gained_speed,
    is_free,
    leaves_bounds,
    levers_of_start,
    misses_end,
    next_impact,
    patience,
    press_for,
    press_until_stick,
    price_of_creeping,
    put_back,
    return_to_start,
    solve_end,
    weigh_clusters,
)
from reference_solver.stepping.phase import NO_PHASE, SHORTENED
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTRADICTED_A, EXHAUSTED, OPENED, SUB_STEPS


@spliced_kernel
def step_island(island: Island, goes_on: bool) -> bool:
    """One step of an island; False if an array is too small, with the step unfinished.

    Where a body may leave its bounds (``ESCAPED``) the step stops before it does; with wider ones it ``goes_on``.
    """
    clock, tally = island.sub.clock, island.tally
    if not goes_on:
        open_step(clock, len(island.bodies.pose), island.options.dt, patience(island))
    while clock[LEFT] > 0.0 or clock[UNSETTLED] > 0.0:
        if clock[UNSETTLED] > 0.0:
            if not settle(island):
                return False
        elif not make_sub_step(island):
            return False
        if clock[ESCAPED] > 0.0:
            return True
        if tally[EXHAUSTED] > 0.0 or tally[CONTRADICTED_A] > 0.0:
            end_run(island)
            clock[LEFT] = clock[UNSETTLED] = 0.0
    return True


@inner_kernel
def end_run(island: Island) -> None:
    """Leave no state that could be taken for an answer."""
    pose, twist = island.bodies.pose, island.bodies.twist
    for i in range(len(pose)):
        if is_free(island, i):
            for k in range(pose.shape[1]):
                pose[i, k] = math.nan
            for k in range(twist.shape[1]):
                twist[i, k] = math.nan


@spliced_kernel
def make_sub_step(island: Island) -> bool:
    """Go to the next event, or to the end of the step; False, with bodies untouched, if an array is too small."""
    clock, options, tally = island.sub.clock, island.options, island.tally
    left, held, rocks = clock[LEFT], clock[HELD], clock[ROCKS]
    if not find_touching(island):
        return False
    if opens_step(clock, options.dt):
        weigh_clusters(island)
        if clock[HELD] > held:
            return True  # what may close is looked for as well
    length = solve_sub_step(island)
    if tally[CONTRADICTED_A] > 0.0:
        return True
    if length == 0.0:
        end_blow(island)
        count_blow(clock, tally)
        clock[MEETING] = math.inf
        return True
    island.sub.lasting.lenient[0] = 1.0 if clock[LONGER_BRIEF] > INSTANT else 0.0
    phase = enter_path(island, length)
    if phase == NO_PHASE:
        go_back(tally, island.sub.opened)
        return_to_start(island)
        if clock[ROCKING] > 0.0:
            clock[ROCKS] = UNTIL_REST
        else:
            give_up_phase(clock, tally)
        return True
    length = phase if phase > 0.0 else length
    end = next_impact(island, length)
    if end < 0.0:
        return_to_start(island)
        return False
    if clock[CONFINED] > 0.0 and leaves_bounds(island, end):
        go_back(tally, island.sub.opened)
        return_to_start(island)
        clock[ESCAPED], clock[HELD], clock[ROCKS] = 1.0, held, rocks
        return True
    shortened = phase == end and clock[OUTCOME] == SHORTENED
    if end < clock[SERIES] and not shortened:
        # What has not ended by then is followed. That comes to an end: each time fewer series are taken to end.
        go_back(tally, island.sub.opened)
        return_to_start(island)
        clock[MEETING], clock[HELD], clock[ROCKS] = end, held, rocks
        return True
    end = follow_path(island, length, end, phase > 0.0)
    tally[SUB_STEPS] += 1.0
    tally[OPENED] = max(tally[OPENED], 1.0)  # a phase opens no solve, and what is solved after it is not the start
    haste, shortened = end < SHORT * options.dt, phase == end and clock[OUTCOME] == SHORTENED
    if clock[BRIEF] > 0.0:
        gained, loaded = gained_speed(island, end)
        end_instant(clock, gained, loaded)
    if end < left and (haste or not shortened):
        count_event(clock, tally, haste, shortened, price_of_creeping(island))
    clock[LEFT] = left - end if left - end > NOTHING_LEFT * options.dt else 0.0
    clock[BLOWS], clock[MEETING] = 0.0, math.inf
    return True


@spliced_kernel
def solve_sub_step(island: Island) -> float:
    """Impacts and force phase; return the length of the sub-step, ``twist`` being the velocities at its end.

    It is 0 where the impact drove bodies together that had no part in it, so that another follows at once (E21). An
    attempt that is made again leaves its sweeps in the tally and nothing else.
    """
    clock, tally = island.sub.clock, island.tally
    clock[ROCKING] = clock[SERIES] = 0.0
    begin_solve(island)
    open_instant(island)
    keep(tally, island.sub.opened)
    length, found = clock[LEFT], NO_IMPACT
    for k in range(SERIES_PASSES):
        if k > 0:
            go_back(tally, island.sub.opened)
            if clock[HELD] > 0.0:
                levers_of_start(island)
        found = collide_now(island)
        keep(tally, island.sub.struck)
        if found >= LANDED and strikes_again(island):
            weigh_event(clock, 0.0 if found == STRUCK else REBOUND)
            return 0.0
        most = min(clock[LEFT], clock[BRIEF] * island.options.dt) if clock[BRIEF] > 0.0 else clock[LEFT]
        length = press_until_stick(island, most, found >= LANDED)
        if not (found >= LANDED and island.options.restitution and end_series(island, length)):
            break
    if clock[HELD] == 0.0:
        length = come_to_rest(island, length, found >= LANDED)
    if found >= REBOUNDED:
        weigh_event(clock, REBOUND if found == REBOUNDED else 0.0)
    end_solve(island)
    return length


@spliced_kernel
def come_to_rest(island: Island, length: float, struck: bool) -> float:
    """Hold contacts of bodies that rock to rest (E22), until they do; length of the sub-step."""
    clock, left = island.sub.clock, island.sub.clock[LEFT]
    longest, shortest = end_rocking(island, length)
    if shortest < left:
        weigh_event(clock, REBOUND)
    if longest == 0.0:
        return length
    go_back(island.tally, island.sub.struck)
    clock[HELD] = clock[ROCKS]  # if rows turn the impulse-level scheme does it
    clock[ROCKS], clock[ROCKING] = 0.0, 1.0
    return press_for(island, min(max(longest, SHORT * island.options.dt), left), struck)


@inner_kernel
def keep_places(island: Island) -> None:
    """Keep all poses for `put_back`; what a phase began with is lost."""
    pose, lasting = island.bodies.pose, island.sub.lasting
    copy_vectors(pose, lasting.base)
    for i in range(len(pose)):
        for d in range(lasting.displacement.shape[1]):
            lasting.displacement[i, d] = 0.0


@inner_kernel
def settle(island: Island) -> bool:
    """Take out what the impulse-level scheme leaves of the gaps and velocities of contacts that it held (E28).

    Gaps first: velocities are those that the closed contacts allow. Their impulses are found anew with the rows of the
    end, by a solve that starts from them: what was too much is taken back. Otherwise it would be an impact in the
    sub-step that follows, which knows nothing of this one. Where closing gaps pushes bodies into others and does not
    get them out again, they stay where they were: a gap is closed by the loads of the next step, an overlap by nobody.
    False if an array is too small; called again, it starts anew.
    """
    clock = island.sub.clock
    if find_loaded(island) < 0:
        return False
    keep_state(island.sub.journal, island.bodies.pose, island.bodies.twist)
    keep_places(island)
    most = max(deepest_overlap(island), PUSHED_INTO)
    moved = close_gaps(island)
    if moved:
        before = math.inf
        for k in range(CLOSINGS):
            if find_loaded(island) < 0:
                return False
            deepest = deepest_overlap(island)
            if deepest <= PUSHED_INTO:
                break
            if k == CLOSINGS - 1 or deepest >= before:
                if deepest > most:
                    put_back(island)
                    if find_loaded(island) < 0:
                        return False
                break
            before = deepest
            close_gaps(island)
    misses = misses_end(island, clock[UNSETTLED])
    if misses:
        solve_end(island, clock[UNSETTLED])
    if moved or misses:
        enter_settled(island)
    end_settling(clock)
    return True
