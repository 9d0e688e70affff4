"""Reasons of PhysX that no setting switches off: figures that hold without the engine, and what it makes of them."""

import math
from functools import partial

import numpy as np
import pytest
from driven import driven, measured_of

from adapters.law.single_precision import ROUNDINGS, UNIT
from adapters.physx import PhysxEngine
from adapters.scene import Body, HalfSpace, Pair, Scene, Sphere
from adapters.stepping import run
from adapters.trajectory import Sampling
from validation.catalogue import CATALOGUE

pytestmark = pytest.mark.optional("physx")
ENGINE = PhysxEngine()
DT = 1.0 / 240.0
settings, _ = driven(ENGINE, "default")
measured = partial(measured_of, ENGINE)
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")


def pushed(solver, speed, spin, mu=0.2, steps=10):
    """Friction on a ball of radius .5 that slips on the floor, over Coulomb's, as a vector (2,)."""
    ball = Body("ball", Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0), (*speed, 0.0, *spin, 0.0))
    scene = Scene("slip", 1, 3, (FLOOR, ball), (Pair(friction=mu),), (0.0, 0.0, -9.81), (steps + 2) * DT)
    found = run(ENGINE, scene, DT, settings(scene, "pgs", solver=solver, angular_damping=0.0), Sampling(1, None))
    return (found.twist[-1, 1, :2] - found.twist[2, 1, :2]) / (mu * 9.81 * steps * DT)


def slip(speed, spin):
    """Velocity of the lowest point of that ball: v + w x (0, 0, -r)."""
    return np.array([speed[0] - 0.5 * spin[1], speed[1] + 0.5 * spin[0]])


@pytest.mark.parametrize(
    ("speed", "spin"), [((3.0, 0.0), (0.0, 0.0)), ((2.0, 2.0), (0.0, 0.0)), ((2.0, 0.0), (4.0, 0.0))]
)
def test_friction_cone_of_small_steps(speed, spin):
    along = slip(speed, spin) / np.linalg.norm(slip(speed, spin))
    assert pushed("tgs", speed, spin) == pytest.approx(-along, abs=2e-3)


def test_gauss_seidel_friction_pyramid_along_the_centre_s_path():
    """A way in any direction is braked by mu g; a slip of 45 degrees against the way by mu g along and across it.

    While it is braked its way turns a little, and the pyramid with it, for less than the half width of 3 degrees.
    """
    for way in (0.0, 0.4, math.pi / 4.0):
        speed = (3.0 * math.cos(way), 3.0 * math.sin(way))
        assert np.linalg.norm(pushed("pgs", speed, (0.0, 0.0))) == pytest.approx(1.0, abs=2e-3)
    askew = pushed("pgs", (2.0, 0.0), (4.0, 0.0))
    assert np.linalg.norm(askew) == pytest.approx(math.sqrt(2.0), abs=2e-3)
    assert abs(math.atan2(askew[1], askew[0]) + 0.75 * math.pi) < math.radians(3.0)
    still = pushed("pgs", (0.0, 0.0), (8.0, -8.0))  # without a way the slip is the direction
    assert still == pytest.approx(-np.array([1.0, 1.0]) / math.sqrt(2.0), abs=2e-3)


@pytest.mark.parametrize("changes", [{}, {"iterations": 255}, {"contact_offset": 1e-4}], ids=str)
def test_ladder_with_gauss_seidel_and_small_steps(changes):
    held = measured("ladder", "pgs", params={"ratio": 0.8}, **changes)
    slid = measured("ladder", "pgs", params={"ratio": 0.8}, solver="tgs", **changes)
    assert held["passing_time"] is None
    truth = CATALOGUE["ladder"].exact(CATALOGUE["ladder"].scene(2, {"ratio": 0.8}))
    assert slid["passing_time"] == pytest.approx(truth["passing_time"], rel=2e-3)


@pytest.mark.parametrize("params", [{}, {"closing": 0.1}], ids=str)
def test_rounded_speed_of_a_kinematic_plate(params):
    """Places between 1 and 2 are 2^-23 apart: two of them over a step, twice at each blow, and none without a plate."""
    found = measured("closing_wall", "tuned", params=params)
    truth = CATALOGUE["closing_wall"].exact(CATALOGUE["closing_wall"].scene(2, params))
    for blow in (1, 2, 3):
        off = abs(found[f"speed[{blow}]"] - truth[f"speed[{blow}]"])
        assert 1e-6 < off <= 2.0 * blow * 2.0 * UNIT * 2.0 / DT


def test_corners_of_a_flat_box_differ_by_roundings():
    """Impulses of 48 roundings each, and a spin whose edge is thrice as fast as what an impulse changes."""
    for params in ({}, {"e": 1.0}, {"aspect": 4.0, "e": 0.8}):
        scene = CATALOGUE["flat_box"].scene(2, params)
        found, least = measured("flat_box", "pgs", params=params), ROUNDINGS * UNIT * scene.params["v"]
        assert abs(found["rebound_ratio"] - scene.material("floor", "box").restitution) < least / scene.params["v"]
        assert found["edge_speed"] < 3.0 * least


@pytest.mark.parametrize("profile", ENGINE.profiles)
def test_directions_and_centres_differ_by_roundings(profile):
    """Of a way of 3 m/s, and of balls whose centres lie within a metre of the origin and whose blow moves both."""
    askew = measured("oblique", profile, 3, {"heading": 30.0, "mu": 0.1})["sideways"]
    assert 1e-9 < askew < ROUNDINGS * UNIT * 3.0
    for params in ({}, {"depth": 0.01, "ratio": 100.0}):
        assert 1e-9 < measured("overlap", profile, params=params)["centre_moved"] < ROUNDINGS * UNIT


def test_spin_loss_rolling_and_spinning_on_the_spot():
    for solver in ("tgs", "pgs"):
        assert measured("rolling_spin", "tuned", 3, solver=solver)["spin"] == pytest.approx(9.9, abs=0.01)
        spot = measured("rolling_spin", "tuned", 3, {"spin": 50.0, "v": 0.0}, solver=solver)["spin"]
        assert spot == pytest.approx(50.0, rel=1e-3)


@pytest.mark.parametrize("small_steps", [1, 2, 4, 10, 50])
def test_rebound_before_touch_within_one_small_step(small_steps):
    """A step's way of free fall is (v + g dt) dt; in one step, of Gauss-Seidel, only what touches is thrown back."""
    speed = 4.0
    way = (speed + 9.81 * DT) * DT

    def is_thrown_back(ahead, **changes):
        height = 0.5 + way * (1.0 + ahead)
        ball = Body(
            "ball", Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0), (0, 0, -speed, 0, 0, 0)
        )
        scene = Scene("ahead", 1, 3, (FLOOR, ball), (Pair(restitution=0.8, friction=0.0),), (0.0, 0.0, -9.81), DT)
        chosen = settings(scene, "default", iterations=small_steps, contact_offset=0.1, **changes)
        return bool(run(ENGINE, scene, DT, chosen, Sampling(1, None)).twist[-1, 1, 2] > 0.0)

    found = [is_thrown_back(ahead / small_steps) for ahead in (-0.1, 0.9, 1.1)]
    assert found == [True, True, False] and not is_thrown_back(0.1, solver="pgs")
