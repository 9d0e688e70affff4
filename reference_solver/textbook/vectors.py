"""Vectors of all bodies, (n, 3), (n, 6) or (n, 7), in kernels."""

from __future__ import annotations

import math

from reference_solver.compilation import spliced_kernel
from reference_solver.model import Array


@spliced_kernel
def copy_vectors(source: Array, target: Array) -> None:
    """Copy all numbers of every body; a slice assignment would allocate."""
    for i in range(len(source)):
        for k in range(source.shape[1]):
            target[i, k] = source[i, k]


@spliced_kernel
def are_finite(vectors: Array) -> bool:
    """Whether every entry is a number: comparisons with what is not would be silently false."""
    for i in range(len(vectors)):
        for k in range(vectors.shape[1]):
            if not math.isfinite(vectors[i, k]):
                return False
    return True
