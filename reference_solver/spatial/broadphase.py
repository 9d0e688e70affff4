"""Which pairs of bodies may touch: bounding boxes, all pairs or sorted along x (sort and sweep)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.spatial.state import BOX, CANDIDATES, CAPSULE, FREE, HALF_SPACE, Bodies, Detection, Indices
from reference_solver.stepping.options import Options
from reference_solver.stepping.sorting import sift_down


@inner_kernel
def bound_bodies(bodies: Bodies, options: Options) -> None:
    """Axis-aligned bounds, widened by the detection margin; a half-space is unbounded."""
    for i in range(len(bodies)):
        # A pair's margin is the smaller of both extents, so that one body's own margin always covers it.
        grow = options.margin * bodies.extent[i]
        for d in range(3):
            wide = bodies.geometry[i, 0]
            if bodies.kind[i] == HALF_SPACE:
                wide = math.inf
            elif bodies.kind[i] == BOX:
                wide = 0.0
                for k in range(3):
                    wide += abs(bodies.axes[i, d, k]) * bodies.geometry[i, k]
            elif bodies.kind[i] == CAPSULE:
                wide = abs(bodies.axes[i, d, 0]) * bodies.geometry[i, 0] + bodies.geometry[i, 1]
            far = wide + (grow + 1e-15 * (wide + abs(bodies.pose[i, d])))  # 1e-15: rounding of these sums
            bodies.low[i, d] = bodies.pose[i, d] - far
            bodies.high[i, d] = bodies.pose[i, d] + far


@inner_kernel
def may_touch(bodies: Bodies, i: int, j: int) -> bool:
    """Bounds overlap and at least one body can respond."""
    if bodies.motion[i] != FREE and bodies.motion[j] != FREE:
        return False
    if bodies.kind[i] == HALF_SPACE or bodies.kind[j] == HALF_SPACE:
        return True
    for d in range(3):
        if bodies.low[i, d] > bodies.high[j, d] or bodies.low[j, d] > bodies.high[i, d]:
            return False
    return True


@inner_kernel
def add_candidate(bodies: Bodies, detection: Detection, i: int, j: int) -> bool:
    """Store the pair if it may touch; False if there is no room."""
    if not may_touch(bodies, i, j):
        return True
    count = detection.found[CANDIDATES]
    if count == len(detection.candidate):
        return False
    detection.candidate[count] = min(i, j) * len(bodies) + max(i, j)
    detection.found[CANDIDATES] = count + 1
    return True


@inner_kernel
def find_candidates(bodies: Bodies, detection: Detection, options: Options) -> bool:
    """Fill `Detection.candidate` in ascending order; False if there is no room."""
    bound_bodies(bodies, options)
    return pair_bodies(bodies, detection, options)


@inner_kernel
def pair_bodies(bodies: Bodies, detection: Detection, options: Options) -> bool:
    """Candidates from the bodies' bounds; False if there is no room."""
    detection.found[CANDIDATES] = 0
    if options.broadphase:
        return sweep_candidates(bodies, detection)
    n = len(bodies)
    for i in range(n):
        for j in range(i + 1, n):
            if not add_candidate(bodies, detection, i, j):
                return False
    return True


@inner_kernel
def sweep_candidates(bodies: Bodies, detection: Detection) -> bool:
    """Sort and sweep along x: only bodies whose x-intervals overlap are paired; then sort the pairs.

    An unbounded body has its lower end at -inf, stays open to the end, and so meets every other one.
    """
    order = detection.order
    sort_by_lower_x(bodies, order)
    n = len(order)
    for s in range(n):
        i = order[s]
        for r in range(s + 1, n):
            j = order[r]
            if bodies.low[j, 0] > bodies.high[i, 0]:
                break
            if not add_candidate(bodies, detection, i, j):
                return False
    sort_keys(detection.candidate, detection.found[CANDIDATES])
    return True


@inner_kernel
def sort_by_lower_x(bodies: Bodies, order: Indices) -> None:
    """Insertion sort from the order of the step before, which is nearly right: bodies move little per step."""
    for s in range(1, len(order)):
        body = order[s]
        r = s
        while r > 0 and bodies.low[order[r - 1], 0] > bodies.low[body, 0]:
            order[r] = order[r - 1]
            r -= 1
        order[r] = body


@inner_kernel
def sort_keys(key: Indices, count: int) -> None:
    """Heap sort in place: no memory is allocated inside kernels."""
    for root in range(count // 2 - 1, -1, -1):
        sift_down(key, root, count)
    for end in range(count - 1, 0, -1):
        key[0], key[end] = key[end], key[0]
        sift_down(key, 0, end)
