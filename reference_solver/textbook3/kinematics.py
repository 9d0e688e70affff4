"""Relative twist of two bodies at the centre of their manifold, what loads and wrenches do to it.

A manifold of any number of points sees its bodies through six numbers in its frame: relative velocity V and
relative angular velocity W at the centre. A point at offset d has u = V + W x d. An impulse p at the point is the
wrench (p, d x p) at the centre.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.textbook3.state import Bodies, Manifolds
from reference_solver.textbook3.vector import (
    ZERO,
    Vector,
    add,
    add_scaled,
    cross,
    length,
    row,
    sub,
    times,
    times_transposed,
)


@inner_kernel
def relative_twist(twist: Array, manifolds: Manifolds, m: int, rotation: int) -> tuple[Vector, Vector]:
    """(V, W) of manifold m, B relative to A, frame; ``twist`` may hold velocities or pseudo-velocities."""
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    v = sub(row(twist, b, 0), row(twist, a, 0))
    if not rotation:  # frictionless spheres: a spin moves the contact point along the tangents only
        return times(manifolds.frame, m, v), (0.0, 0.0, 0.0)
    wa, wb = row(twist, a, 3), row(twist, b, 3)
    v = sub(add(v, cross(wb, row(manifolds.lever_b, m, 0))), cross(wa, row(manifolds.lever_a, m, 0)))
    return times(manifolds.frame, m, v), times(manifolds.frame, m, sub(wb, wa))


@inner_kernel
def velocity_at(v: Vector, w: Vector, manifolds: Manifolds, m: int, p: int) -> Vector:
    """U = V + W x d at point p, frame [m/s]."""
    return add(v, cross(w, row(manifolds.offset[m], p, 0)))


@inner_kernel
def apply_wrench(
    bodies: Bodies, twist: Array, manifolds: Manifolds, m: int, rotation: int, force: Vector, moment: Vector
) -> None:
    """Add the impulse and moment (frame, about the manifold's centre) to B, and their opposites to A."""
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    impulse = times_transposed(manifolds.frame, m, force)
    for d in range(3):
        twist[a, d] -= bodies.inverse_mass[a] * impulse[d]
        twist[b, d] += bodies.inverse_mass[b] * impulse[d]
    if not rotation:
        return
    turning = times_transposed(manifolds.frame, m, moment)
    spin_a = times(bodies.inverse_inertia, a, add(cross(row(manifolds.lever_a, m, 0), impulse), turning))
    spin_b = times(bodies.inverse_inertia, b, add(cross(row(manifolds.lever_b, m, 0), impulse), turning))
    for d in range(3):
        twist[a, 3 + d] -= spin_a[d]
        twist[b, 3 + d] += spin_b[d]


@inner_kernel
def respond(v: Vector, w: Vector, manifolds: Manifolds, m: int, p: int, change: Vector) -> tuple[Vector, Vector]:
    """(V, W) after an impulse `change` (frame) at point p: a product with `Manifolds.response`."""
    r = manifolds.response[m, p]
    for k in range(3):
        v = add_scaled(v, change[k], (r[0, k], r[1, k], r[2, k]))
        w = add_scaled(w, change[k], (r[3, k], r[4, k], r[5, k]))
    return v, w


@inner_kernel
def point_velocity(bodies: Bodies, i: int, arm: Vector) -> Vector:
    """Velocity of a point of body i [m/s]."""
    return add(row(bodies.twist, i, 0), cross(row(bodies.twist, i, 3), arm))


@inner_kernel
def acceleration_at(bodies: Bodies, i: int, arm: Vector) -> float:
    """Magnitude of what loads alone do to a point of body i [m/s^2]."""
    torque = row(bodies.torque, i, 0)
    if torque == ZERO:
        return length(row(bodies.acceleration, i, 0))
    spin = times(bodies.inverse_inertia, i, torque)
    return length(add(row(bodies.acceleration, i, 0), cross(spin, arm)))


@inner_kernel
def load_speed(bodies: Bodies, manifolds: Manifolds, m: int, p: int, dt: float) -> float:
    """Largest relative speed that the loads can give the two bodies at point p within dt [m/s]."""
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    at_a = acceleration_at(bodies, a, row(manifolds.arm_a[m], p, 0))
    at_b = acceleration_at(bodies, b, row(manifolds.arm_b[m], p, 0))
    return dt * (at_a + at_b)


@inner_kernel
def add_pressure(bodies: Bodies, manifolds: Manifolds, m: int, p: int) -> None:
    """Add what the impulse of a point, or its usual one, can at most do to the velocities of its bodies.

    Its usual ones: of impulses that came and went during a solve the round-off stays.
    """
    size = length(row(manifolds.impulse[m], p, 0)) + manifolds.speed[m, p] / manifolds.matrix[m, p, 5]
    for side in range(2):
        i = manifolds.body_b[m] if side else manifolds.body_a[m]
        arm = length(row(manifolds.arm_b[m] if side else manifolds.arm_a[m], p, 0))
        moments = row(bodies.inverse_moments, i, 0)
        bodies.pressed[i, 0] += bodies.inverse_mass[i] * size
        bodies.pressed[i, 1] += max(moments[0], moments[1], moments[2]) * size * arm
