"""Pairs of bodies that can touch, found without a loop over all pairs, and their overlap at the start.

Each body has a bounding box along the axes, over a block of samples. Boxes of similar size (within a factor of two) are
sorted into cells of a grid at least as large, so each lies in at most two cells an axis; boxes that share a cell are
compared. Larger boxes are compared with smaller ones on the grid of the larger. The work grows with the number of
bodies, unless they crowd one place.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array
from adapters.scene import Box, Capsule, Cylinder, Disc, HalfSpace, Scene, Sphere
from adapters.scene.shapes import Shape, reach

#: Samples of a block: slow bodies keep small boxes, and a short run is one block.
BLOCK = 32
#: Cells end at this distance from the origin; beyond it there is one, which costs time but loses no pair.
FARTHEST_CELL = 1e15
#: Multipliers that hash a cell's indices to one number; a collision only adds comparisons.
MIXERS = np.array([73856093, 19349663, 83492791], np.int64)

Pairs = NDArray[np.int64]


def near_pairs(scene: Scene, pose: Array) -> Iterator[tuple[int, int]]:
    """Yield ``i < j`` of every pair with a free body that may touch in a sample of ``pose`` (s, n, 3 | 7).

    A half-space, and a body with a NaN position, may touch every free body.
    """
    d, count = scene.dimension, len(scene.bodies)
    free = np.array([body.motion == "free" for body in scene.bodies])
    size = np.array([reach(body.shape) for body in scene.bodies])[:, None]
    endless = np.array([isinstance(body.shape, HalfSpace) for body in scene.bodies])
    endless |= ~np.isfinite(pose[:, :, :d]).all(axis=(0, 2))
    bounded = np.flatnonzero(~endless)
    found = [np.stack([np.full(count, i), np.arange(count)], 1) for i in np.flatnonzero(endless)]
    for start in range(0, len(pose), BLOCK):
        places = pose[start : start + BLOCK, bounded, :d]
        met = _meeting(places.min(axis=0) - size[bounded], places.max(axis=0) + size[bounded])
        found.append(bounded[met])
    pairs = np.sort(np.concatenate(found or [np.empty((0, 2), np.int64)]), axis=1)
    pairs = pairs[(free[pairs].any(axis=1)) & (pairs[:, 0] < pairs[:, 1])]
    for i, j in np.unique(pairs, axis=0):
        yield int(i), int(j)


def _meeting(low: Array, high: Array) -> Pairs:
    """Pairs of boxes (n, d) that share a point, (m, 2)."""
    if not len(low):
        return np.empty((0, 2), np.int64)
    sizes = (high - low).max(axis=1)
    octave = np.frexp(sizes)[1]  # size < 2^octave
    found = []
    for k in np.unique(octave):
        members = np.flatnonzero(octave <= k)
        pairs = members[_sharing(low[members], high[members], 2.0 ** float(k))]
        pairs = pairs[(octave[pairs] == k).any(axis=1)]
        a, b = pairs[:, 0], pairs[:, 1]
        found.append(pairs[((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1)])
    return np.concatenate(found)


def _sharing(low: Array, high: Array, cell: float) -> Pairs:
    """Pairs of boxes in a common cell, none larger than a cell, (m, 2); a pair with several common cells may repeat."""
    d = low.shape[1]
    ends = [np.clip(np.floor(end / cell), -FARTHEST_CELL, FARTHEST_CELL).astype(np.int64) for end in (low, high)]
    keys, owners = [], []
    for corner in product((0, 1), repeat=d):
        place = np.stack([ends[side][:, axis] for axis, side in enumerate(corner)], 1)
        # A box in one cell along an axis is entered once.
        new = np.array([side == 0 for side in corner]) | (ends[0] != ends[1])
        chosen = np.flatnonzero(new.all(axis=1))
        keys.append((place[chosen] * MIXERS[:d]).sum(axis=1))
        owners.append(chosen)
    key, owner = np.concatenate(keys), np.concatenate(owners)
    order = np.argsort(key, kind="stable")
    key, owner = key[order], owner[order]
    found, ahead = [], 1
    begin = np.arange(len(key))
    while len(begin):
        begin = begin[begin + ahead < len(key)]
        begin = begin[key[begin] == key[begin + ahead]]
        found.append(np.stack([owner[begin], owner[begin + ahead]], 1))
        ahead += 1
    return np.concatenate(found) if found else np.empty((0, 2), np.int64)


def start_overlap(scene: Scene) -> dict[tuple[int, int], float]:
    """Upper bound of the overlap of pairs at the start, by body indices [m]; separated pairs are left out.

    Moving two bodies apart by their overlap along any direction separates them, so the least of several directions is
    an upper bound: the face of a half-space; otherwise the line of centres and the axes of both. It is exact for balls,
    and for boxes with a face in contact.
    """
    poses = np.array([body.pose for body in scene.bodies])
    found = {}
    for i, j in near_pairs(scene, poses[None]):
        depth = min(_depths(scene.bodies[i].shape, poses[i], scene.bodies[j].shape, poses[j]), default=0.0)
        if depth > 0.0:
            found[i, j] = depth
    return found


def _depths(a: Shape, pose_a: Array, b: Shape, pose_b: Array) -> Iterator[float]:
    """Yield the overlap of A and B along some directions [m]; below 0 they are apart."""
    if isinstance(b, HalfSpace):
        a, pose_a, b, pose_b = b, pose_b, a, pose_a
    d = 2 if len(pose_b) == 3 else 3
    if isinstance(a, HalfSpace):
        normal = np.array(a.normal)
        yield a.offset - float(normal @ pose_b[:d]) + _reach_along(b, pose_b, -normal)
        return
    between = pose_b[:d] - pose_a[:d]
    far = float(np.linalg.norm(between))
    for line in (*([between / far] if far else []), *rotation(pose_a[d:]).T, *rotation(pose_b[d:]).T):
        to = line if line @ between >= 0.0 else -line
        yield _reach_along(a, pose_a, to) + _reach_along(b, pose_b, -to) - float(to @ between)


def _reach_along(shape: Shape, pose: Array, direction: Array) -> float:
    """Extent of a shape from its centre along a unit vector [m]."""
    if isinstance(shape, Disc | Sphere):
        return shape.radius
    along = rotation(pose[len(direction) :]).T @ direction
    if isinstance(shape, Box):
        return float(np.abs(along) @ np.array(shape.half_extents))
    if isinstance(shape, Capsule | Cylinder):
        rim = 1.0 if isinstance(shape, Capsule) else float(np.linalg.norm(along[1:]))
        return abs(float(along[0])) * shape.half_length + rim * shape.radius
    return reach(shape) if isinstance(shape, HalfSpace) else float((np.array(shape.vertices) @ along).max())


def rotation(turn: Array) -> Array:
    """Rotation matrix, columns are the body axes: of an angle (1,) [rad] or of a unit quaternion (w, x, y, z)."""
    if len(turn) == 1:
        return np.array([[np.cos(turn[0]), -np.sin(turn[0])], [np.sin(turn[0]), np.cos(turn[0])]])
    w, u = turn[0], turn[1:]
    cross = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
    return np.asarray((w * w - u @ u) * np.eye(3) + 2.0 * np.outer(u, u) + 2.0 * w * cross)
