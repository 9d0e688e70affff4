"""What a turned box stands on: the whole polygon that two faces share, found by a library for plane geometry."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shapely import affinity
from shapely.geometry import box as rectangle

from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation

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
def test_box_at_corners_of_a_shared_face(yaw, lower):
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
def test_pressed_box_over_a_shared_polygon(seed):
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


@pytest.mark.parametrize("fixed_first", [True, False])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("velocity", [(0.4, 0.2), (0.4, 0.4), (0.4, 0.0), (-0.4, 0.2)])
def test_corner_that_starts_on_a_corner(fixed_first, sign, velocity):
    """Slides straight on by its friction, whatever the order of the bodies, and mirrored."""
    mu, time, steps = 0.3, 0.1, 12
    v = np.array([sign * velocity[0], velocity[1], 0.0])
    table = Body(Box((0.5, 0.5, 0.1)), pose=(0.0, 0.0, -0.1, *UPRIGHT), motion="fixed")
    moments = ((0.09 + 4e-4) / 3.0,) * 2 + (0.06,)
    free = Body(Box((0.3, 0.3, 0.02)), 1.0, moments, (0.2 * sign, 0.2, 0.02, *UPRIGHT), (*v, 0.0, 0.0, 0.0))
    bodies = [table, free] if fixed_first else [free, table]
    simulation = Simulation(Model(3, bodies, (0.0, 0.0, -GRAVITY), 0.0, mu), Settings.reference(time / steps))
    simulation.advance(steps)
    end = simulation.pose[1 if fixed_first else 0]
    speed = float(np.linalg.norm(v))
    stops = min(time, speed / (mu * GRAVITY))
    way = speed * stops - 0.5 * mu * GRAVITY * stops**2
    assert end[:3] == pytest.approx(np.array([0.2 * sign, 0.2, 0.02]) + way * v / speed, abs=1e-11)


def test_five_boxes_turned_against_each_other():
    """Thirty-four contacts that stick, more rows than 64: a single block on its edge, by an integration."""
    count, half, height, lean = 5, 0.3, 0.4, math.atan(0.3) * 1.15
    turn = [(math.cos(0.25 * (k % 2)), 0.0, 0.0, math.sin(0.25 * (k % 2))) for k in range(count)]
    own = ((half**2 + 0.04) / 3.0,) * 2 + (2.0 * half**2 / 3.0,)
    boxes = [
        Body(Box((half, half, 0.2)), 1.0, own, (0.0, 0.0, 0.2 + height * k, *turn[k])) for k in range(count)
    ]  # fmt: skip
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
    gravity = (GRAVITY * math.sin(lean), 0.0, -GRAVITY * math.cos(lean))
    simulation = Simulation(Model(3, [floor, *boxes], gravity, 0.0, 3.0), Settings.reference(1 / 120))
    simulation.advance(6)
    # About the edge x = half: each box's own moment (its square base has one about any level axis) and its place.
    arms = np.array([[-half, 0.2 + height * k] for k in range(count)])
    moment = count * own[0] + (arms**2).sum()

    def rate(_, state):
        leans = lean + state[0]
        return [state[1], GRAVITY * (arms[:, 1] * math.sin(leans) + arms[:, 0] * math.cos(leans)).sum() / moment]

    spin = solve_ivp(rate, (0.0, 0.05), [0.0, 0.0], rtol=1e-12, atol=1e-15).y[1, -1]
    assert simulation.twist[1:, 4] == pytest.approx(np.full(count, spin), rel=1e-9)
