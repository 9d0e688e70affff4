"""From geometry to rows: levers, effective masses, targets, and the scale of the residual."""

from __future__ import annotations

import math

from reference_solver.compilation import kernel
from reference_solver.planar.kinematics import apply_normal, apply_tangent, normal_velocity, tangent_velocity
from reference_solver.planar.state import BAUMGARTE, CONTACTS, Bodies, Options, Pairs, Rows

#: Round-off floor of a contact's reference speed, as a share of the speeds of its two points: with a residual of
#: 1e-13 it allows 5e-15 of them, about 20 units in the last place.
SPEED_SHARE = 0.05


@kernel
def prepare(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> None:
    """Fill all rows from the poses and velocities at the start of the step, before forces act."""
    for c in range(rows.count[CONTACTS]):
        prepare_masses(bodies, rows, c)
        a, b = rows.body_a[c], rows.body_b[c]
        for k in range(2):
            rows.point[c, k] = bodies.pose[a, k] + rows.arm_a[c, k]
        rows.friction[c] = pairs.friction[a, b]
        rows.approach[c] = normal_velocity(bodies.twist, rows, c)
        set_target(pairs, rows, c, options)
        set_speed(bodies, rows, c, options)


@kernel
def prepare_masses(bodies: Bodies, rows: Rows, c: int) -> None:
    """Levers (E2) and effective masses (E3)."""
    a, b = rows.body_a[c], rows.body_b[c]
    nx, ny = rows.normal[c, 0], rows.normal[c, 1]
    an = rows.arm_a[c, 0] * ny - rows.arm_a[c, 1] * nx
    bn = rows.arm_b[c, 0] * ny - rows.arm_b[c, 1] * nx
    at = rows.arm_a[c, 0] * nx + rows.arm_a[c, 1] * ny
    bt = rows.arm_b[c, 0] * nx + rows.arm_b[c, 1] * ny
    rows.lever[c, 0], rows.lever[c, 1], rows.lever[c, 2], rows.lever[c, 3] = an, bn, at, bt
    mass = bodies.inverse_mass[a] + bodies.inverse_mass[b]
    ia, ib = bodies.inverse_inertia[a], bodies.inverse_inertia[b]
    rows.normal_mass[c] = 1.0 / (mass + ia * (an * an) + ib * (bn * bn))
    rows.tangent_mass[c] = 1.0 / (mass + ia * (at * at) + ib * (bt * bt))
    rows.coupling[c] = ia * (an * at) + ib * (bn * bt)


@kernel
def set_target(pairs: Pairs, rows: Rows, c: int, options: Options) -> None:
    """Normal velocity b_n to reach (E7, E8, E15)."""
    u, gap = rows.approach[c], rows.gap[c]
    # A gap may be closed within the step, not more; an overlap asks for nothing.
    target = -max(gap, 0.0) / options.dt
    if options.correction == BAUMGARTE:
        target = max(target, options.beta * (-gap - options.slop) / options.dt)
    if options.restitution and u < 0.0:
        rebound = -pairs.restitution[rows.body_a[c], rows.body_b[c]] * u
        if rebound > 0.0:
            target = max(rebound, target)
    rows.target[c] = target


@kernel
def set_speed(bodies: Bodies, rows: Rows, c: int, options: Options) -> None:
    """Speed that the residual of this contact is measured against (E14); which impulses may be warm started.

    A contact whose bodies part or meet faster than the loads of one step explain is an impact: the impulse of the
    step before does not guess this step's, nor this one the next (E9).
    """
    a, b = rows.body_a[c], rows.body_b[c]
    push = options.dt * (acceleration_at(bodies, a, rows.arm_a[c, 0], rows.arm_a[c, 1]))
    push += options.dt * (acceleration_at(bodies, b, rows.arm_b[c, 0], rows.arm_b[c, 1]))
    slip = tangent_velocity(bodies.twist, rows, c)
    meeting = math.sqrt(rows.approach[c] * rows.approach[c] + slip * slip)
    moving = speed_at(bodies, a, rows.arm_a[c, 0], rows.arm_a[c, 1])
    moving += speed_at(bodies, b, rows.arm_b[c, 0], rows.arm_b[c, 1])
    rows.speed[c] = max(meeting, push, SPEED_SHARE * moving)
    rows.bounce[c] = 1 if abs(rows.approach[c]) > push else 0
    if rows.approach[c] > push:
        rows.impulse[c, 0] = rows.impulse[c, 1] = 0.0


@kernel
def acceleration_at(bodies: Bodies, i: int, x: float, y: float) -> float:
    """Magnitude of what loads alone do to a point of body i at arm (x, y) [m/s^2]."""
    ax = bodies.acceleration[i, 0] - bodies.acceleration[i, 2] * y
    ay = bodies.acceleration[i, 1] + bodies.acceleration[i, 2] * x
    return math.sqrt(ax * ax + ay * ay)


@kernel
def speed_at(bodies: Bodies, i: int, x: float, y: float) -> float:
    """Speed of a point of body i at arm (x, y) [m/s]."""
    vx = bodies.twist[i, 0] - bodies.twist[i, 2] * y
    vy = bodies.twist[i, 1] + bodies.twist[i, 2] * x
    return math.sqrt(vx * vx + vy * vy)


@kernel
def warm_start(bodies: Bodies, rows: Rows, options: Options) -> None:
    """Apply the remembered impulses, the tangential ones inside the cone of the row's friction (E9)."""
    for c in range(rows.count[CONTACTS]):
        apply_normal(bodies, bodies.twist, rows, c, rows.impulse[c, 0])
        if options.friction:
            bound = rows.friction[c] * rows.impulse[c, 0]
            rows.impulse[c, 1] = min(max(rows.impulse[c, 1], -bound), bound)
            apply_tangent(bodies, bodies.twist, rows, c, rows.impulse[c, 1])
