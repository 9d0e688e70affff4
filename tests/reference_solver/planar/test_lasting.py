"""Held contacts at any pose: gamma is the rate of the rows, and the state is pose, twist and time alone."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Settings, Simulation
from reference_solver.compilation import from_python
from reference_solver.needs import needs
from reference_solver.pieces import IMPACT
from reference_solver.planar import lasting as held
from reference_solver.planar import manifolds, rows
from reference_solver.planar.world import World
from reference_solver.stepping.lasting import allocate_lasting

evaluate, hold = from_python(held.evaluate), from_python(held.hold)
detect, prepare_masses = from_python(manifolds.detect), from_python(rows.prepare_masses)

DOWN = (0.0, -9.81)
TRIANGLE = Polygon(((0.6, 0.0), (-0.3, 0.5), (-0.3, -0.5)))


def touching(first, second, place, angle, other):
    """A world of two bodies that touch, both moving and turning."""
    state = {"pose": (0.0, 0.0, other), "twist": (0.3, -0.2, 0.9)}
    if isinstance(first, HalfSpace):
        lower = Body(first, motion="prescribed", **state)
    else:
        lower = Body(first, 1.0, 0.4, **state)
    bodies = [lower, Body(second, 2.0, 0.3, (*place, angle), (-0.4, 0.5, -1.7))]
    model = Model(2, bodies, (0.0, 0.0), 0.0, 0.5)
    return World(model, Settings.reference(1.0 / 240.0), needs(model))


PAIRS = {
    "disc on disc": (Disc(0.5), Disc(0.3), (0.48, 0.64), 0.2, 0.1),
    "disc on half-space": (HalfSpace((0.6, 0.8)), Disc(0.3), (0.18, 0.24), 0.2, 0.0),
    "corner on half-space": (HalfSpace((0.0, 1.0)), Box((0.3, 0.4)), (0.0, 0.3 * 0.6 + 0.4 * 0.8), math.asin(0.6), 0.0),
    "corner on face": (Box((1.0, 0.5)), Box((0.3, 0.4)), (0.1, 0.5 + 0.3 * 0.6 + 0.4 * 0.8), math.asin(0.6), 0.0),
    "face on corner": (Box((0.3, 0.4)), Box((1.0, 0.5)), (-0.1, 0.5 + 0.3 * 0.6 + 0.4 * 0.8), 0.0, math.asin(0.6)),
    "disc on corner": (Box((0.3, 0.4)), Disc(0.5), (0.6, 0.8), 0.3, 0.0),
    "disc on face": (Box((0.3, 0.4)), Disc(0.5), (0.1, 0.9), 0.3, 0.0),
    "capsule end on disc": (Capsule(0.4, 0.1), Disc(0.5), (0.76, 0.48), 0.3, 0.0),
    "capsule side on disc": (Capsule(0.4, 0.1), Disc(0.5), (0.2, 0.6), 0.3, 0.0),
    "corner on polygon": (TRIANGLE, Capsule(0.4, 0.1), (1.1, 0.0), 0.0, 0.0),
}


def rows_of(world, lasting):
    evaluate(world._bodies, lasting)
    return lasting.jacobian[: lasting.size[0]].copy(), lasting.gap[: lasting.size[0]].copy()


def displaced(world, pose, t):
    bodies = world._bodies
    bodies.pose[:] = pose + t * bodies.twist
    bodies.real[:, 0], bodies.real[:, 1] = np.cos(bodies.pose[:, 2]), np.sin(bodies.pose[:, 2])


@pytest.mark.parametrize("name", PAIRS)
def test_gamma_is_the_rate_of_the_rows_along_the_motion(name):
    world = touching(*PAIRS[name])
    lasting = allocate_lasting(2, 2, 8)
    assert detect(world._bodies, world._pairs, world._rows, world._options)
    count = int(world._rows.counts[0])
    touched = [c for c in range(count) if abs(world._rows.real[c, 17]) < 1e-12]
    assert touched
    for k, c in enumerate(touched):
        prepare_masses(world._bodies, world._rows, c)
        hold(world._bodies, world._rows, lasting, c, k)
    lasting.size[0] = len(touched)
    pose, twist, step = world.pose.copy(), world.twist.copy(), 1e-6
    for offset in (0.0, 0.01):  # touching, and off contact: stages of a step leave it
        displaced(world, pose, offset)
        centre = rows_of(world, lasting)
        gamma, speed = lasting.gamma[: len(touched)].copy(), lasting.speed[: len(touched)].copy()
        displaced(world, pose, offset + step)
        after = rows_of(world, lasting)
        displaced(world, pose, offset - step)
        before = rows_of(world, lasting)
        for k, (a, b) in enumerate(lasting.body[: len(touched)]):
            both = np.stack([twist[a], twist[b]])
            rate = ((after[0][k] - before[0][k]) / (2.0 * step)).transpose(1, 0, 2)
            # Central differences: a normal turns with 15 rad/s at most, 15^3 1e-12 / 6; round-off 1e-16 over 1e-6.
            assert gamma[k] == pytest.approx((rate * both).sum(axis=(1, 2)), abs=2e-9)
            assert speed[k, 0] == pytest.approx((after[1][k] - before[1][k]) / (2.0 * step), abs=2e-9)
            assert speed[k] == pytest.approx((centre[0][k].transpose(1, 0, 2) * both).sum(axis=(1, 2)), abs=1e-14)
    displaced(world, pose, 0.0)
    _, gap = rows_of(world, lasting)
    assert np.abs(gap).max() < 1e-14
    for k, c in enumerate(touched):
        row = world._rows.real[c]
        normal = lasting.frame[k, 0]
        assert normal == pytest.approx(row[:2], abs=1e-15)


def hill():
    lean, apart = 0.3, 1.3
    place = (apart * math.sin(lean), apart * math.cos(lean), 0.0)
    return Model(2, [Body(Disc(1.0), motion="fixed"), Body(Disc(0.3), 1.0, 0.045, place)], DOWN, 0.0, 0.3)


def rebuilt(model, simulation):
    """The model in the state of a simulation: pose, twist and time are all that is kept."""
    bodies = []
    for k, body in enumerate(model.bodies):
        state = {"pose": tuple(simulation.pose[k]), "twist": tuple(simulation.twist[k])}
        moving = {"mass": body.mass, "inertia": body.inertia} if body.motion == "free" else {}
        bodies.append(Body(body.shape, motion=body.motion, **moving, **state))
    return Model(2, bodies, DOWN, 0.0, float(model.friction[0, 1]))


def test_a_run_rebuilt_from_pose_and_twist_goes_on_with_the_same_bits():
    model, settings = hill(), Settings.reference(1.0 / 240.0)
    whole = Simulation(model, settings)
    parts = Simulation(model, settings)
    for _ in range(12):
        whole.advance(10)
        parts.advance(10)
        parts = Simulation(rebuilt(model, parts), settings)
    assert np.array_equal(whole.pose, parts.pose)
    assert np.array_equal(whole.twist, parts.twist)


@pytest.mark.parametrize("change", [{"warm_starting": False}, {"direct": False}])
def test_settings_of_the_solver_leave_a_turning_contact_alone(change):
    settings = Settings.reference(1.0 / 240.0)
    one, other = Simulation(hill(), settings), Simulation(hill(), replace(settings, **change))
    one.advance(200)
    other.advance(200)
    assert one.certificate["events"] == other.certificate["events"]
    # It rolls, slips and leaves; impacts and frozen phases are solved to 1e-13 of speeds of some m/s.
    assert np.abs(one.pose - other.pose).max() < 1e-12


def test_a_corner_that_lands_spinning_leaves_at_once():
    """e = 0 ends its approach; where w^2 r cos > g it parts nevertheless, and flies."""
    half, spin, angle, dt = 0.1, 30.0, 0.25 * math.pi * 0.9, 1.0 / 240.0
    low = half * (math.sin(angle) + math.cos(angle))
    box = Body(Box((half, half)), 1.0, 2.0 * half**2 / 3.0, (0.0, low, angle), (0.0, -0.5, spin))
    simulation = Simulation(
        Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), box], DOWN, 0.0, 0.0), Settings.reference(dt)
    )
    simulation.advance(1)
    arm = math.cos(angle) * -half + math.sin(angle) * half  # of the lowest corner (-h, -h)
    inertia = 2.0 * half**2 / 3.0
    impulse = -(-0.5 + arm * spin) / (1.0 + arm**2 / inertia)
    assert simulation.twist[1] == pytest.approx(
        [0.0, -0.5 + impulse - 9.81 * dt, spin + arm * impulse / inertia], abs=1e-12
    )


@pytest.mark.parametrize(("half", "lean", "spin"), [((1.0, 0.2), 0.5, -1.0), ((0.6, 0.05), 0.3, -3.0)])
@pytest.mark.parametrize("rate", [20, 60])
def test_a_phase_that_an_impact_cuts_ends_where_bodies_touch(rate, half, lean, spin):
    """A plate that pivots about a corner until the next one lands.

    The impact is looked for on the path of a longer phase, which is 1e-12 m off at these steps: the plate was in the
    floor by that, and struck it twice. The phase is made again until it ends where its own path lands.
    """
    turn = np.array([[math.cos(lean), -math.sin(lean)], [math.sin(lean), math.cos(lean)]])
    x, y = turn @ half
    plate = Body(Box(half), 1.0, (half[0] ** 2 + half[1] ** 2) / 3.0, (x, y, lean), (-spin * y, spin * x, spin))
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), plate], DOWN, 0.5, 5.0)
    pieces = Simulation(model, Settings.reference(1.0 / rate)).record(round(0.5 * rate), pieces=True).pieces
    impacts = np.flatnonzero(pieces.kind == IMPACT)
    assert pieces.begin[impacts[0]] > 0.05 and (np.diff(pieces.begin[impacts]) > 1e-6).all()
    place = pieces.first_body[impacts[0]] + list(pieces.body[pieces.first_body[impacts[0]] :]).index(1)
    _, height, angle = pieces.pose_before[place]
    # Height less the parts of both half widths: a rounding each, of numbers below the longer one, and of the angle's.
    low = height + np.array([-1.0, 1.0]) * half[0] * math.sin(angle) - half[1] * math.cos(angle)
    assert np.abs(low).max() <= 4.0 * np.finfo(float).eps * half[0]


@pytest.mark.few(2)
@pytest.mark.parametrize(
    "end, rate, form", [(1, 0.5, "corner"), (1, -0.5, "edge"), (-1, -0.5, "corner"), (-1, 0.5, "edge")]
)
def test_a_ball_over_the_end_of_a_face_goes_by_its_corner_where_it_goes_out_and_by_the_face_where_it_comes_in(
    end, rate, form
):
    block = Body(Box((0.3, 0.4)), motion="fixed")
    ball = Body(Disc(0.5), 1.0, 0.1, (0.3 * end, 0.9, 0.0), (rate, 0.0, 0.0))
    model = Model(2, [block, ball], (0.0, 0.0), 0.0, 0.5)
    world = World(model, Settings.reference(1.0 / 240.0), needs(model))
    lasting = allocate_lasting(2, 2, 8)
    assert detect(world._bodies, world._pairs, world._rows, world._options)
    prepare_masses(world._bodies, world._rows, 0)
    hold(world._bodies, world._rows, lasting, 0, 0)
    assert lasting.kind[0, held.FORM] == {"corner": held.POINTS, "edge": held.EDGE_OF_A}[form]
