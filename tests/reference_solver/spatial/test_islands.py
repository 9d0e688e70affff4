"""Bodies that cannot meet within a step are stepped apart, as in the plane."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation, Sphere

DOWN = (0.0, 0.0, -9.81)
DT = 1.0 / 60.0
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def world(bodies, restitution=0.4, friction=0.3, gravity=DOWN):
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, *UPRIGHT))
    return Simulation(Model(3, [floor, *bodies], gravity, restitution, friction), Settings.reference(DT))


def ball(x, z, vx=0.0, vz=0.0, radius=0.3, mass=1.0):
    moment = 0.4 * mass * radius**2
    return Body(Sphere(radius), mass, (moment,) * 3, (x, 0.0, z, *UPRIGHT), (vx, 0.0, vz, 0.0, 0.0, 0.0))


def tipping(x):
    """A box that leans on an edge and falls over."""
    half, lean = (0.2, 0.3, 0.5), 0.3
    height = half[0] * math.sin(lean) + half[2] * math.cos(lean)
    turn = (math.cos(0.5 * lean), 0.0, math.sin(0.5 * lean), 0.0)
    moments = tuple((sum(h * h for h in half) - h * h) / 3.0 for h in half)
    return Body(Box(half), 1.0, moments, (x, 0.0, height, *turn))


def test_a_ball_that_bounces_far_away_changes_nothing_here():
    alone = world([tipping(0.0), ball(-2.0, 0.3, 1.5)])
    beside = world([tipping(0.0), ball(-2.0, 0.3, 1.5), ball(1000.0, 1.0, 0.0, -3.0)])
    for _ in range(6):
        alone.advance(10)
        beside.advance(10)
        assert np.array_equal(alone.pose, beside.pose[:3])
        assert np.array_equal(alone.twist, beside.twist[:3])
    assert beside.certificate["events"] > alone.certificate["events"] > 0


def test_contacts_of_all_islands_carry_all_weights():
    simulation = world([ball(float(x), 0.3, mass=1.0 + x) for x in range(6)], restitution=0.0)
    run = simulation.record(2, pieces=True)
    contacts = simulation.contacts()
    assert contacts.body_a.tolist() == [0] * 6
    assert contacts.body_b.tolist() == [1, 2, 3, 4, 5, 6]
    assert contacts.impulse[:, 2] == pytest.approx(9.81 * DT * np.arange(1.0, 7.0), rel=1e-13)
    assert sorted(set(run.pieces.body_b.tolist())) == [1, 2, 3, 4, 5, 6]


def test_a_ball_struck_out_of_its_bounds_meets_what_it_meets():
    """Two balls whose bounds do not reach each other; a heavy fast one sends the first into the second (e = 1)."""
    bodies = [ball(0.0, 9.0, 30.0, mass=1e9), ball(0.61, 9.0, mass=1.0), ball(1.6, 9.0, mass=1e9)]
    simulation = world(bodies, restitution=1.0, friction=0.0, gravity=(0.0, 0.0, 0.0))
    simulation.advance(1)
    # The light one shuttles between the heavy ones: the gap between these is what bounds where it is.
    first, light, last = simulation.pose[1:, 0]
    assert first + 0.6 - 1e-9 <= light <= last - 0.6 + 1e-9
    assert simulation.twist[3, 0] > 0.0
    assert simulation.certificate["holds"], simulation.certificate["reasons"]


def test_what_moves_as_prescribed_is_where_its_velocity_takes_it_for_all_islands():
    floor = Body(
        HalfSpace((0.0, 0.0, 1.0)),
        motion="prescribed",
        pose=(0.0, 0.0, 0.0, *UPRIGHT),
        twist=(0.0, 0.0, 0.5, 0.0, 0.0, 0.0),
    )
    turning = Body(Box((0.1, 0.1, 0.1)), motion="prescribed", pose=(0.0, 9.0, 9.0, *UPRIGHT), twist=(0.0,) * 5 + (2.0,))
    bodies = [floor, ball(0.0, 0.3, 0.0, 0.5), ball(5.0, 2.0), turning]
    simulation = Simulation(Model(3, bodies, DOWN, 0.0, 0.3), Settings.reference(DT))
    simulation.advance(60)
    assert simulation.pose[:3, 2] == pytest.approx([0.5, 0.8, 0.8], abs=1e-12)
    assert simulation.pose[3, 3:] == pytest.approx([math.cos(1.0), 0.0, 0.0, math.sin(1.0)], abs=1e-12)


def test_a_pair_that_no_impulses_keep_apart_ends_the_run_and_is_named():
    ceiling = Body(
        HalfSpace((0.0, 0.0, -1.0)),
        motion="prescribed",
        pose=(0.0, 0.0, 0.62, *UPRIGHT),
        twist=(0.0, 0.0, -0.5, 0.0, 0.0, 0.0),
    )
    low = ball(5.0, 0.1, radius=0.1)
    simulation = world([low, ceiling, ball(0.0, 0.3)], restitution=0.0)
    simulation.advance(60)
    certificate = simulation.certificate
    assert any("no impulses keep bodies 0 and 3 apart" in reason for reason in certificate["reasons"])
    assert not np.isfinite(simulation.pose[3, :3]).any()
