"""Contacts of capsules and convex polygons against geometry worked out another way, and what they do in motion."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Settings, Simulation
from reference_solver.shapes import area_centroid_moment, smallest_extent

DT = 1.0 / 240.0
FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")
TRIANGLE = ((0.0, 0.0), (0.9, 0.1), (0.2, 0.7))
HEXAGON = tuple((0.6 * math.cos(a), 0.4 * math.sin(a)) for a in np.arange(6) * math.pi / 3.0)


def turned(angle, points):
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(points) @ np.array([[c, s], [-s, c]])


def core(shape):
    """Vertices and radius of a shape, from its public fields."""
    if isinstance(shape, Disc):
        return np.zeros((1, 2)), shape.radius
    if isinstance(shape, Capsule):
        return np.array([[shape.half_length, 0.0], [-shape.half_length, 0.0]]), shape.radius
    if isinstance(shape, Box):
        return np.array([[x, y] for x in (-1, 1) for y in (-1, 1)]) * shape.half_extents, 0.0
    return np.array(shape.vertices), 0.0


def body(shape, x, y, angle, **fields):
    return Body(shape, 1.0, 0.1, (x, y, angle), **fields)


def touch(*bodies):
    simulation = Simulation(Model(2, bodies, (0.0, 0.0), 0.0, 0.0), Settings.fixed_step(DT))
    simulation.advance(1)
    return simulation.contacts()


def separation(a, b, directions):
    """Gap of two bodies along unit vectors from a to b: what the supports of both leave."""
    (va, ra), (vb, rb) = core(a.shape), core(b.shape)
    va = turned(a.pose[2], va) + a.pose[:2]
    vb = turned(b.pose[2], vb) + b.pose[:2]
    return (directions @ vb.T).min(axis=1) - (directions @ va.T).max(axis=1) - ra - rb


SHAPES = {
    "disc": Disc(0.3),
    "box": Box((0.5, 0.3)),
    "capsule": Capsule(0.4, 0.2),
    "triangle": Polygon.about_centroid(TRIANGLE),
    "hexagon": Polygon.about_centroid(HEXAGON),
}
ANGLES = np.arange(4000) * (2.0 * math.pi / 4000)
DIRECTIONS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
numbers = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
pairs = st.tuples(st.sampled_from(sorted(SHAPES)), st.sampled_from(["capsule", "triangle", "hexagon"]))


@given(pairs, st.booleans(), numbers, numbers, numbers, numbers)
@hypothesis_settings(derandomize=True)
def test_contacts_along_the_axis_of_least_overlap(pair, swapped, x, y, angle_a, angle_b):
    """No direction separates better than the normal; the least gap is the separation along it.

    Bodies that overlap only in their rounding are as far apart as their cores less the radii, and no direction
    shows a larger separation; overlapping sharp ones part along the normal of an edge. Edges must win by 1e-6 of the
    half width. Left out: capsules whose cores overlap, for which the ends of the core are no axes.
    """
    names = pair[::-1] if swapped else pair
    a = body(SHAPES[names[0]], 0.1, -0.2, 3.0 * angle_a)
    b = body(SHAPES[names[1]], 0.1 + x, -0.2 + y, 3.0 * angle_b)
    found = separation(a, b, DIRECTIONS).max()
    radii = core(a.shape)[1] + core(b.shape)[1]
    extent = min(smallest_extent(a.shape), smallest_extent(b.shape))
    contacts = touch(a, b)
    if found > 0.011 * extent:  # kept within 0.01 of the smaller half width; sampled directions miss 1e-6
        assert len(contacts) == 0
        return
    assume(found < 0.009 * extent and (radii == 0.0 or found > -radii))
    assume(found < -1e-6 or radii > 0.0)  # sharp bodies that do not overlap may miss each other diagonally
    assert 1 <= len(contacts) <= 2
    normal = contacts.normal[0]
    assert math.hypot(*normal) == pytest.approx(1.0, abs=1e-15)
    gap = separation(a, b, normal[None])[0]
    assert contacts.gap.min() == pytest.approx(gap, abs=1e-14)
    assert found <= gap + 2.1e-6 * extent
    for point in contacts.point:  # midway between the surfaces: inside both bodies grown by the overlap
        for one in (a, b):
            reach = separation(body(Disc(1e-9), *point, 0.0), one, DIRECTIONS).max()
            assert reach <= 0.5 * abs(gap) + 1e-8


@given(st.sampled_from(["capsule", "triangle", "hexagon"]), numbers, numbers)
@hypothesis_settings(derandomize=True)
def test_contacts_of_a_half_space_and_a_facing_edge(name, angle, tilt):
    normal = turned(tilt, [[0.0, 1.0]])[0]
    plane = Body(HalfSpace(tuple(normal), 0.25), motion="fixed")
    vertices, radius = core(SHAPES[name])
    heights = turned(3.0 * angle, vertices) @ normal
    centre = normal * (0.25 - heights.min() + radius - 1e-4)
    contacts = touch(plane, body(SHAPES[name], *centre, 3.0 * angle))
    near = heights - heights.min() <= 1e-4 + 0.009 * smallest_extent(SHAPES[name])
    far = heights - heights.min() <= 1e-4 + 0.011 * smallest_extent(SHAPES[name])
    assume((near == far).all())
    assert contacts.gap.min() == pytest.approx(-1e-4, abs=1e-15)
    assert sorted(contacts.feature) == np.flatnonzero(near).tolist()
    for point, gap in zip(contacts.point, contacts.gap, strict=True):
        assert point @ normal - 0.25 == pytest.approx(gap, abs=1e-15)


@pytest.mark.parametrize(
    ("place", "normal", "points"),
    [
        ((0.3, 0.5 - 1e-3, 0.0), (0.0, 1.0), [-0.1, 0.4]),
        ((1.3 - 1e-3, 0.0, 0.0), (1.0, 0.0), [0.65 - 0.5e-3]),
        ((0.0, 0.9 - 1e-3, math.pi / 2.0), (0.0, 1.0), [0.0]),
        ((1.1 - 0.6e-3, 0.4 - 0.8e-3, 0.0), None, None),
    ],
    ids=["side by side", "end to end", "upright", "round end on round end"],
)
def test_capsules_of_length_04_and_radius_025(place, normal, points):
    one, other = Capsule(0.4, 0.25), Capsule(0.4, 0.25)
    contacts = touch(body(one, 0.0, 0.0, 0.0), body(other, *place))
    if normal is None:
        between = np.array([place[0] - 0.8, place[1]])
        assert contacts.gap == pytest.approx([math.hypot(*between) - 0.5], abs=1e-15)
        assert contacts.normal[0] == pytest.approx(between / math.hypot(*between), abs=1e-15)
        return
    assert contacts.gap == pytest.approx([-1e-3] * len(points), abs=1e-15)
    assert contacts.normal == pytest.approx(np.tile(normal, (len(points), 1)), abs=1e-15)
    assert sorted(contacts.point[:, 0]) == pytest.approx(points, abs=1e-15)


def test_features_of_a_rocking_triangle_in_a_turning_world():
    names = set()
    for rock in (-1e-3, -1e-6, 0.0, 1e-6, 1e-3):
        for turn in (0.0, 1.0, 2.5):
            triangle = Polygon.about_centroid(TRIANGLE)
            low = -turned(rock, triangle.vertices)[:2, 1].min()
            x, y = turned(turn, [[0.0, 0.5 + low - 1e-4]])[0]
            contacts = touch(body(Box((0.9, 0.5)), 0.0, 0.0, turn, motion="fixed"), body(triangle, x, y, rock + turn))
            names |= set(contacts.feature.tolist())
    assert len(names) <= 3  # two ends seen from the box's face; one end where the other has left the reach


@pytest.mark.parametrize("profile", [Settings.classical, Settings.fixed_step])
def test_motion_of_a_polygon_with_a_box_s_vertices(profile):
    """Boxes and polygons have different detection; six bodies tumble into a heap before chaos tells them apart."""

    def heap(shape):
        places = [(0.3 * (i % 3), 0.7 + 1.3 * i, 0.4 * i) for i in range(4)]
        bodies = [FLOOR, *(Body(shape, 1.0, 1.0 / 6.0, place) for place in places)]
        simulation = Simulation(Model(2, bodies, (0.0, -9.81), 0.0, 0.4), profile(DT))
        simulation.advance(90)
        return simulation

    box, polygon = heap(Box((0.5, 0.5))), heap(Polygon(((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5))))
    assert len(box.contacts()) == len(polygon.contacts()) > 0
    # Round-off of the positions, grown by a few impacts of at most a factor of ten each.
    assert polygon.pose == pytest.approx(box.pose, abs=1e-10)


@pytest.mark.parametrize(
    "shape", [Capsule(0.4, 0.2), Polygon.about_centroid(HEXAGON), Polygon.about_centroid(TRIANGLE)]
)
def test_weight_and_creep_of_a_body_at_rest(shape):
    vertices, radius = core(shape)
    angle = 0.0
    if isinstance(shape, Polygon):  # lay the first edge down
        along = vertices[1] - vertices[0]
        angle = -math.atan2(along[1], along[0])
    height = radius - turned(angle, vertices)[:, 1].min()
    simulation = Simulation(
        Model(2, [FLOOR, body(shape, 0.0, height, angle)], (0.0, -9.81), 0.0, 0.5), Settings.fixed_step(DT)
    )
    simulation.advance(240)
    assert simulation.contacts().impulse.sum(axis=0) == pytest.approx([0.0, 9.81 * DT], abs=1e-14)
    assert simulation.pose[1] == pytest.approx([0.0, height, angle], abs=1e-12)


def test_energy_of_a_capsule_falling_over_its_end():
    """Leaning on a smooth floor it falls: its centre goes straight down, and what it loses in height it gains."""
    start = 0.2 + 0.4 * math.sin(math.pi / 2.0 - 0.1)
    capsule = Body(Capsule(0.4, 0.2), 1.0, 0.1, (0.0, start, math.pi / 2.0 - 0.1))
    simulation = Simulation(Model(2, [FLOOR, capsule], (0.0, -9.81), 0.0, 0.0), Settings.fixed_step(1e-4))
    simulation.advance(3000)
    (_, y, angle), (vx, vy, w) = simulation.pose[1], simulation.twist[1]
    assert 0.1 < angle < 1.4  # on its way down
    # the end lifts off its tangent by w^2 r dt^2 / 2 within a step: 36 * 0.4 * 0.5e-8 m here
    assert y == pytest.approx(0.2 + 0.4 * math.sin(angle), abs=7e-8)
    assert vx == pytest.approx(0.0, abs=1e-12)
    kinetic = 0.5 * (vy * vy + 0.1 * w * w)
    # first order: g times the distance of one step bounds what each of 3000 steps may gain or lose
    assert kinetic == pytest.approx(9.81 * (start - y), rel=2e-3)


def test_area_centroid_and_moment_of_known_polygons():
    area, centre, moment = area_centroid_moment(((1.0, 2.0), (4.0, 2.0), (4.0, 4.0), (1.0, 4.0)))
    assert (area, centre) == (6.0, (2.5, 3.0))
    assert moment == pytest.approx(6.0 * (9.0 + 4.0) / 12.0, rel=1e-15)
    right = ((0.0, 0.0), (3.0, 0.0), (0.0, 2.0))
    area, centre, moment = area_centroid_moment(right)
    assert area == 3.0
    assert centre == pytest.approx((1.0, 2.0 / 3.0), rel=1e-15)
    assert moment == pytest.approx(3.0 * (9.0 + 4.0) / 18.0, rel=1e-15)  # A (b^2 + h^2) / 18


@pytest.mark.parametrize(
    "vertices",
    [
        ((0.0, 0.0), (1.0, 0.0)),
        ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0)),
        ((-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)),
        ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)),
        ((1.0, 0.0), (-0.8, 0.6), (0.3, -0.95), (0.3, 0.95), (-0.8, -0.6)),
        ((1.0, 0.0), (0.0, 1.0), (0.1, 0.1), (0.0, -1.0)),
        tuple((math.cos(a), math.sin(a)) for a in np.arange(65) * 2.0 * math.pi / 65),
        ((0.0, 0.0), (1.0, math.nan), (0.0, 1.0)),
        7,
    ],
    ids=["two", "flat", "clockwise", "off centre", "pentagram", "dented", "too many", "nan", "number"],
)
def test_bad_polygons_are_refused(vertices):
    with pytest.raises(ValueError, match=r"^vertices: "):
        Polygon(vertices)


@pytest.mark.parametrize("sizes", [(0.0, 1.0), (1.0, -1.0), (math.nan, 1.0)])
def test_bad_capsules_are_refused(sizes):
    with pytest.raises(ValueError, match=r"^(half_length|radius): "):
        Capsule(*sizes)
