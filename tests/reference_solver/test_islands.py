"""Bodies that cannot meet within a step are stepped apart: what happens elsewhere changes nothing, to the last bit."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation
from reference_solver.compilation import from_python
from reference_solver.pieces import FORCES
from reference_solver.stepping.islands import allocate_islands, may_meet
from tests.verification.space import SPACES

G, DT = 9.81, 1.0 / 60.0
REFERENCE = Settings.reference(DT)
both_spaces = pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)


def world(space, bodies, restitution=0.4, friction=0.3):
    return space.simulation([space.floor(), *bodies], REFERENCE, G, restitution, friction)


def weightless(space, bodies, restitution=0.0):
    return space.simulation(bodies, REFERENCE, 0.0, restitution)


def ball(space, along, up, v=0.0, w=0.0, mass=1.0, radius=0.3):
    return space.ball(along, up, space.twist(v, w), radius, mass)


def tipping(space, along):
    """A box that leans on its corner or edge and falls over."""
    half, lean = (0.2, 0.5), 0.3
    return space.box(along, half[0] * math.sin(lean) + half[1] * math.cos(lean), half=half, angle=lean)


def islands_of(simulation):
    """Which bodies made their last step together."""
    label = simulation._world._world.islands.label
    return [int(label[i]) for i in range(len(label)) if simulation.model.bodies[i].motion == "free"]


def same_bits(alone, beside):
    n = len(alone.pose)
    return np.array_equal(alone.pose, beside.pose[:n]) and np.array_equal(alone.twist, beside.twist[:n])


@both_spaces
def test_a_ball_that_bounces_far_away_changes_nothing_here(space):
    here = [tipping(space, 0.0), ball(space, -2.0, 0.3, 1.5)]
    alone, beside = world(space, here), world(space, [*here, ball(space, 1000.0, 1.0, 0.0, -3.0)])
    for _ in range(6):
        alone.advance(10)
        beside.advance(10)
        assert same_bits(alone, beside)
    assert beside.certificate["events"] > alone.certificate["events"] > 0


@both_spaces
def test_only_what_may_meet_is_one_island_and_what_can_meet_nobody_flies_together(space):
    """Two balls askew, whose boxes overlap; two that fall over a floor, and one that reaches it within the step."""
    side = 0.2
    falling = [ball(space, 5.0, 4.0), ball(space, -5.0, 3.0), ball(space, 0.0, 0.3 + side * DT, 0.0, -1.0)]
    for distance, labels in ((0.65, [1, 1, 1, 1, 5]), (0.605, [1, 1, 3, 3, 5])):
        askew = distance / math.sqrt(2.0)
        simulation = world(space, [ball(space, 20.0, 5.0), ball(space, 20.0 + askew, 5.0 + askew), *falling])
        simulation.advance(1)
        assert islands_of(simulation) == labels
        lands = 1.0 + side * G * DT  # a fifth of the step later, or a thousandth less of it
        assert simulation.twist[5, space.up] == pytest.approx(0.4 * lands - (1.0 - side) * G * DT, rel=0.01)


@both_spaces
def test_a_floor_that_turns_may_meet_whatever_it_can_turn_to(space):
    """A half-space about a far pivot: what lies over it now is hit by it within the step."""
    floor = space.floor(motion="prescribed", twist=space.twist(spin=3.0))
    simulation = weightless(space, [floor, ball(space, 30.0, 1.0)])
    simulation.advance(1)
    assert simulation.twist[1, space.up] > 10.0


@both_spaces
def test_contacts_of_all_islands_carry_all_weights(space):
    simulation = world(space, [ball(space, float(x), 0.3, mass=1.0 + x) for x in range(6)], restitution=0.0)
    run = simulation.record(2, pieces=True)
    contacts = simulation.contacts()
    assert contacts.body_a.tolist() == [0] * 6
    assert contacts.body_b.tolist() == [1, 2, 3, 4, 5, 6]
    assert contacts.impulse[:, space.up] == pytest.approx(G * DT * np.arange(1.0, 7.0), rel=1e-13)
    assert sorted(set(run.pieces.body_b.tolist())) == [1, 2, 3, 4, 5, 6]


@both_spaces
def test_a_light_ball_struck_out_of_its_bounds_meets_what_it_meets(space):
    """A heavy ball sends a light one off at three times its speed, into a wall that nothing had come near (e = 1)."""
    speed, gap, far = 3.0, 0.01, 0.09
    start = 0.6 + gap
    heavy, light = ball(space, 0.0, 10.0, speed, mass=1e12), ball(space, start, 10.0)
    simulation = weightless(space, [space.wall(-1.0, -(start + 0.3 + far)), heavy, light], restitution=1.0)
    simulation.advance(1)
    place, velocity, heavy_at, left = start, 0.0, 0.0, DT
    while True:  # between a wall and a ball that nothing stops
        to_heavy = (place - heavy_at - 0.6) / (speed - velocity) if velocity < speed else math.inf
        to_wall = (start + far - place) / velocity if velocity > 0.0 else math.inf
        time = min(to_heavy, to_wall, left)
        place, heavy_at, left = place + time * velocity, heavy_at + time * speed, left - time
        if left <= 0.0:
            break
        velocity = 2.0 * speed - velocity if to_heavy < to_wall else -velocity
    assert simulation.pose[2, 0] == pytest.approx(place, abs=1e-9)  # the heavy one loses 1e-11 of its speed
    assert simulation.twist[2, 0] == pytest.approx(velocity, abs=1e-9)


@both_spaces
def test_a_light_ball_shuttles_between_two_heavy_ones_whose_bounds_do_not_reach_it(space):
    bodies = [ball(space, 0.0, 9.0, 30.0, mass=1e9), ball(space, 0.61, 9.0), ball(space, 1.6, 9.0, mass=1e9)]
    simulation = weightless(space, [space.floor(), *bodies], restitution=1.0)
    simulation.advance(1)
    first, light, last = simulation.pose[1:, 0]
    assert first + 0.6 - 1e-9 <= light <= last - 0.6 + 1e-9
    assert simulation.twist[3, 0] > 0.0
    assert simulation.certificate["holds"], simulation.certificate["reasons"]


@both_spaces
def test_moving_floors_are_where_their_velocity_takes_them_for_all_islands(space):
    floor = space.floor(motion="prescribed", twist=space.twist(0.0, 0.5))
    bodies = [floor, ball(space, 0.0, 0.3, 0.0, 0.5), ball(space, 5.0, 2.0), ball(space, 9.0, 0.3, 0.0, 0.5)]
    simulation = space.simulation(bodies, REFERENCE, G, 0.0, 0.3)
    simulation.advance(60)
    assert simulation.pose[0, space.up] == pytest.approx(0.5, abs=1e-14)
    assert simulation.pose[1:, space.up] == pytest.approx([0.8, 0.8, 0.8], abs=1e-12)


def test_what_turns_as_prescribed_is_where_its_spin_takes_it_for_all_islands():
    space = SPACES[1]
    spins = (0.0,) * 5 + (2.0,)
    turning = Body(Box((0.1, 0.1, 0.1)), motion="prescribed", pose=(0.0, 9.0, 9.0, 1.0, 0.0, 0.0, 0.0), twist=spins)
    simulation = world(space, [ball(space, 0.0, 0.3), ball(space, 5.0, 2.0), turning], restitution=0.0)
    simulation.advance(60)
    assert simulation.pose[3, 3:] == pytest.approx([math.cos(1.0), 0.0, 0.0, math.sin(1.0)], abs=1e-12)


@both_spaces
def test_a_pair_that_no_impulses_keep_apart_ends_the_run_and_is_named(space):
    ceiling = Body(
        HalfSpace(space.vector(0.0, -1.0)),
        motion="prescribed",
        pose=space.pose(0.0, 0.62),
        twist=space.twist(0.0, -0.5),
    )
    simulation = world(space, [ball(space, 5.0, 0.1, radius=0.1), ceiling, ball(space, 0.0, 0.3)], restitution=0.0)
    simulation.advance(60)
    certificate = simulation.certificate
    assert any("no impulses keep bodies 0 and 3 apart" in reason for reason in certificate["reasons"])
    assert not np.isfinite(simulation.pose[3, : space.dimension]).any()


@both_spaces
def test_a_load_takes_bodies_farther_than_their_speed(space):
    """Two balls at rest, 1 mm and the margins of both apart, that a force drives together: they meet."""
    gap = 0.001 + 4.0 * 0.003
    push = 2.0 * (gap / 2.0) / DT**2 * 1.5  # each goes .75 of the gap
    bodies = [
        replace(ball(space, along, 9.0), force=space.vector(sign * push, 0.0))
        for along, sign in ((0.0, 1.0), (0.6 + gap, -1.0))
    ]
    simulation = weightless(space, [space.floor(), *bodies])
    simulation.advance(1)
    assert islands_of(simulation) == [1, 1]
    assert simulation.pose[2, 0] - simulation.pose[1, 0] == pytest.approx(0.6, abs=1e-9)


def bounded(*bodies):
    """Islands of bodies of a reach each, whose centres lie between two corners, of which some are half-spaces."""
    found = allocate_islands(2, len(bodies), 1)
    for i, (reach, low, high, plane) in enumerate(bodies):
        found.reach[i], found.limit[i], found.plane[i] = reach, (*low, *high), plane
    return found


FREE = (0.0, 0.0, 0.0)


def test_bodies_may_meet_that_are_no_farther_apart_than_both_reach_from_the_nearest_ends_of_their_bounds():
    """Corners 3 and 4 m apart, 5 m from each other; to either side, whoever is named first."""
    meet = from_python(may_meet)
    for reach, found in ((2.999, False), (3.001, True)):
        islands = bounded((2.0, (-7.0, -9.0), (0.0, 0.0), FREE), (reach, (3.0, 4.0), (8.0, 9.0), FREE))
        assert meet(islands, 0, 1) is found and meet(islands, 1, 0) is found
    islands = bounded((0.1, (-1.0, -1.0), (1.0, 1.0), FREE), (0.1, (0.5, 0.5), (9.0, 9.0), FREE))
    assert meet(islands, 0, 1)


def test_a_body_may_meet_a_half_space_that_it_can_reach_down_to():
    """A floor through (1, 2) turned to the slope of 3 in 4, 0.5 m above its own centre's plane; least heights by it."""
    meet, normal = from_python(may_meet), (-0.6, 0.8)
    floor = (math.inf, (1.0, 2.0), (1.0, 2.0), (*normal, 0.5))
    for height, found in ((1.001, False), (0.999, True)):
        for corner, far in (((2.0, 0.0), (-3.0, 4.0)), ((0.0, 0.0), (0.0, 0.0))):
            x, y = 1.0 + (0.5 + height) * normal[0], 2.0 + (0.5 + height) * normal[1]
            # Bounds that begin at the lowest point of all: the largest x and the smallest y.
            islands = bounded(floor, (1.0, (x - corner[0], y), (x, y + far[1]), FREE))
            assert meet(islands, 0, 1) is found and meet(islands, 1, 0) is found


@both_spaces
@pytest.mark.parametrize(("height", "offset", "lean"), [(2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 2.0, 0.5)])
def test_a_floor_is_where_its_pose_and_its_offset_take_it(space, height, offset, lean):
    """A ball that touches within the step is an island by itself; one that does not flies with the others."""
    normal = np.array([-math.sin(lean), math.cos(lean)])
    shape = HalfSpace(space.vector(0.0, 1.0), offset)
    floor = Body(shape, motion="fixed", pose=space.pose(0.0, height, lean))
    for gap, apart in ((0.5 * DT, True), (4.0 * DT, False)):
        foot = np.array([0.0, height]) + (offset + 0.3 + gap) * normal
        lands = ball(space, *foot, *(-normal))
        others = [ball(space, *(foot + far * normal)) for far in (9.0, 5.0)]
        simulation = weightless(space, [floor, others[0], lands, others[1]])
        simulation.advance(1)
        assert islands_of(simulation) == ([1, 2, 1] if apart else [1, 1, 1])
        speed = simulation.twist[2, [0, space.up]] @ normal
        assert (abs(speed) < 1e-12) == apart  # it has landed, or has not


@both_spaces
def test_what_a_body_reaches_has_room_for_the_distance_at_which_contacts_are_kept(space):
    """A ball its radius, a turned box half its diagonal."""
    simulation = world(space, [ball(space, 0.0, 5.0), tipping(space, 3.0)])
    simulation.advance(1)
    far = math.sqrt(0.29 if space.dimension == 2 else 0.33)
    reach = simulation._world._world.islands.reach
    assert reach[1:] == pytest.approx([0.3 + 0.01 * 0.3, far + 0.01 * 0.2], rel=1e-12)


@pytest.mark.parametrize(("space", "axis"), [(SPACES[0], 0), (SPACES[0], 1), *((SPACES[1], axis) for axis in range(3))])
def test_where_a_body_leaves_its_bounds_only_whoever_it_meets_makes_the_step_anew(space, axis):
    """A heavy ball sends a light one off, past everybody; a box that falls over elsewhere keeps its bits."""
    d = space.dimension
    along, over = np.zeros(d), np.array(space.vector(40.0, 40.0))
    along[axis] = 1.0

    def shot(place, speed, mass):
        body = ball(space, 0.0, 0.0, mass=mass)
        return replace(
            body, pose=(*(over + place * along), *body.pose[d:]), twist=(*(speed * along), *(0.0,) * (2 * d - 3))
        )

    here = [tipping(space, 0.0), ball(space, -2.0, 0.3, 1.5)]
    alone = world(space, here, restitution=1.0)
    beside = world(space, [*here, shot(0.0, 3.0, 1e6), shot(0.61, 0.0, 1.0), shot(9.0, 0.0, 1.0)], restitution=1.0)
    alone.advance(1)
    beside.advance(1)
    assert beside.twist[4, axis] > 5.0  # it has been hit
    assert islands_of(beside)[2:4] == [3, 3] and islands_of(beside)[4] not in (3, islands_of(beside)[0])
    assert same_bits(alone, beside)


@both_spaces
@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_whoever_a_struck_ball_meets_beyond_its_bounds_is_met_whatever_the_order(space, order):
    """A heavy ball, a light one that it strikes, and one that this one strikes: all along one line, e = 0."""
    bodies = [ball(space, 0.0, 9.0, 6.0, mass=1e9), ball(space, 0.61, 9.0), ball(space, 1.26, 9.0)]
    model = Model(space.dimension, [space.floor(), *(bodies[i] for i in order)], space.vector(0.0, 0.0), 0.0, 0.0)
    simulation = Simulation(model, REFERENCE)
    simulation.advance(1)
    assert simulation.twist[1:, 0] == pytest.approx([6.0] * 3, abs=1e-6)
    assert islands_of(simulation) == [1, 1, 1]
    assert simulation.certificate["holds"], simulation.certificate["reasons"]
    again = Simulation(model, REFERENCE).record(1, pieces=True)
    assert np.array_equal(again.pose[-1], simulation.pose)
    times = again.pieces.length[again.pieces.kind == FORCES]
    assert times.sum() == pytest.approx(DT, rel=1e-12)  # what was made anew has left no piece


@both_spaces
def test_every_body_of_every_island_ends_where_it_moved_and_its_contact_is_remembered(space):
    """Pairs of islands with neighbouring numbers, of one shape and different speeds; nothing sweeps anew at rest."""
    bodies = [ball(space, float(k), 0.3, 0.1 * k) for k in (0, 3, 6, 9)]
    bodies += [ball(space, 2.0 + 20.0 * k, 0.3 + k) for k in (1, 2)]
    simulation = world(space, bodies, restitution=0.0, friction=0.0)
    simulation.advance(1)
    before = simulation.certificate["sweeps"]
    simulation.advance(20)
    assert simulation.pose[1:5, 0] == pytest.approx([k + 0.1 * k * 21 * DT for k in (0, 3, 6, 9)], abs=1e-13)
    assert simulation.certificate["sweeps"] == before  # what carried it a moment ago carries it now
