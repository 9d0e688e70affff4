"""When pieces end, and why."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from reference_solver import Body, Box, Disc, Model, Settings, Simulation, Sphere
from reference_solver.exact.bodies import start_of, world_of
from reference_solver.exact.loop import Loop

G, DT = 10.0, 1.0 / 240.0
UPRIGHT = {2: (0.0,), 3: (1.0, 0.0, 0.0, 0.0)}


def on_a_box(d, off, speed, force):
    """A smooth ball of 1 kg, ``off`` the edge of a fixed box [m], that is driven over it."""
    box = Body(Box((5.0,) + (0.5,) * (d - 1)), motion="fixed", pose=(0.0,) * d + UPRIGHT[d])
    shape, inertia = (Disc(0.5), 0.125) if d == 2 else (Sphere(0.5), (0.1,) * 3)
    rest = (0.0,) * (d - 1)
    pose, twist = (5.0 - off, *rest[1:], 1.0, *UPRIGHT[d]), (speed, *rest, *(0.0,) * (1 if d == 2 else 3))
    ball = Body(shape, 1.0, inertia, pose, twist, force=(-force, *rest))
    return Model(d, [box, ball], (*rest, -G), 0.0, 0.0)


def first_piece(model, longest=10.0):
    world = world_of(model)
    return Loop(world, start_of(model), 1e-11, longest * world.time).next_piece()[1]


@pytest.mark.parametrize("d", [2, 3])
def test_ball_that_is_drawn_back_over_an_edge(d):
    """It passes the edge after .3 s, glides .09 m around it, and is back before the next look.

    Its energy says how fast it is: on the box v^2 = v0^2 - 2 F x; around the edge, turned by a, it has gained
    g r (1 - cos a) - F r sin a.
    """
    off, speed, force = 0.798, 4.19, 10.0
    model = on_a_box(d, off, speed, force)
    leaves = (speed - math.sqrt(speed**2 - 2.0 * force * off)) / force
    assert first_piece(model).length == pytest.approx(leaves, abs=1e-12)
    found = Simulation(model, Settings.reference(DT)).record(200)
    x, z = found.pose[:, 1, 0] - 5.0, found.pose[:, 1, d - 1] - 0.5
    v = found.twist[:, 1, [0, d - 1]]
    beyond = x > 0.0
    assert 60 < beyond.sum() < 80 and (x[-1] < -0.2)
    assert np.abs(np.hypot(x, z)[beyond] - 0.5).max() < 1e-10
    assert np.abs(z[~beyond] - 0.5).max() < 1e-10
    energy = 0.5 * (v**2).sum(axis=1) + G * z + force * x
    assert np.abs(energy - energy[0]).max() < 1e-8


@pytest.mark.parametrize("turns", [1.0, 16.0, 80.0, 80.3])
def test_table_that_turns_away_below_a_ball(turns):
    """A smooth ball rests .2 m beyond the middle of a side of a table that turns; a corner passes below it.

    ``turns``: eighths of a turn in the longest piece. With 16 the corner is below the ball in the middle of the piece
    and at its end.
    """
    spin = turns * math.pi / 4.0
    upright = (math.cos(math.pi / 8.0), 0.0, 0.0, math.sin(math.pi / 8.0))
    table = Body(Box((1.0, 1.0, 0.1)), motion="prescribed", pose=(0.0, 0.0, -0.1, *upright), twist=(0.0,) * 5 + (spin,))
    ball = Body(Sphere(0.1), 1.0, (0.004,) * 3, (1.2, 0.0, 0.1, *UPRIGHT[3]))
    piece = first_piece(Model(3, [table, ball], (0.0, 0.0, -G), 0.0, 0.0))
    assert piece.length == pytest.approx((math.pi / 4.0 - math.acos(1.0 / 1.2)) / spin, rel=1e-9)


@pytest.mark.parametrize("leaves", [0.0008, 0.0033, 0.0084])
def test_disc_that_is_drawn_back_between_two_looks_at_a_step(leaves):
    """A smooth disc on a box that turns: it passes the end after ``leaves`` [s], for 1 ms.

    Along the box r'' = w^2 r - g sin(a), whose solution is r = A cosh(w t) + B sinh(w t) + g / (2 w^2) sin(a).
    """
    lean, spin, radius = 0.3, 0.1, 0.1
    pull = G * math.sin(lean) - spin**2
    speed = 0.5 * pull * (2.0 * leaves + 0.001)
    off = 0.5 * pull * leaves * (leaves + 0.001)
    along, normal = np.array((math.cos(lean), math.sin(lean))), np.array((-math.sin(lean), math.cos(lean)))
    r, height = 1.0 - off, 0.1 + radius
    velocity = speed * along + spin * (r * normal - height * along)
    box = Body(Box((1.0, 0.1)), motion="prescribed", pose=(0.0, 0.0, lean), twist=(0.0, 0.0, spin))
    disc = Body(Disc(radius), 1.0, 0.005, (*(r * along + height * normal), 0.0), (*velocity, 10.0))  # its slip lasts
    c = 0.5 * G / spin**2

    def left(t):
        swings = (speed / spin - c * math.cos(lean)) * math.sinh(spin * t)
        return 1.0 - c * math.sin(lean + spin * t) - (r - c * math.sin(lean)) * math.cosh(spin * t) - swings

    piece = first_piece(Model(2, [box, disc], (0.0, -G), 0.0, 0.0))
    assert piece.turns and piece.length == pytest.approx(brentq(left, 0.0, leaves + 0.0005, xtol=1e-16), abs=1e-8)
