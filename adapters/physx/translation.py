"""A scene in PhysX's terms: materials of pairs as one number per body, planes with their poses.

PhysX takes the mean of two bodies' restitutions and of their frictions, as SAPIEN leaves it (PxCombineMode::eAVERAGE).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from adapters.engine import Array
from adapters.meeting import Meeting, representable
from adapters.scene import Scene

#: What a solution of linear equations in doubles may miss of a number of order 1.
ROUNDING = 1e-12
#: Turns that take the x axis, which a plane looks along, to each axis of the world; halves, so that singles hold them
#: exactly (w, x, y, z).
_ALONG = {
    (0, 1): (1.0, 0.0, 0.0, 0.0),
    (0, -1): (0.0, 0.0, 0.0, 1.0),
    (1, 1): (0.5, 0.5, 0.5, 0.5),
    (1, -1): (0.5, 0.5, -0.5, -0.5),
    (2, 1): (0.5, -0.5, -0.5, -0.5),
    (2, -1): (0.5, 0.5, 0.5, -0.5),
}


def means(scene: Scene, coefficient: str) -> list[float] | None:
    """Numbers of bodies of which each pair's ``coefficient`` is the mean; None if there are none that are allowed.

    A restitution lies in [0, 1], a friction is not negative: a number outside would be another material to the engine.
    """
    return representable(scene, lambda pairs: _means(scene, pairs, coefficient))


def _means(scene: Scene, meetings: Sequence[Meeting], coefficient: str) -> list[float] | None:
    pairs = [(i, j, float(getattr(material, coefficient))) for i, j, material in meetings]
    values = {value for _, _, value in pairs}
    if len(values) == 1:
        return [values.pop()] * len(scene.bodies)
    rows = np.zeros((len(pairs), len(scene.bodies)))
    for row, (i, j, _) in enumerate(pairs):
        rows[row, [i, j]] = 0.5
    from scipy.optimize import lsq_linear

    wanted = np.array([value for _, _, value in pairs])
    most = 1.0 if coefficient == "restitution" else np.inf
    found = lsq_linear(rows, wanted, (0.0, most), method="bvls", tol=1e-15).x
    return None if np.abs(rows @ found - wanted).max(initial=0.0) > ROUNDING else [float(x) for x in found]


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
