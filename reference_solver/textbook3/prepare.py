"""From geometry to rows: collision matrices, targets, and the scale of the residual."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.coulomb import back_into_disc
from reference_solver.model import Array
from reference_solver.textbook.noise import COORDINATE_NOISE, ROUND_OFF, SPEED_SHARE, STILL
from reference_solver.textbook.options import BAUMGARTE, Options
from reference_solver.textbook3.kinematics import apply_wrench, load_speed, point_velocity, relative_twist, velocity_at
from reference_solver.textbook3.state import Bodies, Detection, Manifolds
from reference_solver.textbook3.vector import Vector, add, cross, dot, length, row, scale, times

#: Approach speeds below this fraction of what the loads of one step bring about are a resting body's noise. As
#: targets they would differ from point to point and lift a corner of a face: all its weight would change places.
RESTING_NOISE = 1e-8


@inner_kernel
def prepare(bodies: Bodies, detection: Detection, manifolds: Manifolds, options: Options) -> None:
    """Fill all manifolds from the poses and velocities at the start of the step, before forces act."""
    for m in range(len(manifolds)):
        a, b = manifolds.body_a[m], manifolds.body_b[m]
        manifolds.friction[m] = detection.friction[a, b] if options.friction else 0.0
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            set_response(bodies, manifolds, m, p, options)
            u = velocity_at(v, w, manifolds, m, p)
            set_target(bodies, manifolds, m, p, u[2], detection.restitution[a, b], options)
            set_speed(bodies, manifolds, m, p, u, options)


@inner_kernel
def set_response(bodies: Bodies, manifolds: Manifolds, m: int, p: int, options: Options) -> None:
    """Relative twist at the centre per unit impulse at point p, and the point's own collision matrix.

    K = (1/m_A + 1/m_B) 1 - [r_A] I_A^-1 [r_A] - [r_B] I_B^-1 [r_B], here as the columns of J response.
    """
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    r = manifolds.response[m, p]
    inverse_mass = bodies.inverse_mass[a] + bodies.inverse_mass[b]
    for k in range(3):
        v = scale(inverse_mass, row(manifolds.frame[m], k, 0))
        w = (0.0, 0.0, 0.0)
        if options.rotation:
            n = row(manifolds.frame[m], k, 0)
            spin_a = times(bodies.inverse_inertia, a, cross(row(manifolds.arm_a[m], p, 0), n))
            spin_b = times(bodies.inverse_inertia, b, cross(row(manifolds.arm_b[m], p, 0), n))
            v = add(v, cross(spin_a, row(manifolds.lever_a, m, 0)))
            v = add(v, cross(spin_b, row(manifolds.lever_b, m, 0)))
            w = add(spin_a, spin_b)
        for d in range(3):
            r[d, k] = dot(row(manifolds.frame[m], d, 0), v)
            r[3 + d, k] = dot(row(manifolds.frame[m], d, 0), w)
    set_matrix(manifolds.matrix[m, p], r, row(manifolds.offset[m], p, 0))


@inner_kernel
def set_matrix(matrix: Array, r: Array, offset: Vector) -> None:
    """K of one point from its response: u = V + W x d per unit impulse. Only the upper triangle is kept."""
    u1 = add((r[0, 0], r[1, 0], r[2, 0]), cross((r[3, 0], r[4, 0], r[5, 0]), offset))
    u2 = add((r[0, 1], r[1, 1], r[2, 1]), cross((r[3, 1], r[4, 1], r[5, 1]), offset))
    u3 = add((r[0, 2], r[1, 2], r[2, 2]), cross((r[3, 2], r[4, 2], r[5, 2]), offset))
    matrix[0], matrix[1], matrix[2] = u1[0], u2[0], u3[0]
    matrix[3], matrix[4], matrix[5] = u2[1], u3[1], u3[2]


@inner_kernel
def set_target(
    bodies: Bodies, manifolds: Manifolds, m: int, p: int, u: float, restitution: float, options: Options
) -> None:
    """Normal velocity b_n to reach (E7, E8, E15); u is the normal velocity before forces.

    Without restitution a gap may be closed within the step, down to the slop, not more; an overlap asks for nothing.
    A gap within round-off counts as touching: divided by dt it would be noise to answer in every step. With
    restitution a contact exists only where bodies touch.
    """
    gap = manifolds.gap[m, p]
    target = 0.0
    if restitution == 0.0:
        point = row(manifolds.point[m], p, 0)
        place = max(abs(point[0]), abs(point[1]), abs(point[2]))
        extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
        if gap > options.slop + ROUND_OFF * extent + COORDINATE_NOISE * place:
            target = -(gap - options.slop) / options.dt
    elif u < -RESTING_NOISE * load_speed(bodies, manifolds, m, p, options.dt):
        target = -restitution * u
    if options.correction == BAUMGARTE:
        target = max(target, options.beta * (-gap - options.slop) / options.dt)
    manifolds.target[m, p] = target


@inner_kernel
def set_speed(bodies: Bodies, manifolds: Manifolds, m: int, p: int, u: Vector, options: Options) -> None:
    """Speed that the residual of this point is measured against (E14), and which impulses may be warm started.

    Points that meet or part faster than the loads of one step explain are in an impact: the impulse of the step
    before does not guess this step's, nor this one the next (E9).
    """
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    by_loads = load_speed(bodies, manifolds, m, p, options.dt)
    if options.certified:
        moving = length(point_velocity(bodies, a, row(manifolds.arm_a[m], p, 0)))
        moving += length(point_velocity(bodies, b, row(manifolds.arm_b[m], p, 0)))
        # Bodies stand still to each other below this: loads elsewhere leave as much where none act.
        still = STILL * min(bodies.extent[a], bodies.extent[b]) / options.dt
        manifolds.speed[m, p] = max(max(length(u), by_loads), max(SPEED_SHARE * moving, still))
    manifolds.impact[m, p] = 1 if abs(u[2]) > by_loads else 0
    if u[2] > by_loads:
        for k in range(3):
            manifolds.impulse[m, p, k] = 0.0


@inner_kernel
def warm_start(bodies: Bodies, manifolds: Manifolds, options: Options) -> None:
    """Apply the remembered impulses, the friction part inside the disc (E9)."""
    for m in range(len(manifolds)):
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for p in range(manifolds.points[m]):
            bound = manifolds.friction[m] * manifolds.impulse[m, p, 2]
            t1, t2 = back_into_disc(manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1], bound)
            manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1] = t1, t2
            impulse = row(manifolds.impulse[m], p, 0)
            force = add(force, impulse)
            moment = add(moment, cross(row(manifolds.offset[m], p, 0), impulse))
        apply_wrench(bodies, bodies.twist, manifolds, m, options.rotation, force, moment)
