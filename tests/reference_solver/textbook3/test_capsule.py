"""Contacts of spatial capsules against supports of the shapes along many directions, and capsules in motion."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from reference_solver import Body, Box, Capsule, HalfSpace, Model, Settings, Simulation, Sphere

DT = 1.0 / 240.0
FLOOR = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
#: Upright: body x along world z.
UPRIGHT = (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0)


def matrix(q):
    w, v = q[0], np.array(q[1:])
    return np.array([e + 2.0 * (w * np.cross(v, e) + np.cross(v, np.cross(v, e))) for e in np.eye(3)]).T


def body(shape, place, turn=(1.0, 0.0, 0.0, 0.0), **fields):
    turn = np.asarray(turn, float) / np.linalg.norm(turn)
    return Body(shape, 1.0, (0.1, 0.3, 0.3), (*place, *turn), **fields)


def touch(*bodies):
    simulation = Simulation(Model(3, bodies, (0.0, 0.0, 0.0), 0.0, 0.5), Settings.fixed_step(DT))
    simulation.advance(1)
    return simulation.contacts()


def core(one):
    """Vertices in the world and radius, from the shape's public fields."""
    shape = one.shape
    if isinstance(shape, Box):
        local, radius = np.array(list(itertools.product((-1, 1), repeat=3))) * shape.half_extents, 0.0
    elif isinstance(shape, Capsule):
        local, radius = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]) * shape.half_length, shape.radius
    else:
        local, radius = np.zeros((1, 3)), shape.radius
    return local @ matrix(one.pose[3:]).T + one.pose[:3], radius


def separation(a, b, directions):
    (va, ra), (vb, rb) = core(a), core(b)
    return (directions @ vb.T).min(axis=1) - (directions @ va.T).max(axis=1) - ra - rb


RANDOM = np.random.default_rng(7).standard_normal((3000, 3))
SPHERE_OF_DIRECTIONS = RANDOM / np.linalg.norm(RANDOM, axis=1)[:, None]


def largest_separation(a, b):
    """Largest over all directions: the five best of the sphere, each followed uphill in ever smaller cones.

    The directions of the sphere alone are .05 apart, over which the separation of bodies of this size changes by .04.
    """
    best = []
    for start in np.argsort(separation(a, b, SPHERE_OF_DIRECTIONS))[-5:]:
        direction, size = SPHERE_OF_DIRECTIONS[start], 0.1
        while size > 1e-5:
            cone = np.vstack([direction, direction + size * RANDOM[:300]])
            cone /= np.linalg.norm(cone, axis=1)[:, None]
            found = separation(a, b, cone)
            direction, size = cone[found.argmax()], 0.7 * size
        best.append(found.max())
    return max(best)


numbers = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
turns = st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: math.hypot(*q) > 0.1)
SHAPES = {"sphere": Sphere(0.3), "capsule": Capsule(0.5, 0.25), "box": Box((0.5, 0.3, 0.4))}


@given(st.sampled_from(sorted(SHAPES)), st.booleans(), st.tuples(numbers, numbers, numbers), turns, turns)
@hypothesis_settings(derandomize=True)
def test_contacts_along_the_axis_of_least_overlap(name, swapped, place, turn_a, turn_b):
    """The gap is the separation along the normal, and no direction separates better.

    A pair of edges must win by 1e-3 of the smaller half width, and only where the cores overlap.
    """
    shapes = (SHAPES[name], Capsule(0.4, 0.2))
    one, other = body(shapes[1 if swapped else 0], (0.1, -0.2, 0.3), turn_a), None
    other = body(shapes[0 if swapped else 1], np.multiply(place, 1.2) + (0.1, -0.2, 0.3), turn_b)
    contacts = touch(one, other)
    if len(contacts) == 0:
        assert largest_separation(one, other) > 0.0
        return
    assert len(contacts) <= 2
    normal = contacts.normal[0]
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-14)
    near = normal + 0.05 * RANDOM[:1000]
    gap = separation(one, other, normal[None])[0]
    best = separation(one, other, np.vstack([SPHERE_OF_DIRECTIONS, near / np.linalg.norm(near, axis=1)[:, None]])).max()
    assert contacts.gap.min() == pytest.approx(gap, abs=1e-12)
    assume(np.linalg.norm(place) > 1e-3)
    assert best <= gap + 1.01e-3 * 0.2
    for point in contacts.point:
        dot = Sphere(1e-12)
        for side in (one, other):
            outside = separation(body(dot, point), side, SPHERE_OF_DIRECTIONS).max()
            assert outside <= 0.5 * abs(gap) + 1e-9


@pytest.mark.parametrize("tilt", [0.0, 1e-4, 5e-3])
def test_contacts_of_a_capsule_along_a_face(tilt):
    turn = (math.cos(0.5 * tilt), 0.0, math.sin(0.5 * tilt), 0.0)  # the +x end goes down
    centre = (0.1, 0.2, 0.4 + 0.25 + 0.4 * math.sin(tilt) - 1e-4)
    contacts = touch(body(Box((0.9, 0.9, 0.4)), (0.0,) * 3, motion="fixed"), body(Capsule(0.4, 0.25), centre, turn))
    rise = 0.8 * math.sin(tilt)
    expected = [-1e-4, rise - 1e-4] if rise < 0.01 * 0.25 else [-1e-4]
    assert sorted(contacts.gap) == pytest.approx(expected, abs=1e-14)
    assert contacts.normal == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(expected), 1)), abs=1e-15)


def test_contacts_of_a_capsule_along_an_edge():
    out = np.array([0.0, 0.6, 0.8])
    box, capsule = (
        body(Box((0.3, 0.5, 0.4)), (0.0,) * 3),
        body(Capsule(0.5, 0.2), np.array([0.1, 0.5, 0.4]) + 0.199 * out),
    )
    contacts = touch(box, capsule)
    assert contacts.gap == pytest.approx([-1e-3, -1e-3], abs=1e-15)
    assert contacts.normal == pytest.approx(np.tile(out, (2, 1)), abs=1e-14)
    assert sorted(contacts.point[:, 0]) == pytest.approx([-0.3, 0.3], abs=1e-15)


def test_contacts_of_parallel_and_crossed_capsules():
    first = body(Capsule(0.5, 0.2), (0.0, 0.0, 0.0))
    beside = touch(first, body(Capsule(0.4, 0.2), (0.3, 0.399, 0.0)))
    assert sorted(beside.point[:, 0]) == pytest.approx([-0.1, 0.5], abs=1e-15)
    assert beside.gap == pytest.approx([-1e-3, -1e-3], abs=1e-15)
    crossed = touch(first, body(Capsule(0.4, 0.2), (0.3, 0.1, 0.399), (1.0, 0.0, 0.0, 1.0)))
    assert crossed.point == pytest.approx(np.array([[0.3, 0.0, 0.1995]]), abs=1e-15)
    assert crossed.normal == pytest.approx(np.array([[0.0, 0.0, 1.0]]), abs=1e-15)


@pytest.mark.parametrize("turn", [(1.0, 0.0, 0.0, 0.0), UPRIGHT], ids=["lying", "upright"])
def test_a_resting_capsule_carries_its_weight(turn):
    """Lying along y it could roll, upright it could fall: in exact balance it does neither."""
    height = 0.2 if turn[0] == 1.0 else 0.6
    simulation = Simulation(
        Model(3, [FLOOR, body(Capsule(0.4, 0.2), (0.0, 0.0, height), turn)], (0.0, 0.0, -9.81), 0.0, 0.5),
        Settings.fixed_step(DT),
    )
    simulation.advance(60)
    assert simulation.contacts().impulse.sum(axis=0) == pytest.approx([0.0, 0.0, 9.81 * DT], abs=1e-14)
    assert simulation.pose[1, :3] == pytest.approx([0.0, 0.0, height], abs=1e-12)


def test_rolling_speed_of_a_capsule_released_sliding():
    """Across its axis a capsule is a disc: v = v0 / (1 + k), k = I / (m r^2) about the axis."""
    moments = (0.02, 0.1, 0.1)
    capsule = Body(Capsule(0.4, 0.2), 1.0, moments, (0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0, 0.0, 0.0))
    simulation = Simulation(Model(3, [FLOOR, capsule], (0.0, 0.0, -9.81), 0.0, 0.3), Settings.fixed_step(DT))
    simulation.advance(120)
    k = 0.02 / 0.2**2
    assert simulation.twist[1, 1] == pytest.approx(1.0 / (1.0 + k), abs=1e-12)
    assert simulation.twist[1, 3] == pytest.approx(-simulation.twist[1, 1] / 0.2, abs=1e-11)
