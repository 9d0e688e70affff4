"""Recordings: small, faithful to what is shown, and they say when a motion left what the tolerances allow."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from adapters.scene import Pair
from adapters.trajectory import Trajectory
from validation.canonical import Check
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.running.tracks import _distance_to_path, record, recording_from_bytes, representatives, tube

DT = 1.0 / 240.0


def trajectory_of(scene, t, position):
    pose = np.tile([body.pose for body in scene.bodies], (len(t), 1, 1))
    pose[:, 1, : scene.dimension] = position
    return Trajectory(t, pose, np.zeros_like(pose), None, DT, "completed")


def bouncing(e, height, position_first):
    """A correct fixed-step method: reflects the velocity in the step after which the ball would be in the floor."""
    scene = CATALOGUE["bounce"].scene(2, {"e": 0.8, "height": height})
    steps = math.ceil(scene.duration / DT)
    y, v, path = height, 0.0, [height]
    for _ in range(steps):
        if position_first:
            y += v * DT
            v = -e * v if y <= 0.0 and v < 0.0 else v - 9.81 * DT
        else:
            v = -e * v if y <= 0.0 and v < 0.0 else v - 9.81 * DT
            y += v * DT
        path.append(y)
    t = np.arange(steps + 1) * DT
    return scene, trajectory_of(scene, t, np.column_stack([np.zeros(steps + 1), np.array(path) + 0.5]))


@pytest.mark.parametrize("position_first", [True, False])
def test_correct_method_inside_the_tube_in_every_phase(position_first):
    for height in np.linspace(1.0, 1.04, 9):
        scene, trajectory = bouncing(0.8, float(height), position_first)
        assert record(CATALOGUE["bounce"], scene, trajectory).departure is None


@pytest.mark.parametrize(
    ("unit", "reach"),
    [("m", 1.0), ("m/s", 0.5), ("m/s^2", 0.125), ("1", 0.0), ("rad", 0.0)],  # of what lasts half a second
)
def test_tube_width_by_the_allowance_of_the_whole_run(unit, reach):
    fallen = CATALOGUE["impact"].scene(2)
    scene = replace(fallen, duration=0.5, gravity=(0.0, -9.81), pairs=(Pair(restitution=0.0),))
    judge = SimpleNamespace(checks=lambda scene, dt: [Check("speed", unit, 0.0, 7.0, "planted", "")])
    found = tube(judge, scene, DT, 0.0)
    assert found.distance == pytest.approx(max(7.0 * reach, 9.81 * DT**2), rel=1e-12) and found.per_impact == DT


@pytest.mark.parametrize("e", [0.75, 0.85, 0.13])
def test_wrong_rebound_in_the_tube(e):
    scene, trajectory = bouncing(e, 1.0, True)
    fall = math.sqrt(2.0 / 9.81)
    gone = record(CATALOGUE["bounce"], scene, trajectory).departure
    assert gone is not None and fall < gone < fall * (1.0 + 2.0 * 0.85)


def test_departure_from_the_tube():
    canonical = CATALOGUE["incline"]
    scene = canonical.scene(2, {"ratio": 0.9})
    t = np.arange(481) * DT
    allowed = 9.81 * DT**2  # nothing moves: the checks allow g dt^2 over the whole run
    x = np.where(t < 1.0, 0.9 * allowed, 1.1 * allowed)
    trajectory = trajectory_of(scene, t, np.column_stack([x, np.full_like(x, 0.5)]))
    assert record(canonical, scene, trajectory).departure == t[240]


def test_replay_bytes_to_half_a_level_of_sixteen_bits():
    scene, trajectory = bouncing(0.8, 1.0, True)
    recording = record(CATALOGUE["bounce"], scene, trajectory)
    again = recording_from_bytes(recording.to_bytes())
    half_range = 0.5 * np.ptp(recording.pose, axis=(0, 1))
    assert np.array_equal(again.t, recording.t)
    assert (np.abs(again.pose - recording.pose) <= 0.5 * half_range / 32767 * (1 + 1e-9) + 1e-15).all()


def test_number_of_frames():
    scene, trajectory = bouncing(0.8, 1.0, True)
    t = record(CATALOGUE["bounce"], scene, trajectory).t
    assert np.allclose(np.diff(t), 1 / 60)
    short = CATALOGUE["impact"].scene(2)
    t = np.arange(121) * DT
    assert len(record(CATALOGUE["impact"], short, trajectory_of(short, t, (0.0, 1.0))).t) == 121


def test_one_replay_cell_per_profile_at_equal_parameters():
    def slot(profile, n, dt, iterations=None):
        return Slot("stack", (("n", float(n)),), 2, "toy", profile, dt, iterations)

    a, b = slot("default", 10, DT), slot("tuned", 10, DT)
    others = [slot("default", 10, DT, 30), slot("default", 20, DT), slot("tuned", 10, 1 / 60), slot("tuned", 2, DT)]
    assert representatives([*others, b, a]) == {a, b}
    # A plan without the preferred parameters keeps what all its profiles share.
    assert representatives([slot("default", 3, 1 / 60), slot("tuned", 3, 1 / 60)]) == {
        slot("default", 3, 1 / 60),
        slot("tuned", 3, 1 / 60),
    }


@pytest.mark.parametrize(
    ("path", "distance"),
    [
        ([(0.0, 0.0)], 5.0),
        ([(0.0, 0.0), (0.0, 0.0)], 5.0),
        ([(0.0, 0.0), (3.0, 0.0)], 4.0),
        ([(0.0, 0.0), (6.0, 0.0)], 4.0),
        ([(3.0, 5.0), (3.0, 8.0)], 1.0),
        ([(0.0, 8.0), (0.0, 0.0), (6.0, 8.0)], 0.0),
    ],
)
def test_distance_of_a_point_from_a_path(path, distance):
    found = _distance_to_path(np.array([3.0, 4.0]), np.array(path))
    assert found == pytest.approx(distance, abs=1e-12) and isinstance(found, float)
