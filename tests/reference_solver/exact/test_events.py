"""When pieces end, and why."""

import copy
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.exact import events, features, loop
from reference_solver.exact.bodies import start_of, world_of
from reference_solver.exact.forces import decide
from reference_solver.exact.kernels.features import FACE, POINT
from reference_solver.exact.loop import Loop
from reference_solver.exact.motion import constant, free_acceleration
from reference_solver.exact.rows import Contacts

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


def test_box_that_is_drawn_back_to_a_box_as_high():
    """Corners go along the faces beside the one that they meet: outside of those by round-off they are not clear."""
    speed, pull, e = 0.2, 5.0, 0.5
    back, high = 2.0 * speed / pull, (e * speed) ** 2 / (2.0 * pull)
    for turn in np.random.default_rng(1).uniform(0.0, 6.0, 40):
        along = np.array((math.cos(turn), math.sin(turn)))
        post = Body(Box((0.5, 0.5)), pose=(0.0, 0.0, turn), motion="fixed")
        box = Body(Box((0.5, 0.5)), 1.0, 1 / 6, (*along, turn), (*(speed * along), 0.0), force=tuple(-pull * along))
        world = Simulation(Model(2, [post, box], (0.0, 0.0), e, 0.0), Settings.reference((1.0 + 0.5 * e) * back))
        world.advance(1)
        assert world.pose[1, :2] == pytest.approx((1.0 + high) * along, abs=1e-12)


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


def edge_to_be_left():
    """World, state and contact of a ball on the edge of a box that it leaves: `find` would leave it out."""
    model = on_a_box(2, 0.0, 1.0, 0.0)
    world = world_of(model)
    contacts = Contacts.of(world, np.array([[0, 1, FACE, face, POINT, 0] for face in range(4)]))
    state = start_of(model)
    gap = contacts.at_state(state).rows.gap
    return world, state, contacts.chosen((np.abs(gap) < 1e-12) & (contacts.rows.frame[:, 0, 1] == 1.0))


def test_kind_of_an_event_at_the_start_of_a_piece():
    world, state, contacts = edge_to_be_left()
    free = free_acceleration(world, state.axes, state.velocity)
    piece = constant(world, state, decide(world, state, contacts, free), 1.0)
    event = events.first_event(world, piece, after_instant=False)
    assert event.at_start and event.kind is events.Kind.FEATURE and event.ended == set(contacts.names)


def test_reasons_why_pieces_end():
    """A ball that slides on a box rolls, and comes to its edge."""
    world = world_of(model := replace(on_a_box(2, 1.0, 3.0, 0.0), friction=np.full((2, 2), 0.5)))
    moving, why = Loop(world, start_of(model), 1e-11, 10.0 * world.time), []
    for _ in range(2):
        moving.next_piece()
        why.append(moving.ends)
    assert why == [events.Kind.SLIDE, events.Kind.FEATURE]


def falling_ball(e):
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    return Model(2, [floor, Body(Disc(0.5), 1.0, 0.125, (0.0, 0.5 + 1e-5, 0.0))], (0.0, -G), e, 0.0)


def test_search_that_stops_in_a_sum_of_rebounds(monkeypatch):
    """The series goes on: speeds are not taken off before its end."""
    model = falling_ball(0.5)
    moving = Loop(world_of(model), start_of(model), 1e-11, 1.0)
    while (piece := moving.next_piece()[1]).held.lasts is None:
        begin = copy.deepcopy(moving)
    assert piece.held.lasts == piece.length
    monkeypatch.setattr(events, "next_meeting", lambda *_: (0.5, True))
    piece = begin.next_piece()[1]
    assert piece.length == 0.5 * piece.held.lasts and not begin.blows


def free_plate():
    """A plate that turns about all three axes and falls on the ground."""
    ground = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, *UPRIGHT[3]))
    plate = Body(
        Box((0.5, 0.3, 0.1)), 1.0, (0.03, 0.09, 0.11), (0.0, 0.0, 0.8, *UPRIGHT[3]), (0.0, 0.0, 0.0, 3.0, 1.0, 2.0)
    )
    return Model(3, [ground, plate], (0.0, 0.0, -G), 0.5, 0.3)


def test_tolerance_of_a_step_that_is_cut(monkeypatch):
    """A step up to an event is made to the tolerance of the one in which the event was found."""

    def told(world, state, held, tolerance, length):
        asked.append((state.t, tolerance))
        return made(world, state, held, tolerance, length)

    asked, made, model = [], loop.step, free_plate()
    monkeypatch.setattr(loop, "step", told)
    moving = Loop(world_of(model), start_of(model), 1e-11, 1.0)
    while len(asked) == len({t for t, _ in asked}):
        moving.next_piece()
    assert {tolerance for _, tolerance in asked} == {1e-11 * loop.FREE}


def first_blow(model):
    moving = Loop(world_of(model), start_of(model), 1e-11, 1.0)
    while not (blows := moving.next_piece()[0]):
        pass
    return blows[0].after


def test_step_that_is_cut_and_becomes_shorter_still(monkeypatch):
    """It ends before its event, which is found again."""

    def half(world, state, held, tolerance, length):
        begins.append(state.t)
        return made(
            world,
            state,
            held,
            tolerance,
            length * (0.5 if len(begins) - len(set(begins)) == 1 and begins.count(state.t) == 2 else 1.0),
        )

    begins, made, model = [], loop.step, free_plate()
    truth = first_blow(model)
    monkeypatch.setattr(loop, "step", half)
    moving = Loop(world_of(model), start_of(model), 1e-11, 1.0)
    while len(begins) == len(set(begins)):
        moving.next_piece()
    assert moving.held is not None  # nothing happens there
    begins.clear()
    found = first_blow(model)
    assert len(begins) > len(set(begins)) and abs(found.t - truth.t) < 1e-11
    assert np.abs(found.velocity - truth.velocity).max() < 1e-9


def test_more_contacts_than_there_is_room_for(monkeypatch):
    """A floor of boxes below a box that lies on all of them."""
    tiles = [Body(Box((0.5, 0.5)), motion="fixed", pose=(float(k), -0.5, 0.0)) for k in range(6)]
    model = Model(2, [*tiles, Body(Box((2.7, 0.5)), 1.0, 1.0, (2.5, 0.5, 0.0))], (0.0, -G), 0.0, 0.0)
    world, state = world_of(model), start_of(model)
    every = features.find(world, state)
    assert len(every) > 8
    monkeypatch.setattr(features, "ROOM", 3)
    assert np.array_equal(features.find(world, state), every)
