"""Orientations as rotation vectors about where a path began: R(t) = exp(psi(t)) R(0), psi in world axes [rad].

psi' = w - psi x w / 2 + c psi x (psi x w),   c = (1 - (a/2) cot(a/2)) / a^2,   a = |psi|

(inverse of the left Jacobian of the exponential map; A. Iserles and others, *Acta Numerica* 9, 2000, B.10). Regular for
|psi| < 2 pi; paths are kept far below that.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.spatial.vector import Vector, add, add_scaled, cross, dot, length, scale

#: Below this angle [rad] the series of c is exact to 1e-17; above it the closed form loses no more than two digits.
SERIES = 0.3


@inner_kernel
def quotient(angle: float) -> tuple[float, float]:
    """C of the angle, and c'/a."""
    s = angle * angle
    if angle < SERIES:
        c = 1 / 12 + s * (1 / 720 + s * (1 / 30240 + s * (1 / 1209600 + s * (1 / 47900160 + s * 691 / 1307674368000))))
        rate = 1 / 360 + s * (1 / 7560 + s * (1 / 201600 + s * (1 / 5987520 + s * 691 / 130767436800)))
        return c, rate
    cotangent = 1.0 / math.tan(0.5 * angle)
    c = (1.0 - 0.5 * angle * cotangent) / s
    sine = math.sin(0.5 * angle)
    return c, (0.25 * angle / (sine * sine) - 0.5 * cotangent) / (s * angle) - 2.0 * c / s


@kernel
def vector_rate(psi: Vector, w: Vector) -> Vector:
    """Rate of psi at the angular velocity w (world axes) [rad/s]."""
    c, _ = quotient(length(psi))
    across = cross(psi, w)
    return add_scaled(add_scaled(w, -0.5, across), c, cross(psi, across))


@kernel
def vector_curvature(psi: Vector, w: Vector, w_rate: Vector) -> Vector:
    """Second derivative of psi at the angular velocity w and acceleration w_rate [rad/s^2]."""
    c, c_rate = quotient(length(psi))
    rate = vector_rate(psi, w)
    across, turned = cross(psi, w), cross(rate, w)
    change = add_scaled(scale(-0.5, turned), c_rate * dot(psi, rate), cross(psi, across))
    change = add_scaled(change, c, add(cross(rate, across), cross(psi, turned)))
    return add(vector_rate(psi, w_rate), change)


@kernel
def spin_from_rate(psi: Vector, rate: Vector) -> Vector:
    """Angular velocity at which psi changes at ``rate``: the left Jacobian of psi times it [rad/s]."""
    angle = length(psi)
    s = angle * angle
    if angle < SERIES:
        first = 0.5 + s * (-1 / 24 + s * (1 / 720 + s * (-1 / 40320 + s / 3628800)))
        second = 1 / 6 + s * (-1 / 120 + s * (1 / 5040 + s * (-1 / 362880 + s / 39916800)))
    else:
        half = math.sin(0.5 * angle)
        first = 2.0 * half * half / s
        second = (angle - math.sin(angle)) / (s * angle)
    across = cross(psi, rate)
    return add_scaled(add_scaled(rate, first, across), second, cross(psi, across))
