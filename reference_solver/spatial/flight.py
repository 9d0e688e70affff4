"""Where a body is at time t of a sub-step whose loads are constant, and bounds of its turning (E30).

x(t) = x + v t + a t^2 / 2 is exact. A body whose spin keeps its axis turns by w t + b t^2 / 2. One with unequal moments
turns by the splitting E18 over t, with the angular momentum it has at half the time: second order in t.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.spatial.motion import quaternion, set_orientation, spin_of, split_turn
from reference_solver.spatial.state import BOX, CAPSULE, FIXED, Bodies
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
    """Second derivative of body i's path, moving (start 0) or turning (3): rate, twice that if closing."""
    return scale(2.0 if bodies.closing[i] else 1.0, row(bodies.rate, i, start))


@kernel
def place_at(bodies: Bodies, i: int, t: float, trial: Bodies, k: int) -> None:
    """Write pose, axes and twist of body i at time t into record k of ``trial``, which has body i's shape.

    ``bodies.rate`` holds acceleration and, for a body with unequal moments, torque; for others angular acceleration.
    """
    if bodies.motion[i] == FIXED:
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
        set_orientation(trial, k, split_turn(bodies, i, add_scaled(start, 0.5 * t, b), t))
        w = spin_of(trial, k, add_scaled(start, t, b))
    else:
        w = row(bodies.twist, i, 3)
        turn = rotation_quaternion(scale(t, add_scaled(w, 0.5 * t, b)))
        set_orientation(trial, k, quaternion_product(turn, quaternion(bodies, i)))
        w = add_scaled(w, t, b)
    for d in range(3):
        trial.twist[k, 3 + d] = w[d]


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
    w, b = row(bodies.twist, i, 3), curvature(bodies, i, 3)
    if not bodies.gyroscopic[i]:
        return length(w) + duration * length(b), length(b)
    least = min(bodies.moments[i, 0], bodies.moments[i, 1], bodies.moments[i, 2])
    fastest = (length(row(bodies.angular_momentum, i, 0)) + duration * length(b)) / least
    return fastest, fastest * fastest + length(b) / least


@inner_kernel
def first_fall(c: float, b: float, a: float) -> float:
    """First t >= 0 at which c + b t + a t^2 / 2, c >= 0, falls through zero; infinite if it never does (O3)."""
    if b < 0.0:
        discriminant = b * b - 2.0 * a * c
        return 2.0 * c / (math.sqrt(discriminant) - b) if discriminant >= 0.0 else math.inf
    if a >= 0.0:
        return math.inf
    return (b + math.sqrt(b * b - 2.0 * a * c)) / -a
