"""One geometry routine for all engines: the separation of two bodies from their poses.

Engines report depths by their own rules (margins, speculative gaps, one point or four). Penetration is therefore
measured here, from poses, by the separating-axis test on face normals [Gottschalk, Lin, Manocha 1996].
"""

from __future__ import annotations

import numpy as np

from adapters.engine import Array
from adapters.scene import Box, Disc, HalfSpace, Shape, Sphere


def rotation(pose: Array) -> Array:
    """Rotation matrices (s, d, d) of poses (s, 3) or (s, 7)."""
    if pose.shape[1] == 3:
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    w, x, y, z = (pose[:, 3:] / np.linalg.norm(pose[:, 3:], axis=1, keepdims=True)).T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def _extent(shape: Shape, turn: Array, axis: Array) -> Array:
    """Half width (s,) of ``shape`` along ``axis`` (s, d), seen from its centre."""
    if isinstance(shape, Disc | Sphere):
        return np.full(len(axis), shape.radius)
    assert isinstance(shape, Box)
    along = np.einsum("sij,si->sj", turn, axis)
    return np.abs(along) @ np.array(shape.half_extents)


def separation(a: Shape, pose_a: Array, b: Shape, pose_b: Array) -> Array:
    """Largest gap over the face normals (and centre line of round shapes), (s,) [m]; < 0 is overlap depth.

    Exact for round shapes and half-spaces, and for boxes that face each other; for boxes edge to edge in three
    dimensions it may report a deeper overlap than the true one, never a shallower one.
    """
    if isinstance(a, HalfSpace) or isinstance(b, HalfSpace):
        face, shape, pose = (a, b, pose_b) if isinstance(a, HalfSpace) else (b, a, pose_a)
        assert isinstance(face, HalfSpace)
        d = len(face.normal)
        axis = np.broadcast_to(np.array(face.normal), (len(pose), d))
        return pose[:, :d] @ np.array(face.normal) - face.offset - _extent(shape, rotation(pose), axis)
    d = 2 if pose_a.shape[1] == 3 else 3
    turn_a, turn_b = rotation(pose_a), rotation(pose_b)
    centres = pose_b[:, :d] - pose_a[:, :d]
    axes = [turn[:, :, k] for turn, s in ((turn_a, a), (turn_b, b)) if isinstance(s, Box) for k in range(d)]
    if not (isinstance(a, Box) and isinstance(b, Box)):
        length = np.linalg.norm(centres, axis=1, keepdims=True)
        axes.append(np.where(length > 0.0, centres / np.where(length > 0.0, length, 1.0), np.eye(d)[d - 1]))
    gaps = [
        np.abs(np.einsum("si,si->s", centres, axis)) - _extent(a, turn_a, axis) - _extent(b, turn_b, axis)
        for axis in axes
    ]
    return np.max(gaps, axis=0)
