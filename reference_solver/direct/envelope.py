"""Triangular factors within an envelope: A = L U without interchanges, for matrices of symmetric structure (E43).

Row i of L and column i of U start at the same first entry, and nothing before it ever fills. In 3000 factorisations of
E41's matrix (piles of boxes and discs, friction up to mu = 1) no entry of the factors exceeded 25 times the largest of
the matrix, so that interchanges would gain one digit at most. Without them the factors of a problem in other units
(powers of two) differ by those powers alone.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import NODES, VELOCITY_COUNT, Problem
from reference_solver.model import Array


@inner_kernel
def product(a: Array, at: int, b: Array, bt: int, count: int) -> float:
    """Sum of a[at + k] b[bt + k], in four sums: one alone would wait for its own last addition."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    k = 0
    while k + 4 <= count:
        s0 += a[at + k] * b[bt + k]
        s1 += a[at + k + 1] * b[bt + k + 1]
        s2 += a[at + k + 2] * b[bt + k + 2]
        s3 += a[at + k + 3] * b[bt + k + 3]
        k += 4
    while k < count:
        s0 += a[at + k] * b[bt + k]
        k += 1
    return (s0 + s1) + (s2 + s3)


@inner_kernel
def clear(problem: Problem) -> None:
    """Make the matrix the identity."""
    unknowns = problem.size[NODES] * problem.size[VELOCITY_COUNT]
    for k in range(problem.start[unknowns]):
        problem.lower[k], problem.upper[k] = 0.0, 0.0
    for i in range(unknowns):
        problem.diagonal[i] = 1.0


@inner_kernel
def add(problem: Problem, i: int, j: int, value: float) -> None:
    """Add to entry (i, j) of the matrix, which must lie in the envelope."""
    if i > j:
        problem.lower[problem.start[i] + j - problem.first[i]] += value
    elif i < j:
        problem.upper[problem.start[j] + i - problem.first[j]] += value
    else:
        problem.diagonal[i] += value


@inner_kernel
def factorise(problem: Problem) -> bool:
    """Replace the matrix by its factors; False if a pivot is zero or not finite."""
    lower, upper, first, start = problem.lower, problem.upper, problem.first, problem.start
    for i in range(problem.size[NODES] * problem.size[VELOCITY_COUNT]):
        fi, si = first[i], start[i]
        for j in range(fi, i):
            low = max(fi, first[j])
            sj = start[j] + low - first[j]
            inner = product(lower, si + low - fi, upper, sj, j - low)
            lower[si + j - fi] = (lower[si + j - fi] - inner) / problem.diagonal[j]
            upper[si + j - fi] -= product(lower, sj, upper, si + low - fi, j - low)
        problem.diagonal[i] -= product(lower, si, upper, si, i - fi)
        if problem.diagonal[i] == 0.0 or not math.isfinite(problem.diagonal[i]):
            return False
    return True


@inner_kernel
def substitute(problem: Problem) -> None:
    """Replace the right side by the solution."""
    right, first, start = problem.right, problem.first, problem.start
    unknowns = problem.size[NODES] * problem.size[VELOCITY_COUNT]
    for i in range(unknowns):
        right[i] -= product(problem.lower, start[i], right, first[i], i - first[i])
    for i in range(unknowns - 1, -1, -1):
        right[i] /= problem.diagonal[i]
        for k in range(first[i], i):
            right[k] -= problem.upper[start[i] + k - first[i]] * right[i]
