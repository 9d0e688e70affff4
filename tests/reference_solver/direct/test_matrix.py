"""Order of elimination and factors within the envelope."""

from itertools import pairwise

import numpy as np
import pytest

from reference_solver.direct.problem import NODES, VELOCITY_COUNT


def graph(seed, bodies, share):
    rng = np.random.default_rng(seed)
    return [(a, b) for a in range(bodies) for b in range(a + 1, bodies) if rng.random() < share]


def entries(problem, pairs):
    """Positions of the matrix that two touching bodies, or a body with itself, may fill."""
    width = int(problem.size[VELOCITY_COUNT])
    node = problem.body.node
    blocks = [(node[a], node[b]) for a, b in pairs] + [(node[b], node[a]) for a, b in pairs]
    blocks += [(node[i], node[i]) for i in range(len(node)) if node[i] >= 0]
    return [(m * width + i, n * width + j) for m, n in blocks for i in range(width) for j in range(width)]


def envelope(problem):
    unknowns = int(problem.size[NODES] * problem.size[VELOCITY_COUNT])
    return int(problem.start[unknowns])


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("dimension", [2, 3])
def test_permutation_and_envelope_of_an_order(direct, seed, dimension):
    pairs = graph(seed, 15, 0.12)
    problem = direct.touching(pairs, 15, dimension)
    assert direct.order(problem)
    touched = sorted({i for pair in pairs for i in pair})
    assert sorted(problem.body.node[touched]) == list(range(len(touched)))
    assert all(problem.body.node[i] == -1 for i in range(15) if i not in touched)
    assert all(min(i, j) >= problem.first[max(i, j)] for i, j in entries(problem, pairs))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("dimension", [2, 3])
def test_factors_solve_the_system(direct, seed, dimension):
    """Against LAPACK with interchanges; the matrix is unsymmetric, with a diagonal as heavy as its rows."""
    rng = np.random.default_rng(seed)
    pairs = graph(seed, 12, 0.2)
    problem = direct.touching(pairs, 12, dimension)
    assert direct.order(problem)
    unknowns = int(problem.size[NODES] * problem.size[VELOCITY_COUNT])
    rows, columns = np.array(entries(problem, pairs)).T
    values = rng.normal(size=len(rows))
    heavy = np.bincount(rows, np.abs(values), minlength=unknowns)
    matrix = np.eye(unknowns) + np.diag(heavy)
    np.add.at(matrix, (rows, columns), values)
    right = rng.normal(size=unknowns)
    problem.right[:unknowns] = right
    diagonal = np.arange(unknowns)
    rows, columns = np.concatenate([rows, diagonal]), np.concatenate([columns, diagonal])
    assert direct.factors(problem, rows, columns, np.concatenate([values, heavy]))
    # Condition below 100: some unknowns' round-off times that.
    assert problem.right[:unknowns] == pytest.approx(np.linalg.solve(matrix, right), abs=1e-12)


def test_a_singular_matrix_is_reported(direct):
    problem = direct.touching([(0, 1)], 2)
    assert direct.order(problem)
    assert not direct.factors(problem, np.array([2]), np.array([2]), np.array([-1.0]))


@pytest.mark.parametrize("n", [2, 20, 200])
def test_matrix_width_of_a_column(direct, n):
    """Whatever numbers its bodies carry: the envelope is 3 rows of 3 + 4 + 5 entries per body (planar), and no more."""
    rng = np.random.default_rng(n)
    names = rng.permutation(n)
    pairs = sorted(tuple(sorted(pair)) for pair in pairwise(names))
    problem = direct.touching(pairs, n)
    assert direct.order(problem)
    assert envelope(problem) == (n - 1) * (3 + 4 + 5) + 3


def test_rows_of_a_body_that_touches_all_others(direct):
    """A tray with 50 things on it: an envelope linear in their number, where a band would be quadratic."""
    n = 51
    problem = direct.touching([(0, i) for i in range(1, n)], n)
    assert direct.order(problem)
    # Own blocks of 3 entries per body; the tray's three rows reach across all bodies numbered before it, the one or
    # two bodies numbered after it reach back to it only.
    assert envelope(problem) <= 3 * n + 3 * 3 * n + 2 * 9 * 3


def test_fixed_bodies_are_no_unknowns(direct):
    problem = direct.touching([(0, 1), (0, 2), (1, 2)], 4)
    problem.body.weight[0] = 0.0
    assert direct.order(problem)
    assert problem.size[NODES] == 2
    assert problem.body.node[0] == problem.body.node[3] == -1
