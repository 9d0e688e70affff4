"""What a turned box stands on: the whole polygon that two faces share, found by a library for plane geometry."""

import math

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import box as rectangle

from reference_solver import Body, Box, Model, Settings, Simulation

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
GRAVITY = 9.81


def moved(lower, upper, place, yaw, torque=(0.0, 0.0, 0.0)):
    """How far box ``upper`` moves in a tenth of a second, its middle at ``place`` (2,) on the fixed box ``lower``."""
    a, b, c = upper
    moments = ((b * b + c * c) / 3.0, (a * a + c * c) / 3.0, (a * a + b * b) / 3.0)
    turned = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
    table = Body(Box(lower), pose=(0.0, 0.0, -lower[2], *UPRIGHT), motion="fixed")
    free = Body(Box(upper), 1.0, moments, (*place, c, *turned), torque=torque)
    simulation = Simulation(Model(3, [table, free], (0.0, 0.0, -GRAVITY), 0.0, 0.6), Settings.reference(1 / 60))
    start = simulation.pose[1]
    simulation.advance(6)
    return float(np.abs(simulation.pose[1] - start).max())


@pytest.mark.parametrize("yaw", [0.4, math.pi / 4])
@pytest.mark.parametrize("lower", [(0.5, 0.5, 0.1), (0.62, 0.4, 0.1)])
def test_a_box_stands_up_to_each_corner_of_what_it_shares_with_the_box_below(yaw, lower):
    """Its weight acts at its middle: inside the polygon it stands, outside it tips.

    The lower box is put so that the middle of the upper one lies a little to either side of each corner in turn.
    """
    upper = (0.5, 0.45, 0.2)
    turned = affinity.rotate(rectangle(-upper[0], -upper[1], upper[0], upper[1]), yaw, (0.0, 0.0), use_radians=True)
    below = rectangle(-lower[0], -lower[1], lower[0], lower[1])
    tried = 0
    for x, y in list(below.exterior.coords)[:-1]:
        for share, stands in ((0.98, True), (1.02, False)):
            # The corner of the lower box at the middle of the upper one: their polygon has it as a corner.
            place = (share * x, share * y)
            shared = below.intersection(affinity.translate(turned, *place))
            inside = shared.contains(rectangle(place[0], place[1], place[0] + 1e-9, place[1] + 1e-9))
            assert inside is stands
            way = moved(lower, upper, place, yaw)
            assert way < 1e-13 if stands else way > 1e-3
            tried += 1
    assert tried == 8


@pytest.mark.parametrize("seed", range(12))
def test_a_pressed_box_stands_while_what_presses_it_acts_over_the_shared_polygon(seed):
    """Polygons of four to eight corners; a torque moves the point at which the floor must answer to either side."""
    rng = np.random.default_rng(seed)
    lower, upper = (*rng.uniform(0.4, 0.6, 2), 0.1), (*rng.uniform(0.4, 0.6, 2), 0.2)
    yaw, place = rng.uniform(0.3, 1.2), rng.uniform(-0.1, 0.1, 2)
    turned = affinity.rotate(rectangle(-upper[0], -upper[1], upper[0], upper[1]), yaw, (0.0, 0.0), use_radians=True)
    shared = rectangle(-lower[0], -lower[1], lower[0], lower[1]).intersection(affinity.translate(turned, *place))
    corners = np.array(shared.exterior.coords)[:-1]
    assert len(corners) >= 4
    for corner in corners:
        for share, stands in ((0.995, True), (1.005, False)):
            arm = share * (corner - place)
            way = moved(lower, upper, place, yaw, (-GRAVITY * arm[1], GRAVITY * arm[0], 0.0))
            assert way < 1e-13 if stands else way > 1e-6
