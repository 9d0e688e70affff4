"""Contact points of spheres, boxes and half-spaces against geometry worked out another way."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.textbook3.manifolds import FLAT

DT = 1.0 / 240.0
SETTINGS = Settings.fixed_step(DT)


def matrix(q):
    """Rotation matrix of a quaternion of any length, by its action on the axes."""
    w, v = q[0], np.array(q[1:])
    n = w * w + v @ v
    return np.array([e + 2 * (w * np.cross(v, e) + np.cross(v, np.cross(v, e))) / n for e in np.eye(3)]).T


def body(shape, place, turn=(1.0, 0.0, 0.0, 0.0), **fields):
    turn = np.asarray(turn, float) / np.linalg.norm(turn)
    return Body(shape, 1.0, (1.0, 1.0, 1.0), (*place, *turn), **fields)


def touch(*bodies, settings=SETTINGS):
    """Contacts of bodies at rest: one step moves nothing before detection."""
    simulation = Simulation(Model(3, bodies, (0.0, 0.0, 0.0), 0.0, 0.5), settings)
    simulation.advance(1)
    return simulation.contacts()


def corners(half, place, turn):
    signs = np.array(list(itertools.product((-1, 1), repeat=3)))
    return np.asarray(place) + (signs * half) @ matrix(turn).T


def separations(a, b):
    """Gaps along the candidate axes of two boxes (half, place, turn), from projected corners alone."""
    ra, rb = matrix(a[2]), matrix(b[2])
    axes = [*ra.T, *rb.T]
    for i, j in itertools.product(range(3), range(3)):
        n = np.cross(ra[:, i], rb[:, j])
        if np.linalg.norm(n) > 1e-3:
            axes.append(n / np.linalg.norm(n))
    gaps = []
    for n in axes:
        pa, pb = corners(*a) @ n, corners(*b) @ n
        gaps.append(max(pb.min() - pa.max(), pa.min() - pb.max()))
    return np.array(gaps), np.array(axes)


numbers = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
turns = st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: math.hypot(*q) > 0.1)
halves = st.tuples(*[st.floats(0.2, 1.0).map(lambda x: round(x, 2))] * 3)
places = st.tuples(numbers, numbers, numbers)


@example((0.5, 0.38, 0.7), (0.47, 1.0, 1.0), (-0.188, 0.0, 0.98), (0.0, 0.5, 0.625, 0.0), (0.375, 0.0, 0.367, 0.0))
@given(halves, halves, places, turns, turns)
def test_box_contacts_along_the_axis_of_least_overlap(half_a, half_b, place, turn_a, turn_b):
    a, b = (half_a, (0.1, -0.2, 0.3), turn_a), (half_b, np.multiply(place, 1.5), turn_b)
    gaps, _ = separations(a, b)
    best, extent = gaps.max(), min(*half_a, *half_b)
    contacts = touch(body(Box(half_a), a[1], turn_a), body(Box(half_b), b[1], turn_b))
    if best > 0.0101 * extent:  # the margin within which contacts are kept is 0.01 of the smaller half width
        assert len(contacts) == 0
        return
    assume(best < -1e-9)
    assert 1 <= len(contacts) <= 8
    n = contacts.normal[0]
    assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-14)
    pa, pb = corners(*a) @ n, corners(*b) @ n
    overlap = pa.max() - pb.min()
    # An edge pair must beat a face by 1e-3 of the extent, a face of b one of a by 1e-6.
    assert -best - 1e-12 <= overlap <= -best + 1.01e-3 * extent
    assert np.dot(n, np.subtract(b[1], a[1])) >= -1e-12
    assert contacts.gap.min() >= -overlap - 1e-12
    # Midway between the surfaces: inside both boxes grown by the overlap, or by the gap that a point is kept with.
    for point, gap in zip(contacts.point, contacts.gap, strict=True):
        for half, centre, turn in (a, b):
            local = matrix(turn).T @ (point - centre)
            assert (np.abs(local) <= np.array(half) + 0.5 * max(overlap, gap) + 1e-9).all()


# Centres side by side along the normal: round-off must not choose which way it points.
@example((1.0, 1.0, 1.0), (1.0, 0.5, 0.25), (0.125, 0.0, 0.0), (0, 1, 1, 1), (0, 0, 0, 1), (0, 1, 0, 1), (0, 0, 0))
@given(halves, halves, places, turns, turns, turns, places)
def test_contacts_move_with_the_bodies(half_a, half_b, place, turn_a, turn_b, motion, shift):
    """Turning and shifting both boxes turns and shifts normal and points, and keeps gaps and features."""
    a, b = (half_a, (0.0, 0.0, 0.0), turn_a), (half_b, place, turn_b)
    gaps, _ = separations(a, b)
    assume(distinct(gaps, min(*half_a, *half_b)))
    before = touch(body(Box(half_a), a[1], turn_a), body(Box(half_b), b[1], turn_b))
    r = matrix(motion)
    after = touch(
        body(Box(half_a), r @ a[1] + shift, product(motion, turn_a)),
        body(Box(half_b), r @ b[1] + shift, product(motion, turn_b)),
    )
    assume(not near_reach(before, half_a, half_b))
    assert after.feature.tolist() == before.feature.tolist()
    assert after.gap == pytest.approx(before.gap, abs=1e-12)
    assert after.normal == pytest.approx(before.normal @ r.T, abs=1e-12)
    # Edges that are nearly parallel place their point with a condition of 1 / sin^2, at most 1e6 here.
    assert after.point == pytest.approx(before.point @ r.T + shift, abs=1e-8)


@given(halves, halves, places, turns, turns)
def test_normal_of_exchanged_bodies(half_a, half_b, place, turn_a, turn_b):
    gaps, _ = separations((half_a, (0.0, 0.0, 0.0), turn_a), (half_b, place, turn_b))
    assume(distinct(gaps, min(*half_a, *half_b)))
    one, other = body(Box(half_a), (0.0, 0.0, 0.0), turn_a), body(Box(half_b), place, turn_b)
    there, back = touch(one, other), touch(other, one)
    assume(np.dot(place, place) > 1e-6 and not near_reach(there, half_a, half_b))
    assert len(there) == len(back)
    if len(there):
        assert back.normal[0] == pytest.approx(-there.normal[0], abs=1e-12)
        assert sorted(back.gap) == pytest.approx(sorted(there.gap), abs=1e-12)


def distinct(gaps, extent):
    """No second axis, other than round-off, contends with the best within the advantages of the ranking."""
    best = gaps.max()
    contenders = np.abs(gaps - best) < 2e-3 * extent
    return contenders.sum() == 1 and abs(best) > 1e-9 and abs(best - 0.01 * extent) > 1e-9


def near_reach(contacts, half_a, half_b):
    """A vertex that lies just at the reach may count or not."""
    reach = 0.01 * min(*half_a, *half_b)
    return bool(len(contacts)) and bool((np.abs(contacts.gap - reach) < 1e-9).any())


def product(p, q):
    """Hamilton product."""
    pv, qv = np.array(p[1:]), np.array(q[1:])
    return (p[0] * q[0] - pv @ qv, *(p[0] * qv + q[0] * pv + np.cross(pv, qv)))


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.2, 0.0), (0.3, -0.4), (0.999, 0.999)])
def test_contacts_of_aligned_boxes(shift):
    contacts = touch(body(Box((0.5, 0.5, 0.5)), (0.0, 0.0, 0.0)), body(Box((0.5, 0.5, 0.5)), (*shift, 0.9999)))
    low, high = np.maximum(-0.5, np.array(shift) - 0.5), np.minimum(0.5, np.array(shift) + 0.5)
    expected = sorted(itertools.product(*zip(low, high, strict=True)))
    assert sorted(map(tuple, contacts.point[:, :2].round(12))) == pytest.approx(np.array(expected), abs=1e-12)
    assert contacts.gap == pytest.approx(np.full(4, -1e-4), abs=1e-15)
    assert contacts.normal == pytest.approx(np.tile([0.0, 0.0, 1.0], (4, 1)), abs=0)


@pytest.mark.parametrize(("settings", "kept"), [(SETTINGS, 8), (Settings.classical(0.01), 4)])
def test_contacts_of_squares_turned_by_45_degrees(settings, kept):
    """All vertices of the octagon that both squares share; in the textbook's step four of them, about its centre."""
    turn = (math.cos(math.pi / 8), 0.0, 0.0, math.sin(math.pi / 8))
    a, b = body(Box((0.5, 0.5, 0.5)), (0.0, 0.0, 0.0)), body(Box((0.5, 0.5, 0.5)), (0.0, 0.0, 0.999), turn)
    contacts = touch(a, b, settings=settings)
    assert len(contacts) == kept
    flat = np.abs(contacts.point[:, :2])
    assert np.sort(flat, axis=1) == pytest.approx(np.tile([math.sqrt(0.5) - 0.5, 0.5], (kept, 1)), abs=1e-12)
    assert contacts.point[:, :2].mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert len(set(map(tuple, contacts.point.round(9)))) == kept


def test_crossed_edges_touch_where_they_cross():
    """Two boxes standing on their edges, crossed at right angles: one point, normal along z."""
    h, edge = 0.5, 0.5 * math.sqrt(2.0)
    c, s = math.cos(math.pi / 8), math.sin(math.pi / 8)
    contacts = touch(
        body(Box((h, h, h)), (0.0, 0.0, 0.0), (c, s, 0.0, 0.0)),
        body(Box((h, h, h)), (0.1, 0.2, 2 * edge - 0.01), (c, 0.0, s, 0.0)),
    )
    assert len(contacts) == 1
    assert contacts.normal[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-14)
    assert contacts.gap[0] == pytest.approx(-0.01, abs=1e-14)
    assert contacts.point[0] == pytest.approx([0.1, 0.0, edge - 0.005], abs=1e-14)


@given(places, turns, st.tuples(numbers, numbers, numbers).filter(lambda v: math.hypot(*v) > 0.1))
@example((0.0, 0.0, 0.0), (-0.007, 0.924, 0.522, 0.0), (-0.317, -1.0, -0.383))  # half of the face is flat, half is not
def test_contacts_of_a_box_and_a_half_space(place, turn, normal):
    """Corners, their own gaps; those nearly as high as the middle of all are led back to its height (`FLAT`)."""
    half = (0.5, 0.3, 0.2)
    n = np.asarray(normal) / np.linalg.norm(normal)
    plane = Body(HalfSpace(tuple(n)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    heights = corners(half, place, turn) @ n
    assume(not -1e-9 <= heights.min() <= 0.0021)  # within the margin either may be
    contacts = touch(plane, body(Box(half), place, turn))
    if heights.min() > 0.0021:
        assert len(contacts) == 0
    else:
        assert contacts.gap.min() == pytest.approx(heights.min(), abs=1e-13)
        assert contacts.normal == pytest.approx(np.tile(n, (len(contacts), 1)), abs=1e-14)
        for point, gap in zip(contacts.point, contacts.gap, strict=True):
            above = gap - contacts.gap.mean()
            led_back = above if abs(above) <= FLAT * min(half) else 0.0
            own = point + led_back * n
            distance = np.linalg.norm(corners(half, place, turn) - own, axis=1)
            assert distance.min() <= 1e-13  # the box's own corner: a free body keeps its lever arm
            assert gap == pytest.approx(own @ n, abs=1e-13)


@given(places, turns)
def test_contact_of_a_sphere_and_a_box(place, turn):
    half, radius = np.array([0.5, 0.3, 0.2]), 0.25
    contacts = touch(body(Box(tuple(half)), (0.0, 0.0, 0.0), turn), body(Sphere(radius), place))
    local = matrix(turn).T @ place
    nearest = np.clip(local, -half, half)
    distance = np.linalg.norm(local - nearest)
    assume(not 0.0019 <= distance - radius <= 0.0021)  # the margin's edge, to round-off
    if distance == 0.0:
        distance = (np.abs(local) - half).max()
        assert contacts.gap[0] == pytest.approx(distance - radius, abs=1e-13)
    elif distance - radius > 0.0021:
        assert len(contacts) == 0
    else:
        assert contacts.gap[0] == pytest.approx(distance - radius, abs=1e-13)
        if distance > 1e-6:
            assert contacts.normal[0] == pytest.approx(matrix(turn) @ (local - nearest) / distance, abs=1e-9)


def test_contact_of_spheres():
    along = np.array([1.0, 2.0, -2.0]) / 3.0
    contacts = touch(body(Sphere(0.5), (0.0, 0.0, 0.0)), body(Sphere(0.3), 0.79 * along))
    assert contacts.gap[0] == pytest.approx(-0.01, abs=1e-15)
    assert contacts.normal[0] == pytest.approx(along, abs=1e-15)
    assert contacts.point[0] == pytest.approx(0.495 * along, abs=1e-15)


def test_order_of_contacts_by_bodies_and_features():
    bodies = [body(Box((0.5, 0.5, 0.5)), (x, 0.3 * x, z)) for z in (0.0, 0.999) for x in (0.0, 0.999, 1.998)]
    contacts = touch(*bodies)
    keys = list(zip(contacts.body_a, contacts.body_b, contacts.feature, strict=True))
    assert len(keys) > 12 and keys == sorted(keys) and len(set(keys)) == len(keys)
    assert (contacts.body_a < contacts.body_b).all()


def test_collisions_with_and_without_sorting():
    """Beyond 64 bodies candidates come from sort and sweep; every pair of a lattice must still be found."""
    lattice = [body(Sphere(0.5), (x, y, z)) for x in range(5) for y in range(5) for z in range(5)]
    contacts = touch(*lattice)
    assert len(contacts) == 3 * 4 * 25
    far = [body(Sphere(0.5), (3.0 * i, 0.0, 0.0)) for i in range(70)]
    assert len(touch(*far)) == 0
