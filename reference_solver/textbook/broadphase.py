"""Which pairs of bodies may touch, by their bounding boxes: all pairs, or a grid with a level for each size."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from reference_solver.compilation import spliced_kernel
from reference_solver.model import Array, Model
from reference_solver.needs import ALL_PAIRS_LIMIT
from reference_solver.pieces import Indices

#: Levels of the grid, of cells half as wide each: one bit each of an integer. All smaller bodies are on the last.
LEVELS = 62
#: Cells are wider than their bodies by this share: rounding of a coordinate over a width is less, up to `FARTHEST`.
ROOM = 2.0**-20
#: Cells are counted up to here on both sides of the origin; what is farther away shares the outermost one.
FARTHEST = 2.0**30
#: Large primes for the hash of a cell (Teschner et al., Optimized spatial hashing for collision detection, 2003).
PRIMES = (73856093, 19349663, 83492791)


class Boxes(NamedTuple):
    """Bounding boxes of n bodies in d dimensions, room for the pairs that may touch, and the grid that finds them."""

    free: Indices  # (n,): 1 where forces move the body
    low: Array  # (n, d): lower corners [m], -inf of a half-space
    high: Array  # (n, d): upper corners
    candidate: Indices  # (capacity,): pairs as `pair_of` makes them, ascending
    found: Indices  # (capacity,): the same in the order in which they were found
    begin: Indices  # (n + 1,): first place in `candidate` of each body's pairs
    cell: Indices  # (n, 1 + d): level of a body, -1 if it is unbounded, and the cell of its lower corner
    bucket: Indices  # (power of 2, at least 2 n): first body of all cells with the same hash, -1: none
    after: Indices  # (n,): next body of the same bucket, -1: none


def allocate_boxes(model: Model, capacity: int) -> Boxes:
    """Return the boxes of the bodies, and room for ``capacity`` candidates."""
    bodies, dimension = len(model.bodies), model.dimension
    corners = np.zeros((2, bodies, dimension))
    return Boxes(
        np.array([body.motion == "free" for body in model.bodies], np.int64),
        corners[0],
        corners[1],
        np.zeros(capacity, np.int64),
        np.zeros(capacity, np.int64),
        np.zeros(bodies + 1, np.int64),
        np.zeros((bodies, 1 + dimension), np.int64),
        np.zeros(2 << (bodies - 1).bit_length(), np.int64),
        np.zeros(bodies, np.int64),
    )


def doubled(boxes: Boxes) -> Boxes:
    """Return the same boxes with twice the room for candidates, none found yet."""
    room = 2 * len(boxes.candidate)
    return boxes._replace(candidate=np.zeros(room, np.int64), found=np.zeros(room, np.int64))


@spliced_kernel
def pair_of(a: int, b: int) -> int:
    """Bodies a < b as one integer that sorts like the pair."""
    return (a << 32) | b


@spliced_kernel
def bodies_of(pair: int) -> tuple[int, int]:
    """Bodies of `pair_of`."""
    return pair >> 32, pair & 0xFFFFFFFF


@spliced_kernel
def bound_along(boxes: Boxes, i: int, axis: int, component: float, place: float) -> None:
    """Bound half-space i along an axis that is its normal, to the last bit, by the place of its face there."""
    noise = 1e-15 * abs(place)
    if component == 1.0:
        boxes.high[i, axis] = place + noise
    if component == -1.0:
        boxes.low[i, axis] = place - noise


@spliced_kernel
def may_touch(boxes: Boxes, i: int, j: int) -> bool:
    """Bounds overlap and at least one body can respond."""
    for d in range(boxes.low.shape[1]):
        if boxes.low[i, d] > boxes.high[j, d] or boxes.low[j, d] > boxes.high[i, d]:
            return False
    return bool(boxes.free[i] or boxes.free[j])


@spliced_kernel
def pair_bodies(boxes: Boxes, grid: int) -> int:
    """Fill `candidate` in ascending order; the number of pairs, one more than its length if there is no room."""
    n = len(boxes.low)
    if grid and n > ALL_PAIRS_LIMIT:
        count = find_in_grid(boxes, fill_grid(boxes))
        if count <= len(boxes.candidate):
            sort_pairs(boxes, count)
        return count
    count = 0
    for i in range(n):
        for j in range(i + 1, n):
            if may_touch(boxes, i, j):
                if count == len(boxes.candidate):
                    return count + 1
                boxes.candidate[count] = pair_of(i, j)
                count += 1
    return count


@spliced_kernel
def width_of(boxes: Boxes, i: int) -> float:
    """Longest side of a box; infinite of an unbounded body, and where a corner is no number."""
    widest = 0.0
    for d in range(boxes.low.shape[1]):
        widest = max(widest, boxes.high[i, d] - boxes.low[i, d])
        if not (boxes.high[i, d] - boxes.low[i, d] < math.inf):
            return math.inf
    return widest


@spliced_kernel
def cell_at(place: float, size: float) -> int:
    """Cell of a coordinate."""
    cells = place / size
    return math.floor(math.copysign(min(abs(cells), FARTHEST), cells))


@spliced_kernel
def bucket_of(boxes: Boxes, level: int, x: int, y: int, z: int) -> int:
    """Bucket of a cell; the number of buckets is a power of two."""
    return ((x * PRIMES[0]) ^ (y * PRIMES[1]) ^ (z * PRIMES[2]) ^ level) & (len(boxes.bucket) - 1)


@spliced_kernel
def fill_grid(boxes: Boxes) -> tuple[float, int]:
    """Put each bounded body into the cell of its lower corner, at the last level whose cells are wider than it.

    Returns the width of the cells of level 0, wider than all bodies, and one bit for each level that has bodies. Cells
    of each level are half as wide as those of the one before.
    """
    widest = 0.0
    for i in range(len(boxes.low)):
        width = width_of(boxes, i)
        widest = max(widest, width if width < math.inf else 0.0)
    widest *= 1.0 + ROOM
    boxes.bucket[:] = -1
    occupied, axes = 0, boxes.low.shape[1]
    for i in range(len(boxes.low) - 1, -1, -1):
        width = width_of(boxes, i)
        if width == math.inf:
            boxes.cell[i, 0] = -1
            continue
        level = LEVELS - 1
        if width > 0.0:
            halvings = math.frexp(widest / (width * (1.0 + 0.5 * ROOM)))[1] - 1  # at least 0: no body is as wide
            level = min(halvings, level)
        boxes.cell[i, 0] = level
        occupied |= 1 << level
        size = math.ldexp(widest, -level)
        for d in range(axes):
            boxes.cell[i, 1 + d] = cell_at(boxes.low[i, d], size)
        bucket = bucket_of(boxes, level, boxes.cell[i, 1], boxes.cell[i, 2], boxes.cell[i, 3] if axes == 3 else 0)
        boxes.after[i] = boxes.bucket[bucket]
        boxes.bucket[bucket] = i
    return widest, occupied


@spliced_kernel
def find_in_grid(boxes: Boxes, grid: tuple[float, int]) -> int:
    """Fill `found`: each body with those of its own level and of wider cells, and unbounded ones with all others.

    The lower corner of a body that another one meets is in the same cell as its own, or in one beside it. At its own
    level it looks in one of each two cells that lie opposite each other: from there the other one finds it.
    """
    widest, occupied = grid
    count, n, axes = 0, len(boxes.low), boxes.low.shape[1]
    for i in range(n):
        own = boxes.cell[i, 0]
        if own < 0:
            for j in range(n):
                # Two unbounded ones meet once.
                if (j > i or (j < i and boxes.cell[j, 0] >= 0)) and may_touch(boxes, i, j):
                    count = enter_pair(boxes, count, i, j)
            continue
        for level in range(own + 1):
            if not (occupied >> level) & 1:
                continue
            size = math.ldexp(widest, -level)
            x, y, z = cell_at(boxes.low[i, 0], size), cell_at(boxes.low[i, 1], size), 0
            x1, y1, z0, z1 = cell_at(boxes.high[i, 0], size), cell_at(boxes.high[i, 1], size), 0, 0
            if axes == 3:
                z, z1 = cell_at(boxes.low[i, 2], size), cell_at(boxes.high[i, 2], size)
                z0 = z if level == own else z - 1
            for zz in range(z0, z1 + 1):
                for yy in range(y if level == own and zz == z else y - 1, y1 + 1):
                    for xx in range(x if level == own and zz == z and yy == y else x - 1, x1 + 1):
                        j = boxes.bucket[bucket_of(boxes, level, xx, yy, zz)]
                        beside = level < own or xx != x or yy != y or zz != z
                        while j >= 0:
                            if (beside or j > i) and in_cell(boxes, j, level, xx, yy, zz):
                                if may_touch(boxes, i, j):
                                    count = enter_pair(boxes, count, i, j)
                            j = boxes.after[j]
    return count


@spliced_kernel
def in_cell(boxes: Boxes, j: int, level: int, x: int, y: int, z: int) -> bool:
    """Whether body j lies in this cell: others may share its bucket."""
    same = boxes.cell[j, 0] == level and boxes.cell[j, 1] == x and boxes.cell[j, 2] == y
    return same and (boxes.low.shape[1] == 2 or boxes.cell[j, 3] == z)


@spliced_kernel
def enter_pair(boxes: Boxes, count: int, i: int, j: int) -> int:
    """Enter a pair if there is room; return how many have been found, at most one more than there is room for."""
    if count < len(boxes.found):
        boxes.found[count] = pair_of(min(i, j), max(i, j))
    return min(count + 1, len(boxes.found) + 1)


@spliced_kernel
def sort_pairs(boxes: Boxes, count: int) -> None:
    """Copy the pairs found to `candidate` in ascending order: by the first body by counting, then by the second.

    Pairs of one first body are few, or come in order where it is larger than the others: insertion sort.
    """
    begin = boxes.begin
    begin[:] = 0
    for k in range(count):
        begin[bodies_of(boxes.found[k])[0] + 1] += 1
    for i in range(1, len(begin)):
        begin[i] += begin[i - 1]
    for k in range(count):
        a = bodies_of(boxes.found[k])[0]
        boxes.candidate[begin[a]] = boxes.found[k]
        begin[a] += 1
    for k in range(1, count):
        pair, r = boxes.candidate[k], k
        while r > 0 and boxes.candidate[r - 1] > pair:
            boxes.candidate[r] = boxes.candidate[r - 1]
            r -= 1
        boxes.candidate[r] = pair
