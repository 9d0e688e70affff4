"""A block on a wedge that gives way: Lagrange's equations integrated, planted faults of three sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still

from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.files.mass_properties import moments
from validation.scenes.wedge import FACE, motion

DT = 1 / 240
SIZES = (0.1, 0.01, 0.001)


def accelerations(p):
    """Of the wedge (X) and of the block along the face (s), from Lagrange's equations with the load as multiplier.

    Unknowns X, s and N:
    M X = -N sin + mu N cos,  m (X + s cos) = N sin - mu N cos,  m (-s sin) = N cos + mu N sin - m g.
    """
    a, m, mu, g = math.radians(p["slope"]), p["mass"], p["mu"], p["g"]
    c, s, heavy = math.cos(a), math.sin(a), p["ratio"] * p["mass"]
    found = np.linalg.solve(
        [[heavy, 0.0, s - mu * c], [m, m * c, mu * c - s], [0.0, -m * s, -c - mu * s]], [0.0, 0.0, -m * g]
    )
    return found[0], found[1], found[2]


def slid(scene, dt=DT, order=0.0, wedge=1.0, block=1.0):
    """Both bodies from rest under accelerations that are ``wedge`` and ``block`` times the true ones."""
    p = scene.params
    a = math.radians(p["slope"])
    push, pull, _ = accelerations(p)
    t = np.arange(round(scene.duration / dt) + 1) * dt
    pose, twist = still(scene, len(t))
    for k, rate in (
        (1, np.array([wedge * push, 0.0])),
        (2, np.array([wedge * push + block * pull * math.cos(a), -block * pull * math.sin(a)])),
    ):
        twist[:, k, :2] = np.outer(t, rate)
        pose[:, k, :2] += np.outer(0.5 * t * t + order * dt * t, rate)
    return Trajectory(t, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("params", [{}, {"mu": 0.0}, {"ratio": 0.5}, {"slope": 50.0, "mu": 0.1}, {"ratio": 100.0}])
@pytest.mark.parametrize("order", [-0.5, 0.0, 0.5])
def test_lagrange_s_equations_pass_in_every_step_order(params, order):
    canonical, scene = made("wedge", **params)
    trajectory = slid(scene, order=order)
    assert failing(canonical, scene, trajectory) == set()
    push, pull, load = accelerations(scene.params)
    assert motion(scene.params) == pytest.approx((-push, pull, load), rel=1e-13)
    end = trajectory.t[-1]
    assert canonical.track(scene).position(end) == pytest.approx(
        trajectory.pose[-1, 2, :2] - order * DT * trajectory.twist[-1, 2, :2], abs=1e-12
    )


def test_wedge_without_friction_by_the_textbook():
    p = CATALOGUE["wedge"].complete({"mu": 0.0})
    c, s = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    away, pull, load = motion(p)
    assert away == pytest.approx(9.81 * s * c / (2.0 + s * s)) and load == pytest.approx(2.0 * 9.81 * c / (2.0 + s * s))
    assert pull == pytest.approx(9.81 * s * 3.0 / (2.0 + s * s))


def test_wedge_at_rest_from_the_angle_of_friction():
    tan = math.tan(math.radians(30.0))
    assert motion(CATALOGUE["wedge"].complete({"mu": tan * 1.0001}))[:2] == (0.0, 0.0)
    slow = motion(CATALOGUE["wedge"].complete({"mu": tan * 0.9999, "ratio": 1e6}))[1]
    assert slow == pytest.approx(9.81 * 1e-4 * 0.5, rel=1e-4)


@pytest.mark.parametrize("size", SIZES)
def test_wedge_or_block_with_a_wrong_motion(size):
    canonical, scene = made("wedge")
    assert {"given_way", "momentum"} <= failing(canonical, scene, slid(scene, wedge=1.0 - size))
    assert {"acceleration", "momentum"} <= failing(canonical, scene, slid(scene, block=1.0 + size))
    for axis, k in ((1, 1), (1, 2), (0, 2)):
        gone = slid(scene)
        gone.pose[-1, k, axis] += size
        assert failing(canonical, scene, gone) == {"off_the_face"}
    raised = slid(scene)
    raised.pose[-1, 1:, 1] += size
    assert failing(canonical, scene, raised) == {"off_the_face"}
    for k in (1, 2):
        turned = slid(scene)
        turned.pose[-1, k, 2] += 10.0 * size
        assert failing(canonical, scene, turned) == {"turned"}
    drawn = slid(scene)
    drawn.twist[:, 1:, 0] += 1e-6 * size
    assert failing(canonical, scene, drawn) == {"momentum"}


def test_wedge_held_in_place_fails():
    canonical, scene = made("wedge")
    assert {"given_way", "momentum"} <= failing(canonical, scene, slid(scene, wedge=0.0))


@pytest.mark.parametrize("size", SIZES)
def test_resting_wedge_that_moves_or_turns_fails(size):
    canonical, scene = made("wedge", mu=0.7)
    still = slid(scene, wedge=0.0, block=0.0)
    assert failing(canonical, scene, still) == set()
    for k in (1, 2):
        for axis in (0, 1, 2):
            moved = still.pose.copy()
            moved[-1, k, axis] += 5.0 * size
            assert failing(canonical, scene, replace(still, pose=moved)) == {"moved"}


def test_shapes_of_the_wedge_and_its_block():
    _, scene = made("wedge", slope=40.0)
    _, wedge, block = scene.bodies
    a = math.radians(40.0)
    assert wedge.inertia == pytest.approx(moments(wedge.shape, wedge.mass, 2))
    assert pytest.approx(math.dist(*wedge.shape.vertices[1:])) == FACE
    top = np.array(wedge.pose[:2]) + wedge.shape.vertices[2]
    arm = np.array(block.pose[:2]) - top
    assert arm @ [math.sin(a), math.cos(a)] == pytest.approx(0.5 * 0.3)
    assert arm @ [math.cos(a), -math.sin(a)] == pytest.approx(0.1 + 0.2)


@pytest.mark.parametrize("params", [{"slope": 60.0, "ratio": 0.01}, {"slope": 60.0, "mu": 1.5}])
def test_tipping_block_refused_by_name(params):
    with pytest.raises(ValueError, match=r"wedge\.ratio"):
        made("wedge", **params)
