"""The step that is cut where bodies meet and where slides end, and the loop over such steps (E19 to E27, E30 to E34).

sub-step:  detect what touches -> impacts -> force phase up to the first end of a slide -> next impact -> move

What is left of the step after a cut is the next sub-step. A step without events is one sub-step.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.direct.problem import Problem
from reference_solver.journal import keep_state
from reference_solver.model import Array
from reference_solver.spatial.certificate import certify, open_solve, point_work
from reference_solver.spatial.entries import enter_release, enter_settled, enter_sub_step
from reference_solver.spatial.flight import begin_flight, curvature, move_along, undo
from reference_solver.spatial.impact import carries, collide_now, copy_twists, end_series, release
from reference_solver.spatial.iteration import solve_velocities
from reference_solver.spatial.jam import weigh_clusters
from reference_solver.spatial.kinematics import relative_twist, velocity_at
from reference_solver.spatial.ledger import enter_contacts, enter_impulses
from reference_solver.spatial.manifolds import pair_key
from reference_solver.spatial.midpoint import (
    close_gaps,
    deepest,
    exchange_levers,
    keep_change,
    levers_of_start,
    misses_end,
    press_at_mid_drift,
    take_back,
)
from reference_solver.spatial.motion import accelerate, displace
from reference_solver.spatial.phase import NO_PHASE, cut_phase, end_phase, enter_phase, part_points
from reference_solver.spatial.position import correct_positions
from reference_solver.spatial.prepare import warm_start
from reference_solver.spatial.slide import certify_press, hop_time, press_until_stick
from reference_solver.spatial.state import (
    FREE,
    POINTS,
    REMEMBERED,
    Bodies,
    Detection,
    Ledger,
    Manifolds,
    Memory,
    SubStep,
)
from reference_solver.spatial.sticking import prepare_wrenches
from reference_solver.spatial.time_of_impact import next_impact
from reference_solver.spatial.touching import detect_touching
from reference_solver.spatial.vector import add, row, times_transposed
from reference_solver.stepping.accounting import go_back, keep
from reference_solver.stepping.clock import (
    BRIEF,
    CONFINED,
    CRAWL,
    ESCAPED,
    EVENTS,
    HASTE,
    HELD,
    HOPPED,
    JAMMED,
    LEFT,
    MOST_SOFT_IN_SPACE,
    OUTCOME,
    REBOUND,
    SERIES,
    UNSETTLED,
    count_event,
    end_instant,
    end_settling,
    give_up_phase,
    hold_hops,
    open_step,
    open_sub_step,
    weigh_event,
)
from reference_solver.stepping.impacts import LANDED, NO_IMPACT, REBOUNDED, SERIES_PASSES
from reference_solver.stepping.lasting import CONTACTS as LASTING
from reference_solver.stepping.midpoint import CLOSINGS, PUSHED_INTO
from reference_solver.stepping.noise import EVENT_BUDGET, NOTHING_LEFT, SHORT
from reference_solver.stepping.options import Options
from reference_solver.stepping.phase import SHORTENED
from reference_solver.tally import (
    CONTACT_WORK,
    CONTRADICTED_A,
    EXHAUSTED,
    LOAD_WORK,
    SURFACE_WORK,
)

#: Contacts of a phase that cost little: with more of them phases that creep try the patience of the step the sooner.
CHEAP = 4


@spliced_kernel
def located_step(
    bodies: Bodies,
    detection: Detection,
    room: Manifolds,
    memory: Memory,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
) -> bool:
    """One step of an island; False if an array is too small, with the step unfinished."""
    open_step(sub.clock, len(bodies), options.dt, MOST_SOFT_IN_SPACE)
    while sub.clock[LEFT] > 0.0 or sub.clock[UNSETTLED] > 0.0:
        if sub.clock[UNSETTLED] > 0.0:
            if not settle(bodies, detection, room, memory, problem, sub, ledger, options, tally):
                return False
        elif not sub_step(bodies, detection, room, memory, problem, sub, ledger, options, tally):
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
    """Whether any free body's way until ``end`` may leave the bounds given for the step; its flight has begun."""
    for i in range(len(bodies)):
        if bodies.motion[i] != FREE:
            continue
        for k in range(3):
            way = end * (abs(bodies.twist[i, k]) + 0.5 * end * abs(curvature(bodies, i, 0)[k]))
            if bodies.curved[i]:
                c = bodies.path[i, k]
                way = end * (abs(c[1]) + end * (abs(c[2]) + end * (abs(c[3]) + end * (abs(c[4]) + end * abs(c[5])))))
            if not (sub.limit[i, k] <= bodies.pose[i, k] - way and bodies.pose[i, k] + way <= sub.limit[i, 3 + k]):
                return True
    return False


@inner_kernel
def end_run(bodies: Bodies) -> None:
    """Leave no state that could be taken for an answer."""
    for i in range(len(bodies)):
        if bodies.motion[i] == FREE:
            for k in range(6):
                bodies.pose[i, k] = bodies.twist[i, k] = math.nan


@spliced_kernel
def sub_step(
    bodies: Bodies,
    detection: Detection,
    room: Manifolds,
    memory: Memory,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
) -> bool:
    """Go to the next event, or to the end of the step; False, with bodies untouched, if an array is too small."""
    left = sub.clock[LEFT]
    found = detect_touching(bodies, detection, room, memory, sub.past, options, sub.clock)
    if found < 0 or ledger.filled[0] + POINTS * found > len(ledger.real):
        return False
    manifolds = room[:found]
    if left == options.dt and sub.clock[JAMMED] == 0.0 and sub.clock[HELD] == 0.0:
        weigh_clusters(bodies, manifolds, sub, options, tally)
        if sub.clock[HELD] > 0.0:
            return True  # points that may close are looked for as well
    keep(tally, sub.opened)
    length = solve_sub_step(bodies, detection, manifolds, problem, sub, options, tally)
    smooth = enter_phase(bodies, manifolds, sub, options, tally, left, length)
    if smooth == NO_PHASE:
        give_up_phase(sub.clock, tally)
        go_back(tally, sub.opened)
        copy_twists(bodies.before, bodies.twist)
        return True
    held, pushed = sub.clock[HELD] > 0.0, False
    if smooth > 0.0:
        length = smooth
        part_points(bodies, manifolds, options, length)
    else:
        if not held:
            certify_press(bodies, manifolds, options, tally, length)
        pushed = found > 0 and correct_positions(bodies, manifolds, options, tally)
    begin_flight(bodies, manifolds, sub, options, length)
    end = length
    if sub.clock[EVENTS] < EVENT_BUDGET:
        end = next_impact(bodies, detection, manifolds, sub, options, length)
        if end < 0.0:
            undo(bodies)
            return False
    if sub.clock[CONFINED] > 0.0 and leaves_bounds(bodies, sub, end):
        sub.clock[ESCAPED] = 1.0
        return True
    if smooth > 0.0 and end < length:
        cut_phase(bodies, manifolds, sub, end)
        length = end
    remember_forces(bodies, detection, manifolds, memory, length, options.dt)
    if end < length or held:
        cut_work(bodies, manifolds, sub, options, tally, end, end / length)
    if held:
        exchange_levers(manifolds, sub)
        enter_impulses(bodies, manifolds, manifolds.hit, ledger)
        exchange_levers(manifolds, sub)
        enter_impulses(bodies, manifolds, manifolds.impulse, ledger)
    else:
        enter_contacts(bodies, manifolds, ledger)
    keep_state(sub.journal, bodies.pose, bodies.before)
    move_along(bodies, end, end == length and smooth == 0.0)
    if smooth > 0.0:
        end_phase(bodies, sub, tally, end)
    if pushed:
        displace(bodies, options.dt)
    sub.clock[UNSETTLED] = end if held and found > 0 else 0.0
    enter_sub_step(bodies, manifolds, sub, options, end)
    if options.restitution and release(bodies, manifolds, problem, options, tally):
        enter_contacts(bodies, manifolds, ledger)
        enter_release(bodies, manifolds, sub, options, end)
    haste, shortened = end < SHORT * options.dt, smooth == end and sub.clock[OUTCOME] == SHORTENED
    if sub.clock[BRIEF] > 0.0:
        end_instant(sub.clock, tally, *gained_speed(bodies, end))
    if end < left and (haste or not shortened):
        crawl = CRAWL * max(1.0, sub.lasting.size[LASTING] / CHEAP)
        count_event(sub.clock, tally, (crawl if shortened else HASTE) if haste else 1.0)
    sub.clock[LEFT] = left - end if left - end > NOTHING_LEFT * options.dt else 0.0
    return True


@inner_kernel
def gained_speed(bodies: Bodies, length: float) -> tuple[float, float]:
    """Largest change of a velocity in a sub-step, and what loads do in it, over free bodies [m/s]."""
    gained, loaded = 0.0, 0.0
    for i in range(len(bodies)):
        for k in range(3):
            if bodies.motion[i] == FREE:
                gained = max(gained, abs(bodies.twist[i, k] - bodies.first[i, k]))
                loaded = max(loaded, length * abs(bodies.acceleration[i, k]))
    return gained, loaded


@inner_kernel
def settle(
    bodies: Bodies,
    detection: Detection,
    room: Manifolds,
    memory: Memory,
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
    found = detect_touching(bodies, detection, room, memory, sub.past, options, sub.clock)
    if found < 0 or ledger.filled[0] + POINTS * found > len(ledger.real):
        return False
    if found == 0:
        end_settling(sub.clock)
        return True
    keep_state(sub.journal, bodies.pose, bodies.twist)
    moved = close_gaps(bodies, room[:found], options)
    if moved:
        for k in range(CLOSINGS):
            found = detect_touching(bodies, detection, room, memory, sub.past, options, sub.clock)
            if found < 0:
                return False
            if k == CLOSINGS - 1 or deepest(bodies, room[:found]) <= PUSHED_INTO:
                break
            close_gaps(bodies, room[:found], options)
    manifolds, time = room[:found], sub.clock[UNSETTLED]
    misses = misses_end(bodies, manifolds, options, time)
    if misses:
        prepare_wrenches(bodies, manifolds, options)
        take_back(bodies, manifolds, options, tally)
        open_solve(bodies, 0.0, tally)
        warm_start(bodies, manifolds, options)
        solve_velocities(bodies, manifolds, problem, options, tally)
        certify(bodies, manifolds, options, tally)
        keep_change(bodies, manifolds, time)
        enter_impulses(bodies, manifolds, manifolds.hit, ledger)
    if moved or misses:
        enter_settled(bodies, manifolds, sub, options)
    end_settling(sub.clock)
    return True


@spliced_kernel
def solve_sub_step(
    bodies: Bodies,
    detection: Detection,
    manifolds: Manifolds,
    problem: Problem,
    sub: SubStep,
    options: Options,
    tally: Array,
) -> float:
    """Impacts and force phase; return the length of the sub-step, ``twist`` being the velocities at its end.

    An attempt that is made again leaves its sweeps in the tally and nothing else.
    """
    copy_twists(bodies.twist, bodies.before)
    prepare_wrenches(bodies, manifolds, options)
    length, found, struck = sub.clock[LEFT], NO_IMPACT, False
    open_sub_step(sub.clock, options.dt)
    for k in range(SERIES_PASSES):
        if k > 0:
            go_back(tally, sub.opened)
            if sub.clock[HELD] > 0.0:
                levers_of_start(bodies, manifolds, sub, options)
        found = collide_now(bodies, manifolds, problem, options, tally)
        keep(tally, sub.struck)
        struck = found >= LANDED
        if sub.clock[HELD] > 0.0 and len(manifolds) > 0:
            press_at_mid_drift(bodies, manifolds, problem, sub, options, tally, sub.clock[LEFT])
        else:
            length = press_until_stick(bodies, manifolds, problem, sub, options, tally, struck)
        if not (struck and options.restitution and end_series(bodies, manifolds, sub, options, length)):
            break
    if sub.clock[HELD] == 0.0 and sub.clock[SERIES] == 0.0:
        hold_hops(sub.clock, hop_time(bodies, manifolds, sub, options))
        if sub.clock[HOPPED] > 0.0:
            length = press_until_stick(bodies, manifolds, problem, sub, options, tally, struck)
    if found >= REBOUNDED:
        weigh_event(sub.clock, REBOUND if found == REBOUNDED else 0.0)
    keep(tally, sub.saved)
    copy_twists(bodies.twist, bodies.last)
    return length


@inner_kernel
def cut_work(
    bodies: Bodies, manifolds: Manifolds, sub: SubStep, options: Options, tally: Array, end: float, share: float
) -> None:
    """Impulses, and work in the tally, of a sub-step that was solved at full length and cut at ``end``."""
    for entry in (CONTACT_WORK, SURFACE_WORK, LOAD_WORK):
        tally[entry] = sub.saved[entry]
    accelerate(bodies, end)
    open_solve(bodies, end, tally)
    for i in range(len(bodies)):
        for k in range(6):
            bodies.twist[i, k] = bodies.first[i, k] + share * (bodies.last[i, k] - bodies.first[i, k])
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        v_start, w_start = relative_twist(bodies.start, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            for k in range(3):
                manifolds.impulse[m, p, k] *= share
            both = add(velocity_at(v, w, manifolds, m, p), velocity_at(v_start, w_start, manifolds, m, p))
            done, moved, _ = point_work(bodies, manifolds, m, p, both)
            tally[CONTACT_WORK], tally[SURFACE_WORK] = tally[CONTACT_WORK] + done, tally[SURFACE_WORK] + moved
    copy_twists(bodies.first, bodies.twist)


@inner_kernel
def remember_forces(
    bodies: Bodies, detection: Detection, manifolds: Manifolds, memory: Memory, length: float, dt: float
) -> None:
    """Keep the forces of the sub-step: they start the next solve, and tell which contacts last (E20).

    In a very short sub-step the impulses stem from round-off and turning normals rather than from forces; what was
    known before is the better guess.
    """
    for m in range(len(manifolds)):
        memory.pair[m] = pair_key(bodies, manifolds.body_a[m], manifolds.body_b[m])
        memory.points[m] = manifolds.points[m]
        for p in range(manifolds.points[m]):
            memory.feature[m, p] = manifolds.feature[m, p]
            known, divisor = row(manifolds.impulse[m], p, 0), max(length, SHORT * dt)
            ends = manifolds.release[m, p] > 0.0 or not carries(manifolds, m, p, length / dt)
            if length < SHORT * dt and manifolds.force[m, p, 2] > 0.0:
                known, divisor = row(manifolds.force[m], p, 0), 1.0
            force = times_transposed(manifolds.frame, m, known)
            for d in range(3):
                memory.impulse[m, p, d] = 0.0 if ends else force[d] / divisor
    detection.found[REMEMBERED] = len(manifolds)
