"""Enumeration finds every solution of a small contact problem, and how many there are."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference_solver.exact_contact import coulomb_solutions, frictionless_solutions, non_negative_least_squares

#: Round-off of systems of at most twelve rows, scaled to unit diagonal, times their condition (below 1e3 here).
EXACT = 1e-11


def rod_tip(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1 + 3 * c * c, 3 * s * c], [3 * s * c, 1 + 3 * s * s]])


def random_problem(seed, contacts):
    """Two points per random body pair: W = J J^T of full rank, and a random velocity."""
    rng = np.random.default_rng(seed)
    jacobian = rng.standard_normal((2 * contacts, 3 * contacts))
    return jacobian @ jacobian.T, rng.standard_normal(2 * contacts)


def violation(w, q, mu, solution):
    """Largest contradiction to Coulomb's law: separation, complementarity, cone, opposite slip."""
    p, u = solution.impulse, solution.velocity
    assert u.ravel() == pytest.approx(w @ p.ravel() + q, abs=EXACT * np.abs(q).max())
    normal = np.maximum(np.maximum(-p[:, 0], -u[:, 0]), np.abs(p[:, 0] * u[:, 0]))
    cone = np.maximum(np.abs(p[:, 1]) - mu * p[:, 0], 0.0)
    slip = np.abs(u[:, 1]) * (mu * p[:, 0] - np.abs(p[:, 1])) + np.maximum(u[:, 1] * p[:, 1], 0.0)
    return max(normal.max(), cone.max(), slip.max())


@pytest.mark.parametrize("contacts", [1, 2, 3])
@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), mu=st.floats(0.05, 0.5))
def test_every_solution_satisfies_coulombs_law(contacts, seed, mu):
    w, q = random_problem(seed, contacts)
    solutions = coulomb_solutions(w, q, [mu] * contacts)
    assert solutions
    scale = np.abs(q).max() ** 2 / np.diag(w).min()
    assert max(violation(w, q, mu, s) for s in solutions) <= 1e-9 * max(1.0, scale, np.linalg.cond(w))


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6))
def test_energy_minimum_of_a_smooth_problem(seed):
    rng = np.random.default_rng(seed)
    jacobian = rng.standard_normal((4, 6))
    w, q = jacobian @ jacobian.T, rng.standard_normal(4)
    solutions = frictionless_solutions(w, q)
    assert len(solutions) == 1  # W is positive definite
    p = solutions[0].impulse[:, 0]
    # the LCP is the optimality condition of 1/2 p.W p + q.p over p >= 0: no neighbour may be lower
    energy = 0.5 * p @ w @ p + q @ p
    for other in np.maximum(p + 0.1 * rng.standard_normal((200, 4)), 0.0):
        assert 0.5 * other @ w @ other + q @ other >= energy - EXACT


def test_redundant_contacts_leave_one_velocity():
    # a box on two corners: four rows, three degrees of freedom, both corners sticking
    half = 0.5
    rows = np.array([[0, 1, -half], [-1, 0, -half], [0, 1, half], [-1, 0, -half]])
    w = rows @ np.diag([1.0, 1.0, 6.0]) @ rows.T
    q = rows @ np.array([0.05, -1.0, 0.0])
    solutions = coulomb_solutions(w, q, [0.5, 0.5])
    assert len(solutions) == 1
    assert np.abs(solutions[0].velocity).max() <= EXACT
    assert solutions[0].impulse[:, 0].sum() == pytest.approx(1.0, abs=EXACT)  # all of the momentum m v


def test_limit_of_enumerated_contacts_with_friction():
    # six discs on a floor, none of which knows of the others
    w = np.kron(np.eye(6), np.diag([1.0, 3.0]))
    q = np.tile([-1.0, 0.3], 6)
    (solution,) = coulomb_solutions(w, q, [0.2] * 6)
    assert solution.modes == ("stick",) * 6
    with pytest.raises(ValueError, match="7 contacts"):
        coulomb_solutions(np.eye(14), np.zeros(14), [0.1] * 7)


@pytest.mark.parametrize("tangent", [0.5, 1.0, 2.0, 4.0])
def test_solutions_of_a_sliding_rod_by_painleves_threshold(tangent):
    angle = math.atan(tangent)
    threshold = (1 + 3 * math.cos(angle) ** 2) / (3 * math.sin(angle) * math.cos(angle))
    counts = {
        (factor, pull): len(coulomb_solutions(rod_tip(angle), np.array([pull, 0.0]), [factor * threshold], [1.0]))
        for factor in (1 - 1e-9, 1 + 1e-9)
        for pull in (-1.0, 1.0)
    }
    assert list(counts.values()) == [1, 1, 0, 2]


def test_rod_sliding_away_from_its_end():
    for mu in (0.5, 2.0, 50.0):
        assert len(coulomb_solutions(rod_tip(math.atan(2.0)), np.array([-1.0, 0.0]), [mu], [-1.0])) == 1


def test_rod_jammed_without_collision_beyond_the_threshold():
    w = rod_tip(math.atan(2.0))
    for approach in (1e-3, 1e-9):  # however slowly it comes: the jump does not shrink with the step
        (jam,) = coulomb_solutions(w, np.array([-approach, 1.0]), [1.6])
        assert jam.modes == ("stick",)
        assert np.abs(jam.velocity).max() <= EXACT
        assert jam.impulse[0, 0] > 0.1


def test_modes_of_a_problem_scaled_by_mass_ratios():
    w, q = random_problem(3, 2)
    masses = np.repeat([1.0, 1e-6], 2)
    (one,) = coulomb_solutions(w, q, [0.3, 0.3])
    (other,) = coulomb_solutions(masses[:, None] * w * masses, masses * q, [0.3, 0.3])
    assert one.modes == other.modes


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6))
def test_optimality_of_non_negative_least_squares(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.standard_normal((4, 5)), rng.standard_normal(4)
    x, residual = non_negative_least_squares(a, b)
    slope = a.T @ (b - a @ x)
    assert residual == pytest.approx(np.linalg.norm(b - a @ x))
    assert x.min() >= 0.0
    assert slope.max() <= 1e-10  # no column would lower the residual ...
    assert np.abs(slope[x > 0]).max(initial=0.0) <= 1e-10  # ... and those in use are at their best


@pytest.mark.parametrize("bad", [(np.eye(3), np.zeros(2)), (np.zeros((2, 2)), np.zeros(2))])
def test_refusal_of_arrays_that_are_no_contact_problem(bad):
    with pytest.raises(ValueError, match="matrix"):
        coulomb_solutions(*bad, [0.1])


def test_solution_of_a_step_s_contact_problem():
    """2000 random problems of one and two contacts on free bodies: impulses exist, several or one (E54).

    W is symmetric and positive semi-definite, and q is a velocity that free bodies can have; then a solution exists
    (D. Stewart and J. Trinkle 1996, M. Anitescu and F. Potra 1997).
    """
    rng = np.random.default_rng(3)
    several = 0
    for trial in range(2000):
        count = 1 + trial % 2
        levers = rng.standard_normal((2 * count, 3))
        for c in range(count):  # normal and tangent of a contact are perpendicular unit vectors
            angle = rng.uniform(0.0, 2.0 * math.pi)
            levers[2 * c, :2] = math.cos(angle), math.sin(angle)
            levers[2 * c + 1, :2] = -math.sin(angle), math.cos(angle)
        matrix = levers @ np.diag([1.0, 1.0, rng.uniform(0.1, 10.0)]) @ levers.T
        free = levers @ rng.standard_normal(3)  # velocities that the bodies can have
        solutions = coulomb_solutions(matrix, free, rng.uniform(0.0, 3.0, count))
        assert solutions
        several += len(solutions) > 1
    assert several > 0  # existence, not uniqueness
