"""Which pairs of bodies may touch: bounding boxes, all pairs or sorted along x (sort and sweep)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.planar.columns import COS, EXTENT, MOTION, REACH, SHAPE, SIN, SIZE
from reference_solver.planar.state import BOX, CANDIDATES, CAPSULE, FREE, HALF_SPACE, Bodies, Pairs, Rows
from reference_solver.stepping.options import Options
from reference_solver.stepping.sorting import sift_down


@inner_kernel
def bound_bodies(bodies: Bodies, pairs: Pairs, options: Options) -> None:
    """Axis-aligned bounds, widened by the detection margin; a half-space is unbounded."""
    for i in range(len(bodies.kind)):
        wide = bodies.real[i, SIZE]
        high = wide
        if bodies.kind[i, SHAPE] == HALF_SPACE:
            wide = high = math.inf
        elif bodies.kind[i, SHAPE] == BOX:
            c, s = abs(bodies.real[i, COS]), abs(bodies.real[i, SIN])
            wide = c * bodies.real[i, SIZE] + s * bodies.real[i, SIZE + 1]
            high = s * bodies.real[i, SIZE] + c * bodies.real[i, SIZE + 1]
        elif bodies.kind[i, SHAPE] >= CAPSULE:
            wide = high = bodies.real[i, REACH]
        # A pair's margin is the smaller of both extents, so that one body's own margin always covers it.
        grow = options.margin * bodies.real[i, EXTENT] + 1e-15 * (abs(bodies.pose[i, 0]) + abs(bodies.pose[i, 1]))
        pairs.bounds[i, 0] = bodies.pose[i, 0] - wide - grow
        pairs.bounds[i, 1] = bodies.pose[i, 1] - high - grow
        pairs.bounds[i, 2] = bodies.pose[i, 0] + wide + grow
        pairs.bounds[i, 3] = bodies.pose[i, 1] + high + grow


@inner_kernel
def may_touch(bodies: Bodies, pairs: Pairs, i: int, j: int) -> bool:
    """Bounds overlap and at least one body can respond."""
    if bodies.kind[i, MOTION] != FREE and bodies.kind[j, MOTION] != FREE:
        return False
    if bodies.kind[i, SHAPE] == HALF_SPACE or bodies.kind[j, SHAPE] == HALF_SPACE:
        return True
    for axis in range(2):
        if pairs.bounds[i, axis] > pairs.bounds[j, axis + 2] or pairs.bounds[j, axis] > pairs.bounds[i, axis + 2]:
            return False
    return True


@inner_kernel
def add_candidate(bodies: Bodies, pairs: Pairs, rows: Rows, i: int, j: int) -> bool:
    """Store the pair if it may touch; False if there is no room."""
    if not may_touch(bodies, pairs, i, j):
        return True
    count = rows.counts[CANDIDATES]
    if count == len(pairs.candidate):
        return False
    pairs.candidate[count] = min(i, j) * len(bodies.kind) + max(i, j)
    rows.counts[CANDIDATES] = count + 1
    return True


@inner_kernel
def find_candidates(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> bool:
    """Fill `Pairs.candidate` in ascending order; False if there is no room."""
    bound_bodies(bodies, pairs, options)
    return pair_bodies(bodies, pairs, rows, options)


@inner_kernel
def pair_bodies(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> bool:
    """Candidates from `Pairs.bounds`; False if there is no room."""
    rows.counts[CANDIDATES] = 0
    n = len(bodies.kind)
    if options.broadphase:
        return sweep_candidates(bodies, pairs, rows)
    for i in range(n):
        for j in range(i + 1, n):
            if not add_candidate(bodies, pairs, rows, i, j):
                return False
    return True


@inner_kernel
def sweep_candidates(bodies: Bodies, pairs: Pairs, rows: Rows) -> bool:
    """Sort and sweep along x: only bodies whose x-intervals overlap are paired; then sort the pairs.

    An unbounded body has its lower end at -inf, stays open to the end, and so meets every other one.
    """
    sort_by_lower_x(pairs)
    n = len(pairs.order)
    for s in range(n):
        i = pairs.order[s]
        for r in range(s + 1, n):
            j = pairs.order[r]
            if pairs.bounds[j, 0] > pairs.bounds[i, 2]:
                break
            if not add_candidate(bodies, pairs, rows, i, j):
                return False
    sort_candidates(pairs, rows.counts[CANDIDATES])
    return True


@inner_kernel
def sort_by_lower_x(pairs: Pairs) -> None:
    """Insertion sort from the order of the step before, which is nearly right: bodies move little per step."""
    for s in range(1, len(pairs.order)):
        body = pairs.order[s]
        r = s
        while r > 0 and pairs.bounds[pairs.order[r - 1], 0] > pairs.bounds[body, 0]:
            pairs.order[r] = pairs.order[r - 1]
            r -= 1
        pairs.order[r] = body


@inner_kernel
def sort_candidates(pairs: Pairs, count: int) -> None:
    """Heap sort of the candidate keys, in place: no memory is allocated inside kernels."""
    key = pairs.candidate
    for root in range(count // 2 - 1, -1, -1):
        sift_down(key, root, count)
    for end in range(count - 1, 0, -1):
        key[0], key[end] = key[end], key[0]
        sift_down(key, 0, end)
