"""Bodies on surfaces that turn as prescribed, against closed forms: rows turn by a spin that no force changes."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from reference_solver import Model, Settings
from reference_solver.certificate.truth import certify
from reference_solver.geometry import rotation
from tests.verification.space import GRAVITY, ROUNDNESS, SPACES

RADIUS, MASS, TIME = 0.2, 1.3, 0.8
#: Angle of the plank at the start [rad], its spin [rad/s], place and rate of the ball along it [m, m/s].
ANGLE, SPIN, PLACE, RATE = -0.3, 1.2, 0.3, 0.4


def rolled(space, t):
    """Place along the plank [m], its rate [m/s], and the plank's angle [rad] after the time t.

    Seen from the plank, which turns by W about a point of its surface: ``(1 + k) s'' = W^2 s - g sin(q)``, k the ball's
    I/m r^2, since friction turns the ball by ``-s''/r``.
    """
    k = ROUNDNESS[space.dimension]
    pace, swing = SPIN / math.sqrt(1.0 + k), GRAVITY / ((2.0 + k) * SPIN**2)
    first, second = PLACE - swing * math.sin(ANGLE), (RATE - swing * SPIN * math.cos(ANGLE)) / pace
    angle, c, s = ANGLE + SPIN * t, math.cosh(pace * t), math.sinh(pace * t)
    place = first * c + second * s + swing * math.sin(angle)
    rate = pace * (first * s + second * c) + swing * SPIN * math.cos(angle)
    return place, rate, angle


def centre(place, angle):
    """Place of the ball in the world [m]."""
    return (
        place * math.cos(angle) - RADIUS * math.sin(angle),
        place * math.sin(angle) + RADIUS * math.cos(angle),
    )


def on_a_plank(space):
    """A ball that rolls on a plank that turns about the origin."""
    x, y = centre(PLACE, ANGLE)
    v = (RATE * math.cos(ANGLE) - SPIN * y, RATE * math.sin(ANGLE) + SPIN * x)
    plank = space.floor(ANGLE, motion="prescribed", twist=space.twist(0.0, 0.0, SPIN))
    ball = space.ball(x, y, space.twist(*v, SPIN - RATE / RADIUS), RADIUS, MASS)
    return Model(space.dimension, [plank, ball], space.vector(0.0, -GRAVITY), 0.0, 3.0)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
def test_ball_that_rolls_on_a_turning_plank(space):
    found = certify(on_a_plank(space), Settings.reference(TIME / 192), 192, 16)
    assert found.holds
    for t, pose, bound in zip(found.t, found.pose[:, 1], found.error, strict=True):
        place, _, angle = rolled(space, t)
        there = np.array(space.pose(*centre(place, angle)))[: space.dimension]
        assert np.linalg.norm(pose[: space.dimension] - there) <= bound + 1e-14
    assert found.error[-1] <= 1e-9
    # It has turned by what it rolled and by what the plank did.
    turn = SPIN * TIME - (rolled(space, TIME)[0] - PLACE) / RADIUS
    want = rotation(np.array(space.pose(0.0, 0.0, turn))[None])[0]
    assert rotation(found.pose[-1, 1][None])[0] == pytest.approx(want, abs=1e-10)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
def test_ball_that_flies_along_a_turning_plane(space):
    """Seen from the plane the ball falls with ``2 W v``: it meets it within a step, though it starts on its way off."""
    spin, dt, radius = 5.0, 1.0 / 60.0, 0.01
    start, velocity = np.array([0.0, 0.02]), np.array([20.0, 0.5])

    def normal(t):
        return np.array([-math.sin(spin * t), math.cos(spin * t)])

    when = brentq(lambda t: normal(t) @ (start + t * velocity) - radius, 0.0, dt, xtol=1e-15)
    place, n = start + when * velocity, normal(when)
    approach = n @ (velocity - spin * np.array([-place[1], place[0]]))
    after = velocity - 2.0 * approach * n
    plane = space.floor(motion="prescribed", twist=space.twist(0.0, 0.0, spin))
    ball = space.ball(*start, space.twist(*velocity), radius)
    simulation = space.simulation([plane, ball], Settings.reference(dt), restitution=1.0)
    simulation.advance(1)
    d = space.dimension
    assert when < dt and approach < -1.0
    assert simulation.twist[1, :d] == pytest.approx(np.array(space.vector(*after)), abs=1e-11)
    assert simulation.pose[1, :d] == pytest.approx(np.array(space.vector(*(place + (dt - when) * after))), abs=1e-12)
