"""Bodies that an impact drives much farther in a step than they were to go: they meet what is there."""

import itertools

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere

DT, RADIUS = 1.0 / 60.0, 0.3
GRAVITY = 9.81


def ball(dimension, x, speed=0.0, mass=1.0):
    """A ball on the first axis, ten metres up, that moves along it."""
    if dimension == 2:
        return Body(Disc(RADIUS), mass, 0.5 * mass * RADIUS**2, (x, 10.0, 0.0), (speed, 0.0, 0.0))
    twist, moments = (speed, *[0.0] * 5), (0.4 * mass * RADIUS**2,) * 3
    return Body(Sphere(RADIUS), mass, moments, (x, 0.0, 10.0, 1.0, 0.0, 0.0, 0.0), twist)


def fixed(dimension, shape, x, height=10.0):
    pose = (x, height, 0.0) if dimension == 2 else (x, 0.0, height, 1.0, 0.0, 0.0, 0.0)
    return Body(shape, pose=pose, motion="fixed")


def obstacle(dimension, kind, x):
    """A wall that faces the ball, or a post, whose surface is at x on the first axis."""
    if kind == "wall":
        return fixed(dimension, HalfSpace((-1.0, *[0.0] * (dimension - 1)), -x), 0.0, 0.0)
    if kind == "box":
        return fixed(dimension, Box((0.5,) * dimension), x + 0.5)
    return fixed(dimension, Disc(0.5) if dimension == 2 else Sphere(0.5), x + 0.5)


def world(dimension, bodies, restitution, gravity=0.0):
    down = (*[0.0] * (dimension - 1), -gravity)
    return Simulation(Model(dimension, bodies, down, restitution, 0.0), Settings.reference(DT))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kind", ["wall", "box", "post"])
@pytest.mark.parametrize("last", [False, True])
def test_struck_ball_before_an_obstacle(dimension, kind, last):
    """Hit after .01 m at 3 m/s it goes at 6 m/s, meets the obstacle after .06 m more, and comes back for the rest."""
    bodies = [ball(dimension, 0.0, 3.0, mass=1e12), ball(dimension, 0.61)]
    post = obstacle(dimension, kind, 0.61 + RADIUS + 0.06)
    simulation = world(dimension, [*bodies, post] if last else [post, *bodies], 1.0)
    simulation.advance(1)
    light = 1 if last else 2
    back = DT - 0.01 / 3.0 - 0.06 / 6.0
    assert simulation.pose[light, 0] == pytest.approx(0.67 - 6.0 * back, abs=1e-9)
    assert simulation.twist[light, 0] == pytest.approx(-6.0, abs=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_struck_ball_on_a_shelf(dimension, order):
    """A light ball is struck into a third one that rests on a shelf, nobody else's.

    Without the shelf it fell by g h^2/2, 1.4 mm: no more than it might have.
    """
    bodies = [ball(dimension, 0.0, 3.0, mass=1e9), ball(dimension, 0.61), ball(dimension, 1.26, mass=1e6)]
    shelf = fixed(dimension, Box((0.1,) * dimension), 1.26, 10.0 - RADIUS - 0.1)
    restitution = np.ones((4, 4))
    restitution[3] = restitution[:, 3] = 0.0  # else the third bounces on the shelf without end
    simulation = world(dimension, [*(bodies[i] for i in order), shelf], restitution, GRAVITY)
    simulation.advance(1)
    third = order.index(2)
    assert abs(simulation.pose[third, dimension - 1] - 10.0) < 1e-6  # blows on it are not quite level
    assert abs(simulation.pose[third, 0] - 1.26) < 1e-5
