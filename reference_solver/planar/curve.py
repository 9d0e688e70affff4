"""Sub-steps in which rows turn: from the rows of an instant to a phase of lasting contact, and back (E35 to E39)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar.columns import (
    COS,
    EXTENT,
    GAP,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    MOTION,
    NX,
    NY,
    PN,
    PT,
    SIN,
    SPEED,
    TARGET,
    A,
    B,
)
from reference_solver.planar.flight import place, put_back
from reference_solver.planar.impact import flies, gap_noise
from reference_solver.planar.kinematics import normal_velocity
from reference_solver.planar.lasting import evaluate, hold
from reference_solver.planar.press import FAR
from reference_solver.planar.rows import still_speed
from reference_solver.planar.state import CONTACTS, FREE, Bodies, Pairs, Rows, SubStep
from reference_solver.planar.time_of_impact import next_impact
from reference_solver.stepping import phase
from reference_solver.stepping.accounting import go_back, keep
from reference_solver.stepping.clock import LEFT, OUTCOME, ROCKING
from reference_solver.stepping.lasting import CONTACTS as HELD_CONTACTS
from reference_solver.stepping.lasting import OPEN, Lasting
from reference_solver.stepping.noise import FROZEN, NOISE
from reference_solver.stepping.options import Options
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTACT_WORK, LOAD_WORK, SURFACE_WORK

#: Repetitions of a phase to make it end at an impact; each squares what the one before missed it by.
REPEATS = 6
#: Relative change of its length that ends them: a few units in the last place.
SAME_LENGTH = 1e-15
#: How far beyond its end the path of a phase is followed, in multiples of its length: a quintic tells nothing of more.
AHEAD = 1.5


@inner_kernel
def note_contacts(bodies: Bodies, rows: Rows, lasting: Lasting, length: float, dt: float) -> bool:
    """Note all rows that touch and do not part as lasting contacts; False if there are none, or too many.

    The same part as in the frozen solve of ``length``.
    """
    count = 0
    for c in range(rows.counts[CONTACTS]):
        speed = rows.real[c, SPEED]
        u = normal_velocity(bodies.twist, rows, c)
        leaves = u > max(NOISE * speed, still_speed(bodies, rows, c, dt)) and flies(bodies, rows, c, u, length)
        if leaves or rows.real[c, GAP] > gap_noise(bodies, rows, c):
            continue
        if count == len(lasting.row):
            return False
        hold(bodies, rows, lasting, c, count)
        lasting.speeds[count] = speed
        lasting.extent[count] = min(bodies.real[rows.integer[c, A], EXTENT], bodies.real[rows.integer[c, B], EXTENT])
        count += 1
    lasting.size[HELD_CONTACTS] = count
    return count > 0


@inner_kernel
def turns(bodies: Bodies, rows: Rows, sub: SubStep, length: float, dt: float) -> bool:
    """Whether rows of lasting contacts change along the frozen path, or end; bodies are where they were afterwards."""
    lasting = sub.lasting
    copy_vectors(sub.start, bodies.twist)
    found = False
    if note_contacts(bodies, rows, lasting, length, dt):
        evaluate(bodies, lasting)
        keep_rows(lasting)
        phase.keep_limits(bodies, lasting)
        for part in range(2 if sub.clock[ROCKING] > 0.0 else 1, 3):  # what rocks to rest ends as it began
            for i in range(len(bodies.kind)):
                place(bodies, sub, i, 0.5 * part * length)
            evaluate(bodies, lasting)
            found = found or rows_changed(bodies, lasting) or phase.passes_limit(bodies, lasting)
        for i in range(len(bodies.kind)):
            put_back(bodies, sub, i)
    copy_vectors(sub.after, bodies.twist)
    return found


@inner_kernel
def keep_rows(lasting: Lasting) -> None:
    """Keep the Jacobian of all contacts."""
    for k in range(lasting.size[HELD_CONTACTS]):
        for side in range(2):
            for row in range(2):
                for d in range(3):
                    lasting.trial[k, side, row, d] = lasting.jacobian[k, side, row, d]


@inner_kernel
def rows_changed(bodies: Bodies, lasting: Lasting) -> bool:
    """Whether any entry that matters differs from the one kept by more than a share of its lever, or of one.

    One of a body that neither answers to it nor moves along it does not.
    """
    for k in range(lasting.size[HELD_CONTACTS]):
        for side in range(2):
            lever = max(abs(lasting.trial[k, side, 0, 2]), abs(lasting.trial[k, side, 1, 2]))
            for row in range(2):
                for d in range(3):
                    if lasting.response[k, side, row, d] == 0.0 and bodies.twist[lasting.body[k, side], d] == 0.0:
                        continue
                    change = abs(lasting.jacobian[k, side, row, d] - lasting.trial[k, side, row, d])
                    if change > FROZEN * (1.0 if d < 2 else lever):
                        return True
    return False


@inner_kernel
def curve(bodies: Bodies, rows: Rows, sub: SubStep, tally: Array) -> float:
    """Find the phase that replaces the frozen solve, and its paths; its length, 0 if there is none.

    Bodies are where the sub-step began afterwards, with the velocities of its end.
    """
    keep(tally, sub.saved)
    go_back(tally, sub.struck)
    copy_vectors(sub.start, bodies.twist)
    length, outcome = phase.find_phase(bodies, sub.lasting, sub.clock[LEFT])
    sub.clock[OUTCOME] = outcome
    if outcome == phase.FAILED:
        keep(sub.saved, tally)
        restore(bodies, sub)
        return 0.0
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN] = rows.real[c, PT] = 0.0
        rows.real[c, TARGET] = -FAR * rows.real[c, SPEED] if rows.real[c, SPEED] > 0.0 else -FAR
    for k in range(sub.lasting.size[HELD_CONTACTS]):
        if sub.lasting.mode[k] != OPEN:
            rows.real[sub.lasting.row[k], TARGET] = 0.0
    end_curve(bodies, sub, length)
    return length


@inner_kernel
def end_curve(bodies: Bodies, sub: SubStep, length: float) -> None:
    """Keep the end of the phase just made and its paths, and put bodies back to its start."""
    copy_vectors(bodies.pose, sub.final)
    copy_vectors(bodies.twist, sub.after)
    for i in range(len(bodies.kind)):
        phase.write_path(sub.lasting, i, length, sub.path[i])
    restore(bodies, sub)


@inner_kernel
def restore(bodies: Bodies, sub: SubStep) -> None:
    """Put bodies where the sub-step began, with the velocities of its end."""
    copy_vectors(sub.after, bodies.twist)
    for i in range(len(bodies.kind)):
        put_back(bodies, sub, i)


@inner_kernel
def follow_curve(
    bodies: Bodies, pairs: Pairs, rows: Rows, sub: SubStep, options: Options, length: float, end: float
) -> float:
    """Go to the end of the phase, or to an impact in it: then the phase is made again until it ends there."""
    for repeat in range(REPEATS if end < length else 0):
        known = min(length, AHEAD * end)
        phase.go_back(bodies, sub.lasting)
        phase.step_phase(bodies, sub.lasting, end)
        end_curve(bodies, sub, end)
        if repeat == REPEATS - 1:
            break
        again = next_impact(bodies, pairs, rows, sub, options, known)
        if again >= known or abs(again - end) <= SAME_LENGTH * end or again <= 0.0:
            break
        end = again
    copy_vectors(sub.final, bodies.pose)
    copy_vectors(sub.after, bodies.twist)
    for i in range(len(bodies.kind)):
        if bodies.pose[i, 2] != sub.pose[i, 2]:
            turn_to(bodies, i)
    return end


@inner_kernel
def turn_to(bodies: Bodies, i: int) -> None:
    """Cosine and sine of body i's angle."""
    bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])


@inner_kernel
def enter_curve(bodies: Bodies, rows: Rows, sub: SubStep, tally: Array) -> None:
    """Impulses of the phase in its rows, and its work in the tally."""
    for k in range(sub.lasting.size[HELD_CONTACTS]):
        c = sub.lasting.row[k]
        nx, ny, px, py = rows.real[c, NX], rows.real[c, NY], sub.lasting.impulse[k, 0], sub.lasting.impulse[k, 1]
        rows.real[c, PN], rows.real[c, PT] = nx * px + ny * py, nx * py - ny * px
        tally[CONTACT_WORK] += sub.lasting.work[k, 0]
        tally[SURFACE_WORK] += sub.lasting.work[k, 1]
    for i in range(len(bodies.kind)):
        for d in range(3):
            inverse = bodies.real[i, INVERSE_MASS if d < 2 else INVERSE_INERTIA]
            if bodies.kind[i, MOTION] == FREE and inverse > 0.0:
                tally[LOAD_WORK] += bodies.real[i, LOAD + d] / inverse * (bodies.pose[i, d] - sub.pose[i, d])
