"""Which contacts that part leave, and which ones loads take back from mere noise (E22)."""

from math import sqrt

import pytest

from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation
from reference_solver.compilation import from_python
from reference_solver.planar import impact as planar
from reference_solver.planar.columns import ENDING, IMPACT, RESTITUTION
from reference_solver.spatial import slide as spatial

G, UPRIGHT = 9.81, (1.0, 0.0, 0.0, 0.0)
SPEEDS = {"lower than noise": 0.5, "higher than noise": 2.0}


def resting_box(dimension):
    """Bodies and contacts of a box that rests on the floor."""
    pose = (0.0, 0.0, 0.0) if dimension == 2 else (0.0, 0.0, 0.0, *UPRIGHT)
    up = (0.0,) * (dimension - 1) + (1.0,)
    floor = Body(HalfSpace(up), pose=pose, motion="fixed")
    place = tuple(x + 0.5 * (k == dimension - 1) for k, x in enumerate(pose))
    box = Body(Box((0.5,) * dimension), 1.0, 1 / 6 if dimension == 2 else (1 / 6,) * 3, place)
    model = Model(dimension, [floor, box], tuple(-G * x for x in up), 0.0, 0.5)
    simulation = Simulation(model, Settings.reference(1.0 / 240.0))
    simulation.advance(1)
    world = simulation._world
    return (world._bodies, world._rows) if dimension == 2 else (world._bodies, world._manifolds[:1])


@pytest.mark.few(5)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(
    ("struck", "e", "speed", "back_within", "leaves"),
    [
        (True, 0.5, "lower than noise", True, True),  # a rebound, however low
        (True, 0.0, "lower than noise", True, False),
        (False, 0.5, "lower than noise", True, False),
        (False, 0.0, "lower than noise", True, False),
        (False, 0.0, "lower than noise", False, True),  # not back before the end
        (False, 0.0, "higher than noise", True, True),
        (False, 0.0, "higher than noise", False, True),
    ],
)
def test_what_parts_leaves_unless_loads_take_it_back_from_noise(dimension, struck, e, speed, back_within, leaves):
    """Of speed u it gets ``u^2 / 2 g`` high and is back after ``2 u / g``."""
    bodies, contacts = resting_box(dimension)
    own, at = (planar, (0,)) if dimension == 2 else (spatial, (0, 0))
    if dimension == 2:
        contacts.integer[0, IMPACT], contacts.real[0, RESTITUTION], contacts.integer[0, ENDING] = struck, e, 0
    else:
        contacts.impact[0, 0], contacts.restitution[0] = struck, e
    u = SPEEDS[speed] * sqrt(2.0 * G * from_python(own.gap_noise)(bodies, contacts, *at))
    length = 2.0 * u / G * (2.0 if back_within else 0.5)
    assert from_python(own.flies)(bodies, contacts, *at, u, length) == leaves
