"""Paths of all bodies: polynomials of degree five at most, each valid from a time of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reference_solver.model import Array

#: Coefficients of a polynomial of degree five.
COEFFICIENTS = 6


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
