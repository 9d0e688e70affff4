"""A broken rack: event-driven collisions of discs keep what it judges; faults of sizes, and balls that pass."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made

from adapters.trajectory import Trajectory

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def broken(scene, dt=DT, e=1.0):
    """Discs that collide at the times at which they meet, pair after pair; pairs that meet at once, together."""
    n = len(scene.bodies)
    place = np.array([b.pose[:2] for b in scene.bodies])
    velocity = np.array([b.twist[:2] for b in scene.bodies])
    first, second = np.triu_indices(n, 1)
    times = np.arange(round(scene.duration / dt) + 1) * dt
    rows, now = [], 0.0

    def next_meeting():
        apart, closing = place[second] - place[first], velocity[second] - velocity[first]
        a, b = (closing**2).sum(axis=1), (apart * closing).sum(axis=1)
        c = (apart**2).sum(axis=1) - 1.0
        root = b * b - a * c
        with np.errstate(invalid="ignore", divide="ignore"):
            wait = np.where((b < -1e-12) & (root > 0.0), np.maximum(0.0, c / (-b + np.sqrt(root))), math.inf)
        return wait

    for t in times:
        while min(wait := next_meeting(), default=math.inf) <= t - now:
            soonest = wait.min()
            place, now = place + soonest * velocity, now + soonest
            meeting = np.flatnonzero(wait <= soonest + 1e-10)
            rows_of = np.zeros((len(meeting), n, 2))
            for row, k in zip(rows_of, meeting, strict=True):
                i, j = first[k], second[k]
                row[j] = (place[j] - place[i]) / np.linalg.norm(place[j] - place[i])
                row[i] = -row[j]
            flat = rows_of.reshape(len(meeting), -1)
            impulse = np.linalg.solve(flat @ flat.T, -(1.0 + e) * flat @ velocity.ravel())
            velocity = velocity + (flat.T @ impulse).reshape(n, 2)
        place, now = place + (t - now) * velocity, t
        rows.append((place, velocity))
    pose, twist = np.zeros((len(times), n, 3)), np.zeros((len(times), n, 3))
    pose[:, :, :2], twist[:, :, :2] = np.array([r[0] for r in rows]), np.array([r[1] for r in rows])
    return Trajectory(times, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("params", [{"rows": 1.0}, {"apart": 0.05}, {"rows": 3.0, "apart": 0.2, "v": 5.0}])
def test_momentum_energy_and_mirror_of_a_rack(params):
    canonical, scene = made("rack", **params)
    trajectory = broken(scene)
    assert failing(canonical, scene, trajectory) == set()
    moved = np.linalg.norm(trajectory.twist[-1, 1:, :2], axis=1) > 1e-3
    assert moved.sum() >= min(3, len(moved))


@pytest.mark.parametrize("size", SIZES)
def test_rack_with_lost_energy_momentum_mirror_or_overlap(size):
    canonical, scene = made("rack", apart=0.05)
    assert failing(canonical, scene, broken(scene, e=1.0 - size)) == {"energy_defect"}
    last = len(scene.bodies) - 1
    faster = broken(scene)
    faster.twist[-1, [last - 3, last], 0] *= 1.0 + size  # both of a pair of images
    assert failing(canonical, scene, faster) == {"momentum_defect", "energy_defect"}
    left = broken(scene)
    left.twist[-1, last, 1] += size
    left.twist[-1, 0, 1] -= size
    assert failing(canonical, scene, left) == {"energy_defect", "asymmetry"}
    deep = broken(scene)
    deep.pose[3, 2, :2] = deep.pose[3, 1, :2] + [0.95 - 0.2 * size, 0.0]
    assert failing(canonical, scene, deep) == {"penetration"}


def test_cue_ball_that_passes_through_fails():
    canonical, scene = made("rack")
    free = broken(replace(scene, bodies=scene.bodies[:1]))
    pose = np.array([[b.pose for b in scene.bodies]] * len(free.t))
    twist = np.array([[b.twist for b in scene.bodies]] * len(free.t))
    pose[:, 0], twist[:, 0] = free.pose[:, 0], free.twist[:, 0]
    assert failing(canonical, scene, Trajectory(free.t, pose, twist, None, DT, "completed")) == {"penetration"}


def test_bound_of_an_overlap_by_step():
    canonical, scene = made("rack")
    bounds = [{c.metric: c.bound for c in canonical.checks(scene, dt)}["penetration"] for dt in (1 / 60, 1 / 240)]
    assert bounds[0] == pytest.approx(4.0 * bounds[1]) and bounds[0] < 0.1
