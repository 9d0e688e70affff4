"""Textbook motions and loads that are the same in the plane and in space, along one level axis and upwards."""

import dataclasses
import math

import numpy as np
import pytest

from reference_solver import Settings
from tests.verification.columns import interface_impulses
from tests.verification.space import GRAVITY as G
from tests.verification.space import SPACES

DT = 1.0 / 240.0
EPS = np.finfo(float).eps
pytestmark = pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
shapes = pytest.mark.parametrize("shape", ["ball", "box"])


def test_rebound_and_impulse_of_the_worked_example(space, settings):
    ball = space.ball(0.0, 0.5, space.twist(0.0, -6.0), mass=0.5)
    simulation = space.simulation([space.floor(), ball], settings, restitution=0.8)
    simulation.advance(1)
    assert simulation.twist[1] == pytest.approx(space.twist(0.0, 4.8), abs=4 * EPS * 6.0)
    assert simulation.contacts().impulse[0] == pytest.approx(space.vector(0.0, 5.4), abs=4 * EPS * 5.4)


def bounces(height, e, t):
    """Height over its rest and velocity of a ball dropped at rest, after t: parabolas between impacts (O16)."""
    impact, speed = math.sqrt(2 * height / G), e * math.sqrt(2 * G * height)
    if t < impact:
        return height - 0.5 * G * t * t, -G * t
    if t >= impact + 2 * speed / (G * (1 - e)):
        return 0.0, 0.0
    while t >= impact + 2 * speed / G:
        impact, speed = impact + 2 * speed / G, e * speed
    return speed * (t - impact) - 0.5 * G * (t - impact) ** 2, speed - G * (t - impact)


@pytest.mark.few(24)
@shapes
@pytest.mark.parametrize("dt", [0.1, 1 / 60, 1 / 240, 1 / 1000])
@pytest.mark.parametrize("e", [0.0, 0.3, 0.5, 0.8])
def test_parabolas_and_rest_of_a_dropped_body(space, shape, dt, e):
    """Every sample against the closed form; at rest after (1 + e)/(1 - e) falls, to the bit."""
    height, up = 0.93, space.up
    body = getattr(space, shape)(0.2, 0.5 + height)
    simulation = space.simulation([space.floor(), body], Settings.reference(dt), G, e, 0.3)
    record = simulation.record(round(4.5 / dt))
    exact = np.array([bounces(height, e, t) for t in record.t])
    # Each of some hundred events rounds position and time once: 1e2 units in the last place of a metre.
    assert np.abs(record.pose[:, 1, up] - 0.5 - exact[:, 0]).max() < 3e-14
    moving = np.abs(exact[:, 1]) > 1e-6  # at an impact, round-off decides on which side of it a sample lies
    # Round-off of a height moves an impact at v by 1e-16 m / v: at most 2e-14 s for bounces of 5 mm/s, which steps of
    # 1 ms still see, some ten of them. Gravity multiplies the sum.
    assert record.twist[moving, 1, up] == pytest.approx(exact[moving, 1], abs=1e-11)
    assert np.abs(record.twist[-1, 1]).max() <= 1e-14
    place = record.pose[-1, 1, : space.dimension]
    assert place == pytest.approx(space.vector(0.2, 0.5), abs=1e-13)


@pytest.mark.few(12)
@shapes
@pytest.mark.parametrize("speed", [1e2, 1e3, 1e4, 1e6])
@pytest.mark.parametrize("e", [0.5, 1.0])
def test_rebound_from_a_thin_wall(space, shape, speed, e):
    wall = space.box(0.0, 0.0, half=(0.0005, 50.0), motion="fixed")
    body = getattr(space, shape)(-1.0, 0.1, space.twist(speed))
    dt = 0.8 / speed
    simulation = space.simulation([wall, body], Settings.reference(dt), restitution=e)
    simulation.advance(1)
    velocity = simulation.twist[1, : space.dimension]
    assert velocity == pytest.approx(space.vector(-e * speed, 0.0), rel=1e-12)
    assert shape == "box" or velocity[0] == -e * speed  # corners share a blow by round-off
    way = 1.0 - 0.5 - 0.0005
    # The instant is known to a unit in the last place of a step, 1e-18 s, which the speed multiplies.
    expected = -0.5005 - e * (speed * dt - way)
    assert simulation.pose[1, 0] == pytest.approx(expected, rel=1e-12, abs=1e-14)


@pytest.mark.few(8)
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 10, 20])
def test_weight_on_each_interface_of_a_column_for_a_second(space, reference, n, friction):
    simulation = space.simulation(space.column([1.0] * n), reference, G, 0.0, friction)
    start, weights = simulation.pose, G * DT * np.arange(n, 0, -1)
    for _ in range(240):
        simulation.advance(1)
        # Round-off of 1e-15 times the condition of the column, which grows like n^2 (0.4 n^2): 2e-13 at n = 20.
        assert interface_impulses(simulation, space, n) / weights == pytest.approx(1.0, abs=1e-10)
        assert np.abs(simulation.pose - start).max() <= 1e-11
        assert np.abs(simulation.twist).max() <= 1e-12


@pytest.mark.parametrize("offset", [0.4999, 0.501])
@pytest.mark.parametrize("motion", ["fixed", "free"])
def test_overhanging_box_at_the_edge_of_its_support(space, reference, motion, offset):
    bodies = [space.floor(), space.box(0.0, 0.5, motion=motion), space.box(offset, 1.5)]
    simulation = space.simulation(bodies, reference, G, 0.0, 0.5)
    simulation.advance(480)
    if offset > 0.5:
        assert simulation.pose[2, space.up] < 1.4
    else:
        assert np.abs(simulation.pose[2] - space.pose(offset, 1.5)).max() <= 1e-10


@pytest.mark.parametrize("correction", ["baumgarte", "split", "none"])
def test_speed_injected_by_baumgarte_and_split_impulse(space, classical, correction):
    overlap, beta = 0.01, 0.2
    settings = dataclasses.replace(classical, position_correction=correction, slop=0.0, beta=beta)
    simulation = space.simulation([space.floor(), space.ball(0.0, 0.5 - overlap)], settings)
    simulation.advance(1)
    speed = beta * overlap / DT if correction == "baumgarte" else 0.0
    assert simulation.twist[1, space.up] == pytest.approx(speed, rel=1e-12, abs=0.0)
    moved = 0.0 if correction == "none" else beta * overlap
    assert simulation.pose[1, space.up] - 0.5 + overlap == pytest.approx(moved, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("masses", [[1.0, ratio] * 4 for ratio in (1e2, 1e4, 1e6)], ids=str)
def test_interfaces_of_alternating_masses_in_every_step_of_the_direct_solver(space, fixed_step, masses):
    """Impulse i is the weight above; the unit in the last place of g h is what a light box may miss."""
    simulation = space.simulation(space.column(masses), fixed_step, G, 0.0, 0.5)
    weights = G * DT * np.cumsum(masses[::-1])[::-1]
    for _ in range(50):
        simulation.advance(1)
        carried = interface_impulses(simulation, space, len(masses))
        assert np.abs(carried / weights - 1.0).max() <= 1e-14 * max(masses)
    assert simulation.certificate["direct"] > 0


@pytest.mark.parametrize(("shape", "friction"), [("ball", 0.0), ("box", 0.5)])
def test_column_solved_directly_in_one_step(space, fixed_step, shape, friction):
    """Of forty smooth balls only normal rows are left, and bodies that do not turn."""
    n = 40 if shape == "ball" else 30
    simulation = space.simulation(space.column([1.0] * n, shape), fixed_step, G, 0.0, friction)
    simulation.advance(1)
    assert ("rotation" in simulation.left_out) == (shape == "ball") and simulation.certificate["direct"] == 1
    weights = G * DT * np.arange(n, 0, -1)
    assert interface_impulses(simulation, space, n) / weights == pytest.approx(1.0, abs=1e-13)


def test_direct_answer_against_the_sweeps(space, fixed_step):
    """Six boxes of different masses, sliding past each other along one line.

    In one line, because where the points of a face slip in different directions, friction depends on how redundant
    points share their load, and Coulomb's law leaves that open: such a step has many answers.
    """
    answers = []
    for direct in (True, False):
        boxes = [space.box(0.02 * i, 0.5 + i, space.twist(0.4 - 0.2 * i), mass=1.0 + 2.0 * i) for i in range(6)]
        settings = dataclasses.replace(fixed_step, direct=direct, max_sweeps=100_000)
        simulation = space.simulation([space.floor(), *boxes], settings, G, 0.0, 0.4)
        simulation.advance(1)
        assert simulation.certificate["converged"]
        assert (simulation.certificate["direct"] > 0) is direct
        answers.append(simulation.twist)
    # A residual of 1e-13 of g h over the contraction per sweep, at least 1e-3 here.
    assert answers[0] == pytest.approx(answers[1], abs=1e-11)
