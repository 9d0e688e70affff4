"""How good the answer of one contact solve is, measured from what it left behind (E14, E60 to E63).

The measure knows nothing of how the answer was found: it sees velocities before impulses and after, the manifolds,
and the impulses. Every contact solve opens with `open_solve` and ends with `certify`,
before any body turns.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.coulomb import cone_defect
from reference_solver.direct.problem import IMPULSE_SHARE
from reference_solver.model import Array
from reference_solver.tally import (
    CONE,
    EXCESS,
    LOAD_WORK,
    MOMENTUM,
    NATURAL,
    OPENED,
    PENETRATION,
    PULL,
    RESOLUTION,
    UNIQUE,
)
from reference_solver.textbook.accounting import (
    LAST_PLACE,
    begin_certificate,
    enter_creation,
    enter_energy,
    enter_overlap,
    enter_share,
)
from reference_solver.textbook.motion import FREE
from reference_solver.textbook.options import Options
from reference_solver.textbook3.kinematics import (
    add_pressure,
    apply_wrench,
    point_velocity,
    relative_twist,
    velocity_at,
)
from reference_solver.textbook3.residual import point_residual
from reference_solver.textbook3.state import Bodies, Manifolds
from reference_solver.textbook3.vector import (
    Vector,
    add,
    cross,
    dot,
    length,
    row,
    scale,
    sub,
    times,
    times_transposed,
)

#: Normal and tangential response of a contact are coupled above this share: below is the round-off of its levers.
COUPLED = 1e-12


@kernel
def open_solve(bodies: Bodies, dt: float, tally: Array) -> None:
    """Keep v* before impulses act, and enter the work of the loads that brought it about within ``dt``."""
    tally[OPENED] += 1.0
    for i in range(len(bodies)):
        place = max(abs(bodies.pose[i, 0]), abs(bodies.pose[i, 1]), abs(bodies.pose[i, 2]))
        tally[RESOLUTION] = max(tally[RESOLUTION], LAST_PLACE * place / bodies.extent[i])
        for k in range(6):
            bodies.start[i, k] = bodies.twist[i, k]
        if bodies.motion[i] != FREE:
            continue
        acceleration, torque = row(bodies.acceleration, i, 0), row(bodies.torque, i, 0)
        middle = sub(row(bodies.twist, i, 0), scale(0.5 * dt, acceleration))
        tally[LOAD_WORK] += dt * dot(acceleration, middle) / bodies.inverse_mass[i]
        spin = times(bodies.inverse_inertia, i, torque)
        tally[LOAD_WORK] += dt * dot(torque, sub(row(bodies.twist, i, 3), scale(0.5 * dt, spin)))


@kernel
def certify(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array) -> None:
    """Enter how well velocities and impulses solve the contact problem; velocities and impulses are not changed."""
    if not begin_certificate(bodies.twist, tally):
        return
    work, surface, effort, restored = 0.0, 0.0, 0.0, False
    before, tally[PENETRATION] = tally[PENETRATION], 0.0
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        v_start, w_start = relative_twist(bodies.start, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            u = velocity_at(v, w, manifolds, m, p)
            inspect_point(bodies, manifolds, m, p, u, tally)
            both = add(u, velocity_at(v_start, w_start, manifolds, m, p))
            done, moved, size = point_work(bodies, manifolds, m, p, both)
            work, surface, effort = work + done, surface + moved, effort + size
            restored = restored or manifolds.target[m, p] > 0.0
    enter_overlap(before, tally)
    enter_creation(work, effort, restored, tally)
    enter_energy(work, surface, effort, kinetic_change(bodies), tally)
    tally[UNIQUE] += 1.0 if is_unique(bodies, manifolds) else 0.0
    check_momentum(bodies, manifolds, options, tally)


@inner_kernel
def is_unique(bodies: Bodies, manifolds: Manifolds) -> bool:
    """Whether the velocities are proven to be the only answer (E66); uses up ``pressed``."""
    for i in range(len(bodies)):
        bodies.pressed[i, 0] = 0.0
    for m in range(len(manifolds)):
        bodies.pressed[manifolds.body_a[m], 0] += manifolds.points[m]
        bodies.pressed[manifolds.body_b[m], 0] += manifolds.points[m]
    for m in range(len(manifolds)):
        if manifolds.friction[m] == 0.0:
            continue
        a, b = manifolds.body_a[m], manifolds.body_b[m]
        if bodies.motion[a] == FREE and bodies.pressed[a, 0] > 1.0:
            return False
        if bodies.motion[b] == FREE and bodies.pressed[b, 0] > 1.0:
            return False
        k = manifolds.matrix[m, 0]
        if max(abs(k[2]), abs(k[4])) > COUPLED * k[5]:
            return False
    return True


@inner_kernel
def inspect_point(bodies: Bodies, manifolds: Manifolds, m: int, p: int, u: Vector, tally: Array) -> None:
    """Law and limits of one point; u is its velocity after the solve, frame."""
    k, impulse, mu = manifolds.matrix[m, p], row(manifolds.impulse[m], p, 0), manifolds.friction[m]
    mass = 1.0 / k[5]
    if mu > 0.0:
        mass = 1.0 / max(k[5], 0.5 * (k[0] + k[3]))
    else:
        u = (0.0, 0.0, u[2])
    size = max(mass * manifolds.speed[m, p], IMPULSE_SHARE * abs(impulse[2]))
    tally[NATURAL] = max(tally[NATURAL], point_residual(manifolds, m, p, u))
    enter_share(tally, CONE, cone_defect(impulse, u, manifolds.target[m, p], mu, mass), size)
    enter_share(tally, PULL, -impulse[2], size)
    tangent = math.sqrt(impulse[0] * impulse[0] + impulse[1] * impulse[1])
    enter_share(tally, EXCESS, tangent - mu * impulse[2], size)
    extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
    enter_share(tally, PENETRATION, -manifolds.gap[m, p], extent)


@inner_kernel
def point_work(bodies: Bodies, manifolds: Manifolds, m: int, p: int, both: Vector) -> tuple[float, float, float]:
    """Work on the relative motion, work of surfaces that move as prescribed, and the size of both (E62) [J].

    ``both`` is the point's velocity before the solve plus that after it, frame. The size is at least what a contact of
    this mass and speed usually does: where impulses came and went during the solve, all work is round-off.
    """
    usual = manifolds.speed[m, p] ** 2 / manifolds.matrix[m, p, 5]
    impulse = row(manifolds.impulse[m], p, 0)
    normal, tangent = 0.5 * impulse[2] * both[2], 0.5 * (impulse[0] * both[0] + impulse[1] * both[1])
    world = times_transposed(manifolds.frame, m, impulse)
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    by_a, by_b = 0.0, 0.0
    if bodies.motion[a] != FREE:
        by_a = dot(world, point_velocity(bodies, a, row(manifolds.arm_a[m], p, 0)))
    if bodies.motion[b] != FREE:
        by_b = -dot(world, point_velocity(bodies, b, row(manifolds.arm_b[m], p, 0)))
    return normal + tangent, by_a + by_b, usual + abs(normal) + abs(tangent) + abs(by_a) + abs(by_b)


@inner_kernel
def kinetic_change(bodies: Bodies) -> tuple[float, float]:
    """Change of kinetic energy from v* to v+, and what its round-off is a share of: that energy itself [J]."""
    gained, size = 0.0, 0.0
    for i in range(len(bodies)):
        if bodies.inverse_mass[i] == 0.0:
            continue
        after, before = row(bodies.twist, i, 0), row(bodies.start, i, 0)
        done, scaled = energy_between(before, after, (1.0, 1.0, 1.0))
        gained, size = gained + done / bodies.inverse_mass[i], size + scaled / bodies.inverse_mass[i]
        after = times_transposed(bodies.axes, i, row(bodies.twist, i, 3))
        before = times_transposed(bodies.axes, i, row(bodies.start, i, 3))
        done, scaled = energy_between(before, after, row(bodies.moments, i, 0))
        gained, size = gained + done, size + scaled
    return gained, size


@inner_kernel
def energy_between(before: Vector, after: Vector, mass: Vector) -> tuple[float, float]:
    """Half the sum of mass (after^2 - before^2), from the difference, and the size that its round-off goes with."""
    gained, size = 0.0, 0.0
    for k in range(3):
        change, both = after[k] - before[k], after[k] + before[k]
        if change != 0.0:
            gained += 0.5 * mass[k] * change * both
            size += 0.5 * mass[k] * (abs(change * both) + 0.25 * both * both)
    return gained, size


@inner_kernel
def check_momentum(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array) -> None:
    """Defect of v+ = v* + M^-1 J^T p, linear and angular part of each body by itself (E61); uses up ``start``."""
    for i in range(len(bodies)):
        bodies.pressed[i, 0] = bodies.pressed[i, 1] = 0.0
    for m in range(len(manifolds)):
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for p in range(manifolds.points[m]):
            impulse = row(manifolds.impulse[m], p, 0)
            force = add(force, impulse)
            moment = add(moment, cross(row(manifolds.offset[m], p, 0), impulse))
            add_pressure(bodies, manifolds, m, p)
        apply_wrench(bodies, bodies.start, manifolds, m, options.rotation, force, moment)
    for i in range(len(bodies)):
        for part in range(2):
            after, sought = row(bodies.twist, i, 3 * part), row(bodies.start, i, 3 * part)
            enter_share(tally, MOMENTUM, length(sub(after, sought)), length(after) + bodies.pressed[i, part])
