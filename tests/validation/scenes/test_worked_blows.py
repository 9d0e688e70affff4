"""Balls inside each other and between closing walls, worked out by hand: start, what is forgiven, numbers, ghost."""

from dataclasses import replace

import numpy as np
import pytest
from planted import made, stated

from adapters.trajectory import Trajectory

DT = 1 / 64


def near(value):
    """Near enough to tell one round-off of 1e-12 from another beside what is of a step."""
    return pytest.approx(value, rel=1e-13)


def still(scene, steps, dt=DT):
    """A record in which nothing happens, to be written into."""
    t = np.arange(steps + 1) * dt
    pose = np.array([[body.pose for body in scene.bodies]] * len(t))
    twist = np.array([[body.twist for body in scene.bodies]] * len(t))
    return Trajectory(t, pose, twist, None, dt, "completed")


# ---- two balls inside each other ----

#: Radii of 1/2 m, 1/4 m inside each other, 3 and 12 kg, 1/2 s at 2 m/s.
INSIDE = {"depth": 0.5, "ratio": 4.0, "v": 2.0, "mass": 3.0, "duration": 0.5}


@pytest.mark.parametrize("dimension", [2, 3])
def test_start_of_two_overlapping_balls(dimension):
    _, scene = made("overlap", dimension, **INSIDE)
    first, second = scene.bodies
    assert (scene.name, scene.version, scene.duration, scene.gravity) == ("overlap", 1, 0.5, (0.0,) * dimension)
    assert (first.name, first.mass, second.name, second.mass) == ("first", 3.0, "second", 12.0)
    assert first.shape.radius == second.shape.radius == 0.5
    assert first.inertia == (0.375 if dimension == 2 else (pytest.approx(0.3),) * 3)
    assert first.pose[:dimension] == (0.0,) * dimension and second.pose[0] == 0.75 and not any(second.pose[1:dimension])
    ahead = (*(0.0,) * (dimension - 1), 2.0)
    assert first.twist[:dimension] == second.twist[:dimension] == ahead
    assert not any(first.twist[dimension:]) and not any(second.twist[dimension:])
    assert (scene.pairs[0].restitution, scene.pairs[0].friction) == (0.0, 0.0)


def test_round_off_of_an_overlap_removed_in_a_step():
    """1/4 m in 1/64 s are 16 m/s, beside 2 m/s; places reach 1/2 m and the 1 m of the way."""
    canonical, scene = made("overlap", **INSIDE)
    assert stated(canonical.checks(scene, DT)) == {
        "thrown": ("m/s", near(18e-12)),
        "centre_moved": ("m", near(1.5e-12)),
        "grown": ("m", near(1.5e-12)),
        "left": ("1", None),
    }
    assert {check.metric: check.truth for check in canonical.checks(scene, DT)} == {
        "thrown": 0.0, "centre_moved": 0.0, "grown": 0.0, "left": None,
    }  # fmt: skip


@pytest.mark.parametrize("dimension", [2, 3])
def test_measures_of_an_overlap(dimension):
    """One ball is pushed 0.1 m in, then both out again: the common centre of 3 and 12 kg follows."""
    canonical, scene = made("overlap", dimension, **INSIDE)
    record = still(scene, 4)
    record.pose[1:, 1, 0] = (0.65, 0.85, 0.95, 0.875)
    record.twist[2, 1, :dimension] += (0.3,) + (0.0,) * (dimension - 2) + (0.4,)
    record.twist[3, 0, 0] = 0.1
    record.twist[2, :, dimension:] = 9.0  # spin is no speed of places
    assert canonical.measure(scene, record) == {
        "thrown": (pytest.approx(0.5), ""),
        "centre_moved": (pytest.approx(0.8 * 0.2), ""),
        "grown": (pytest.approx(0.1), ""),
        "left": (pytest.approx(0.5), ""),
    }


def test_overlap_of_balls_of_two_sizes():
    canonical, scene = made("overlap", **INSIDE)
    small = replace(scene.bodies[0], shape=replace(scene.bodies[0].shape, radius=0.4))
    record = still(scene, 2)
    record.pose[:, 0, 0] = (0.0, 0.0, 0.1)
    found = canonical.measure(replace(scene, bodies=(small, scene.bodies[1])), record)
    assert found["grown"][0] == pytest.approx(0.1) and found["left"][0] == pytest.approx(0.25 / 0.15)


def test_error_of_an_overlap():
    canonical, scene = made("overlap", **INSIDE)
    assert canonical.primary.error(scene, DT, {"thrown": (1.5, "")}) == (pytest.approx(1.5 / 16.0), "")
    assert canonical.primary.error(scene, DT, {"thrown": (None, "lost")}) == (None, "lost")


@pytest.mark.parametrize(
    ("thrown", "moved", "grown", "word"),
    [
        (2.0, 0.05, 0.025, ""),
        (2.001, 0.0, 0.0, "flew apart"),
        (2.001, 0.06, 0.03, "flew apart"),
        (0.0, 0.0501, 0.0, "drove off"),
        (0.0, 0.0501, 0.03, "drove off"),
        (0.0, 0.0, 0.0251, "sank in"),
        (None, 0.0, 0.0, "no answer"),
        (0.0, None, 0.0, "no answer"),
        (0.0, 0.0, None, "no answer"),
    ],
)
def test_how_an_overlap_ended(thrown, moved, grown, word):
    """2 m/s, a tenth of a radius of 1/2 m, a tenth of 1/4 m."""
    canonical, scene = made("overlap", **INSIDE)
    found = {"thrown": (thrown, ""), "centre_moved": (moved, ""), "grown": (grown, "")}
    (frontier,) = canonical.frontiers
    assert frontier.fate(scene, found) == word


# ---- a plate that closes in ----

#: From the middle of 8 m at 1 m/s towards a plate at 1 m/s: blows at 2, 5 and 6 s, the wall between at 4 and 5.6 s.
CLOSING = {"length": 8.0, "v": 1.0, "closing": 1.0, "radius": 0.5, "mass": 2.0}


@pytest.mark.parametrize("dimension", [2, 3])
def test_wall_plate_and_ball_stand_in_a_row(dimension):
    _, scene = made("closing_wall", dimension, **CLOSING)
    wall, plate, ball = scene.bodies
    rest, turns = (0.0,) * (dimension - 1), (0.0,) * (1 if dimension == 2 else 3)
    assert (scene.name, scene.version, scene.gravity) == ("closing_wall", 1, (0.0,) * dimension)
    assert scene.duration == pytest.approx(6.0 + 1.0 / 7.0, rel=1e-14)  # halfway back from the last blow
    assert (wall.name, wall.motion, wall.shape.normal, wall.shape.offset) == ("wall", "fixed", (1.0, *rest), 0.0)
    assert (plate.name, plate.motion, plate.twist) == ("plate", "prescribed", (-1.0, *rest, *turns))
    assert plate.shape.half_extents == (0.5, *(1.0,) * (dimension - 1))
    assert plate.pose[:dimension] == (9.5, *rest)  # its face is 8 m and a diameter away from the wall
    assert (ball.name, ball.mass, ball.shape.radius, ball.motion) == ("ball", 2.0, 0.5, "free")
    assert ball.pose[:dimension] == (4.5, *rest) and ball.twist == (1.0, *rest, *turns)
    assert (scene.pairs[0].restitution, scene.pairs[0].friction) == (1.0, 0.0)


def test_allowance_of_a_closing_plate_by_blows():
    canonical, scene = made("closing_wall", **CLOSING)
    assert stated(canonical.checks(scene, DT)) == {
        "speed[1]": ("m/s", near(7e-12)),
        "time[1]": ("s", near(1 / 64 + 2e-12)),
        "speed[2]": ("m/s", near(7e-12)),
        "time[2]": ("s", near(5 / 64 + 5e-12)),
        "speed[3]": ("m/s", near(7e-12)),
        "time[3]": ("s", near(9 / 64 + 6e-12)),
    }
    truths = {check.metric: check.truth for check in canonical.checks(scene, DT)}
    assert truths == pytest.approx(
        {"speed[1]": 3.0, "time[1]": 2.0, "speed[2]": 5.0, "time[2]": 5.0, "speed[3]": 7.0, "time[3]": 6.0}
    )


def test_truth_of_the_replay_between_two_walls():
    canonical, scene = made("closing_wall", 3, **CLOSING)
    ghost = canonical.track(scene)
    assert ghost.body == "ball"
    for t, x in ((0.0, 4.5), (1.0, 5.5), (3.0, 3.5), (4.5, 2.0), (5.3, 2.0), (5.8, 1.5), (6.1, 1.8)):
        assert ghost.position(t) == pytest.approx((x, 0.0, 0.0), abs=1e-12)


def test_error_of_a_closing_plate():
    canonical, scene = made("closing_wall", **CLOSING)
    assert canonical.primary.error(scene, DT, {"speed[3]": (7.6, "")}) == (pytest.approx(0.1), "")
    assert canonical.primary.error(scene, DT, {"speed[3]": (6.4, "")}) == (pytest.approx(0.1), "")
    assert canonical.primary.error(scene, DT, {"speed[3]": (None, "lost")}) == (None, "lost")
    _, slow = made("closing_wall", **(CLOSING | {"closing": 0.25}))
    truth = canonical.exact(slow)["speed[3]"]
    assert truth == 2.5 and canonical.primary.error(slow, DT, {"speed[3]": (2.65, "")})[0] == pytest.approx(0.1)


def thrown_once(scene, places, velocities):
    """A record of the ball that has these places and velocities around the sample at 2 s, and goes on with the last."""
    record = still(scene, 400)
    k = 2 * 64
    record.pose[k : k + len(places), 2, 0], record.twist[:, 2, 0] = places, 1.0
    record.twist[k : k + len(velocities), 2, 0] = velocities
    record.twist[k + len(velocities) :, 2, 0] = velocities[-1]
    return record


@pytest.mark.parametrize(
    ("places", "velocities", "time"),
    [
        # 1 m/s until a quarter of the step, -1 m/s after it: half a step less than if it had gone on.
        ((6.0, 6.0 - 0.5 / 64), (1.0, -1.0), 2.25 / 64),
        ((6.0, 6.0), (1.0, 0.0), 2.0 / 64),  # it stops dead
        ((6.0, 6.0 + 5.0 / 64), (1.0, -1.0), 3.0 / 64),  # lines that meet later are told at the end of the step
        ((6.0, 6.0 - 5.0 / 64), (1.0, -1.0), 2.0 / 64),  # and earlier ones at its start
    ],
)
def test_turning_point_of_a_ball(places, velocities, time):
    canonical, scene = made("closing_wall", **CLOSING)
    found = canonical.measure(scene, thrown_once(scene, places, velocities))
    assert found["time[1]"] == (pytest.approx(2.0 + time - 2.0 / 64, abs=1e-12), "")
    assert found["time[2]"] == (None, "the plate does not throw it back 2 times")


def test_ball_that_stands_between_two_ways():
    canonical, scene = made("closing_wall", **CLOSING)
    found = canonical.measure(scene, thrown_once(scene, (6.0,) * 4, (1.0, 0.0, 0.0, -1.0)))
    assert found["time[1]"][0] == pytest.approx(2.0) and found["time[2]"][0] is None


def test_speeds_halfway_and_at_an_early_end():
    canonical, scene = made("closing_wall", **CLOSING)
    record = still(scene, 330)  # 5.156 s: before the middle of the second way back
    record.twist[:, 2, 0] = -np.arange(331.0)
    found = canonical.measure(scene, record)
    assert {metric: found[metric] for metric in ("speed[1]", "speed[2]", "speed[3]")} == {
        "speed[1]": (3.0 * 64, ""), "speed[2]": (330.0, ""), "speed[3]": (330.0, ""),
    }  # fmt: skip


def test_ways_of_the_two_samples_around_a_blow():
    """What the ball did two samples before is no part of it: it was faster then, and somewhere else."""
    canonical, scene = made("closing_wall", **CLOSING)
    record = thrown_once(scene, (6.0, 6.0 - 0.5 / 64), (1.0, -1.0))
    record.twist[127, 2, 0], record.pose[127, 2, 0] = 2.0, 5.0
    assert canonical.measure(scene, record)["time[1]"] == (pytest.approx(2.0 + 0.25 / 64, abs=1e-12), "")
