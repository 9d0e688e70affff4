"""The step that is cut where bodies meet and where slides end, and the loop over such steps (E19 to E27).

sub-step:  detect -> keep what touches -> impacts -> force phase up to the first end of a slide -> next impact -> move

What is left of the step after a cut is the next sub-step. A step without events is one sub-step.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.direct.problem import Problem
from reference_solver.journal import keep_state
from reference_solver.model import Array
from reference_solver.planar.block import prepare_blocks
from reference_solver.planar.certificate import certify, open_solve
from reference_solver.planar.columns import (
    FORCE_N,
    FORCE_T,
    LOAD,
    MOTION,
    PN,
    PT,
    RELEASE,
)
from reference_solver.planar.curve import curve, enter_curve, follow_curve, turns
from reference_solver.planar.entries import enter_release, enter_settled, enter_sub_step
from reference_solver.planar.flight import begin_flight, move_along
from reference_solver.planar.impact import collide_now, end_series, keep_loaded, keep_touching, release
from reference_solver.planar.iteration import solve_velocities
from reference_solver.planar.jam import weigh_clusters
from reference_solver.planar.kinematics import copy_vectors
from reference_solver.planar.ledger import enter_contacts
from reference_solver.planar.manifolds import detect, row_key
from reference_solver.planar.midpoint import (
    close_gaps,
    deepest,
    keep_change,
    levers_of_start,
    misses_end,
    take_back,
)
from reference_solver.planar.position import correct_positions
from reference_solver.planar.press import cut_work
from reference_solver.planar.rocking import rest
from reference_solver.planar.rows import warm_start
from reference_solver.planar.slide import press_until_stick
from reference_solver.planar.state import CONTACTS, FREE, REMEMBERED, Bodies, Ledger, Pairs, Rows, SubStep
from reference_solver.planar.step import move
from reference_solver.planar.time_of_impact import next_impact
from reference_solver.stepping.accounting import go_back, keep
from reference_solver.stepping.clock import (
    BRIEF,
    CONFINED,
    CRAWL,
    ESCAPED,
    HASTE,
    HELD,
    JAMMED,
    LEFT,
    MOST_SOFT,
    OUTCOME,
    REBOUND,
    ROCKING,
    ROCKS,
    SERIES,
    UNSETTLED,
    UNTIL_REST,
    count_event,
    end_instant,
    end_settling,
    give_up_phase,
    open_step,
    open_sub_step,
    weigh_event,
)
from reference_solver.stepping.impacts import LANDED, NO_IMPACT, REBOUNDED, SERIES_PASSES
from reference_solver.stepping.midpoint import CLOSINGS, PUSHED_INTO
from reference_solver.stepping.noise import NOTHING_LEFT, SHORT
from reference_solver.stepping.options import BLOCK, Options
from reference_solver.stepping.phase import SHORTENED
from reference_solver.tally import CONTRADICTED_A, EXHAUSTED


@spliced_kernel
def located_step(
    bodies: Bodies,
    pairs: Pairs,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
) -> bool:
    """One step of an island; False if an array is too small, with the step unfinished."""
    open_step(sub.clock, len(bodies.kind), options.dt, MOST_SOFT)
    while sub.clock[LEFT] > 0.0 or sub.clock[UNSETTLED] > 0.0:
        if sub.clock[UNSETTLED] > 0.0:
            if not settle(bodies, pairs, rows, problem, sub, ledger, options, tally):
                return False
        elif not sub_step(bodies, pairs, rows, problem, sub, ledger, options, tally):
            return False
        if sub.clock[ESCAPED] > 0.0:
            sub.clock[LEFT] = sub.clock[UNSETTLED] = 0.0
            return True
        if tally[EXHAUSTED] > 0.0 or tally[CONTRADICTED_A] > 0.0:
            end_run(bodies)
            sub.clock[LEFT] = sub.clock[UNSETTLED] = 0.0
    return True


@inner_kernel
def leaves_bounds(bodies: Bodies, sub: SubStep, end: float) -> bool:
    """Whether any free body's path until ``end`` may leave the bounds given for the step."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] != FREE:
            continue
        for k in range(2):
            c = sub.path[i, k]
            way = end * (abs(c[1]) + end * (abs(c[2]) + end * (abs(c[3]) + end * (abs(c[4]) + end * abs(c[5])))))
            if not (sub.limit[i, k] <= sub.pose[i, k] - way and sub.pose[i, k] + way <= sub.limit[i, 2 + k]):
                return True
    return False


@inner_kernel
def end_run(bodies: Bodies) -> None:
    """Leave no state that could be taken for an answer."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FREE:
            for k in range(3):
                bodies.pose[i, k] = bodies.twist[i, k] = math.nan


@spliced_kernel
def sub_step(
    bodies: Bodies,
    pairs: Pairs,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
) -> bool:
    """Go to the next event, or to the end of the step; False, with bodies untouched, if an array is too small."""
    left = sub.clock[LEFT]
    if not detect(bodies, pairs, rows, options):
        return False
    if sub.clock[LEFT] == options.dt and sub.clock[HELD] == 0.0:
        weigh_clusters(bodies, rows, sub, options, tally)
    keep_touching(bodies, pairs, rows, sub, options.dt)
    if ledger.used[0] + rows.counts[CONTACTS] > len(ledger.real):
        return False
    if options.solver == BLOCK:
        prepare_blocks(bodies, rows)
    copy_vectors(bodies.twist, sub.before)
    length = solve_sub_step(bodies, rows, problem, sub, options, tally)
    if tally[CONTRADICTED_A] > 0.0:
        return True
    begin_flight(bodies, rows, sub, length)
    curved = 0.0
    if sub.clock[HELD] == 0.0 and sub.clock[SERIES] == 0.0 and turns(bodies, rows, sub, length):
        if sub.clock[ROCKING] > 0.0:
            sub.clock[ROCKS] = UNTIL_REST
        elif sub.clock[JAMMED] == 0.0:
            curved = curve(bodies, rows, sub, tally)
        if curved == 0.0:
            if sub.clock[ROCKING] == 0.0:
                give_up_phase(sub.clock, tally)
            go_back(tally, sub.tally[0])
            copy_vectors(sub.before, bodies.twist)
            return True
    length = curved if curved > 0.0 else length
    end = next_impact(bodies, pairs, rows, sub, options, length)
    if end < 0.0:
        copy_vectors(sub.before, bodies.twist)
        return False
    if sub.clock[CONFINED] > 0.0 and leaves_bounds(bodies, sub, end):
        sub.clock[ESCAPED] = 1.0
        return True
    if curved > 0.0:
        end = follow_curve(bodies, pairs, rows, sub, options, length, end)
        enter_curve(bodies, rows, sub, tally)
        length = end
    elif rows.counts[CONTACTS] > 0 and correct_positions(bodies, rows, options, tally):
        move_along(bodies, sub, end, end == length)
        move(bodies, bodies.pseudo, options.dt)
    else:
        move_along(bodies, sub, end, end == length)
    remember_forces(bodies, rows, length, options.dt)
    if end < length:
        cut_work(bodies, rows, sub, tally, end, end / length)
    sub.clock[UNSETTLED] = end if sub.clock[HELD] > 0.0 and rows.counts[CONTACTS] > 0 else 0.0
    enter_contacts(bodies, rows, ledger)
    enter_sub_step(bodies, rows, sub, options, end, curved > 0.0)
    if options.restitution and release(bodies, rows, problem, options, tally):
        enter_contacts(bodies, rows, ledger)
        enter_release(bodies, rows, sub, options, end)
    haste, shortened = end < SHORT * options.dt, curved == end and sub.clock[OUTCOME] == SHORTENED
    if sub.clock[BRIEF] > 0.0:
        end_instant(sub.clock, tally, *gained_speed(bodies, sub, end))
    if end < left and (haste or not shortened):
        count_event(sub.clock, tally, (CRAWL if shortened else HASTE) if haste else 1.0)
    sub.clock[LEFT] = left - end if left - end > NOTHING_LEFT * options.dt else 0.0
    return True


@inner_kernel
def gained_speed(bodies: Bodies, sub: SubStep, length: float) -> tuple[float, float]:
    """Largest change of a velocity in a sub-step, and what loads do in it, over free bodies [m/s]."""
    gained, loaded = 0.0, 0.0
    for i in range(len(bodies.kind)):
        for k in range(2):
            if bodies.kind[i, MOTION] == FREE:
                gained = max(gained, abs(bodies.twist[i, k] - sub.start[i, k]))
                loaded = max(loaded, length * abs(bodies.real[i, LOAD + k]))
    return gained, loaded


@inner_kernel
def settle(
    bodies: Bodies,
    pairs: Pairs,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
) -> bool:
    """Take out what the impulse-level scheme leaves of the gaps and velocities of contacts that it held (E28).

    Gaps first: velocities are those that the closed contacts allow. Their impulses are found anew with the rows of the
    end, by a solve that starts from them: what was too much is taken back. Otherwise it would be an impact in the
    sub-step that follows, which knows nothing of this one. False if an array is too small; called again, it starts
    anew.
    """
    if not detect(bodies, pairs, rows, options):
        return False
    if not keep_loaded(bodies, pairs, rows):
        end_settling(sub.clock)
        return True
    if ledger.used[0] + rows.counts[CONTACTS] > len(ledger.real):
        return False
    if options.solver == BLOCK:
        prepare_blocks(bodies, rows)
    keep_state(sub.journal, bodies.pose, bodies.twist)
    moved = close_gaps(bodies, rows, sub, options)
    if moved:
        for k in range(CLOSINGS):
            if not detect(bodies, pairs, rows, options):
                return False
            keep_loaded(bodies, pairs, rows)
            if options.solver == BLOCK:
                prepare_blocks(bodies, rows)
            if k == CLOSINGS - 1 or deepest(bodies, rows) <= PUSHED_INTO:
                break
            close_gaps(bodies, rows, sub, options)
    time = sub.clock[UNSETTLED]
    misses = misses_end(bodies, rows, options, time)
    if misses:
        take_back(bodies, rows, options, tally)
        open_solve(bodies, 0.0, tally)
        warm_start(bodies, rows, options)
        solve_velocities(bodies, rows, problem, options, tally)
        certify(bodies, rows, options, tally)
        keep_change(rows, time)
        enter_contacts(bodies, rows, ledger)
    if moved or misses:
        enter_settled(bodies, rows, sub, options)
    end_settling(sub.clock)
    return True


@spliced_kernel
def solve_sub_step(bodies: Bodies, rows: Rows, problem: Problem, sub: SubStep, options: Options, tally: Array) -> float:
    """Impacts and force phase; return the length of the sub-step, `bodies.twist` being the velocities at its end."""
    left = sub.clock[LEFT]
    length, found = left, NO_IMPACT
    sub.clock[ROCKING] = 0.0
    open_sub_step(sub.clock, options.dt)
    keep(tally, sub.tally[0])
    for k in range(SERIES_PASSES):
        if k > 0:
            go_back(tally, sub.tally[0])
            if sub.clock[HELD] > 0.0:
                levers_of_start(bodies, rows, options)
        found = collide_now(bodies, rows, problem, sub, options, tally)
        most = min(left, sub.clock[SERIES]) if sub.clock[SERIES] > 0.0 else left
        length = press_until_stick(bodies, rows, problem, sub, options, tally, most)
        if not (found >= LANDED and options.restitution and end_series(bodies, rows, sub, options, length)):
            break
    if sub.clock[HELD] == 0.0:
        length = rest(bodies, rows, problem, sub, options, tally, length)
    if found >= REBOUNDED:
        weigh_event(sub.clock, REBOUND if found == REBOUNDED else 0.0)
    return length


@inner_kernel
def remember_forces(bodies: Bodies, rows: Rows, length: float, dt: float) -> None:
    """Keep the forces of the sub-step: they start the next solve, and tell which contacts last (E20).

    In a very short sub-step the impulses stem from round-off and turning normals rather than from forces; what was
    known before is the better guess.
    """
    for c in range(rows.counts[CONTACTS]):
        rows.old_key[c] = row_key(bodies, rows, c)
        lasts = 0.0 if rows.real[c, RELEASE] > 0.0 or rows.real[c, PN] <= 0.0 else 1.0
        if length < SHORT * dt and rows.real[c, FORCE_N] > 0.0:
            rows.old_impulse[c, 0] = lasts * rows.real[c, FORCE_N]
            rows.old_impulse[c, 1] = lasts * rows.real[c, FORCE_T]
        else:
            rows.old_impulse[c, 0] = lasts * rows.real[c, PN] / max(length, SHORT * dt)
            rows.old_impulse[c, 1] = lasts * rows.real[c, PT] / max(length, SHORT * dt)
    rows.counts[REMEMBERED] = rows.counts[CONTACTS]
