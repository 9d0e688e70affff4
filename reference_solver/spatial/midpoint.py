"""Force phases at impulse level: one solve for the mean velocity, with bodies and rows at mid-drift (E28).

    q_m = q0 + (h/2) v0,   v = v0 + (h/2) M^-1 f + M^-1 J(q_m)^T p,   v1 = 2 v - v0,   q1 = q0 + h v

As in the plane; a body with unequal moments turns by its angular momentum, which takes the moments of the impulses over
the whole of the sub-step, and v0 is what its momentum gives at mid-drift. For bodies that jam, and where no phase of
fifth order is found.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.spatial.certificate import certify, open_solve, point_work
from reference_solver.spatial.features import follow, name_features
from reference_solver.spatial.flight import place_at, reach_of
from reference_solver.spatial.impact import clear_point, doubt, gap_noise, set_reference_speed
from reference_solver.spatial.kinematics import apply_wrench, relative_twist, velocity_at
from reference_solver.spatial.manifolds import set_frame
from reference_solver.spatial.motion import (
    accelerate,
    collect_momentum,
    momentum_of,
    put_orientation,
    quaternion,
    set_orientation,
    spin_of,
)
from reference_solver.spatial.prepare import set_response, warm_start
from reference_solver.spatial.residual import natural_map
from reference_solver.spatial.separation import radius_of
from reference_solver.spatial.sequential_impulses import sweep_points
from reference_solver.spatial.state import FIXED, FREE, HALF_SPACE, POINTS, Bodies, Manifolds, SubStep
from reference_solver.spatial.sticking import prepare_wrenches
from reference_solver.spatial.touching import closed_gap
from reference_solver.spatial.vector import (
    add,
    add_scaled,
    cross,
    length,
    quaternion_product,
    rotation_quaternion,
    row,
    sub,
    times,
    times_transposed,
)
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.lasting import Lasting
from reference_solver.stepping.midpoint import CLOSED, CLOSING_SWEEPS, FAR_ABOVE, GAP_SHARE, LEFT_OVER, LEVERAGE
from reference_solver.stepping.noise import NOISE
from reference_solver.stepping.options import Options
from reference_solver.stepping.sweeps import CHECK_INTERVAL
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTACT_WORK, LOAD_WORK, SURFACE_WORK


@inner_kernel
def press_at_mid_drift(
    bodies: Bodies,
    manifolds: Manifolds,
    problem: Problem,
    sub_step: SubStep,
    options: Options,
    tally: Array,
    time: float,
) -> None:
    """Velocities at the end of a sub-step of ``time``: from ``first`` to ``twist``, poses being those of its start.

    Rows are those of mid-drift afterwards; `exchange_levers` brings back those of the start.
    """
    contact, surface, load = tally[CONTACT_WORK], tally[SURFACE_WORK], tally[LOAD_WORK]
    drift(bodies, manifolds, sub_step, options, 0.5 * time)
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            set_reference_speed(bodies, manifolds, m, p, velocity_at(v, w, manifolds, m, p), options.dt)
            clear_point(manifolds, m, p)
            for k in range(3):
                manifolds.impulse[m, p, k] = 0.5 * time * manifolds.force[m, p, k] if options.warm_starting else 0.0
            if manifolds.gap[m, p] > closed_gap(bodies, manifolds, m, p):
                manifolds.target[m, p] = -manifolds.gap[m, p] / time
    prepare_wrenches(bodies, manifolds, options)
    copy_vectors(bodies.twist, bodies.last)  # what the bodies would have at mid-drift without forces
    accelerate(bodies, 0.5 * time)
    open_solve(bodies, 0.5 * time, tally)
    warm_start(bodies, manifolds, options)
    solve_velocities(bodies, manifolds, problem, options, tally)
    certify(bodies, manifolds, options, tally)
    doubt(bodies, manifolds, options, tally)
    tally[CONTACT_WORK], tally[SURFACE_WORK], tally[LOAD_WORK] = contact, surface, load  # of the half: see `cut_work`
    reach_end(bodies, manifolds, sub_step)


@inner_kernel
def drift(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options, time: float) -> None:
    """Go to where the velocities ``first`` take bodies in ``time``, and give rows the levers of their features there.

    ``twist`` is ``first`` afterwards, the spin of a body with unequal moments what its momentum makes of it. Points
    without features that can be followed keep their levers, but for what keeps them in one place (`join_levers`).
    """
    lasting, m, known = sub_step.lasting, 0, 0
    copy_vectors(bodies.first, bodies.twist)
    keep_levers(manifolds, sub_step)
    for i in range(len(bodies)):
        for d in range(7):
            sub_step.start_pose[i, d] = bodies.pose[i, d]
        for d in range(6):
            bodies.rate[i, d] = 0.0
        bodies.closing[i] = bodies.curved[i] = 0
    start_momenta(bodies)
    while m < len(manifolds):
        begin, known = m, 0
        while m < len(manifolds) and known + manifolds.points[m] <= len(lasting.row):
            for p in range(manifolds.points[m]):
                if name_features(bodies, manifolds, lasting, POINTS * m + p, known):
                    lasting.row[known] = POINTS * m + p
                    known += 1
            m += 1
        for i in range(len(bodies)):
            place_at(bodies, i, time, bodies, i)
        for other in range(begin, m):
            join_levers(bodies, manifolds, other)
        for k in range(known):
            follow(bodies, lasting, k)
            take_levers(manifolds, lasting, k)
        for other in range(begin, m):
            set_frame(bodies, manifolds, other)
            turn_forces(manifolds, sub_step, other)
            for p in range(manifolds.points[other]):
                set_response(bodies, manifolds, other, p, options)
        if m < len(manifolds):
            put_back(bodies, sub_step)


@inner_kernel
def join_levers(bodies: Bodies, manifolds: Manifolds, m: int) -> None:
    """Let the levers of manifold m end in one place at mid-drift: half way between where those of its start end.

    One wrench at a manifold's centre acts on both bodies (`set_frame`). Beside followed points of the same manifold,
    levers of the start would be those of another place for one of the bodies: the direct solver, which goes by levers,
    then solved another problem than that of the sweeps and of the certificate, by 1e-4 of an impulse.
    """
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    for p in range(manifolds.points[m]):
        for d in range(3):
            apart = bodies.pose[b, d] + manifolds.arm_b[m, p, d] - bodies.pose[a, d] - manifolds.arm_a[m, p, d]
            manifolds.arm_a[m, p, d] += 0.5 * apart
            manifolds.arm_b[m, p, d] -= 0.5 * apart


@inner_kernel
def start_momenta(bodies: Bodies) -> None:
    """Angular momentum after the impacts; that before them, to which they are added when the flight begins, is kept."""
    for i in range(len(bodies)):
        if bodies.gyroscopic[i]:
            hit = momentum_of(bodies, i, sub(row(bodies.first, i, 3), row(bodies.before, i, 3)))
            for d in range(3):
                bodies.momentum_before[i, d] = bodies.angular_momentum[i, d]
                bodies.angular_momentum[i, d] += hit[d]


@inner_kernel
def put_back(bodies: Bodies, sub_step: SubStep) -> None:
    """Put bodies where the sub-step began."""
    start = sub_step.start_pose
    for i in range(len(bodies)):
        if bodies.motion[i] == FIXED:
            continue
        for d in range(3):
            bodies.pose[i, d] = start[i, d]
        if bodies.turning[i]:
            put_orientation(bodies, i, (start[i, 3], start[i, 4], start[i, 5], start[i, 6]))
        for d in range(6):
            bodies.twist[i, d] = bodies.first[i, d]


@inner_kernel
def reach_end(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep) -> None:
    """From mean velocities and half the impulses to those of the end, and to all of them; bodies to their start."""
    for i in range(len(bodies)):
        gained = sub(row(bodies.twist, i, 3), row(bodies.last, i, 3))
        if bodies.gyroscopic[i]:
            gained = momentum_of(bodies, i, gained)
        for d in range(3):
            bodies.last[i, d] = 2.0 * bodies.twist[i, d] - bodies.first[i, d]
            bodies.last[i, 3 + d] = gained[d]
    put_back(bodies, sub_step)
    for i in range(len(bodies)):
        gained = row(bodies.last, i, 3)
        if bodies.gyroscopic[i]:
            for d in range(3):
                bodies.angular_momentum[i, d] = bodies.momentum_before[i, d]
            gained = times(bodies.inverse_inertia, i, gained)
        for d in range(3):
            bodies.twist[i, d] = bodies.last[i, d]
            bodies.twist[i, 3 + d] = bodies.first[i, 3 + d] + 2.0 * gained[d]
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            for k in range(3):
                manifolds.impulse[m, p, k] *= 2.0


@inner_kernel
def keep_levers(manifolds: Manifolds, sub_step: SubStep) -> None:
    """Keep frames and levers of all points."""
    for m in range(len(manifolds)):
        copy_levers(manifolds, m, sub_step.kept, m)


@inner_kernel
def copy_levers(source: Manifolds, i: int, target: Manifolds, k: int) -> None:
    """Copy frame and levers of manifold i of the source to manifold k of the target."""
    for d in range(3):
        target.lever_a[k, d], target.lever_b[k, d] = source.lever_a[i, d], source.lever_b[i, d]
        for r in range(3):
            target.frame[k, r, d] = source.frame[i, r, d]
        for p in range(POINTS):
            target.arm_a[k, p, d], target.arm_b[k, p, d] = source.arm_a[i, p, d], source.arm_b[i, p, d]
            target.offset[k, p, d] = source.offset[i, p, d]


@inner_kernel
def exchange_levers(manifolds: Manifolds, sub_step: SubStep) -> None:
    """Exchange frames and levers of all points for those kept; ``probe`` is used up."""
    for m in range(len(manifolds)):
        copy_levers(manifolds, m, sub_step.probe, 0)
        copy_levers(sub_step.kept, m, manifolds, m)
        copy_levers(sub_step.probe, 0, sub_step.kept, m)


@inner_kernel
def levers_of_start(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options) -> None:
    """Bring back what all rows were before they went to mid-drift."""
    exchange_levers(manifolds, sub_step)
    for m in range(len(manifolds)):
        turn_forces(manifolds, sub_step, m)
        for p in range(manifolds.points[m]):
            set_response(bodies, manifolds, m, p, options)
    prepare_wrenches(bodies, manifolds, options)


@inner_kernel
def turn_forces(manifolds: Manifolds, sub_step: SubStep, m: int) -> None:
    """Turn the forces of manifold m from the frame kept into its own."""
    for p in range(manifolds.points[m]):
        world = times_transposed(sub_step.kept.frame, m, row(manifolds.force[m], p, 0))
        force = times(manifolds.frame, m, world)
        for d in range(3):
            manifolds.force[m, p, d] = force[d]


@inner_kernel
def take_levers(manifolds: Manifolds, lasting: Lasting, k: int) -> None:
    """Levers of the point of noted contact k, and its normal for the manifold, from the Jacobian.

    The rows f of a frame give a lever back: ``sum over f of f x (a x f) = 2 a``.
    """
    m, p = lasting.row[k] // POINTS, lasting.row[k] % POINTS
    arm_a, arm_b = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for r in range(3):
        f = row(lasting.frame[k], r, 0)
        arm_a = add_scaled(arm_a, -0.5, cross(f, row(lasting.jacobian[k, 0], r, 3)))
        arm_b = add_scaled(arm_b, 0.5, cross(f, row(lasting.jacobian[k, 1], r, 3)))
    for d in range(3):
        manifolds.arm_a[m, p, d], manifolds.arm_b[m, p, d] = arm_a[d], arm_b[d]
        manifolds.frame[m, 2, d] = lasting.frame[k, 0, d]


@inner_kernel
def misses_end(bodies: Bodies, manifolds: Manifolds, options: Options, time: float) -> bool:
    """Whether velocities are not those that contacts held over ``time`` allow at its end; gives rows their impulses."""
    misses = False
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            u = velocity_at(v, w, manifolds, m, p)
            set_reference_speed(bodies, manifolds, m, p, u, options.dt)
            clear_point(manifolds, m, p)
            for k in range(3):
                manifolds.impulse[m, p, k] = time * manifolds.force[m, p, k]
                manifolds.hit[m, p, k] = 0.0
            noise = NOISE * manifolds.speed[m, p]
            misses = misses or abs(u[2]) > noise
            along = math.hypot(manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1])
            if along < manifolds.friction[m] * manifolds.impulse[m, p, 2]:
                misses = misses or math.hypot(u[0], u[1]) > noise
    return misses


@inner_kernel
def closable(bodies: Bodies, manifolds: Manifolds, m: int, p: int) -> float:
    """What of the gap of a point is closed at a time [m]."""
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    most = math.inf
    for i in (a, b):
        if bodies.kind[i] != HALF_SPACE:
            most = min(most, LEFT_OVER * (reach_of(bodies, i) + radius_of(bodies, i)))
    return min(max(manifolds.gap[m, p], -most), most)


@inner_kernel
def deepest(bodies: Bodies, manifolds: Manifolds) -> float:
    """Largest overlap of all points, as a share of the smaller half width."""
    worst = 0.0
    for m in range(len(manifolds)):
        extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
        for p in range(manifolds.points[m]):
            worst = max(worst, -manifolds.gap[m, p] / extent)
    return worst


@inner_kernel
def close_gaps(bodies: Bodies, manifolds: Manifolds, options: Options) -> bool:
    """Move bodies until the gaps of all points are closed, by M^-1 J^T; whether rows are not what they were.

    Sweeps for displacements, whose impulses are counted from far above zero: contacts push and pull. Of gaps and
    overlaps that are wider than what the scheme leaves that much is closed at a time; where they contradict each other
    bodies stay.
    """
    widest = 0.0
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            if abs(manifolds.gap[m, p]) > GAP_SHARE * gap_noise(bodies, manifolds, m, p):
                widest = max(widest, abs(closable(bodies, manifolds, m, p)))
    if widest == 0.0:
        return False
    copy_vectors(bodies.twist, bodies.last)
    for i in range(len(bodies)):
        for d in range(6):
            bodies.twist[i, d] = 0.0
    for m in range(len(manifolds)):
        manifolds.friction[m] = 0.0
        for p in range(manifolds.points[m]):
            clear_point(manifolds, m, p)
            manifolds.impulse[m, p, 2] = FAR_ABOVE * widest / manifolds.matrix[m, p, 5]
            manifolds.target[m, p], manifolds.speed[m, p] = -closable(bodies, manifolds, m, p), widest
    for k in range(CLOSING_SWEEPS):
        sweep_points(bodies, manifolds, options, 1.0, 0, 0)
        if k % CHECK_INTERVAL == 0 and natural_map(bodies, manifolds, options) <= CLOSED:
            break
    farthest = 0.0
    for i in range(len(bodies)):
        if bodies.motion[i] == FREE:
            turned = (reach_of(bodies, i) + radius_of(bodies, i)) * length(row(bodies.twist, i, 3))
            farthest = max(farthest, length(row(bodies.twist, i, 0)) + turned)
    if farthest <= LEVERAGE * widest:
        displace(bodies, bodies.twist)
    copy_vectors(bodies.last, bodies.twist)
    for i in range(len(bodies)):
        if bodies.gyroscopic[i]:
            w = spin_of(bodies, i, row(bodies.angular_momentum, i, 0))
            for d in range(3):
                bodies.twist[i, 3 + d] = w[d]
    return True


@inner_kernel
def displace(bodies: Bodies, way: Array) -> None:
    """Move and turn free bodies by displacements (n, 6) [m, rad]."""
    for i in range(len(bodies)):
        if bodies.motion[i] != FREE:
            continue
        for d in range(3):
            bodies.pose[i, d] += way[i, d]
        if way[i, 3] != 0.0 or way[i, 4] != 0.0 or way[i, 5] != 0.0:
            turn = rotation_quaternion(row(way, i, 3))
            set_orientation(bodies, i, quaternion_product(turn, quaternion(bodies, i)))


@inner_kernel
def take_back(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array) -> None:
    """Velocities without the impulses of the rows, so that a solve may find other ones; their work in the tally."""
    copy_vectors(bodies.twist, bodies.start)
    copy_vectors(bodies.twist, bodies.before)
    for m in range(len(manifolds)):
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for p in range(manifolds.points[m]):
            impulse = row(manifolds.impulse[m], p, 0)
            force = add_scaled(force, -1.0, impulse)
            moment = add_scaled(moment, -1.0, cross(row(manifolds.offset[m], p, 0), impulse))
        apply_wrench(bodies, bodies.twist, manifolds, m, options.rotation, force, moment)
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        v_start, w_start = relative_twist(bodies.start, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            both = add(velocity_at(v, w, manifolds, m, p), velocity_at(v_start, w_start, manifolds, m, p))
            done, moved, _ = point_work(bodies, manifolds, m, p, both)
            tally[CONTACT_WORK], tally[SURFACE_WORK] = tally[CONTACT_WORK] - done, tally[SURFACE_WORK] - moved


@inner_kernel
def keep_change(bodies: Bodies, manifolds: Manifolds, time: float) -> None:
    """Enter impulses less those that were there before as those of an impact."""
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            for k in range(3):
                manifolds.hit[m, p, k] = manifolds.impulse[m, p, k] - time * manifolds.force[m, p, k]
                manifolds.impulse[m, p, k] = 0.0
    for i in range(len(bodies)):
        if bodies.gyroscopic[i]:
            collect_momentum(bodies, i, row(bodies.before, i, 3))
