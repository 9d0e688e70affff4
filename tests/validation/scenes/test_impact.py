"""A ball against a floor: built as it is described, and every number read from a motion that is written by hand."""

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.scene import Disc, Pair, Sphere
from adapters.trajectory import ContactRecord, Trajectory
from validation.catalogue import CATALOGUE
from validation.scenes import impact

DT = 1 / 64
PARAMS = {"e": 0.5, "v": 4.0, "delay": 0.25, "mu": 0.125, "mass": 2.0, "radius": 0.75}


def scene_of(dimension=2, **params):
    return CATALOGUE["impact"].scene(dimension, PARAMS | params)


@pytest.mark.parametrize("dimension", [2, 3])
def test_delay_of_a_blow_without_gravity(dimension):
    scene = scene_of(dimension)
    floor, ball = scene.bodies
    assert (scene.name, scene.version, scene.dimension) == ("impact", 1, dimension)
    assert scene.gravity == (0.0,) * dimension and scene.duration == pytest.approx(0.25 + 0.45)
    assert scene.pairs == (Pair(restitution=0.5, friction=0.125),)
    assert floor.motion == "fixed" and floor.shape.offset == 0.0
    assert (ball.name, ball.mass, ball.shape) == ("ball", 2.0, Disc(0.75) if dimension == 2 else Sphere(0.75))
    gap, speed = ball.pose[dimension - 1] - 0.75, ball.twist[dimension - 1]
    assert (gap, speed) == (1.0, -4.0) and gap / -speed == 0.25
    assert not any(ball.twist[: dimension - 1]) and not any(ball.twist[dimension:])


def run(scene, after, impulses, recorded=True):
    """Falls at v, leaves with ``after``; impulses on the ball from the floor, and some from elsewhere."""
    d, steps = scene.dimension, 40
    pose = np.array([[body.pose for body in scene.bodies]] * (steps + 1))
    twist = np.array([[[0.0] * len(scene.bodies[1].twist), scene.bodies[1].twist]] * (steps + 1))
    twist[-1, 1, d - 1] = after
    twist[-1, 1, 0] = 0.25  # across: of no concern
    flat = np.zeros((len(impulses), d))
    flat[:, d - 1], flat[:, 0] = impulses, 0.5
    a = np.zeros(len(impulses), dtype=int)
    rows = Contacts(a, a + 1, np.zeros_like(flat), np.zeros_like(flat), flat, np.zeros(len(a)))
    starts = np.minimum(np.arange(steps + 2), len(impulses))
    record = ContactRecord(np.arange(steps + 1), starts, rows) if recorded else None
    return Trajectory(np.arange(steps + 1) * DT, pose, twist, record, DT, "completed")


@pytest.mark.parametrize("dimension", [2, 3])
def test_numbers_of_the_end_and_of_the_contact(dimension):
    scene = scene_of(dimension)
    measured = impact.measure(scene, run(scene, 2.0, [7.0, 5.0]))
    assert measured == {
        "rebound_ratio": (0.5, ""), "rebound_speed": (2.0, ""), "velocity_change": (6.0, ""),
        "impulse": (12.0, ""), "momentum_defect": (0.0, ""),
    }  # fmt: skip
    assert {name: value for name, (value, _) in measured.items()} == impact.exact(scene)


@pytest.mark.parametrize(("impulses", "defect"), [([10.0], 0.25), ([7.0, 7.0], 0.25), ([], 1.5)])
def test_momentum_defect_without_an_impulse(impulses, defect):
    scene = scene_of()
    measured = impact.measure(scene, run(scene, 2.0, impulses))
    assert measured["impulse"] == (sum(impulses), "") and measured["momentum_defect"] == (defect, "")


def test_missing_values_without_impulses_and_their_reasons():
    scene = scene_of()
    measured = impact.measure(scene, run(scene, -1.0, [1.0], recorded=False))
    assert measured["rebound_ratio"] == (-0.25, "") and measured["velocity_change"] == (3.0, "")
    assert measured["impulse"] == measured["momentum_defect"] == (None, "contacts were not recorded")


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_track_goes_straight_in_and_straight_out(dimension):
    track = impact.track(scene_of(dimension))
    across = (0.0,) * (dimension - 1)
    assert track.body == "ball"
    assert [track.position(t) for t in (0.0, 0.125, 0.25, 0.75)] == [(*across, z) for z in (1.75, 1.25, 0.75, 1.75)]


def test_impact_error_as_distance_from_e_or_a_reason():
    scene = scene_of()
    assert impact.rebound_error(scene, DT, {"rebound_ratio": (0.25, "")}) == (0.25, "")
    assert impact.rebound_error(scene, DT, {"rebound_ratio": (None, "it never came")}) == (None, "it never came")
