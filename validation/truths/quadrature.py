"""Gauss' rule for truths with an integral; each rule is computed once."""

from __future__ import annotations

from functools import cache

import numpy as np


@cache
def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of Gauss and Legendre's rule on [-1, 1], to be read only.

    Making one takes the eigenvalues of a matrix of ``count`` rows: milliseconds, where the sum takes microseconds.
    """
    nodes, weights = np.polynomial.legendre.leggauss(count)
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights
