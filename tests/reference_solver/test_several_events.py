"""Motions with several events in a step, and loads that pass through others."""

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere

DT, G = 1.0 / 240.0, 9.81
PLACE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def half_space(normal, offset=0.0):
    pose = PLACE if len(normal) == 3 else (0.0, 0.0, 0.0)
    return Body(HalfSpace(normal, offset), motion="fixed", pose=pose)


def test_ball_between_walls_with_little_play():
    """A hundred metres a second and a centimetre of play: 83 impacts in a step of 1/60 s, each followed."""
    half, speed, play, dt = 0.5, 100.0, 0.01, 1.0 / 60.0
    walls = [half_space((1.0, 0.0), -half - play), half_space((-1.0, 0.0), -half - play)]
    ball = Body(Disc(half), 1.0, 0.125, (0.0, 0.0, 0.0), (speed, 0.0, 0.0))
    simulation = Simulation(Model(2, [*walls, ball], (0.0, 0.0), 1.0, 0.0), Settings.reference(dt))
    simulation.advance(30)
    unfolded = (speed * 30 * dt + play) % (4.0 * play)
    assert simulation.pose[2, 0] == pytest.approx(play - abs(unfolded - 2.0 * play), abs=1e-11)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("count", range(2, 8))
def test_load_on_the_last_of_a_column(dimension, count):
    """Without gravity only the last has a load: round-off of what passes through the others contradicts nothing."""
    shape, inertia = (Disc(0.5), 0.125) if dimension == 2 else (Sphere(0.5), (0.1,) * 3)
    up = (0.0,) * (dimension - 1)
    bodies = [half_space((*up, 1.0))]
    for k in range(count):
        place = (*up, 0.5 + k, *((0.0,) if dimension == 2 else PLACE[3:]))
        bodies.append(Body(shape, 1.0, inertia, place, force=(*up, -10.0 if k == count - 1 else 0.0)))
    simulation = Simulation(Model(dimension, bodies, (0.0,) * dimension, 0.0, 0.0), Settings.reference(DT))
    start = simulation.pose.copy()
    simulation.advance(30)
    # Before, what parted by round-off where no load acts was let go, and sank 5e-13 m.
    assert np.abs(simulation.pose - start).max() < 1e-15 and np.abs(simulation.twist).max() < 1e-12
    contacts = simulation.contacts()
    assert (contacts.impulse * contacts.normal).sum(axis=1) == pytest.approx([10.0 * DT] * count, rel=1e-9)


def test_rest_of_a_sphere_in_a_corner_of_three_planes():
    """Three contacts at once, e = 0."""
    planes = [half_space(tuple(np.eye(3)[k])) for k in range(3)]
    ball = Body(Sphere(0.5), 1.0, (0.1, 0.1, 0.1), (0.6, 0.7, 0.8, 1.0, 0.0, 0.0, 0.0))
    simulation = Simulation(Model(3, [*planes, ball], (-3.0, -4.0, -5.0), 0.0, 0.0), Settings.reference(DT))
    simulation.advance(240)
    assert simulation.pose[-1, :3] == pytest.approx([0.5, 0.5, 0.5], abs=1e-13)
    assert np.abs(simulation.twist[-1]).max() <= 1e-15


@pytest.mark.parametrize("free", [False, True])
def test_block_that_slides_past_the_end_of_another(free):
    """Faces stay flush: the corner that leaves hands its contact on to that of the block below."""
    mass, below = 5.0, (0.0, 0.5, 0.0)
    table = (
        Body(Box((1.0, 0.5)), mass, mass * 1.25 / 3.0, below)
        if free
        else Body(Box((1.0, 0.5)), motion="fixed", pose=below)
    )
    block = Body(Box((0.5, 0.1)), 1.0, 0.26 / 3.0, (0.3, 1.1, 0.0), (2.0, 0.0, 0.0))
    simulation = Simulation(
        Model(2, [half_space((0.0, 1.0)), table, block], (0.0, -G), 0.0, 0.1), Settings.reference(DT)
    )
    # Friction, mu times half the height below the centre, tips it .01 m sooner; one step at 2 m/s is .0083 m.
    while simulation.pose[2, 0] < 0.98:
        simulation.advance(1)
        assert simulation.pose[2, 1:] == pytest.approx([1.1, 0.0], abs=1e-12)
