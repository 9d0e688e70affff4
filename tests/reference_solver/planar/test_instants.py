"""What happens in no time, or all but none: jams, hops, series of rebounds on contacts that turn, touching racks."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Polygon, Settings, Simulation
from reference_solver.certificate.relations import Change
from reference_solver.certificate.truth import certify
from reference_solver.compilation import from_python
from reference_solver.needs import needs
from reference_solver.pieces import IMPACT, IMPULSE_LEVEL, ROCKING
from reference_solver.planar import entries, manifolds
from reference_solver.planar.columns import GAP, NX, NY
from reference_solver.planar.world import World
from reference_solver.stepping import clock

detect = from_python(manifolds.detect)

DOWN = (0.0, -9.81)
FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")


def rod(half, lean, speed):
    """A thin box with its lower left corner on the floor, sliding to the left."""
    c, s = math.cos(lean), math.sin(lean)
    pose = (half[0] * c - half[1] * s, half[0] * s + half[1] * c, lean)
    moment = (half[0] ** 2 + half[1] ** 2) / 3.0
    return Body(Box(half), 1.0, moment, pose, (-speed, 0.0, 0.0))


@pytest.mark.parametrize(("mu", "lean", "speed"), [(2.5, 1.2, 1.0), (2.0, 1.0, 1.0), (2.0, 0.8, 3.0)])
def test_a_slip_that_no_force_stands_against_ends_by_the_impulses_of_a_jam(mu, lean, speed):
    """W p = (0, -u_t), which lies within the cone: the corner stops at once, and the rod pivots from there on."""
    body = rod((0.5, 1e-3), lean, speed)
    model = Model(2, [FLOOR, body], DOWN, 0.0, mu)
    simulation = Simulation(model, Settings.reference(1.0 / 240.0))
    simulation.advance(1)
    arm = np.array([-body.pose[0], -body.pose[1]])
    rows = np.array([[0.0, 1.0, arm[0]], [1.0, 0.0, -arm[1]]])  # normal, tangent to the right
    inverse = np.diag([1.0, 1.0, 1.0 / body.inertia])
    impulse = np.linalg.solve(rows @ inverse @ rows.T, [0.0, speed])
    assert impulse[0] > 0.0 and abs(impulse[1]) < mu * impulse[0]  # the jam that the law allows
    after = np.array(body.twist) + inverse @ rows.T @ impulse
    first = Simulation(model, Settings.reference(1e-6))
    first.advance(1)
    assert first.twist[1] == pytest.approx(after, abs=1e-4)  # and a microsecond of weight: 1e-5 m/s
    certificate = certify(model, Settings.reference(1.0 / 240.0), 20)
    assert certificate.holds, certificate.reasons
    assert certificate.error[-1] < 1e-9


def test_a_smooth_disc_leaves_another_where_nothing_presses_it_and_is_not_drawn_back():
    """cos(phi) = 2/3 from rest; the level speed it leaves with stays what it is."""
    hill, radius, lean = 1.0, 0.25, 0.05
    reach = hill + radius
    pose = (reach * math.sin(lean), reach * math.cos(lean), 0.0)
    bodies = [Body(Disc(hill), motion="fixed"), Body(Disc(radius), 1.0, 0.03, pose)]
    simulation = Simulation(Model(2, bodies, DOWN, 0.0, 0.0), Settings.reference(1.0 / 60.0))
    cosine = 2.0 * math.cos(lean) / 3.0
    level = math.sqrt(9.81 * reach * cosine) * cosine
    while math.hypot(*simulation.pose[1, :2]) < reach + 1e-2:
        simulation.advance(1)
    assert simulation.twist[1, 0] == pytest.approx(level, abs=1e-8)
    assert simulation.certificate["held_steps"] == 0


@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("seed", range(4))
def test_a_series_of_rebounds_on_a_corner_ends_where_the_step_says_nothing(restitution, seed):
    """The step's end decides when a series is held: runs whose steps end elsewhere agree all the same."""
    random = np.random.default_rng(700 + seed)
    half, angle = random.uniform(0.15, 0.4, 2), random.uniform(-3.0, 3.0)
    body = Body(Box(tuple(half)), 1.0, float(half @ half) / 3.0, (0.0, 0.9, angle), (0.3, 0.0, random.uniform(-2, 2)))
    model = Model(2, [FLOOR, body], DOWN, restitution, 0.8)
    time = 0.6
    # What is held moves 1e-11 of a half width over a hundred steps, phases are good to 1e-10 (gates of `certify`), and
    # some ten impacts on corners multiply either by less than ten; held too soon it was 1e-6.
    ends = []
    for steps in (144, 200, 1003):
        simulation = Simulation(model, Settings.reference(time / steps))
        simulation.advance(steps)
        ends.append(simulation.pose[1].copy())
    assert ends[0] == pytest.approx(ends[2], abs=1e-8)
    assert ends[1] == pytest.approx(ends[2], abs=1e-8)


@pytest.mark.parametrize("apart", [0.0, 1e-12])
def test_a_rack_that_touches_is_broken_by_one_impact(apart):
    """Six smooth elastic discs in a triangle: Newton's law at all contacts at once keeps momentum and energy."""
    radius, bodies = 0.1, []
    for row in range(3):
        for k in range(row + 1):
            side = 2.0 * radius + apart
            bodies.append(Body(Disc(radius), 1.0, 0.005, ((k - 0.5 * row) * side, row * side * math.sqrt(0.75), 0.0)))
    bodies.append(Body(Disc(radius), 1.0, 0.005, (0.0, -1.0, 0.0), (0.0, 2.0, 0.0)))
    simulation = Simulation(Model(2, bodies, (0.0, 0.0), 1.0, 0.0), Settings.reference(1.0 / 240.0))
    simulation.advance(130)
    assert simulation.certificate["holds"], simulation.certificate["reasons"]
    assert simulation.twist[:, 1].sum() == pytest.approx(2.0, abs=1e-13)
    assert (simulation.twist[:, :2] ** 2).sum() == pytest.approx(4.0, abs=1e-12)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_corners_that_meet_touch_along_the_edges_that_approach_least(sign, swapped):
    """Both pairs of edges tie with no gap; order of bodies, and mirrors, change nothing."""
    turn = 0.25 * math.pi
    bodies = [
        Body(Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (0.0, 0.0, turn), (1.0, 0.4 * sign, 0.0)),
        Body(Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (math.sqrt(2.0) + 0.1, 0.04 * sign, turn)),
    ]
    if swapped:
        bodies = bodies[::-1]
    simulation = Simulation(Model(2, bodies, (0.0, 0.0), 0.0, 0.0), Settings.reference(1.0 / 240.0))
    pieces = simulation.record(48, pieces=True).pieces
    blow = pieces.first_contact[np.flatnonzero(pieces.kind == IMPACT)[0]]
    # (1, -1) sqrt(1/2) closes with .6 sqrt(1/2) m/s, (1, 1) sqrt(1/2) with 1.4 sqrt(1/2). At the lever 1/2 a body
    # yields 1 + (1/4)/(1/6) = 2.5 /kg: an impulse of .6 sqrt(1/2)/5, .06 along either axis; on B, which comes second.
    onto_b = np.array([0.06, -0.06 * sign]) * (-1.0 if swapped else 1.0)
    assert pieces.impulse[blow] == pytest.approx(onto_b, abs=1e-9)
    assert simulation.certificate["holds"]


def rows_of(model):
    """Normals and gaps of the contacts that are near."""
    world = World(model, Settings.reference(1.0 / 60.0), needs(model))
    assert detect(world._bodies, world._pairs, world._rows, world._options)
    return world._rows.real[: int(world._rows.counts[0])][:, [NX, NY, GAP]].copy()


def test_faces_that_are_all_but_parallel_know_no_heading():
    """Which of two faces a contact goes by is told by their order, not by when each stops to separate the boxes.

    Both have all but the same normal, whatever way it points: a quarter turn of the world turns all contacts, and one
    that went by the other face would have its normal off by the tilt, 1e-3 rad.
    """
    random, turn = np.random.default_rng(4), Change(2, axes=(1, 0), signs=(-1.0, 1.0))
    for _ in range(50):
        tilt, half, apart = random.uniform(-9e-4, 9e-4), (0.5, 0.3), random.choice([0.0, 1e-5, 1e-3])
        height = half[0] * abs(math.sin(tilt)) + half[1] * math.cos(tilt) + apart
        twist = (random.uniform(-1.0, 1.0), -0.3, random.uniform(-0.5, 0.5))
        bodies = [
            Body(Box((0.5, 0.5)), 2.0, 0.3, (0.0, -0.5, 0.0)),
            Body(Box(half), 1.0, 0.1, (random.uniform(-0.6, 0.6), height, tilt), twist),
        ]
        model = Model(2, bodies if random.uniform() < 0.5 else bodies[::-1], DOWN, 0.5, 0.0)
        rows, turned = rows_of(model), rows_of(turn.model(model))
        assert len(rows) > 0
        assert np.stack([-rows[:, 1], rows[:, 0], rows[:, 2]], axis=1) == pytest.approx(turned, abs=1e-14)


def test_where_nothing_rubs_no_contact_is_said_to():
    """A smooth polygon that rolls over: the normal turns, and what it was before is no tangential impulse."""
    corners = [(0.4 * math.cos(a), 0.4 * math.sin(a)) for a in np.arange(5) * 0.4 * math.pi]
    body = Body(Polygon.about_centroid(tuple(corners)), 1.0, 0.05, (0.0, 0.5, 0.3), (0.5, 0.0, 2.0))
    hill = Body(Disc(0.5), motion="fixed", pose=(0.0, -0.5, 0.0))
    simulation = Simulation(Model(2, [FLOOR, hill, body], DOWN, 0.0, 0.0), Settings.reference(1.0 / 240.0))
    for _ in range(200):
        simulation.advance(1)
        contacts = simulation.contacts()
        for normal, impulse in zip(contacts.normal, contacts.impulse, strict=True):
            along = normal[0] * impulse[1] - normal[1] * impulse[0]
            assert abs(along) <= 0.05 * math.hypot(*impulse) + 1e-15  # normals turn within a step
    assert simulation.certificate["excess"] <= 1e-14


def test_a_piece_in_which_bodies_rock_to_rest_is_named_so_and_another_that_is_held_is_not():
    model, named = Model(2, [FLOOR, rod((0.5, 0.1), 0.1, 0.0)], DOWN, 0.0, 0.5), from_python(entries.impulse_scheme)
    sub = World(model, Settings.reference(1.0 / 60.0), needs(model))._sub
    sub.clock[clock.HELD] = 1.0
    assert named(sub) == IMPULSE_LEVEL
    sub.clock[clock.ROCKING] = 1.0
    assert named(sub) == ROCKING
