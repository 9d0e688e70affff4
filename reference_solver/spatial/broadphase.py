"""Which pairs of bodies may touch: bounding boxes, all pairs or sorted along x (sort and sweep)."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.compilation import kernel
from reference_solver.planar.state import Options
from reference_solver.spatial.state import BOX, CANDIDATES, FREE, HALF_SPACE, Bodies, Manifolds, Pairs


@kernel
def bound_bodies(bodies: Bodies, pairs: Pairs, options: Options) -> None:
    """Axis-aligned bounds, widened by the detection margin; a half-space is unbounded."""
    for i in range(len(bodies.shape)):
        # A pair's margin is the smaller of both extents, so that one body's own margin always covers it.
        grow = options.margin * bodies.extent[i]
        for d in range(3):
            wide = bodies.size[i, 0]
            if bodies.shape[i] == HALF_SPACE:
                wide = math.inf
            elif bodies.shape[i] == BOX:
                wide = 0.0
                for k in range(3):
                    wide += abs(bodies.axes[i, d, k]) * bodies.size[i, k]
            far = wide + (grow + 1e-15 * (wide + abs(bodies.pose[i, d])))  # 1e-15: rounding of these sums
            pairs.low[i, d] = bodies.pose[i, d] - far
            pairs.high[i, d] = bodies.pose[i, d] + far


@kernel
def may_touch(bodies: Bodies, pairs: Pairs, i: int, j: int) -> bool:
    """Bounds overlap and at least one body can respond."""
    if bodies.motion[i] != FREE and bodies.motion[j] != FREE:
        return False
    if bodies.shape[i] == HALF_SPACE or bodies.shape[j] == HALF_SPACE:
        return True
    for d in range(3):
        if pairs.low[i, d] > pairs.high[j, d] or pairs.low[j, d] > pairs.high[i, d]:
            return False
    return True


@kernel
def add_candidate(bodies: Bodies, pairs: Pairs, manifolds: Manifolds, i: int, j: int) -> bool:
    """Store the pair if it may touch; False if there is no room."""
    if not may_touch(bodies, pairs, i, j):
        return True
    count = manifolds.count[CANDIDATES]
    if count == len(pairs.candidate):
        return False
    pairs.candidate[count] = min(i, j) * len(bodies.shape) + max(i, j)
    manifolds.count[CANDIDATES] = count + 1
    return True


@kernel
def find_candidates(bodies: Bodies, pairs: Pairs, manifolds: Manifolds, options: Options) -> bool:
    """Fill `Pairs.candidate` in ascending order; False if there is no room."""
    bound_bodies(bodies, pairs, options)
    manifolds.count[CANDIDATES] = 0
    if options.broadphase:
        return sweep_candidates(bodies, pairs, manifolds)
    n = len(bodies.shape)
    for i in range(n):
        for j in range(i + 1, n):
            if not add_candidate(bodies, pairs, manifolds, i, j):
                return False
    return True


@kernel
def sweep_candidates(bodies: Bodies, pairs: Pairs, manifolds: Manifolds) -> bool:
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
            if not add_candidate(bodies, pairs, manifolds, i, j):
                return False
    count = manifolds.count[CANDIDATES]
    pairs.candidate[:count] = np.sort(pairs.candidate[:count])
    return True
