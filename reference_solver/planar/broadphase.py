"""Which pairs of bodies may touch: bounding boxes, all pairs or sorted along x (sort and sweep)."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.compilation import kernel
from reference_solver.planar.state import BOX, CANDIDATES, FREE, HALF_SPACE, Bodies, Options, Pairs, Rows


@kernel
def bound_bodies(bodies: Bodies, pairs: Pairs, options: Options) -> None:
    """Axis-aligned bounds, widened by the detection margin; a half-space is unbounded."""
    for i in range(len(bodies.shape)):
        wide = bodies.size[i, 0]
        high = wide
        if bodies.shape[i] == HALF_SPACE:
            wide = high = math.inf
        elif bodies.shape[i] == BOX:
            c, s = abs(bodies.turn[i, 0]), abs(bodies.turn[i, 1])
            wide = c * bodies.size[i, 0] + s * bodies.size[i, 1]
            high = s * bodies.size[i, 0] + c * bodies.size[i, 1]
        # A pair's margin is the smaller of both extents, so that one body's own margin always covers it.
        grow = options.margin * bodies.extent[i] + 1e-15 * (abs(bodies.pose[i, 0]) + abs(bodies.pose[i, 1]))
        pairs.low[i, 0] = bodies.pose[i, 0] - wide - grow
        pairs.high[i, 0] = bodies.pose[i, 0] + wide + grow
        pairs.low[i, 1] = bodies.pose[i, 1] - high - grow
        pairs.high[i, 1] = bodies.pose[i, 1] + high + grow


@kernel
def may_touch(bodies: Bodies, pairs: Pairs, i: int, j: int) -> bool:
    """Bounds overlap and at least one body can respond."""
    if bodies.motion[i] != FREE and bodies.motion[j] != FREE:
        return False
    if bodies.shape[i] == HALF_SPACE or bodies.shape[j] == HALF_SPACE:
        return True
    for axis in range(2):
        if pairs.low[i, axis] > pairs.high[j, axis] or pairs.low[j, axis] > pairs.high[i, axis]:
            return False
    return True


@kernel
def add_candidate(bodies: Bodies, pairs: Pairs, rows: Rows, i: int, j: int) -> bool:
    """Store the pair if it may touch; False if there is no room."""
    if not may_touch(bodies, pairs, i, j):
        return True
    count = rows.count[CANDIDATES]
    if count == len(pairs.candidate):
        return False
    pairs.candidate[count] = min(i, j) * len(bodies.shape) + max(i, j)
    rows.count[CANDIDATES] = count + 1
    return True


@kernel
def find_candidates(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> bool:
    """Fill `Pairs.candidate` in ascending order; False if there is no room."""
    bound_bodies(bodies, pairs, options)
    rows.count[CANDIDATES] = 0
    n = len(bodies.shape)
    if options.broadphase:
        return sweep_candidates(bodies, pairs, rows)
    for i in range(n):
        for j in range(i + 1, n):
            if not add_candidate(bodies, pairs, rows, i, j):
                return False
    return True


@kernel
def sweep_candidates(bodies: Bodies, pairs: Pairs, rows: Rows) -> bool:
    """Sort and sweep along x: only bodies whose x-intervals overlap are paired; then sort the keys.

    An unbounded body has its lower end at -inf, stays open to the end, and so meets every other one.
    """
    order = np.argsort(pairs.low[:, 0])
    n = len(order)
    for s in range(n):
        i = order[s]
        for r in range(s + 1, n):
            j = order[r]
            if pairs.low[j, 0] > pairs.high[i, 0]:
                break
            if not add_candidate(bodies, pairs, rows, i, j):
                return False
    count = rows.count[CANDIDATES]
    pairs.candidate[:count] = np.sort(pairs.candidate[:count])
    return True
