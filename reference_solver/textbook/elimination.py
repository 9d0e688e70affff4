"""Small systems of linear equations."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array


@inner_kernel
def eliminate(system: Array, n: int, least: float) -> bool:
    """Solve n equations in place by Gaussian elimination; right side and solution are column n.

    False if they are singular: a pivot is no larger than ``least``, or no number.
    """
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[pivot, k]):
                pivot = i
        if not (abs(system[pivot, k]) > least and math.isfinite(system[pivot, k])):
            return False
        if pivot != k:
            for j in range(k, n + 1):
                system[k, j], system[pivot, j] = system[pivot, j], system[k, j]
        for i in range(k + 1, n):
            part = system[i, k] / system[k, k]
            for j in range(k + 1, n + 1):
                system[i, j] -= part * system[k, j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            system[i, n] -= system[i, j] * system[j, n]
        system[i, n] /= system[i, i]
    return True
