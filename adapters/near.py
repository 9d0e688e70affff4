"""Pairs of bodies that can touch at all, found without a look at every pair.

Each body is held by a box along the axes, over a block of samples. Boxes of about one size (within a factor of two) are
sorted into cells of a grid that none of them exceeds, so that each lies in two cells an axis at most; what shares a
cell is compared. Larger boxes meet smaller ones on the grid of the larger. For bodies that do not crowd one place the
work grows as their number.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array
from adapters.scene import HalfSpace, Scene
from adapters.shapes import reach

#: Samples that a box holds a body for: what moves little in them keeps its box small, and a short run is one block.
BLOCK = 32
#: Cells are counted to this far from the origin; beyond it they are one, which costs time and no pair.
FARTHEST_CELL = 1e15
#: What makes one number of a cell's place on each axis; cells that share it are compared, and no harm is done.
MIXERS = np.array([73856093, 19349663, 83492791], np.int64)

Pairs = NDArray[np.int64]


def near_pairs(scene: Scene, pose: Array) -> Iterator[tuple[int, int]]:
    """Yield ``i < j`` of every pair, one of them free, that may touch in a sample of ``pose`` (s, n, 3 | 7).

    A half-space, and a body whose place is no number, may touch whatever is free.
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
    """Pairs of boxes no larger than a cell that lie in one cell, (m, 2); a pair that shares several may come again."""
    d = low.shape[1]
    ends = [np.clip(np.floor(end / cell), -FARTHEST_CELL, FARTHEST_CELL).astype(np.int64) for end in (low, high)]
    keys, owners = [], []
    for corner in product((0, 1), repeat=d):
        place = np.stack([ends[side][:, axis] for axis, side in enumerate(corner)], 1)
        # A box that lies in one cell along an axis is entered there once.
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
