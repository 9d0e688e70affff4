"""The solvers against each other, against theory, and against an independent solution."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Settings
from reference_solver.compilation import from_python
from reference_solver.textbook2 import pair_modes
from reference_solver.textbook2.pair_modes import IMPULSE, LOCAL_COLUMNS, LOCAL_ROWS, VELOCITY

G = 9.81


def leaning(build):
    """A box with another on it, a disc and a wall: sticking and sliding rows, one load path, unique impulses."""
    return [
        build.floor(),
        build.box(0.0, 0.5, (0.8, 0.0, 0.0)),
        build.box(-0.1, 1.5),
        build.disc(1.0, 0.5, (0.0, 0.0, 1.0)),
        build.box(1.6, 0.6, half=(0.1, 0.6), motion="fixed"),
    ]


def test_converged_answer_with_warm_starting(build, fixed_step):
    results = []
    for warm in (True, False):
        simulation = build.simulation(leaning(build), replace(fixed_step, warm_starting=warm), (0.0, -G), 0.0, 0.3)
        simulation.advance(60)
        assert simulation.certificate["converged"]
        results.append(simulation)
    # Each of 60 steps may leave 1e-13 of its impulses.
    assert results[0].twist == pytest.approx(results[1].twist, abs=1e-11)
    assert results[0].pose == pytest.approx(results[1].pose, abs=1e-11)
    efforts = [result.certificate["sweeps"] + result.certificate["factorisations"] for result in results]
    assert efforts[0] < efforts[1]


def test_answer_of_scalar_rows_and_blocks(build, fixed_step):
    twists = []
    for solver in ("scalar", "block"):
        settings = replace(fixed_step, solver=solver, relaxation=1.0)
        simulation = build.simulation(leaning(build), settings, (0.0, -G), 0.0, 0.3)
        simulation.advance(30)
        assert simulation.certificate["converged"]
        twists.append(simulation.twist)
    # Scalar rows contract slowly: a residual of 1e-13 leaves some 1e-11.
    assert twists[0] == pytest.approx(twists[1], abs=1e-9)


def test_error_by_its_residual(build):
    """Stopping earlier leaves a larger error, and none larger than the condition of the column allows."""
    n, errors = 10, []
    for residual in (1e-4, 1e-7, 1e-10, 1e-13):
        simulation = build.column(n, replace(Settings.fixed_step(build.dt), residual=residual))
        simulation.advance(1)
        assert simulation.certificate["residual"] <= residual
        contacts = simulation.contacts()
        pressed = np.bincount(contacts.body_b - 1, contacts.impulse[:, 1])
        errors.append(np.abs(pressed / (G * build.dt * np.arange(n, 0, -1)) - 1.0).max())
        # 1 / (1 - cos^2(pi / 2n)) = 0.4 n^2 steps of the residual's size; 4 for the norm.
        assert errors[-1] <= 4.0 * 0.4 * n * n * residual
    assert errors == sorted(errors, reverse=True)


def test_an_unreached_residual_is_reported(build):
    simulation = build.column(10, replace(Settings.fixed_step(build.dt), max_sweeps=5))
    simulation.advance(3)
    certificate = simulation.certificate
    assert certificate["converged"] is False
    assert certificate["residual"] > 1e-6
    assert certificate["worst_sweeps"] == 5
    assert certificate["sweeps"] == 15


def test_fixed_number_of_sweeps(build):
    simulation = build.column(3, Settings.classical(build.dt, 7))
    simulation.advance(11)
    assert simulation.certificate["sweeps"] == 77
    assert simulation.certificate["converged"] is True


def test_answer_by_relaxation(build, fixed_step):
    answers = []
    for relaxation in (1.0, 1.5, 1.8, None):
        simulation = build.column(6, replace(fixed_step, relaxation=relaxation))
        simulation.advance(1)
        answers.append(simulation.contacts().impulse[:, 1])
    for answer in answers[1:]:
        assert answer == pytest.approx(answers[0], rel=1e-10)


def velocities_of_one_block(build, settings, box, friction, restitution):
    simulation = build.simulation([build.floor(), box], settings, (0.0, -G), restitution, friction)
    before = simulation.twist
    simulation.advance(1)
    return simulation, before


@pytest.mark.parametrize("seed", range(40))
def test_contact_problem_of_a_two_point_block(build, fixed_step, seed):
    """Random flat impacts of a box: signs, cone, complementarity and maximal dissipation, checked from outside."""
    rng = np.random.default_rng(seed)
    half = (rng.uniform(0.2, 1.0), rng.uniform(0.2, 1.0))
    mu, e = rng.uniform(0.0, 1.0), rng.choice([0.0, 0.5])
    box = build.box(0.0, half[1] - 1e-4, tuple(rng.normal(size=3) * [2.0, 1.0, 3.0]), half=half)
    simulation, before = velocities_of_one_block(build, fixed_step, box, mu, e)
    contacts, after = simulation.contacts(), simulation.twist[1]
    assert simulation.certificate["converged"]
    arms = contacts.point - simulation.model.bodies[1].pose[:2]
    for c, arm in enumerate(arms):
        speed = np.array([after[0] - after[2] * arm[1], after[1] + after[2] * arm[0]])
        approach = before[1, 1] + before[1, 2] * arm[0]
        target = -e * approach if approach < 0.0 else 0.0
        tangent, normal = contacts.impulse[c]
        scale = 1e-11
        assert normal >= 0.0
        assert speed[1] - target >= -scale
        assert normal * (speed[1] - target) <= scale
        assert abs(tangent) <= mu * normal + scale
        # Sliding: friction at its bound and against the slip.
        assert abs(speed[0]) <= scale or tangent == pytest.approx(-math.copysign(mu * normal, speed[0]), abs=scale)


def test_block_modes_against_enumeration_of_sixteen(build, fixed_step):
    """An independent least-squares enumeration of open, stick, slip+, slip- at both points finds the same motion."""
    found_modes = set()
    for seed in range(30):
        rng = np.random.default_rng(100 + seed)
        half, mu = (rng.uniform(0.2, 1.0), rng.uniform(0.2, 1.0)), rng.uniform(0.1, 0.9)
        box = build.box(0.0, half[1], tuple(rng.normal(size=3) * [1.5, 1.0, 3.0]), half=half)
        simulation, before = velocities_of_one_block(build, fixed_step, box, mu, 0.0)
        free = before[1] + build.dt * np.array([0.0, -G, 0.0])
        rows = []
        for x in (-half[0], half[0]):
            rows += [[0.0, 1.0, x], [1.0, 0.0, half[1]]]
        jacobian = np.array(rows)
        inverse_mass = np.diag([1.0, 1.0, 1.0 / box.inertia])
        w, q = jacobian @ inverse_mass @ jacobian.T, jacobian @ free
        solutions = []
        for modes in itertools.product(("open", "stick", "+", "-"), repeat=2):
            p = solve_mode(w, q, mu, modes)
            if p is not None:
                solutions.append(free + inverse_mass @ jacobian.T @ p)
                found_modes.add(modes)
        assert any(np.allclose(simulation.twist[1], s, atol=1e-10) for s in solutions), seed
    assert len(found_modes) >= 5


def solve_mode(w, q, mu, modes):
    """Impulses (n1, t1, n2, t2) of one mode, or None if they break an inequality."""
    equations, right = [], []
    for point, mode in enumerate(modes):
        n, t = 2 * point, 2 * point + 1
        unit = np.eye(4)
        if mode == "open":
            equations += [unit[n], unit[t]]
            right += [0.0, 0.0]
        else:
            way = {"stick": 0.0, "+": 1.0, "-": -1.0}[mode]
            equations += [w[n], w[t] if mode == "stick" else unit[t] + way * mu * unit[n]]
            right += [-q[n], -q[t] if mode == "stick" else 0.0]
    p = np.linalg.lstsq(np.array(equations), np.array(right), rcond=1e-12)[0]
    u = q + w @ p
    for point, mode in enumerate(modes):
        n, t = 2 * point, 2 * point + 1
        way = {"+": 1.0, "-": -1.0}.get(mode, 0.0)
        fine = p[n] >= -1e-12 and u[n] >= -1e-12 and abs(p[t]) <= mu * p[n] + 1e-9 and way * u[t] >= -1e-12
        if not fine or (mode != "open" and abs(u[n]) > 1e-9) or (mode == "stick" and abs(u[t]) > 1e-9):
            return None
    return p


def test_friction_shared_by_two_sticking_points_of_a_face():
    """A box of 1 kg over a floor, off its middle: J^T p takes all its velocity, p_n by moments about either point."""
    solve, local = from_python(pair_modes.solve_modes), np.zeros((LOCAL_ROWS, LOCAL_COLUMNS))
    left, right, height, moment = 0.2, 0.5, 0.4, 0.13
    rows = np.array([[0.0, 1.0, -left], [1.0, 0.0, height], [0.0, 1.0, right], [1.0, 0.0, height]])
    w = rows @ np.diag((1.0, 1.0, 1.0 / moment)) @ rows.T
    mu, falls, slides = (0.6, 0.9), 2.0, 0.3
    velocity = np.array([-slides, -falls, 0.0])
    local[VELOCITY, :4] = rows @ velocity
    assert solve(w, local, *mu)
    impulse = local[IMPULSE, :4]
    first = (falls * right + slides * height) / (left + right)
    assert impulse[[0, 2]] == pytest.approx([first, falls - first], rel=1e-13)
    may = np.array(mu) * impulse[[0, 2]]
    assert impulse[[1, 3]] == pytest.approx(slides * may / may.sum(), rel=1e-13)
    assert np.abs(local[VELOCITY, :4]).max() < 1e-15 * falls / moment
