"""Force phases in which rows change with the bodies: one Dormand-Prince step instead of the frozen solve (E35 to E39).

The contacts of the sub-step are noted with their features; where none of their rows would change along the path of the
frozen solve, that solve is exact and used. Else `stepping.phase` goes to the end of the phase. Bodies that no noted
contact holds fly on as in any other sub-step.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.model import Array
from reference_solver.spatial.features import follow, name_features
from reference_solver.spatial.impact import carries, gap_noise
from reference_solver.spatial.kinematics import relative_twist, velocity_at
from reference_solver.spatial.motion import accelerate, momentum_of, put_orientation
from reference_solver.spatial.operations import Spatial, displace
from reference_solver.spatial.state import FIXED, FREE, POINTS, Bodies, Manifolds, SubStep
from reference_solver.spatial.vector import dot, length, row, sub, times_transposed
from reference_solver.stepping import accounting
from reference_solver.stepping.clock import BRIEF, HELD, JAMMED, OUTCOME
from reference_solver.stepping.equalities import row_value
from reference_solver.stepping.lasting import BODIES, CONTACTS, STAGES, Lasting
from reference_solver.stepping.noise import FROZEN, NOISE
from reference_solver.stepping.options import Options
from reference_solver.stepping.phase import (
    FAILED,
    NO_PHASE,
    begin_phase,
    find_phase,
    go_back,
    keep_limits,
    passes_limit,
    step_phase,
    write_path,
)
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTACT_WORK, LOAD_WORK, SURFACE_WORK

#: Gap of a contact that is held, as a share of the smaller half width: more is for the frozen solve to close (E20).
CLOSED = 1e-9

#: What becomes of contacts: all are noted; there are none; gaps are left to close; one cannot be followed.
NOTED, NO_CONTACTS, GAPS_OPEN, NOT_FOLLOWED = 0, 1, 2, 3


@inner_kernel
def note_contacts(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep) -> int:
    """Note all points that are pressed together, and which bodies they hold; what became of it."""
    lasting = sub_step.lasting
    k, outcome = 0, NOTED
    for i in range(len(bodies)):
        sub_step.held[i] = 0
    for m in range(len(manifolds)):
        a, b = manifolds.body_a[m], manifolds.body_b[m]
        extent = min(bodies.extent[a], bodies.extent[b])
        for p in range(manifolds.points[m]):
            if manifolds.open[m, p]:
                continue
            if k == len(lasting.gap) or not name_features(bodies, manifolds, lasting, POINTS * m + p, k):
                return NOT_FOLLOWED
            lasting.row[k] = POINTS * m + p
            lasting.speeds[k], lasting.extent[k] = manifolds.speed[m, p], extent
            follow(bodies, lasting, k)
            if not abs(lasting.gap[k]) <= CLOSED * extent + gap_noise(bodies, manifolds, m, p):
                outcome = GAPS_OPEN
            sub_step.held[a] = sub_step.held[b] = 1
            k += 1
    lasting.size[CONTACTS] = k
    lasting.size[BODIES] = len(bodies)
    return outcome if k > 0 else NO_CONTACTS


@inner_kernel
def rows_stay(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, time: float) -> bool:
    """Whether no row of a noted contact, and no slip's direction, changes along the way that bodies go, and none ends.

    They go at the mean of ``first`` and ``last``.
    """
    lasting = sub_step.lasting
    for k in range(lasting.size[CONTACTS]):
        if slip_turns(bodies, manifolds, lasting, k):
            return False
        for side in range(2):
            i = lasting.body[k, side]
            if bodies.gyroscopic[i] and not (keeps_turn(bodies.first, i, time) and keeps_turn(bodies.last, i, time)):
                return False
            for r in range(3):
                for d in range(6):
                    sub_step.rows[k, side, r, d] = lasting.jacobian[k, side, r, d]
    for i in range(len(bodies)):
        for d in range(6):
            lasting.displacement[i, d] = 0.5 * time * (bodies.first[i, d] + bodies.last[i, d])
    space = Spatial(bodies, bodies.pose, bodies.twist)
    keep_limits(space, lasting)
    for i in range(len(bodies)):
        if sub_step.held[i]:
            displace(space, lasting, i)
    stay = True
    for k in range(lasting.size[CONTACTS]):
        follow(bodies, lasting, k)
        for side in range(2):
            i = lasting.body[k, side]
            if bodies.motion[i] == FREE or (bodies.motion[i] != FIXED and bodies.turning[i]):
                stay = stay and same_rows(sub_step.rows[k, side], lasting.jacobian[k, side], lasting.extent[k])
    stay = stay and not passes_limit(space, lasting)
    for i in range(len(bodies)):
        for d in range(6):
            lasting.displacement[i, d] = 0.0
        if sub_step.held[i]:
            for d in range(3):
                bodies.pose[i, d] = lasting.base[i, d]
            displace(space, lasting, i)
    return stay


@inner_kernel
def slip_turns(bodies: Bodies, manifolds: Manifolds, lasting: Lasting, k: int) -> bool:
    """Whether noted contact k slips first in one direction and last in another, which friction follows.

    Of a slip that ends on the way its friction tells: where it does not turn, that is along it.
    """
    if lasting.friction[k] == 0.0:
        return False
    x, y = row_value(lasting, k, 1, bodies.first), row_value(lasting, k, 2, bodies.first)
    noise = NOISE * lasting.speeds[k]
    if math.hypot(x, y) <= noise:
        return False
    x_last, y_last = row_value(lasting, k, 1, bodies.last), row_value(lasting, k, 2, bodies.last)
    if math.hypot(x_last, y_last) <= noise:
        m, p = lasting.row[k] // POINTS, lasting.row[k] % POINTS
        force = times_transposed(manifolds.frame, m, row(manifolds.impulse[m], p, 0))
        x_last, y_last = dot(force, row(lasting.frame[k], 1, 0)), dot(force, row(lasting.frame[k], 2, 0))
    return bool(abs(x * y_last - y * x_last) > FROZEN * math.hypot(x, y) * math.hypot(x_last, y_last))


@inner_kernel
def keeps_turn(twist: Array, i: int, time: float) -> bool:
    """Whether body i turns by no more than round-off in that time: then its gyroscopic term is the square of that."""
    return bool(time * length(row(twist, i, 3)) <= FROZEN)


@inner_kernel
def any_turns(bodies: Bodies, manifolds: Manifolds, time: float) -> bool:
    """Whether a body with contacts turns in that time, at its velocities first or last."""
    for m in range(len(manifolds)):
        for i in (manifolds.body_a[m], manifolds.body_b[m]):
            if not (keeps_turn(bodies.first, i, time) and keeps_turn(bodies.last, i, time)):
                return True
    return False


@inner_kernel
def same_rows(before: Array, after: Array, extent: float) -> bool:
    """Whether the rows of one side of a contact are the same but for round-off."""
    for r in range(3):
        reach = extent + length(row(before, r, 3))
        change = length(sub(row(after, r, 0), row(before, r, 0)))
        turned = length(sub(row(after, r, 3), row(before, r, 3)))
        if change > FROZEN or turned > FROZEN * reach:
            return False
    return True


@inner_kernel
def is_exact(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, time: float) -> bool:
    """Whether the frozen solve from ``first`` to ``last`` is: no row changes on its way. Notes the contacts."""
    noted = sub_step.noted[0] = note_contacts(bodies, manifolds, sub_step)
    if noted == NO_CONTACTS:
        return True
    if noted == NOT_FOLLOWED:
        return not any_turns(bodies, manifolds, time)
    begin_phase(Spatial(bodies, bodies.pose, bodies.twist), sub_step.lasting)
    return rows_stay(bodies, manifolds, sub_step, time)


@spliced_kernel
def enter_phase(
    bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options, tally: Array, left: float, frozen: float
) -> float:
    """Go through a phase whose rows change, at most ``left`` long; its length, 0 where the frozen solve is exact.

    `NO_PHASE` where it is not, and no phase is found; where the island jams none is looked for.
    ``frozen``: length of the frozen solve, from ``first`` to ``last``. Afterwards ``twist`` are the velocities at the
    end of the phase, its poses and velocities stand in the sub-step, the paths in the bodies; poses are those of its
    start.
    """
    for i in range(len(bodies)):
        bodies.curved[i] = 0
    if sub_step.clock[HELD] > 0.0 or sub_step.clock[BRIEF] > 0.0 or is_exact(bodies, manifolds, sub_step, frozen):
        return 0.0
    lasting, space = sub_step.lasting, Spatial(bodies, bodies.pose, bodies.twist)
    if sub_step.noted[0] != NOTED or sub_step.clock[JAMMED] > 0.0:
        return NO_PHASE
    copy_vectors(bodies.first, bodies.twist)
    time, outcome = find_phase(space, lasting, left)
    sub_step.clock[OUTCOME] = outcome
    if outcome == FAILED:
        copy_vectors(bodies.last, bodies.twist)
        return NO_PHASE
    accounting.go_back(tally, sub_step.struck)
    keep_end(bodies, sub_step)
    for i in range(len(bodies)):
        if sub_step.held[i] and bodies.motion[i] != FIXED:
            bodies.curved[i] = 1
            write_path(lasting, i, time, bodies.path[i])
    go_back(space, lasting)
    copy_vectors(bodies.first, bodies.twist)
    accelerate(bodies, time)
    for i in range(len(bodies)):
        for d in range(6):
            if bodies.curved[i]:
                bodies.twist[i, d] = sub_step.end_twist[i, d]
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            for d in range(3):
                manifolds.impulse[m, p, d] = 0.0
    enter_impulses(manifolds, lasting)
    return time


@inner_kernel
def keep_end(bodies: Bodies, sub_step: SubStep) -> None:
    """Keep poses and velocities of the end of a phase."""
    for i in range(len(bodies)):
        for d in range(7):
            sub_step.end_pose[i, d] = bodies.pose[i, d]
        for d in range(6):
            sub_step.end_twist[i, d] = bodies.twist[i, d]


@inner_kernel
def enter_impulses(manifolds: Manifolds, lasting: Lasting) -> None:
    """Impulses of the phase, in the frames of the manifolds at its start; and which of the noted points parted."""
    for k in range(lasting.size[CONTACTS]):
        m, p = lasting.row[k] // POINTS, lasting.row[k] % POINTS
        world = row(lasting.impulse, k, 0)
        for d in range(3):
            manifolds.impulse[m, p, d] = dot(row(manifolds.frame[m], d, 0), world)


@inner_kernel
def cut_phase(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, time: float) -> None:
    """Make the phase again, up to ``time``."""
    space = Spatial(bodies, bodies.pose, bodies.twist)
    step_phase(space, sub_step.lasting, time)
    keep_end(bodies, sub_step)
    go_back(space, sub_step.lasting)
    enter_impulses(manifolds, sub_step.lasting)


@inner_kernel
def end_phase(bodies: Bodies, sub_step: SubStep, tally: Array, time: float) -> None:
    """Put the bodies held in the phase where it ends, all others being there, and enter its work."""
    lasting = sub_step.lasting
    for k in range(lasting.size[CONTACTS]):
        tally[CONTACT_WORK] += lasting.work[k, 0]
        tally[SURFACE_WORK] += lasting.work[k, 1]
    for i in range(len(bodies)):
        if bodies.curved[i]:
            for d in range(3):
                bodies.pose[i, d] = sub_step.end_pose[i, d]
            if bodies.turning[i]:
                q = sub_step.end_pose[i]
                put_orientation(bodies, i, (q[3], q[4], q[5], q[6]))
            for d in range(6):
                bodies.twist[i, d] = sub_step.end_twist[i, d]
            if bodies.gyroscopic[i]:
                momentum = momentum_of(bodies, i, row(bodies.twist, i, 3))
                for d in range(3):
                    bodies.angular_momentum[i, d] = momentum[d]
        if bodies.motion[i] == FREE:
            way = sub(row(bodies.pose, i, 0), row(lasting.base, i, 0))
            tally[LOAD_WORK] += dot(row(bodies.acceleration, i, 0), way) / bodies.inverse_mass[i]
            for d in range(3):  # the turn about an axis of the torque, by Hermite's formula of fourth order
                spins = row(bodies.first, i, 3)[d] + bodies.twist[i, 3 + d]
                bend = lasting.slope[0, i, 3 + d] - lasting.slope[STAGES - 1, i, 3 + d]
                tally[LOAD_WORK] += bodies.torque[i, d] * time * (0.5 * spins + time * bend / 12.0)


@inner_kernel
def part_points(bodies: Bodies, manifolds: Manifolds, options: Options, time: float) -> None:
    """Mark the points that carry nothing in a phase and leave in it: they are looked for at their return."""
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            parts = velocity_at(v, w, manifolds, m, p)[2] > NOISE * manifolds.speed[m, p]
            if parts and not carries(manifolds, m, p, time / options.dt):
                manifolds.open[m, p] = 1
