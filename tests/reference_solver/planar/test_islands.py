"""Bodies that cannot meet within a step are stepped apart: what happens elsewhere changes nothing, to the last bit."""

import itertools
import math

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation
from reference_solver.compilation import from_python
from reference_solver.pieces import FORCES
from reference_solver.stepping.islands import allocate_islands, may_meet

DOWN = (0.0, -9.81)
DT = 1.0 / 60.0


def world(bodies, restitution=0.4, friction=0.3):
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    return Simulation(Model(2, [floor, *bodies], DOWN, restitution, friction), Settings.reference(DT))


def disc(x, y, vx=0.0, vy=0.0, radius=0.3, mass=1.0):
    return Body(Disc(radius), mass, 0.5 * mass * radius**2, (x, y, 0.0), (vx, vy, 0.0))


def tipping(x):
    """A box that leans on its corner and falls over."""
    half, lean = (0.2, 0.5), 0.3
    height = half[0] * math.sin(lean) + half[1] * math.cos(lean)
    return Body(Box(half), 1.0, 0.29 / 3.0, (x, height, lean))


def test_a_ball_that_bounces_far_away_changes_nothing_here():
    alone = world([tipping(0.0), disc(-2.0, 0.3, 1.5)])
    beside = world([tipping(0.0), disc(-2.0, 0.3, 1.5), disc(1000.0, 1.0, 0.0, -3.0)])
    for _ in range(6):
        alone.advance(10)
        beside.advance(10)
        assert np.array_equal(alone.pose, beside.pose[:3])
        assert np.array_equal(alone.twist, beside.twist[:3])
    assert beside.certificate["events"] > alone.certificate["events"] > 0


def islands_of(simulation):
    """Which bodies made their last step together."""
    label = simulation._world._world.islands.label
    return [int(label[i]) for i in range(len(label)) if simulation.model.bodies[i].motion == "free"]


def test_only_what_may_meet_is_one_island_and_what_can_meet_nobody_flies_together():
    """Two discs askew, whose boxes overlap; two that fall over a floor, and one that reaches it within the step."""
    askew, side = 0.65 / math.sqrt(2.0), 0.2
    falling = [disc(5.0, 4.0), disc(-5.0, 3.0), disc(0.0, 0.3 + side * DT, 0.0, -1.0)]
    simulation = world([disc(20.0, 5.0), disc(20.0 + askew, 5.0 + askew), *falling])
    simulation.advance(1)
    assert islands_of(simulation) == [1, 1, 1, 1, 5]
    closer = 0.605 / math.sqrt(2.0)
    simulation = world([disc(20.0, 5.0), disc(20.0 + closer, 5.0 + closer), *falling])
    simulation.advance(1)
    assert islands_of(simulation) == [1, 1, 3, 3, 5]
    lands = 1.0 + side * 9.81 * DT  # a fifth of the step later, or a thousandth less of it
    assert simulation.twist[5, 1] == pytest.approx(0.4 * lands - (1.0 - side) * 9.81 * DT, rel=0.01)


def test_a_floor_that_turns_may_meet_whatever_it_can_turn_to():
    """A half-space about a far pivot: what lies over it now is hit by it within the step."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="prescribed", twist=(0.0, 0.0, 3.0))
    simulation = Simulation(Model(2, [floor, disc(30.0, 1.0)], (0.0, 0.0), 0.0, 0.0), Settings.reference(DT))
    simulation.advance(1)
    assert simulation.twist[1, 1] > 10.0


def test_contacts_of_all_islands_carry_all_weights():
    simulation = world([disc(float(x), 0.3, mass=1.0 + x) for x in range(6)], restitution=0.0)
    simulation.advance(2)
    contacts = simulation.contacts()
    assert contacts.body_a.tolist() == [0] * 6
    assert contacts.body_b.tolist() == [1, 2, 3, 4, 5, 6]
    weights = 9.81 * DT * np.arange(1.0, 7.0)
    assert contacts.impulse[:, 1] == pytest.approx(weights, rel=1e-13)


def test_a_light_ball_struck_out_of_its_bounds_meets_what_it_meets():
    """A heavy disc sends a light one off at three times its speed, into one that nothing had come near (e = 1)."""
    speed, gap, far = 3.0, 0.01, 0.09
    start = 0.6 + gap
    heavy, light = disc(0.0, 10.0, speed, mass=1e12), disc(start, 10.0, mass=1.0)
    wall = Body(HalfSpace((-1.0, 0.0), -(start + 0.3 + far)), motion="fixed")
    bodies = [wall, heavy, light]
    simulation = Simulation(Model(2, bodies, (0.0, 0.0), 1.0, 0.0), Settings.reference(DT))
    simulation.advance(1)
    place, velocity, heavy_at, left = start, 0.0, 0.0, DT
    while True:  # between a wall and a disc that nothing stops
        to_heavy = (place - heavy_at - 0.6) / (speed - velocity) if velocity < speed else math.inf
        to_wall = (start + far - place) / velocity if velocity > 0.0 else math.inf
        time = min(to_heavy, to_wall, left)
        place, heavy_at, left = place + time * velocity, heavy_at + time * speed, left - time
        if left <= 0.0:
            break
        velocity = 2.0 * speed - velocity if to_heavy < to_wall else -velocity
    assert simulation.pose[2, 0] == pytest.approx(place, abs=1e-9)  # the heavy one loses 1e-11 of its speed
    assert simulation.twist[2, 0] == pytest.approx(velocity, abs=1e-9)


def test_moving_floors_are_where_their_velocity_takes_them_for_all_islands():
    floor = Body(HalfSpace((0.0, 1.0)), motion="prescribed", twist=(0.0, 0.5, 0.0))
    bodies = [floor, disc(0.0, 0.3, 0.0, 0.5), disc(5.0, 2.0), disc(9.0, 0.3, 0.0, 0.5)]
    simulation = Simulation(Model(2, bodies, DOWN, 0.0, 0.3), Settings.reference(DT))
    simulation.advance(60)
    assert simulation.pose[0, 1] == pytest.approx(0.5, abs=1e-14)
    assert simulation.pose[1:, 1] == pytest.approx([0.8, 0.8, 0.8], abs=1e-12)


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


@pytest.mark.parametrize(("pose", "offset"), [((0.0, 2.0, 0.0), 0.0), ((0.0, 0.0, 0.0), 2.0), ((0.0, 0.0, 0.5), 2.0)])
def test_a_floor_is_where_its_pose_and_its_offset_take_it(pose, offset):
    """A disc that touches within the step is an island by itself; one that does not flies with the others."""
    normal = np.array([-math.sin(pose[2]), math.cos(pose[2])])
    floor = Body(HalfSpace((0.0, 1.0), offset), motion="fixed", pose=pose)
    for gap, apart in ((0.5 * DT, True), (4.0 * DT, False)):
        foot = np.array(pose[:2]) + (offset + 0.3 + gap) * normal
        bodies = [floor, disc(*(foot + 9.0 * normal)), disc(*foot, *(-normal)), disc(*(foot + 5.0 * normal))]
        simulation = Simulation(Model(2, bodies, (0.0, 0.0), 0.0, 0.0), Settings.reference(DT))
        simulation.advance(1)
        assert islands_of(simulation) == ([1, 2, 1] if apart else [1, 1, 1])
        assert (abs(simulation.twist[2, :2] @ normal) < 1e-12) == apart  # it has landed, or has not


def test_what_a_body_reaches_has_room_for_the_distance_at_which_contacts_are_kept():
    simulation = world([disc(0.0, 5.0), disc(3.0, 5.0)])
    simulation.advance(1)
    model = simulation._world._world
    assert (model.islands.reach[1:] > 0.3).all() and (model.islands.reach[1:] < 0.31).all()


@pytest.mark.parametrize("axis", [0, 1])
def test_where_a_body_leaves_its_bounds_only_whoever_it_meets_makes_the_step_anew(axis):
    """A heavy disc sends a light one off, past everybody; a box that falls over elsewhere keeps its bits."""
    along, over = np.zeros(2), np.array([40.0, 40.0])
    along[axis] = 1.0

    def shot(place, speed, mass):
        return disc(*(over + place * along), *(speed * along), mass=mass)

    heavy, light, beyond = shot(0.0, 3.0, 1e6), shot(0.61, 0.0, 1.0), shot(9.0, 0.0, 1.0)
    alone = world([tipping(0.0), disc(-2.0, 0.3, 1.5)], restitution=1.0)
    beside = world([tipping(0.0), disc(-2.0, 0.3, 1.5), heavy, light, beyond], restitution=1.0)
    alone.advance(1)
    beside.advance(1)
    assert beside.twist[4, axis] > 5.0  # it has been hit
    assert islands_of(beside)[2:4] == [3, 3] and islands_of(beside)[4] not in (3, islands_of(beside)[0])
    assert np.array_equal(alone.pose, beside.pose[:3])
    assert np.array_equal(alone.twist, beside.twist[:3])


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_whoever_a_struck_disc_meets_beyond_its_bounds_is_met_whatever_the_order(order):
    """A heavy disc, a light one that it strikes, and one that this one strikes: all along one line, e = 0."""
    bodies = [disc(0.0, 9.0, 6.0, mass=1e9), disc(0.61, 9.0), disc(1.26, 9.0)]
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    model = Model(2, [floor, *(bodies[i] for i in order)], (0.0, 0.0), 0.0, 0.0)
    simulation = Simulation(model, Settings.reference(DT))
    simulation.advance(1)
    assert simulation.twist[1:, 0] == pytest.approx([6.0] * 3, abs=1e-6)
    assert islands_of(simulation) == [1, 1, 1]
    assert simulation.certificate["holds"], simulation.certificate["reasons"]
    again = Simulation(model, Settings.reference(DT)).record(1, pieces=True)
    assert np.array_equal(again.pose[-1], simulation.pose)
    times = again.pieces.length[again.pieces.kind == FORCES]
    assert times.sum() == pytest.approx(DT, rel=1e-12)  # what was made anew has left no piece
