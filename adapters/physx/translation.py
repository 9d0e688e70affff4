"""A scene for PhysX: poses of planes, and of bodies with prescribed rotation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from adapters.engine import Array

#: Rotations of the x axis, a plane's normal, to each axis of the world; halves, which are exact in single precision (w,
#: x, y, z).
_ALONG = {
    (0, 1): (1.0, 0.0, 0.0, 0.0),
    (0, -1): (0.0, 0.0, 0.0, 1.0),
    (1, 1): (0.5, 0.5, 0.5, 0.5),
    (1, -1): (0.5, 0.5, -0.5, -0.5),
    (2, 1): (0.5, -0.5, -0.5, -0.5),
    (2, -1): (0.5, 0.5, 0.5, -0.5),
}


def turn_to(normal: tuple[float, ...]) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) that takes the x axis to ``normal``; exact along the axes of the world."""
    axis = int(np.argmax(np.abs(normal)))
    sign = 1 if normal[axis] > 0.0 else -1
    first = _ALONG[axis, sign]
    near = np.zeros(3)
    near[axis] = sign
    rest = np.array([1.0 + near @ normal, *np.cross(near, normal)])
    w, x, y, z = (float(c) for c in _product(rest / np.linalg.norm(rest), np.array(first)))
    return (w, x, y, z)


def _product(p: Array, q: Array) -> Array:
    """Product of two quaternions (w, x, y, z)."""
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def turned(quaternion: Sequence[float], spin: Sequence[float], time: float) -> tuple[float, float, float, float]:
    """A quaternion after turning with ``spin`` [rad/s, world axes] for ``time`` [s]."""
    rate = math.hypot(*spin)
    if rate == 0.0:
        w, x, y, z = quaternion
        return (w, x, y, z)
    half = 0.5 * rate * time
    turn = np.array([math.cos(half), *(math.sin(half) / rate * np.asarray(spin))])
    w, x, y, z = (float(c) for c in _product(turn, np.asarray(quaternion)))
    return (w, x, y, z)
