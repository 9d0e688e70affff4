"""Paths of all bodies: polynomials of degree five at most, each valid from a time of its own; values and bounds."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.structures import structure

#: Coefficients of a polynomial of degree five.
COEFFICIENTS = 6
#: Factors of derivatives by order and power: j (j - 1) .. of as many terms as the order has.
FALLING = np.array(
    [[math.prod(range(j - m + 1, j + 1)) for j in range(COEFFICIENTS)] for m in range(COEFFICIENTS)], float
)
#: By how much bounds are widened: they are sums of at most a dozen rounded terms.
ROUNDED_UP = 1.0 + 1e-14


@structure
class Paths(NamedTuple):
    """Where bodies are between their events; V = 3 | 6 velocities, P = 3 | 7 numbers of a pose.

    At time t of the step, ``s = t - begin[i]``, body i stands at ``pose[i]`` displaced by
    ``sum over k of coefficient[i, :, k] s**k``. A displacement is (dx, dy, dtheta), or (dx, dy, dz, psi) with the
    rotation vector psi in world axes: R = exp(psi) R(pose).
    """

    begin: Array  # (n,): time in the step from which the path is valid [s]
    end: Array  # (n,): and until when
    pose: Array  # (n, P): at its begin
    coefficient: Array  # (n, V, 6): entry 0 is zero; [m/s^k], [rad/s^k]


def allocate_paths(dimension: int, bodies: int) -> Paths:
    """Return room for the paths of ``bodies`` bodies."""
    numbers, velocities = (3, 3) if dimension == 2 else (7, 6)
    coefficient = np.zeros((bodies, velocities, COEFFICIENTS))
    return Paths(np.zeros(bodies), np.zeros(bodies), np.zeros((bodies, numbers)), coefficient)


@inner_kernel
def derivative(paths: Paths, i: int, k: int, order: int, t: float) -> float:
    """Derivative of displacement k of body i with respect to time, at time t; order 0 is the displacement (Horner)."""
    s = t - paths.begin[i]
    value = 0.0
    for j in range(COEFFICIENTS - 1, order - 1, -1):
        value = value * s + FALLING[order, j] * paths.coefficient[i, k, j]
    return value


@inner_kernel
def degree(paths: Paths, i: int, first: int, last: int) -> int:
    """Highest power of the time in displacements ``first`` to before ``last`` of body i."""
    for j in range(COEFFICIENTS - 1, 0, -1):
        for k in range(first, last):
            if paths.coefficient[i, k, j] != 0.0:
                return j
    return 0


@inner_kernel
def derivative_bound(paths: Paths, i: int, turning: bool, order: int, t: float, later: float) -> float:
    """Bound of the length of a derivative of the displacement, or of the turn, of body i over [t, later].

    Taylor's series about t ends with the fifth derivative: ``|p^(m)(t + s)| <= sum_j |p^(m+j)(t)| s^j / j!``, or
    with the highest power that the displacement has.
    """
    axes = paths.coefficient.shape[1] // 2 + (0 if turning else paths.coefficient.shape[1] % 2)
    first = paths.coefficient.shape[1] - axes if turning else 0
    bound, factor = 0.0, 1.0
    for j in range(degree(paths, i, first, first + axes) + 1 - order):
        square = 0.0
        for k in range(first, first + axes):
            square += derivative(paths, i, k, order + j, t) ** 2
        bound += factor * math.sqrt(square)
        factor *= (later - t) / (j + 1)
    return bound * ROUNDED_UP
