"""Complementary pivoting: against enumeration, and where Newton's rounds stand still."""

import json
from pathlib import Path

import numpy as np
import pytest

from reference_solver.direct.pivoting import COVERINGS
from reference_solver.direct.problem import FACTORISATIONS, PIVOTED_CONTACTS
from reference_solver.exact_contact import coulomb_solutions

#: Gap of the natural map, of speeds of about 1.
SOLVED = 1e-13
#: Pivots do not refine what they find: some hundred of them leave a few thousand roundings.
PIVOTED = 1e-11


@pytest.mark.few(30)
@pytest.mark.parametrize("attempt", range(COVERINGS))
@pytest.mark.parametrize("mu", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("seed", range(10))
def test_answers_agree_with_enumeration(direct, seed, mu, attempt):
    """W p + q of the answer is one of the velocities that enumeration of all 4^c modes finds (O9)."""
    contacts = 1 + seed % 5
    problem = direct.random(seed, contacts, mu=mu)
    w, q = direct.delassus(problem)
    solutions = coulomb_solutions(w, q, [mu] * contacts)
    assert direct.pivots(problem, attempt) <= PIVOTED
    velocity = w @ problem.contact.impulse[:, :2].ravel() + q
    assert min(np.abs(velocity - solution.velocity.ravel()).max() for solution in solutions) <= 1e-9


@pytest.mark.parametrize("seed", range(20))
def test_larger_answers_obey_the_law(direct, seed):
    """Signs, complementarity, cone, and friction against the slip of 20 to 40 contacts, from W and q alone.

    Pivots from one covering may end nowhere: on some machines those of seed 14 do from the first. The solver asks the
    next then, of what it had before.
    """
    mu = 0.2 + 0.04 * seed
    for attempt in range(COVERINGS):
        problem = direct.random(100 + seed, 20 + seed, mu=mu)
        w, q = direct.delassus(problem)
        left = direct.pivots(problem, attempt)
        if left <= PIVOTED:
            break
    assert left <= PIVOTED
    p = problem.contact.impulse[:, :2]
    u = (w @ p.ravel() + q).reshape(-1, 2)
    size = np.abs(p).max()
    assert p[:, 0].min() >= 0.0
    assert u[:, 0].min() >= -1e-10
    assert np.abs(p[:, 0] * u[:, 0]).max() <= 1e-10 * size
    assert (np.abs(p[:, 1]) <= mu * p[:, 0] * (1.0 + 1e-15)).all()
    assert np.abs(p[:, 1] * u[:, 1] + mu * p[:, 0] * np.abs(u[:, 1])).max() <= 1e-10 * max(size, 1.0)


@pytest.mark.parametrize("attempt", range(COVERINGS))
@pytest.mark.parametrize("points", [2, 3, 10])
def test_redundant_points_share_one_force(direct, points, attempt):
    """Single impulses are not unique; their sums, and the rest they bring about, are."""
    problem = direct.pressed_block(points)
    assert direct.pivots(problem, attempt) <= PIVOTED
    assert problem.contact.impulse[:, 0].sum() == pytest.approx(1.0, rel=1e-12)
    assert problem.contact.impulse[:, 1].sum() == pytest.approx(0.2, rel=1e-12)


def jammed(direct):
    """19 contacts of 11 bodies of .2 to 9 kg, mu = .8, as a pile met them whose run ended there."""
    told = json.loads((Path(__file__).parent / "jammed.json").read_text())
    masses = np.array([[np.inf if entry is None else entry for entry in row] for row in told["masses"]])
    state = np.array(told["jacobians"]), masses, np.array(told["twists"])
    problem = direct.problem(2, told["pairs"], *state, told["friction"], 0.0)
    problem.contact.speed[:] = told["speeds"]
    return problem


@pytest.mark.parametrize("budget", [20, 100])
def test_where_rounds_stand_still_pivots_end(direct, budget):
    """A table without room leaves it to rounds alone."""
    problem = jammed(direct)
    alone = jammed(direct)._replace(table=np.zeros((0, 2)))
    assert direct.solve(alone, SOLVED, budget) > 1e-4
    assert direct.solve(problem, SOLVED, budget) <= SOLVED
    assert problem.size[FACTORISATIONS] == alone.size[FACTORISATIONS] >= budget


def test_problems_without_pivots(direct):
    """In space, and of more contacts than there is room for: impulses are zero, as `withdraw` left them."""
    for problem in (direct.random(1, 3, dimension=3), direct.pressed_block(PIVOTED_CONTACTS + 1)):
        assert direct.pivots(problem, 0) == np.inf
        assert not problem.contact.impulse.any()
