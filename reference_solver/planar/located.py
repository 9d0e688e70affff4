"""The step that is cut where bodies meet and where slides end, and the loop over such steps (E19 to E27).

sub-step:  detect -> keep what touches -> impacts -> force phase up to the first end of a slide -> next impact -> move

What is left of the step after a cut is the next sub-step. A step without events is one sub-step.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.direct.problem import Problem
from reference_solver.journal import close_step
from reference_solver.model import Array
from reference_solver.planar.block import prepare_blocks
from reference_solver.planar.certificate import row_work
from reference_solver.planar.clock import REBOUND, count_event, most_events, open_step, weigh_event
from reference_solver.planar.columns import (
    FORCE_N,
    FORCE_T,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    MOTION,
    PN,
    PT,
    RELEASE,
)
from reference_solver.planar.entries import enter_release, enter_sub_step
from reference_solver.planar.flight import begin_flight, move_along
from reference_solver.planar.impact import (
    LANDED,
    NO_IMPACT,
    REBOUNDED,
    collide_now,
    end_series,
    keep_touching,
    release,
)
from reference_solver.planar.kinematics import copy_vectors
from reference_solver.planar.ledger import enter_contacts
from reference_solver.planar.manifolds import detect, row_key
from reference_solver.planar.position import correct_positions
from reference_solver.planar.slide import go_back, keep, press_until_stick
from reference_solver.planar.state import (
    BLOCK,
    CONTACTS,
    EVENTS,
    FREE,
    LEFT,
    REMEMBERED,
    Bodies,
    Buffer,
    Ledger,
    Options,
    Pairs,
    Rows,
    SubStep,
)
from reference_solver.planar.step import move
from reference_solver.planar.time_of_impact import next_impact
from reference_solver.tally import CONTACT_WORK, LOAD_WORK, SURFACE_WORK

#: What is left of a step below this share of it is nothing.
NOTHING_LEFT = 1e-14
#: A sub-step shorter than this share of a step tells nothing about forces.
SHORT = 1e-3
#: Passes that mark ending series of rebounds; each marks at least one row more.
SERIES_PASSES = 4


@inner_kernel
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
    """One step; False if an array is too small: called again, it goes on with the sub-step that stopped."""
    if sub.clock[LEFT] == 0.0:
        open_step(sub.clock, len(bodies.kind), options.dt)
        ledger.used[0] = 0
    while sub.clock[LEFT] > 0.0:
        if not sub_step(bodies, pairs, rows, problem, sub, ledger, options, tally):
            return False
    return True


@inner_kernel
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
    keep_touching(bodies, pairs, rows, sub)
    if ledger.used[0] + rows.counts[CONTACTS] > len(ledger.real):
        return False
    if options.solver == BLOCK:
        prepare_blocks(bodies, rows)
    copy_vectors(bodies.twist, sub.before)
    length = solve_sub_step(bodies, rows, problem, sub, options, tally)
    begin_flight(bodies, rows, sub, length)
    end = length
    if sub.clock[EVENTS] < most_events(len(bodies.kind)):
        end = next_impact(bodies, pairs, rows, sub, options, length)
        if end < 0.0:
            copy_vectors(sub.before, bodies.twist)
            return False
    if rows.counts[CONTACTS] > 0 and correct_positions(bodies, rows, options, tally):
        move_along(bodies, sub, end, end == length)
        move(bodies, bodies.pseudo, options.dt)
    else:
        move_along(bodies, sub, end, end == length)
    remember_forces(bodies, rows, length, options.dt)
    if end < length:
        cut_work(bodies, rows, sub, tally, end, end / length)
    enter_contacts(bodies, rows, ledger)
    enter_sub_step(bodies, rows, sub, options, end)
    if options.restitution and release(bodies, rows, problem, options, tally):
        enter_contacts(bodies, rows, ledger)
        enter_release(bodies, rows, sub, options, end)
    if end < left:
        count_event(sub.clock, len(bodies.kind), tally)
    sub.clock[LEFT] = left - end if left - end > NOTHING_LEFT * options.dt else 0.0
    return True


@inner_kernel
def cut_work(bodies: Bodies, rows: Rows, sub: SubStep, tally: Array, end: float, share: float) -> None:
    """Impulses, and work in the tally, of a sub-step that was solved at full length and cut at ``end``."""
    for entry in range(CONTACT_WORK, LOAD_WORK + 1):
        tally[entry] = sub.tally[1, entry]
    for i in range(len(bodies.kind)):
        for k in range(3):
            bodies.start[i, k] = sub.start[i, k] + end * bodies.real[i, LOAD + k]
            inverse = bodies.real[i, INVERSE_MASS if k < 2 else INVERSE_INERTIA]
            if bodies.kind[i, MOTION] == FREE and inverse > 0.0:
                mean = 0.5 * (bodies.start[i, k] + sub.start[i, k])
                tally[LOAD_WORK] += end * bodies.real[i, LOAD + k] / inverse * mean
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN], rows.real[c, PT] = share * rows.real[c, PN], share * rows.real[c, PT]
        done, moved, _ = row_work(bodies, rows, c)
        tally[CONTACT_WORK], tally[SURFACE_WORK] = tally[CONTACT_WORK] + done, tally[SURFACE_WORK] + moved


@inner_kernel
def solve_sub_step(bodies: Bodies, rows: Rows, problem: Problem, sub: SubStep, options: Options, tally: Array) -> float:
    """Impacts and force phase; return the length of the sub-step, `bodies.twist` being the velocities at its end."""
    left = sub.clock[LEFT]
    length, found = left, NO_IMPACT
    keep(tally, sub.tally[0])
    for k in range(SERIES_PASSES):
        if k > 0:
            go_back(tally, sub.tally[0])
        found = collide_now(bodies, rows, problem, sub, options, tally)
        struck = found >= LANDED
        length = press_until_stick(bodies, rows, problem, sub, options, tally, left, struck)
        if not (struck and options.restitution and end_series(bodies, rows, sub, length)):
            break
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


@kernel
def run_located(
    bodies: Bodies,
    pairs: Pairs,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
    buffer: Buffer,
    first: int,
    steps: int,
    stride: int,
) -> int:
    """Like `run_steps` in step.py, for located steps."""
    for k in range(first, steps):
        sampled = stride > 0 and (k + 1) % stride == 0
        if sampled and len(buffer.real) > 0 and buffer.offset[k // stride] + len(ledger.real) > len(buffer.real):
            return k
        if not located_step(bodies, pairs, rows, problem, sub, ledger, options, tally):
            return k
        close_step(sub.journal)
        if sampled:
            sample_located(bodies, ledger, buffer, (k + 1) // stride - 1)
    return steps


@inner_kernel
def sample_located(bodies: Bodies, ledger: Ledger, buffer: Buffer, s: int) -> None:
    """Write the state, and the contacts where the buffer has room for any, as sample s."""
    copy_vectors(bodies.pose, buffer.pose[s])
    copy_vectors(bodies.twist, buffer.twist[s])
    start = buffer.offset[s]
    buffer.offset[s + 1] = start
    if len(buffer.real) > 0:
        buffer.offset[s + 1] = start + ledger.used[0]
        copy_ledger(ledger, buffer, start)


@kernel
def copy_ledger(ledger: Ledger, buffer: Buffer, start: int) -> None:
    """Contacts of the last step, from index ``start`` on."""
    for c in range(ledger.used[0]):
        for d in range(3):
            buffer.integer[start + c, d] = ledger.integer[c, d]
        for d in range(7):
            buffer.real[start + c, d] = ledger.real[c, d]
