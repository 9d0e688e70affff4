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
    """Return orientations (..., 1 | 4) after turns (..., 1 | 3)."""
    if orientation.shape[-1] == 1:
        return orientation + turn
    half = 0.5 * np.linalg.norm(turn, axis=-1, keepdims=True)
    real, imaginary = np.cos(half), 0.5 * np.sinc(half / np.pi) * turn
    first, rest = orientation[..., :1], orientation[..., 1:]
    product = np.concatenate(
        [
            real * first - (imaginary * rest).sum(-1, keepdims=True),
            real * rest + imaginary * first + np.cross(imaginary, rest),
        ],
        axis=-1,
    )
    return product / np.linalg.norm(product, axis=-1, keepdims=True)
