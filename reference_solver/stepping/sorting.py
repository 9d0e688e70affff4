"""Sorting of keys in place, without allocation (heap sort); for both dimensions."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.pieces import Indices


@inner_kernel
def sift_down(key: Indices, root: int, end: int) -> None:
    """Restore the heap below ``root``."""
    while 2 * root + 1 < end:
        child = 2 * root + 1
        if child + 1 < end and key[child + 1] > key[child]:
            child += 1
        if key[root] >= key[child]:
            return
        key[root], key[child] = key[child], key[root]
        root = child


@inner_kernel
def sort_keys(key: Indices, count: int) -> None:
    """Sort the first keys."""
    for root in range(count // 2 - 1, -1, -1):
        sift_down(key, root, count)
    for end in range(count - 1, 0, -1):
        key[0], key[end] = key[end], key[0]
        sift_down(key, 0, end)
