"""Which pairs of bodies may touch, by their bounding boxes: all pairs, or sorted along x (sort and sweep)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array, Model
from reference_solver.pieces import Indices
from reference_solver.stepping.operations import Bodies, is_free
from reference_solver.stepping.sorting import sort_keys
from reference_solver.structures import structure


@structure
class Boxes(NamedTuple):
    """Bounding boxes of bodies, and room for the pairs that may touch; d axes."""

    low: Array  # (n, d): lower corners [m], -inf of a half-space
    high: Array  # (n, d): upper corners
    order: Indices  # (n,): bodies by ascending lower x, as of the last sort
    candidate: Indices  # (capacity,): a * n + b, ascending


def allocate_boxes(model: Model, capacity: int) -> Boxes:
    """Return the boxes of a model, and room for ``capacity`` candidates."""
    # Sorted before the first sweep: from an arbitrary order insertion sort would take n^2 / 4 moves.
    order = np.argsort([body.pose[0] for body in model.bodies], kind="stable").astype(np.int64)
    corners = np.zeros((2, len(order), model.dimension))
    return Boxes(corners[0], corners[1], order, np.zeros(capacity, np.int64))


def doubled(boxes: Boxes) -> Boxes:
    """Return the same boxes with twice the room for candidates, none found yet."""
    return boxes._replace(candidate=np.zeros(2 * len(boxes.candidate), np.int64))


@inner_kernel
def boxes_part(boxes: Boxes, order: Indices, count: int) -> Boxes:
    """The boxes of the first bodies, in an order of their own."""
    return Boxes(boxes.low[:count], boxes.high[:count], order[:count], boxes.candidate)


@inner_kernel
def may_touch(bodies: Bodies, boxes: Boxes, i: int, j: int) -> bool:
    """Bounds overlap and at least one body can respond."""
    if not is_free(bodies, i) and not is_free(bodies, j):
        return False
    for d in range(boxes.low.shape[1]):
        if boxes.low[i, d] > boxes.high[j, d] or boxes.low[j, d] > boxes.high[i, d]:
            return False
    return True


@inner_kernel
def pair_bodies(bodies: Bodies, boxes: Boxes, sweep: int) -> int:
    """Fill `candidate` in ascending order; the number of pairs, one more than its length if there is no room."""
    if sweep:
        return sweep_candidates(bodies, boxes)
    count, n = 0, len(boxes.order)
    for i in range(n):
        for j in range(i + 1, n):
            if may_touch(bodies, boxes, i, j):
                if count == len(boxes.candidate):
                    return count + 1
                boxes.candidate[count] = i * n + j
                count += 1
    return count


@inner_kernel
def sweep_candidates(bodies: Bodies, boxes: Boxes) -> int:
    """Sort and sweep along x: only bodies whose x-intervals overlap are paired; then sort the pairs.

    An unbounded body has its lower end at -inf, stays open to the end, and so meets every other one.
    """
    sort_by_lower_x(boxes)
    count, n = 0, len(boxes.order)
    for s in range(n):
        i = boxes.order[s]
        for r in range(s + 1, n):
            j = boxes.order[r]
            if boxes.low[j, 0] > boxes.high[i, 0]:
                break
            if may_touch(bodies, boxes, i, j):
                if count == len(boxes.candidate):
                    return count + 1
                boxes.candidate[count] = min(i, j) * n + max(i, j)
                count += 1
    sort_keys(boxes.candidate, count)
    return count


@inner_kernel
def sort_by_lower_x(boxes: Boxes) -> None:
    """Insertion sort from the order of the step before, which is nearly right: bodies move little per step."""
    for s in range(1, len(boxes.order)):
        body = boxes.order[s]
        r = s
        while r > 0 and boxes.low[boxes.order[r - 1], 0] > boxes.low[body, 0]:
            boxes.order[r] = boxes.order[r - 1]
            r -= 1
        boxes.order[r] = body
