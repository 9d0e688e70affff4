"""Rotations: the one subject, besides shapes and the friction cone, that is told for plane and space apart.

An orientation is an angle (planar) or a unit quaternion (spatial); both are numbers of a pose. A turn is a rotation
vector in world axes with one or three entries, as a spin is.
"""

from __future__ import annotations

import numpy as np

from reference_solver.model import Array

#: Generators E of rotations, by dimension: under the spin w a point r has the velocity sum_k w_k E_k r.
GENERATORS = {
    2: np.array([[[0.0, -1.0], [1.0, 0.0]]]),
    3: np.array(
        [
            [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
            [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
            [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        ]
    ),
}


def turned(orientation: Array, turn: Array) -> Array:
    """Return orientations (..., 1 | 4) after turns (..., 1 | 3) [rad]."""
    if orientation.shape[-1] == 1:
        return orientation + turn
    half = 0.5 * np.sqrt((turn * turn).sum(-1, keepdims=True))
    real, imaginary = np.cos(half), 0.5 * np.sinc(half / np.pi) * turn
    w, rest = orientation[..., 0], orientation[..., 1:]
    u, v = ([each[..., k] for k in range(3)] for each in (imaginary, rest))
    product = np.empty((*turn.shape[:-1], 4))
    product[..., 0] = real[..., 0] * w - (imaginary * rest).sum(-1)
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., 1 + k] = real[..., 0] * v[k] + u[k] * w + (u[i] * v[j] - u[j] * v[i])
    return product / np.sqrt((product * product).sum(-1, keepdims=True))
