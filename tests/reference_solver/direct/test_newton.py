"""Contact problems by themselves: against enumeration, redundant, with several answers, in other units."""

import numpy as np
import pytest

from reference_solver.direct.problem import FACTORISATIONS
from reference_solver.exact_contact import coulomb_solutions

#: Gap of the natural map, of speeds of about 1.
SOLVED = 1e-13


@pytest.mark.few(30)
@pytest.mark.parametrize("mu", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("seed", range(30))
def test_planar_problems_agree_with_enumeration(direct, seed, mu):
    """W p + q of the answer is one of the velocities that enumeration of all 4^c modes finds (O9)."""
    contacts = 1 + seed % 5
    problem = direct.random(seed, contacts, mu=mu)
    w, q = direct.delassus(problem)
    solutions = coulomb_solutions(w, q, [mu] * contacts)
    residual = direct.solve(problem, SOLVED, 500)
    velocity = w @ problem.contact.best[:, :2].ravel() + q
    assert residual <= SOLVED
    # A residual of 1e-13 leaves its product with the condition of W, below 1e4 here.
    distance = min(np.abs(velocity - solution.velocity.ravel()).max() for solution in solutions)
    assert distance <= 1e-9


@pytest.mark.parametrize("seed", range(20))
def test_spatial_answers_obey_the_law(direct, seed):
    """Signs, complementarity, disc, and friction against the slip, checked from W and q alone."""
    mu, contacts = 0.4, 1 + seed % 6
    problem = direct.random(seed, contacts, dimension=3, mu=mu)
    w, q = direct.delassus(problem)
    assert direct.solve(problem, SOLVED, 500) <= SOLVED
    p = problem.contact.best.copy()
    u = (w @ p.ravel() + q).reshape(-1, 3)
    size = np.abs(p).max()
    assert p[:, 0].min() >= 0.0
    assert u[:, 0].min() >= -1e-11
    assert np.abs(p[:, 0] * u[:, 0]).max() <= 1e-11 * size
    friction, slip = np.linalg.norm(p[:, 1:], axis=1), np.linalg.norm(u[:, 1:], axis=1)
    assert (friction <= mu * p[:, 0] * (1.0 + 1e-15)).all()
    # Maximal dissipation: p_t . u_t = -mu p_n |u_t|.
    power = (p[:, 1:] * u[:, 1:]).sum(axis=1) + mu * p[:, 0] * slip
    assert np.abs(power).max() <= 1e-11 * max(size, 1.0)


@pytest.mark.parametrize("points", [2, 3, 10])
def test_redundant_points_share_one_force(direct, points):
    """Single impulses are not unique; their sums, and the rest they bring about, are."""
    problem = direct.pressed_block(points)
    assert direct.solve(problem, SOLVED, 100) <= SOLVED
    assert problem.contact.best[:, 0].sum() == pytest.approx(1.0, rel=1e-14)
    assert problem.contact.best[:, 1].sum() == pytest.approx(0.2, rel=1e-13)
    assert np.abs(problem.body.twist[1]).max() <= 1e-15


@pytest.mark.parametrize("ratio", [1e-6, 1e-9, 1e-12])
def test_load_of_points_out_of_line(direct, ratio):
    """Three points on a rigid block, the middle one a little higher: it carries all, however little that is.

    While all three are pressed, rounds move load at a pace that goes with the ratio; their number must not go with its
    inverse.
    """
    problem = direct.pressed_block(3)
    problem.contact.target[1] = ratio
    # The pull along the floor is kept out: it would tilt the block.
    problem.body.twist[1, 0] = 0.0
    problem.contact.friction[:] = 0.0
    assert direct.solve(problem, 1e-3 * ratio, 100) <= 1e-3 * ratio
    assert problem.contact.best[:, 0] == pytest.approx([0.0, 1.0 + ratio, 0.0], abs=1e-12)
    assert problem.size[FACTORISATIONS] <= 15


def test_a_worse_answer_is_not_taken(direct):
    """Without a factorisation to spend nothing changes, and the residual is that of the start."""
    problem = direct.pressed_block(2)
    before = direct.solve(problem, SOLVED, 0)
    assert before > 0.1
    assert np.abs(problem.contact.best).max() == 0.0
    assert problem.size[FACTORISATIONS] == 0


@pytest.mark.parametrize("target", [-1e-3, 1e-3, 1.0])
@pytest.mark.parametrize("slide", [-5.0, 5.0])
@pytest.mark.parametrize("spin", [-3.0, 0.0, 3.0])
def test_answer_of_a_painleve_rod(direct, target, slide, spin):
    """A rod at 0.8 rad, mu = 2.5, beyond Painleve's threshold of 1.64: impulses have one or three answers there."""
    angle, mu = 0.8, 2.5
    jacobians = np.zeros((1, 2, 2, 3))
    jacobians[0, 1] = [[0.0, 1.0, -np.cos(angle)], [-1.0, 0.0, -np.sin(angle)]]
    jacobians[0, 0] = -jacobians[0, 1]
    masses = np.array([[1.0] * 3, [1.0, 1.0, 1.0 / 3.0]])
    twists = np.array([[0.0] * 3, [slide, 0.0, spin]])
    problem = direct.problem(2, [(0, 1)], jacobians, masses, twists, mu, target)
    w, q = direct.delassus(problem)
    solutions = coulomb_solutions(w, q, [mu])
    assert direct.solve(problem, SOLVED, 100) <= SOLVED
    velocity = w @ problem.contact.best[0, :2] + q
    assert min(np.abs(velocity - solution.velocity[0]).max() for solution in solutions) <= 1e-11


def test_state_after_a_fresh_start(direct):
    """From wrong impulses: the same velocities, and without a factorisation to spend those impulses stay the best."""
    twists = []
    for spoilt in (False, True):
        problem = direct.random(7, 5)
        if spoilt:
            contact, body = problem.contact, problem.body
            contact.impulse[:, :2] = [1.0, 0.1]
            for c in range(5):
                for side in range(2):
                    body.twist[contact.body[c, side]] += contact.impulse[c] @ contact.response[c, side]
            before = contact.impulse.copy()
            direct.solve(problem, SOLVED, 0, False)
            assert np.array_equal(contact.best, before)
        assert direct.solve(problem, SOLVED, 200, spoilt) <= SOLVED
        twists.append(problem.body.twist.copy())
    assert twists[0] == pytest.approx(twists[1], abs=1e-10)


def test_units_change_nothing_but_units(direct):
    """Lengths by 2^7, masses by 2^-5, times by 2^3: impulses by the same powers, to the last bit."""
    length, mass, time = 2.0**7, 2.0**-5, 2.0**3
    answers = []
    for scaled in (False, True):
        problem = direct.random(3, 6)
        if scaled:
            speed = length / time
            factor = np.array([1.0, 1.0, length])
            problem.contact.jacobian[..., :3] *= factor
            problem.contact.response[..., :3] /= mass * factor
            problem.contact.admittance[:] /= mass
            problem.contact.speed[:] *= speed
            problem.body.twist[:, :3] *= speed / factor
            problem.body.weight[:, :3] *= mass * factor**2
        assert direct.solve(problem, SOLVED, 500) <= SOLVED
        answers.append(problem.contact.best / (mass * length / time if scaled else 1.0))
    assert np.array_equal(*answers)
