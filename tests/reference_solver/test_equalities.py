"""Equalities of a phase against dense algebra: matrix, solution, and the choice where rows say the same (E37)."""

import numpy as np
import pytest

from reference_solver.compilation import from_python
from reference_solver.stepping import equalities
from reference_solver.stepping.equalities import CONTRADICTORY, INDEPENDENT, REDUNDANT
from reference_solver.stepping.lasting import CONTACTS, OPEN, SLIP, STICK, allocate_lasting

assemble, factors_of, force_contacts, list_rows, solve_for, solve_rows = (
    from_python(kernel)
    for kernel in (
        equalities.assemble,
        equalities.factors_of,
        equalities.force_contacts,
        equalities.list_rows,
        equalities.solve_for,
        equalities.solve_rows,
    )
)

#: Bodies, the first of which is fixed, and contacts between random pairs of them: most share no body.
BODIES, TOUCHING = 24, 9


def drawn(dimension, seed):
    """Contacts of all modes between random bodies, with random levers; rows that say the same are all but impossible.

    There are at most 27 rows, and 69 velocities.
    """
    rng = np.random.default_rng(seed)
    lasting = allocate_lasting(dimension, BODIES, TOUCHING)
    velocities = 3 * (dimension - 1)
    lasting.size[CONTACTS] = TOUCHING
    light = rng.uniform(0.5, 2.0, (BODIES, velocities))
    light[0] = 0.0
    for k in range(TOUCHING):
        lasting.body[k] = rng.choice(BODIES, 2, replace=False)
        lasting.mode[k] = (STICK, SLIP, OPEN, STICK, SLIP)[k % 5]
        lasting.friction[k] = rng.uniform(0.1, 0.5)
        towards = rng.normal(size=dimension - 1)
        lasting.direction[k] = towards / np.linalg.norm(towards)
        lasting.jacobian[k] = rng.normal(size=lasting.jacobian[k].shape)
        lasting.jacobian[k, 0, :, : velocities // 3] = 0.0  # entries that are zero before those that are not...
        lasting.jacobian[k, 1, :, -velocities // 3 :] = 0.0  # ... and after them
        for side in range(2):
            lasting.response[k, side] = lasting.jacobian[k, side] * light[lasting.body[k, side]]
        lasting.usual[k] = rng.uniform(0.5, 2.0, dimension)
        lasting.scale[k] = 1.0
    return lasting, rng


def dense(lasting, count):
    """G M^-1 F of the rows that are numbered, from whole rows over all bodies."""
    width = lasting.free.shape[1]
    rows, forces = np.zeros((count, BODIES * width)), np.zeros((count, BODIES * width))
    for i in range(count):
        k, row = lasting.unknown[i]
        for side in range(2):
            at = slice(lasting.body[k, side] * width, (lasting.body[k, side] + 1) * width)
            rows[i, at] += lasting.jacobian[k, side, row]
            forces[i, at] += lasting.response[k, side, row]
            if row == 0 and lasting.mode[k] == SLIP:
                forces[i, at] -= lasting.friction[k] * (lasting.direction[k] @ lasting.response[k, side, 1:])
    return rows @ forces.T


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("dimension", [2, 3])
def test_matrix_and_solution_are_those_of_dense_algebra(dimension, seed):
    lasting, rng = drawn(dimension, seed)
    count = list_rows(lasting)
    assert count == sum({OPEN: 0, SLIP: 1, STICK: dimension}[mode] for mode in lasting.mode)
    lasting.matrix[:] = 7.0  # of the phase before
    assemble(lasting, 0, count, True)
    expected = dense(lasting, count)
    assert np.allclose(lasting.matrix[:count, :count], expected, rtol=0.0, atol=1e-14 * np.abs(expected).max())
    assert (expected == 0.0).sum() > 0.3 * expected.size  # or nothing that is left out would be noticed
    lasting.right[:count] = rng.normal(size=count)
    assert factors_of(lasting, 0, count) < 0
    solve_for(lasting, 0, count, -1, 0.0)
    solution = np.linalg.solve(expected, lasting.right[:count])
    # round-off of either, magnified by the condition at most
    limit = 1e-15 * count * np.linalg.cond(expected) * np.abs(solution).max()
    assert np.abs(lasting.answer[:count] - solution).max() <= limit


@pytest.mark.parametrize("told", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("dimension", [2, 3])
def test_redundant_rows_get_the_forces_nearest_to_the_usual_ones(dimension, seed, told):
    """Least squares of what each force differs by, over its weight: found by a pseudo-inverse instead."""
    lasting, rng = drawn(dimension, seed)
    lasting.mode[:] = STICK
    for twin, of in ((3, 0), (7, 2)):  # contacts that say what others say, with other usual forces
        lasting.body[twin] = lasting.body[of]
        lasting.jacobian[twin], lasting.response[twin] = lasting.jacobian[of], lasting.response[of]
    count = list_rows(lasting)
    right = dense(lasting, count) @ rng.normal(size=count)
    lasting.right[:count] = right
    assert solve_rows(lasting, count, False, told, False) == REDUNDANT
    matrix, right = dense(lasting, count), lasting.right[:count].copy()  # in the order of clusters by now
    usual = told * np.array([lasting.usual[tuple(unknown)] for unknown in lasting.unknown[:count]])
    carried = [(lasting.usual[k, 0], lasting.friction[k] if row else 1.0) for k, row in lasting.unknown[:count]]
    weight = np.abs(carried).prod(axis=1)
    root = np.sqrt(weight)
    change = root * (np.linalg.pinv(matrix * root, rcond=1e-9) @ (right - matrix @ usual))
    sizes = np.linalg.svd(matrix * root, compute_uv=False)
    sizes = sizes[sizes > 1e-9 * sizes[0]]  # others are round-off: conditions here are below 1e4
    # round-off of either, magnified by the condition: corrections gain back what squaring the matrix costs
    limit = 1e-15 * count * sizes[0] / sizes[-1] * np.abs(usual + change).max()
    assert np.abs(lasting.answer[:count] - usual - change).max() <= limit


@pytest.mark.parametrize("dimension", [2, 3])
def test_what_one_cluster_says_twice_changes_no_bit_of_another(dimension):
    """Two pairs of bodies, each on the ground: the second pair's forces are what they are without the first pair."""
    lasting, rng = drawn(dimension, 1)
    lasting.mode[:] = OPEN
    lasting.mode[[0, 1, 2, 3, 4]] = STICK
    for k, pair in enumerate([(1, 2), (3, 4), (0, 1), (0, 3), (1, 2)]):
        lasting.body[k] = pair
        free = np.array([body != 0 for body in pair], float)
        lasting.response[k] = lasting.jacobian[k] * free[:, None, None]
    lasting.jacobian[4], lasting.response[4] = lasting.jacobian[0], lasting.response[0]
    lasting.gamma[:] = rng.normal(size=lasting.gamma.shape)
    lasting.gamma[4] = lasting.gamma[0]
    assert force_contacts(lasting, False) == REDUNDANT
    together = lasting.force[[1, 3]].copy()
    lasting.mode[[0, 2, 4]] = OPEN
    assert force_contacts(lasting, False) == INDEPENDENT
    assert (lasting.force[[1, 3]] == together).all() and (together != 0.0).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_rows_that_say_otherwise_of_the_same_contradict_each_other(dimension):
    lasting, _ = drawn(dimension, 0)
    lasting.mode[:] = STICK
    lasting.body[3], lasting.jacobian[3], lasting.response[3] = (
        lasting.body[0],
        lasting.jacobian[0],
        lasting.response[0],
    )
    count = list_rows(lasting)
    lasting.right[:count] = 1.0
    assert solve_rows(lasting, count, False, 1.0, False) == REDUNDANT
    count = list_rows(lasting)
    lasting.right[:count] = 1.0
    lasting.right[3 * dimension] = 2.0
    assert solve_rows(lasting, count, False, 1.0, False) == CONTRADICTORY


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("dimension", [2, 3])
def test_forces_that_hold_what_is_held_stay_what_they_are(dimension, seed):
    """Two contacts say what others do: how they share a load is told by how they did, however unevenly."""
    lasting, rng = drawn(dimension, seed)
    lasting.mode[:] = STICK
    for twin, of in ((3, 0), (7, 2)):
        lasting.body[twin] = lasting.body[of]
        lasting.jacobian[twin], lasting.response[twin] = lasting.jacobian[of], lasting.response[of]
    lasting.gamma[:] = rng.normal(size=lasting.gamma.shape)
    lasting.gamma[[3, 7]] = lasting.gamma[[0, 2]]
    count = list_rows(lasting)
    matrix, held = dense(lasting, count), [tuple(unknown) for unknown in lasting.unknown[:count]]
    needed = np.linalg.pinv(matrix, rcond=1e-9) @ -np.array([lasting.gamma[row] for row in held])
    for size, row in zip(needed, held, strict=True):
        lasting.usual[row] = size
    uneven = rng.uniform(1.0, 2.0, dimension)
    lasting.usual[[0, 2]] += uneven
    lasting.usual[[3, 7]] -= uneven
    assert force_contacts(lasting, False) == REDUNDANT
    # round-off of what is missed, magnified by the condition of what is not redundant
    sizes = np.linalg.svd(matrix, compute_uv=False)
    limit = 1e-14 * count * sizes[0] / sizes[sizes > 1e-9 * sizes[0]][-1] * np.abs(lasting.usual).max()
    assert np.abs(lasting.force - lasting.usual).max() <= limit < 1e-3


@pytest.mark.parametrize("dimension", [2, 3])
def test_where_friction_turns_forces_of_its_cluster_alone_are_found_anew(dimension):
    """Two pairs of bodies, each on the ground, slip on it; friction of one slip turns, and is noted to have."""
    lasting, rng = drawn(dimension, 2)
    lasting.mode[:] = OPEN
    lasting.mode[[0, 1]], lasting.mode[[2, 3]] = STICK, SLIP
    for k, pair in enumerate([(1, 2), (3, 4), (0, 1), (0, 3)]):
        lasting.body[k] = pair
        free = np.array([body != 0 for body in pair], float)
        lasting.response[k] = lasting.jacobian[k] * free[:, None, None]
    lasting.gamma[:] = rng.normal(size=lasting.gamma.shape)
    lasting.friction[[2, 3]] = 0.3
    assert force_contacts(lasting, False) == INDEPENDENT
    before = lasting.force.copy()
    lasting.direction[2] = -lasting.direction[2]
    lasting.turned[:] = [k == 2 for k in range(len(lasting.turned))]
    marked = 7.0  # stands for what was found, in the cluster that must not be asked again
    lasting.force[1, 0] = lasting.force[3, 0] = marked
    assert force_contacts(lasting, True) == INDEPENDENT
    again = lasting.force.copy()
    assert again[1, 0] == again[3, 0] == marked
    assert (again[3, 1:] == -0.3 * marked * lasting.direction[3]).all()
    assert force_contacts(lasting, False) == INDEPENDENT
    assert (lasting.force[[0, 2]] == again[[0, 2]]).all() and (before[[0, 2]] != again[[0, 2]]).any()
    assert (lasting.force[[1, 3]] == before[[1, 3]]).all()


@pytest.mark.parametrize("redundant", [False, True])
def test_factors_serve_any_number_of_right_sides(redundant):
    lasting, rng = drawn(3, 3)
    lasting.mode[:] = STICK
    if redundant:
        lasting.body[3], lasting.jacobian[3] = lasting.body[0], lasting.jacobian[0]
        lasting.response[3] = lasting.response[0]
    count = list_rows(lasting)
    assemble(lasting, 0, count, False)
    rank = factors_of(lasting, 0, count)
    assert rank == (count - 3 if redundant else -1)
    for _ in range(3):
        wanted = dense(lasting, count) @ rng.normal(size=count)
        lasting.right[:count] = wanted
        found = solve_for(lasting, 0, count, rank, 0.0)
        assert found == (REDUNDANT if redundant else INDEPENDENT)
        left = dense(lasting, count) @ lasting.answer[:count] - wanted
        assert np.abs(left).max() <= 1e-9 * np.abs(wanted).max()
