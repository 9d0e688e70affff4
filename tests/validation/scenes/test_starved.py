"""A pressed row: sweeps over its contacts leave what the scene says they leave; faults of sizes fail."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import carried, failing, made

from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.cells import Outcome, Slot
from validation.running.execution import execute
from validation.scenes import starved

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def sweep(impulse, v, mass, closed):
    """One sweep over the contacts from the wall outwards: each impulse is what stops its own approach, or nothing."""
    for k in np.flatnonzero(closed):
        below = v[k - 1] if k else 0.0
        soft = 1.0 / mass + (1.0 / mass if k else 0.0)
        new = max(0.0, impulse[k] + (below - v[k]) / soft)
        change, impulse[k] = new - impulse[k], new
        v[k] += change / mass
        if k:
            v[k - 1] -= change / mass


def swept(scene, sweeps, dt=DT, warm=True):
    """Sequential impulses along the row: ``sweeps`` a step, from the last step's impulses, nothing pushed out."""
    p, n = scene.params, len(scene.bodies) - 1
    x = np.array([body.pose[0] for body in scene.bodies[1:]])
    v, impulse, gap = np.zeros(n), np.zeros(n), np.zeros(n)
    places, speeds, impulses = [x], [v.copy()], [impulse.copy()]
    for _ in range(round(scene.duration / dt)):
        v[-1] -= p["press"] / p["mass"] * dt
        closed = gap <= 0.0
        impulse[~closed] = 0.0
        if warm:
            v += (impulse - np.append(impulse[1:], 0.0)) / p["mass"]
        else:
            impulse[:] = 0.0
        for _ in range(sweeps):
            sweep(impulse, v, p["mass"], closed)
        x = x + v * dt
        gap = np.diff(np.append(-starved.RADIUS, x)) - 2.0 * starved.RADIUS
        for kept, now in ((places, x), (speeds, v), (impulses, impulse)):
            kept.append(now.copy())
    return recorded(scene, np.array(places), np.array(speeds), np.array(impulses), dt)


def recorded(scene, places, speeds, impulses, dt=DT):
    steps, n = len(places), len(scene.bodies) - 1
    pose, twist = np.zeros((steps, n + 1, 3)), np.zeros((steps, n + 1, 3))
    pose[:, 1:, 0], twist[:, 1:, 0] = places, speeds
    contacts = carried([(k, k + 1) for k in range(n)], np.stack([impulses, np.zeros((steps, n))], axis=2))
    return Trajectory(np.arange(steps) * dt, pose, twist, contacts, dt, "completed")


def resting(scene, share=1.0, dt=DT):
    steps, n = round(scene.duration / dt) + 1, len(scene.bodies) - 1
    places = np.tile([body.pose[0] for body in scene.bodies[1:]], (steps, 1))
    return recorded(scene, places, np.zeros((steps, n)), np.full((steps, n), share * scene.params["press"] * dt), dt)


@pytest.mark.parametrize("n", [3, 10, 30])
def test_residual_of_a_sweep_by_the_stated_factor(n):
    """One step of a row, swept for long: what a sweep leaves over what the one before left tends to cos^2(pi/2n)."""
    v, impulse, left = np.zeros(n), np.zeros(n), []
    v[-1] = -1.0
    for _ in range(5 * n * n // 2):
        sweep(impulse, v, 1.0, np.ones(n, bool))
        left.append(np.abs(impulse - 1.0).max())  # solved, each contact passes all of it on
    assert left[-1] / left[-2] == pytest.approx(math.cos(0.5 * math.pi / n) ** 2, rel=1e-3)


@pytest.mark.parametrize(("n", "dt"), [(1, DT), (3, 1 / 60), (5, DT)])
def test_fully_solved_row_passes(n, dt):
    canonical, scene = made("starved", n=float(n))
    assert failing(canonical, scene, resting(scene, dt=dt)) == set()
    assert failing(canonical, scene, swept(replace(scene, duration=1.0), 20 * n, dt)) == set()


@pytest.mark.parametrize(("sweeps", "warm"), [(1, True), (1, False), (2, False), (4, False), (10, False)])
def test_displacement_of_a_row_with_too_few_iterations(sweeps, warm):
    """Impulses of the step before are half of the answer: who throws them away starves with ten sweeps."""
    canonical, scene = made("starved")
    found = failing(canonical, scene, swept(scene, sweeps, warm=warm))
    assert {"displacement", "penetration"} <= found


def test_error_of_ten_balls_after_forty_sweeps():
    assert math.cos(0.5 * math.pi / 10) ** (2 * 40) == pytest.approx(math.exp(-1.0), rel=0.02)


@pytest.mark.parametrize("dt", [1 / 60, DT])
def test_starved_contacts_one_step_late_and_two_steps_late(dt):
    """The press acts for one step on a ball that nothing holds; for two it goes 3 g dt^2 deep."""
    canonical, scene = made("starved")
    fallen = scene.params["press"] / scene.params["mass"] * dt * dt
    late, later = resting(scene, dt=dt), resting(scene, dt=dt)
    late.pose[1:, -1, 0] -= fallen
    later.pose[1:, -1, 0] -= 3.0 * fallen
    assert failing(canonical, scene, late) == set()
    assert failing(canonical, scene, later) == {"penetration"}


@pytest.mark.parametrize("size", SIZES)
def test_faults_of_three_sizes_fail(size):
    canonical, scene = made("starved")
    allowed = {check.metric: check.bound for check in canonical.checks(scene, DT)}
    for share in (1.0 - size, 1.0 + size):
        assert failing(canonical, scene, resting(scene, share)) == {"load_error"}
    aside = resting(scene)
    aside.pose[5, 3:, 0] += allowed["displacement"] * (1.0 + size)  # apart, so that nothing overlaps
    assert failing(canonical, scene, aside) == {"displacement"}
    deep = resting(scene)
    deep.pose[5, -1, 0] -= allowed["penetration"] * (1.0 + size)
    assert failing(canonical, scene, deep) == {"penetration"}
    moving = resting(scene)
    moving.twist[:, 2, 1] = math.sqrt(2.0 * allowed["kinetic_energy"] * (1.0 + size))
    assert failing(canonical, scene, moving) == {"kinetic_energy"}


def test_one_contact_without_load_and_missing_values():
    canonical, scene = made("starved")
    trajectory = resting(scene)
    trajectory.contacts.rows.impulse[3 :: len(scene.bodies) - 1] = 0.0
    assert canonical.measure(scene, trajectory)["load_error"] == (1.0, "")
    value, reason = canonical.measure(scene, replace(trajectory, contacts=None))["load_error"]
    assert value is None and reason


def test_a_row_gave_way_or_held():
    _, scene = made("starved")
    assert starved.fate(scene, {"displacement": (0.09, ""), "penetration": (0.0, "")}) == ""
    assert starved.fate(scene, {"displacement": (0.11, ""), "penetration": (0.0, "")}) == "gave way"
    assert starved.fate(scene, {"displacement": (0.0, ""), "penetration": (0.11, "")}) == "gave way"
    assert starved.fate(scene, {"displacement": (None, "no"), "penetration": (0.0, "")}) == "NaN"


@pytest.mark.few(6)
@pytest.mark.parametrize("rate", [60, 120, 240, 480, 960])
@pytest.mark.parametrize("n", [*range(1, 11), 15, 20, 30])
def test_certificate_of_a_row_pressed_at_its_last_ball(n, rate):
    params = CATALOGUE["starved"].minimal({"n": float(n), "duration": 1.0})
    observation = execute(Slot("starved", params, 2, "reference", "reference", 1.0 / rate))
    assert observation.outcome is Outcome.OK, observation.reason
