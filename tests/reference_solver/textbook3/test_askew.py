"""A capsule that rolls down a slope with its axis askew: what sticks at both ends of a line rolls across that line."""

import math

import numpy as np
import pytest

from reference_solver import Body, Capsule, HalfSpace, Model, Settings
from reference_solver.certificate.truth import certify
from tests.verification.space import GRAVITY

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def orientation(axes):
    """Quaternion of three axes, columns of a turn with a trace above -1."""
    w = 0.5 * math.sqrt(1.0 + np.trace(axes))
    return (w, *(np.array([axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]]) / (4.0 * w)))


@pytest.mark.parametrize("askew", [-1.1, 0.0, 0.6])
@pytest.mark.parametrize("steps", [5, 60])
def test_capsule_askew_on_a_slope(askew, steps):
    """With k = I/m r^2 about its axis ``a = g sin(slope) cos(askew)/(1 + k)``; what pulls along the axis is held."""
    slope, radius, half, mass, time, start = 0.3, 0.1, 0.4, 2.0, 0.6, 0.5
    k = 0.5
    normal = np.array([math.sin(slope), 0.0, math.cos(slope)])
    down, level = np.array([math.cos(slope), 0.0, -math.sin(slope)]), np.array([0.0, 1.0, 0.0])
    axis = math.cos(askew) * level + math.sin(askew) * down
    ahead = np.cross(axis, normal)
    moment, across = k * mass * radius**2, mass * (half + radius) ** 2 / 3.0
    pose = (*(radius * normal), *orientation(np.column_stack([axis, np.cross(normal, axis), normal])))
    capsule = Body(
        Capsule(half, radius), mass, (moment, across, across), pose, (*(start * ahead), *(start / radius * axis))
    )
    floor = Body(HalfSpace(tuple(normal)), motion="fixed", pose=(0.0, 0.0, 0.0, *UPRIGHT))
    model = Model(3, [floor, capsule], (0.0, 0.0, -GRAVITY), 0.0, 5.0)
    found = certify(model, Settings.reference(time / steps), steps, 5)
    gained = float(ahead @ np.array([0.0, 0.0, -GRAVITY])) / (1.0 + k)
    assert gained == pytest.approx(GRAVITY * math.sin(slope) * math.cos(askew) / (1.0 + k))
    place = radius * normal + (start * time + 0.5 * gained * time**2) * ahead
    assert found.holds, found.reasons
    assert np.linalg.norm(found.pose[-1, 1, :3] - place) <= found.error[-1] + 1e-14
    assert found.error[-1] < 1e-9  # runs at a tenth and at ten times of the tolerance are as far apart
