"""A box on a belt: Coulomb's law integrated in the room's frame, planted faults of three sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still

from adapters.trajectory import Trajectory

DT = 1 / 240


def ridden(scene, dt=DT, mu=None, belt=None, offset=0.0):
    """The box in the room: dv/dt = mu g towards the belt's velocity, in many small steps, no faster than the belt.

    ``offset`` in steps shifts what is sampled, as step orders do.
    """
    p, fine = scene.params, 200
    mu, belt = p["mu"] if mu is None else mu, p["v"] if belt is None else belt
    h, x, v, path = dt / fine, 0.0, 0.0, []
    for k in range(round(scene.duration / dt) * fine + 1):
        if k % fine == 0:
            path.append((x, v))
        before, v = v, min(belt, v + mu * p["g"] * h)
        x += 0.5 * (before + v) * h
    place, speed = np.array(path).T
    n, d = len(path), scene.dimension
    pose, twist = still(scene, n)
    angle = math.radians(p["heading"])
    line = np.array([1.0]) if d == 2 else np.array([math.cos(angle), math.sin(angle)])
    pose[:, 1, : d - 1] = np.outer(place + offset * dt * speed, line)
    twist[:, 1, : d - 1] = np.outer(speed, line)
    return Trajectory(np.arange(n) * dt, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("dt", [1 / 60, DT])
@pytest.mark.parametrize(("dimension", "heading"), [(2, 0.0), (3, 0.0), (3, 30.0)])
def test_conveyor_by_coulomb_s_law_in_every_step_order(dimension, heading, dt, offset):
    canonical, scene = made("conveyor", dimension, heading=heading)
    trajectory = ridden(scene, dt, offset=offset)
    assert failing(canonical, scene, trajectory) == set()
    if not offset and dt == DT:
        measured, truth = canonical.measure(scene, trajectory), canonical.exact(scene)
        assert {name: measured[name][0] for name in truth} == pytest.approx(truth, abs=1e-5)


def test_replay_truth_along_the_path_of_the_box():
    canonical, scene = made("conveyor", 3, heading=30.0)
    trajectory, track = ridden(scene), canonical.track(scene)
    for k in (0, 40, 120, len(trajectory.t) - 1):
        assert track.position(trajectory.t[k]) == pytest.approx(trajectory.pose[k, 1, :3], abs=1e-5)


def test_conveyor_taken_for_a_floor_or_running_backwards():
    canonical, scene = made("conveyor")
    still = ridden(scene, belt=0.0)
    assert {"slipped", "pull", "slip_speed"} == failing(canonical, scene, still)
    back = ridden(scene)
    back = replace(back, pose=back.pose * [-1.0, 1.0, 1.0], twist=-back.twist)
    assert {"slipped", "pull", "slip_speed"} == failing(canonical, scene, back)


@pytest.mark.parametrize("size", [0.1, 0.01, 0.001])
def test_conveyor_with_wrong_friction_belt_hop_turn_or_bend(size):
    canonical, scene = made("conveyor", 3)
    wrong = failing(canonical, scene, ridden(scene, mu=0.4 * (1.0 - size)))
    assert "pull" in wrong and (size < 0.05 or "slipped" in wrong)
    # A belt of another speed shows in the speed at the end at once, and in the mark once it is 5 % of it.
    slow = failing(canonical, scene, ridden(scene, belt=2.0 * (1.0 - size)))
    assert "slip_speed" in slow and (size < 0.05 or "slipped" in slow)
    good = ridden(scene)
    for axis, metric in ((2, "hop"), (1, "astray")):
        moved = good.pose.copy()
        moved[-1, 1, axis] += size
        assert failing(canonical, scene, replace(good, pose=moved)) == {metric}
    turned = good.pose.copy()
    turned[10:, 1, 3:] = [math.cos(0.5 * size), 0.0, 0.0, math.sin(0.5 * size)]
    assert failing(canonical, scene, replace(good, pose=turned)) == {"turned"}


def test_fixed_belt_with_a_surface_along_its_heading():
    _, scene = made("conveyor", 3, heading=30.0)
    belt = scene.bodies[0]
    assert belt.motion == "fixed" and not any(belt.twist)
    assert belt.surface_velocity == pytest.approx([2.0 * math.sqrt(0.75), 1.0, 0.0])
