"""Where a body is at time t of a sub-step whose loads are constant, and bounds of its turning (E30).

x(t) = x + v t + a t^2 / 2 is exact. A body whose spin keeps its axis turns by w t + b t^2 / 2. One with unequal moments
turns by the splitting E18, composed to order 8 in pieces short enough that its error is round-off.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.spatial.motion import composed_turn, quaternion, set_orientation, spin_of
from reference_solver.spatial.state import BOX, CAPSULE, FIXED, Bodies
from reference_solver.spatial.turning import spin_from_rate
from reference_solver.spatial.vector import (
    Vector,
    add_scaled,
    length,
    quaternion_product,
    rotation_quaternion,
    row,
    scale,
)


@inner_kernel
def curvature(bodies: Bodies, i: int, start: int) -> Vector:
    """Second derivative of body i's path at its start, moving (0) or turning (3): rate, twice that if closing."""
    if bodies.curved[i]:
        return path_derivative(bodies, i, start, 2, 0.0)
    return scale(2.0 if bodies.closing[i] else 1.0, row(bodies.rate, i, start))


@kernel
def place_at(bodies: Bodies, i: int, t: float, trial: Bodies, k: int) -> None:
    """Write pose, axes and twist of body i at time t into record k of ``trial``, which has body i's shape.

    ``bodies.rate`` holds acceleration and, for a body with unequal moments, torque; for others angular acceleration.
    """
    if bodies.motion[i] == FIXED:
        return
    if bodies.curved[i]:
        place_on_path(bodies, i, t, trial, k)
        return
    v, a = row(bodies.twist, i, 0), curvature(bodies, i, 0)
    for d in range(3):
        trial.pose[k, d] = bodies.pose[i, d] + t * (v[d] + 0.5 * t * a[d])
        trial.twist[k, d] = v[d] + t * a[d]
    if not bodies.turning[i]:
        return
    b = curvature(bodies, i, 3)
    if bodies.gyroscopic[i]:
        start = row(bodies.angular_momentum, i, 0)
        set_orientation(trial, k, composed_turn(bodies, i, start, b, t))
        w = spin_of(trial, k, add_scaled(start, t, b))
    else:
        w = row(bodies.twist, i, 3)
        turn = rotation_quaternion(scale(t, add_scaled(w, 0.5 * t, b)))
        set_orientation(trial, k, quaternion_product(turn, quaternion(bodies, i)))
        w = add_scaled(w, t, b)
    for d in range(3):
        trial.twist[k, 3 + d] = w[d]


@inner_kernel
def path_derivative(bodies: Bodies, i: int, start: int, order: int, t: float) -> Vector:
    """Derivative of the displacement (start 0) or the rotation vector (3) of a curved path at time t (Horner)."""
    x, y, z = 0.0, 0.0, 0.0
    for j in range(5, order - 1, -1):
        factor = 1.0
        for m in range(order):
            factor *= j - m
        x = x * t + factor * bodies.path[i, start, j]
        y = y * t + factor * bodies.path[i, start + 1, j]
        z = z * t + factor * bodies.path[i, start + 2, j]
    return x, y, z


@inner_kernel
def path_bound(bodies: Bodies, i: int, start: int, order: int, duration: float) -> float:
    """Bound of the length of that derivative over the time: the sum of those of its terms."""
    bound, power = 0.0, 1.0
    for j in range(order, 6):
        factor = 1.0
        for m in range(order):
            factor *= j - m
        term = (bodies.path[i, start, j], bodies.path[i, start + 1, j], bodies.path[i, start + 2, j])
        bound += factor * power * length(term)
        power *= duration
    return bound


@inner_kernel
def place_on_path(bodies: Bodies, i: int, t: float, trial: Bodies, k: int) -> None:
    """`place_at` on a curved path."""
    way, v = path_derivative(bodies, i, 0, 0, t), path_derivative(bodies, i, 0, 1, t)
    psi = path_derivative(bodies, i, 3, 0, t)
    w = spin_from_rate(psi, path_derivative(bodies, i, 3, 1, t))
    for d in range(3):
        trial.pose[k, d] = bodies.pose[i, d] + way[d]
        trial.twist[k, d], trial.twist[k, 3 + d] = v[d], w[d]
    if bodies.turning[i]:
        set_orientation(trial, k, quaternion_product(rotation_quaternion(psi), quaternion(bodies, i)))


@inner_kernel
def copy_body(bodies: Bodies, i: int, trial: Bodies, k: int) -> None:
    """Give record k of ``trial`` the shape, inertia and present state of body i."""
    trial.kind[k] = bodies.kind[i]
    trial.motion[k] = bodies.motion[i]
    trial.extent[k] = bodies.extent[i]
    for d in range(4):
        trial.geometry[k, d] = bodies.geometry[i, d]
    for d in range(3):
        trial.moments[k, d] = bodies.moments[i, d]
        trial.inverse_moments[k, d] = bodies.inverse_moments[i, d]
        for c in range(3):
            trial.axes[k, d, c] = bodies.axes[i, d, c]
    for d in range(7):
        trial.pose[k, d] = bodies.pose[i, d]
    for d in range(6):
        trial.twist[k, d] = bodies.twist[i, d]


@inner_kernel
def reach_of(bodies: Bodies, i: int) -> float:
    """Distance of the farthest corner of the core from its centre; 0 of a sphere, which may turn as it likes [m]."""
    if bodies.kind[i] == BOX:
        return length(row(bodies.geometry, i, 0))
    return bodies.geometry[i, 0] if bodies.kind[i] == CAPSULE else 0.0


@kernel
def turning_bounds(bodies: Bodies, i: int, duration: float) -> tuple[float, float]:
    """Bounds of |w| [rad/s] and of |dw/dt| [rad/s^2] over the time.

    With angular momentum L a body turns at |L| / I_min at most, and w changes by I^-1 (torque - w x L).
    """
    if not bodies.turning[i]:
        return 0.0, 0.0
    if bodies.curved[i]:  # w is the integral of exp(u psi) psi' over u from 0 to 1
        fastest = path_bound(bodies, i, 3, 1, duration)
        return fastest, path_bound(bodies, i, 3, 2, duration) + 0.5 * fastest * fastest
    w, b = row(bodies.twist, i, 3), curvature(bodies, i, 3)
    if not bodies.gyroscopic[i]:
        return length(w) + duration * length(b), length(b)
    least = min(bodies.moments[i, 0], bodies.moments[i, 1], bodies.moments[i, 2])
    fastest = (length(row(bodies.angular_momentum, i, 0)) + duration * length(b)) / least
    return fastest, fastest * fastest + length(b) / least


@inner_kernel
def bend_of_path(bodies: Bodies, i: int, duration: float) -> float:
    """Largest change of the acceleration of the centre over the time; none but on a curved path [m/s^2]."""
    return duration * path_bound(bodies, i, 0, 3, duration) if bodies.curved[i] else 0.0


@inner_kernel
def first_fall(c: float, b: float, a: float) -> float:
    """First t >= 0 at which c + b t + a t^2 / 2, c >= 0, falls through zero; infinite if it never does (O3)."""
    if b < 0.0:
        discriminant = b * b - 2.0 * a * c
        return 2.0 * c / (math.sqrt(discriminant) - b) if discriminant >= 0.0 else math.inf
    if a >= 0.0:
        return math.inf
    return (b + math.sqrt(b * b - 2.0 * a * c)) / -a
