"""Boxes on seams and far away: Coulomb's law integrated anew passes, bumps, wrong friction and coarse places fail."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.trajectory import Trajectory

DT = 1 / 240
NAMES = ("seam", "far_origin")
SIZES = (0.1, 0.01, 0.001)


def sliding(scene, dt=DT, mu=None, offset=0.0):
    """v' = -mu g until v = 0, by DOP853; ``offset`` in steps shifts what is sampled, as step orders do."""
    p, box = scene.params, len(scene.bodies) - 1
    mu = p["mu"] if mu is None else mu

    def stop(t, y):
        return y[1]

    stop.terminal = True
    times = np.arange(round(scene.duration / dt) + 1) * dt
    found = solve_ivp(lambda t, y: [y[1], -mu * p["g"]], (0.0, 1e3), [0.0, p["v"]], "DOP853", dense_output=True,
                      events=stop, rtol=1e-12, atol=1e-12)  # fmt: skip
    y = found.sol(np.minimum(times, found.t[-1]))
    pose, twist = still(scene, len(times))
    pose[:, box, 0] += y[0] + offset * dt * (y[1] - p["v"])
    twist[:, box, 0] = np.where(times < found.t[-1], y[1], 0.0)
    return Trajectory(times, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("name", NAMES)
def test_seams_stopping_distance_by_coulomb_in_every_order(name, dimension, dt, offset):
    canonical, scene = made(name, dimension)
    trajectory = sliding(scene, dt, offset=offset)
    assert failing(canonical, scene, trajectory) == set()
    if not offset:
        way = canonical.measure(scene, trajectory)["stopping_distance"][0]
        assert way == pytest.approx(canonical.exact(scene)["stopping_distance"], abs=1e-9)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", NAMES)
def test_seams_with_a_bump_stop_turn_or_wrong_friction(name, size):
    canonical, scene = made(name, 3)
    box = len(scene.bodies) - 1
    wrong = failing(canonical, scene, sliding(scene, mu=0.4 * (1.0 - size)))
    assert "braking" in wrong and (size < 0.02 or "stopping_distance" in wrong)
    good = sliding(scene)
    raised = good.pose.copy()
    raised[50, box, 2] += size
    assert failing(canonical, scene, replace(good, pose=raised)) == {"hop"}
    turned = good.pose.copy()
    turned[50:, box, 3:] = [math.cos(0.5 * size), 0.0, math.sin(0.5 * size), 0.0]
    assert failing(canonical, scene, replace(good, pose=turned)) == {"turned"}
    bent = good.pose.copy()
    bent[-1, box, 1] += size
    assert failing(canonical, scene, replace(good, pose=bent)) == {"astray"}
    late = good.twist.copy()
    late[-1, box, 1] = size
    assert failing(canonical, scene, replace(good, twist=late)) == {"end_speed"}


def test_a_seam_that_stops_the_box_fails():
    canonical, scene = made("seam")
    stopped = sliding(scene)
    at = int(np.argmax(stopped.pose[:, -1, 0] > 0.1))
    stopped.pose[at:, -1, 0] = 0.1
    stopped.twist[at:] = 0.0
    assert failing(canonical, scene, stopped) == {"stopping_distance", "braking"}


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("plate", [0.25, 1.0])
def test_start_and_length_of_plates(plate, dimension):
    canonical, scene = made("seam", dimension, plate=plate)
    *plates, box = scene.bodies
    for body in plates:
        assert body.pose[dimension - 1] + body.shape.half_extents[-1] == 0.0
    for left, right in pairwise(plates):
        assert right.pose[0] - left.pose[0] == pytest.approx(plate, abs=1e-15)
    end = box.pose[0] + canonical.exact(scene)["stopping_distance"] + box.shape.half_extents[0]
    assert plates[-1].pose[0] + 0.5 * plate > end and plates[0].pose[0] - 0.5 * plate < 0.0


@pytest.mark.parametrize("far", [1024.0, 1048576.0, 1e8])
def test_distant_scene_equal_to_the_last_place(far):
    scene, near = made("far_origin", far=far)[1], made("far_origin", far=0.0)[1]
    for body, other in zip(scene.bodies, near.bodies, strict=True):
        assert np.abs(np.array(body.pose[:2]) - far - other.pose[:2]).max() <= np.spacing(far)


def test_single_precision_positions_far_away_fail():
    """At 2^20 m a float knows places to 0.125 m: a box that moves 1.25 cm a step does not move at all."""
    canonical, scene = made("far_origin")
    coarse = sliding(scene)
    x = np.float32(coarse.pose[0, 1, 0])
    for k, v in enumerate(coarse.twist[:-1, 1, 0], 1):
        x = np.float32(x + np.float32(v * DT))
        coarse.pose[k, 1, 0] = x
    assert failing(canonical, scene, coarse) == {"stopping_distance"}
