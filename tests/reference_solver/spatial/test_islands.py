"""Bodies that cannot meet within a step are stepped apart, as in the plane."""

import itertools
import math
from dataclasses import replace

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


def islands_of(simulation):
    """Which bodies made their last step together."""
    label = simulation._world._world.islands.label
    return [int(label[i]) for i in range(len(label)) if simulation.model.bodies[i].motion == "free"]


def test_only_what_may_meet_is_one_island_and_what_can_meet_nobody_flies_together():
    """Two balls askew, whose boxes overlap; two that fall over a floor, and one that reaches it within the step."""
    falling = [ball(5.0, 4.0), ball(-5.0, 3.0), ball(0.0, 0.3 + 0.2 * DT, 0.0, -1.0)]
    for distance, pair in ((0.65, [1, 1]), (0.605, [1, 1])):
        askew = distance / math.sqrt(2.0)
        simulation = world([ball(20.0, 5.0), ball(20.0 + askew, 5.0 + askew), *falling])
        simulation.advance(1)
        others = [1, 1] if distance > 0.62 else [3, 3]
        assert islands_of(simulation) == [*pair, *others, 5]
    lands = 1.0 + 0.2 * 9.81 * DT
    assert simulation.twist[5, 2] == pytest.approx(0.4 * lands - 0.8 * 9.81 * DT, rel=0.01)


def test_a_load_takes_bodies_farther_than_their_speed():
    """Two balls at rest, 1 mm and the margins of both apart, that a force drives together: they meet."""
    gap = 0.001 + 4.0 * 0.003
    push = 2.0 * (gap / 2.0) / DT**2 * 1.5  # each goes .75 of the gap
    bodies = [ball(x, 9.0) for x in (0.0, 0.6 + gap)]
    bodies = [replace(body, force=(sign * push, 0.0, 0.0)) for body, sign in zip(bodies, (1.0, -1.0), strict=True)]
    simulation = world(bodies, restitution=0.0, gravity=(0.0, 0.0, 0.0))
    simulation.advance(1)
    assert islands_of(simulation) == [1, 1]
    assert simulation.pose[2, 0] - simulation.pose[1, 0] == pytest.approx(0.6, abs=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_where_a_body_leaves_its_bounds_only_whoever_it_meets_makes_the_step_anew(axis):
    """A heavy ball sends a light one off, past everybody; a box that falls over elsewhere keeps its bits."""
    along, over = np.zeros(3), np.array([40.0, 0.0, 40.0])
    along[axis] = 1.0

    def shot(place, velocity, mass):
        body = ball(0.0, 0.0, mass=mass)
        return replace(body, pose=(*(over + place * along), *UPRIGHT), twist=(*(velocity * along), 0.0, 0.0, 0.0))

    heavy, light, beyond = shot(0.0, 3.0, 1e6), shot(0.61, 0.0, 1.0), shot(9.0, 0.0, 1.0)
    alone = world([tipping(0.0), ball(-2.0, 0.3, 1.5)], restitution=1.0)
    beside = world([tipping(0.0), ball(-2.0, 0.3, 1.5), heavy, light, beyond], restitution=1.0)
    alone.advance(1)
    beside.advance(1)
    assert beside.twist[4, axis] > 5.0  # it has been hit
    assert islands_of(beside)[2:4] == [3, 3] and islands_of(beside)[4] not in (3, islands_of(beside)[0])
    assert np.array_equal(alone.pose, beside.pose[:3])
    assert np.array_equal(alone.twist, beside.twist[:3])


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_whoever_a_struck_ball_meets_beyond_its_bounds_is_met_whatever_the_order(order):
    """A heavy ball, a light one that it strikes, and one that this one strikes: all along one line, e = 0."""
    bodies = [ball(0.0, 9.0, 6.0, mass=1e9), ball(0.61, 9.0), ball(1.26, 9.0)]
    simulation = world([bodies[i] for i in order], restitution=0.0, friction=0.0, gravity=(0.0, 0.0, 0.0))
    simulation.advance(1)
    speed = simulation.twist[1:, 0]
    assert speed == pytest.approx([6.0] * 3, abs=1e-6)
    assert islands_of(simulation) == [1, 1, 1]
    assert simulation.certificate["holds"], simulation.certificate["reasons"]


def test_a_floor_that_turns_may_meet_whatever_it_can_turn_to():
    """A half-space about a far pivot: what lies over it now is hit by it within the step."""
    floor = Body(
        HalfSpace((0.0, 0.0, 1.0)),
        motion="prescribed",
        pose=(0.0, 0.0, 0.0, *UPRIGHT),
        twist=(0.0, 0.0, 0.0, 0.0, -3.0, 0.0),
    )
    simulation = Simulation(Model(3, [floor, ball(30.0, 1.0)], (0.0, 0.0, 0.0), 0.0, 0.0), Settings.reference(DT))
    simulation.advance(1)
    assert simulation.twist[1, 2] > 10.0


@pytest.mark.parametrize(("place", "offset", "lean"), [(2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 2.0, 0.5)])
def test_a_floor_is_where_its_pose_and_its_offset_take_it(place, offset, lean):
    """A ball that touches within the step is an island by itself; one that does not flies with the others."""
    normal = np.array([math.sin(lean), 0.0, math.cos(lean)])
    turn = (math.cos(0.5 * lean), 0.0, math.sin(0.5 * lean), 0.0)
    at = np.array([0.0, 0.0, place])
    floor = Body(HalfSpace((0.0, 0.0, 1.0), offset), motion="fixed", pose=(*at, *turn))
    for gap, apart in ((0.5 * DT, True), (4.0 * DT, False)):
        foot = at + (offset + 0.3 + gap) * normal
        places = (foot + 9.0 * normal, foot, foot + 5.0 * normal)
        bodies = [replace(ball(0.0, 0.0), pose=(*x, *UPRIGHT)) for x in places]
        bodies[1] = replace(bodies[1], twist=(*(-normal), 0.0, 0.0, 0.0))
        simulation = Simulation(Model(3, [floor, *bodies], (0.0, 0.0, 0.0), 0.0, 0.0), Settings.reference(DT))
        simulation.advance(1)
        assert islands_of(simulation) == ([1, 2, 1] if apart else [1, 1, 1])
        assert (abs(simulation.twist[2, :3] @ normal) < 1e-12) == apart  # it has landed, or has not


def test_what_a_body_reaches_has_room_for_the_distance_at_which_contacts_are_kept():
    """A ball its radius, a turned box half its diagonal."""
    simulation = world([ball(0.0, 5.0), tipping(3.0)])
    simulation.advance(1)
    for reach, far, width in zip(
        simulation._world._world.islands.reach[1:], (0.3, math.sqrt(0.38)), (0.3, 0.2), strict=True
    ):
        assert reach == pytest.approx(far + 0.01 * width, rel=1e-12)


def test_every_body_of_every_island_ends_where_it_moved_and_its_contact_is_remembered():
    """Pairs of islands with neighbouring numbers, of one shape and different speeds; nothing sweeps anew at rest."""
    bodies = [ball(float(k), 0.3, 0.1 * k) for k in (0, 3, 6, 9)] + [ball(2.0 + 20.0 * k, 0.3 + k) for k in (1, 2)]
    simulation = world(bodies, restitution=0.0, friction=0.0)
    simulation.advance(1)
    before = simulation.certificate["sweeps"]
    simulation.advance(20)
    assert simulation.pose[1:5, 0] == pytest.approx([k + 0.1 * k * 21 * DT for k in (0, 3, 6, 9)], abs=1e-13)
    assert simulation.certificate["sweeps"] == before  # what carried it a moment ago carries it now
