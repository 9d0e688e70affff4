"""A capsule that rolls down a slope with its axis askew: what sticks at both ends of a line rolls across that line."""

import math

import numpy as np
import pytest

from reference_solver import Body, Capsule, HalfSpace, Model, Settings, Simulation
from reference_solver.certificate.truth import certify
from tests.verification.space import GRAVITY

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
#: Speed at the start [m/s].
START = 0.5


def orientation(axes):
    """Quaternion of three axes, columns of a turn with a trace above -1."""
    w = 0.5 * math.sqrt(1.0 + np.trace(axes))
    return (w, *(np.array([axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]]) / (4.0 * w)))


def rolling(askew, disturbance=0.0):
    """The model, where the capsule starts, the direction that it rolls in, and its acceleration."""
    slope, radius, half, mass, k = 0.3, 0.1, 0.4, 2.0, 0.5
    normal = np.array([math.sin(slope), 0.0, math.cos(slope)])
    down, level = np.array([math.cos(slope), 0.0, -math.sin(slope)]), np.array([0.0, 1.0, 0.0])
    axis = math.cos(askew) * level + math.sin(askew) * down
    ahead = np.cross(axis, normal)
    moment, across = k * mass * radius**2, mass * (half + radius) ** 2 / 3.0
    pose = (*(radius * normal), *orientation(np.column_stack([axis, np.cross(normal, axis), normal])))
    twist = np.array((*(START * ahead), *(START / radius * axis))) + disturbance
    capsule = Body(Capsule(half, radius), mass, (moment, across, across), pose, tuple(twist))
    floor = Body(HalfSpace(tuple(normal)), motion="fixed", pose=(0.0, 0.0, 0.0, *UPRIGHT))
    gained = float(ahead @ np.array([0.0, 0.0, -GRAVITY])) / (1.0 + k)
    assert gained == pytest.approx(GRAVITY * math.sin(slope) * math.cos(askew) / (1.0 + k))
    return Model(3, [floor, capsule], (0.0, 0.0, -GRAVITY), 0.0, 5.0), radius * normal, ahead, gained


@pytest.mark.parametrize("askew", [-1.1, 0.0, 0.6])
@pytest.mark.parametrize("steps", [5, 60])
def test_capsule_askew_on_a_slope(askew, steps):
    """With k = I/m r^2 about its axis ``a = g sin(slope) cos(askew)/(1 + k)``; what pulls along the axis is held."""
    time = 0.6
    model, place, ahead, gained = rolling(askew)
    found = certify(model, Settings.reference(time / steps), steps, 5)
    place = place + (START * time + 0.5 * gained * time**2) * ahead
    assert found.holds, found.reasons
    assert np.linalg.norm(found.pose[-1, 1, :3] - place) <= found.error[-1] + 1e-14
    assert found.error[-1] < 1e-9  # runs at a tenth and at ten times of the tolerance are as far apart


def test_capsule_askew_that_is_struck_by_round_off():
    """Its ends approach the slope at 1e-12 m/s: velocities of .5 m/s tell these speeds to a ten-thousandth."""
    for seed in range(6):
        disturbance = 1e-12 * np.random.default_rng(seed).uniform(-1.0, 1.0, 6)
        model, place, ahead, gained = rolling(0.6, disturbance)
        world = Simulation(model, Settings.reference(0.1))
        world.advance(1)
        assert world.pose[1, :3] == pytest.approx(place + (0.1 * START + 0.005 * gained) * ahead, abs=1e-11)
