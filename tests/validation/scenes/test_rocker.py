"""A board on a log: its swing against integrated motion with forces, and what loses or adds energy, slips or yaws."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def place_of(p, theta):
    """Centre of a board that has rolled by theta from level, contact at its middle there."""
    r, h = p["radius"], 0.5 * p["thickness"]
    across, along = np.array([-np.sin(theta), np.cos(theta)]), np.array([np.cos(theta), np.sin(theta)])
    return (r + h) * across + r * theta * along


def integrated(scene, dt=DT, drag=0.0, g=None, slip=0.0, heavy=1.0):
    """Newton's and Euler's laws with the two contact forces as unknowns of a linear system, DOP853.

    The constraint is differenced from `place_of`, twice: nothing here knows Lagrange's equation.
    """
    p, h = scene.params, 1e-4
    g = p["g"] if g is None else g
    own = heavy * (p["length"] ** 2 + p["thickness"] ** 2) / 12.0

    def rates(t, y):
        theta, spin = y
        before, here, after = (place_of(p, theta + k * h) for k in (-1, 0, 1))
        first, second = (after - before) / (2.0 * h), (after - 2.0 * here + before) / h**2
        arm = p["radius"] * np.array([-math.sin(theta), math.cos(theta)]) - here
        # Unknown: spin', and the force (over the mass) at the contact. Centre: first spin' + second spin^2 = F - g.
        system = np.array([[first[0], -1.0, 0.0], [first[1], 0.0, -1.0], [own, arm[1], -arm[0]]])
        turn = np.linalg.solve(system, [-second[0] * spin**2, -second[1] * spin**2 - g, 0.0])[0]
        return [spin, turn - drag * spin]

    times = np.arange(round(scene.duration / dt) + 1) * dt
    theta, spin = solve_ivp(
        rates, (0.0, times[-1]), [math.radians(p["tilt"]), 0.0], "DOP853", t_eval=times, rtol=1e-9, atol=1e-10
    ).y
    place = place_of(p, theta).T
    place = place + slip * np.linspace(0.0, 1.0, len(times))[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])
    n, d = len(times), scene.dimension
    pose, twist = still(scene, n)
    if d == 2:
        pose[:, 1] = np.column_stack([place, theta])
        twist[:, 1, 2] = spin
    else:
        zero = np.zeros(n)
        pose[:, 1, [0, 2]] = place
        pose[:, 1, 3:] = np.column_stack([np.cos(theta / 2), zero, -np.sin(theta / 2), zero])
        twist[:, 1, 4] = -spin
    return Trajectory(times, pose, twist, None, dt, "completed")


@pytest.mark.parametrize(
    ("dimension", "params"),
    [(2, {}), (3, {}), (2, {"tilt": 2.0}), (2, {"thickness": 0.4}), (2, {"tilt": 30.0, "mu": 2.0})],
)
def test_board_by_forces_at_its_contact(dimension, params):
    canonical, scene = made("rocker", dimension, **params)
    trajectory = integrated(scene)
    measured, truth = canonical.measure(scene, trajectory), canonical.exact(scene)
    assert measured["swing_time"][0] == pytest.approx(truth["swing_time"], rel=1e-6)
    # The top is told by a sample.
    assert measured["amplitude"][0] == pytest.approx(1.0, abs=2e-4)
    assert measured["slip"][0] == pytest.approx(0.0, abs=1e-12)
    assert failing(canonical, scene, trajectory) == set()


def test_small_swings_have_the_period_of_the_formula():
    _, scene = made("rocker", tilt=0.1)
    h, r, square = 0.05, 0.5, (4.0 + 0.01) / 12.0
    rate = math.sqrt(9.81 * (r - h) / (h * h + square))
    assert CATALOGUE["rocker"].exact(scene)["swing_time"] == pytest.approx(math.pi / rate, rel=1e-5)


@pytest.mark.parametrize("size", SIZES)
def test_rocker_with_wrong_gravity_inertia_drag_slip_or_yaw(size):
    canonical, scene = made("rocker", 3)
    dt = DT if size > 0.05 else 1 / 960
    assert size < 0.05 or "swing_time" in failing(canonical, scene, integrated(scene, dt, g=9.81 * (1.0 - size)))
    assert size < 0.05 or "swing_time" in failing(canonical, scene, integrated(scene, dt, heavy=1.0 + size))
    assert size < 0.005 or "amplitude" in failing(canonical, scene, integrated(scene, dt, drag=size))
    slipping = failing(canonical, scene, integrated(scene, 1 / 960, slip=2.0 * size))
    assert slipping == {"slip"}
    yawing = integrated(scene)
    yawing.twist[7, 1, 5] = size
    assert failing(canonical, scene, yawing) == {"yaw"}


@pytest.mark.parametrize(
    ("params", "named"),
    [({"thickness": 1.1}, "radius"), ({"tilt": 60.0, "length": 1.0, "mu": 9.0}, "tilt"), ({"mu": 0.1}, "mu")],
)
def test_boards_that_fall_off_or_slip_are_refused(params, named):
    with pytest.raises(SceneError, match=rf"rocker\.{named}"):
        made("rocker", **params)


def test_resting_board_without_swings():
    canonical, scene = made("rocker")
    still = integrated(scene)
    still = replace(still, pose=np.repeat(still.pose[:1], len(still.t), axis=0), twist=0.0 * still.twist)
    assert canonical.measure(scene, still)["swing_time"] == (None, "it never arrives there")
