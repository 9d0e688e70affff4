"""Overlaps from poses, against independent libraries on 10 000 random poses of every pair of shapes."""

import math

import numpy as np
import pytest

from adapters.scene import Body, Box, Capsule, Disc, HalfSpace, Pair, Polygon, Scene, Sphere
from adapters.trajectory import Trajectory
from validation import geometry, metrics
from validation.files import invariants
from validation.geometry import deepest, least_gap, overlap, separation

COUNT = 10_000
ROD = Capsule(0.6, 0.15)
TRIANGLE = Polygon(((0.7, -0.1), (-0.2, 0.5), (-0.5, -0.4)))
PLANAR = [
    (Disc(0.4), Disc(0.7)),
    (Disc(0.3), Box((1.0, 0.25))),
    (Box((0.4, 0.7)), Box((1.0, 0.1))),
    (ROD, Box((0.4, 0.7))),
    (ROD, Capsule(0.3, 0.4)),
    (TRIANGLE, Disc(0.3)),
    (TRIANGLE, ROD),
    (TRIANGLE, Box((1.0, 0.1))),
]
SPATIAL = [
    (Sphere(0.4), Sphere(0.7)),
    (Sphere(0.3), Box((1.0, 0.25, 0.5))),
    (Box((0.4, 0.7, 0.2)), Box((1.0, 0.1, 0.6))),
    (ROD, Sphere(0.4)),
    (ROD, Box((0.4, 0.7, 0.2))),
    (ROD, Capsule(0.3, 0.4)),
]


def poses(dimension, seed, count=COUNT):
    """Random places within a metre or so of each other, and all orientations."""
    rng = np.random.default_rng(seed)
    place = rng.normal(scale=0.7, size=(count, dimension))
    if dimension == 2:
        return np.column_stack([place, rng.uniform(-np.pi, np.pi, count)])
    turn = rng.normal(size=(count, 4))
    return np.column_stack([place, turn / np.linalg.norm(turn, axis=1, keepdims=True)])


def corners(shape, pose):
    """Corners of a planar body (k, 2); of what is round, the points that its radius is about."""
    if isinstance(shape, Disc):
        return pose[None, :2]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    if isinstance(shape, Box):
        local = np.array([(x, y) for x in (-1, 1) for y in (-1, 1)]) * shape.half_extents
    elif isinstance(shape, Capsule):
        local = np.array([(-shape.half_length, 0.0), (shape.half_length, 0.0)])
    else:
        local = np.array(shape.vertices)
    return pose[:2] + local @ np.array([(c, s), (-s, c)])


@pytest.mark.parametrize("pair", PLANAR, ids=str)
def test_planar_distances_and_depths_are_those_of_shapely(pair):
    """Two convex bodies are as far apart as the origin is from their differences, and as deep as it lies in them."""
    shapely = pytest.importorskip("shapely", reason="shapely is a development dependency")
    a, b = pair
    pose_a, pose_b = poses(2, 1), poses(2, 2)
    found = separation(a, pose_a, b, pose_b)
    radii = sum(shape.radius for shape in pair if isinstance(shape, Disc | Capsule))
    expected = np.empty(COUNT)
    origin = shapely.Point(0.0, 0.0)
    for k in range(COUNT):
        ca, cb = corners(a, pose_a[k]), corners(b, pose_b[k])
        hull = shapely.MultiPoint((cb[:, None] - ca[None]).reshape(-1, 2)).convex_hull
        inside = hull.geom_type == "Polygon" and hull.contains(origin)
        expected[k] = (-hull.exterior.distance(origin) if inside else hull.distance(origin)) - radii
    assert ((expected < 0.0).sum() > 500) and ((expected > 0.0).sum() > 500)
    np.testing.assert_allclose(found, expected, atol=1e-12)  # coordinates of metres, some hundred roundings


def placed(coal, shape, pose):
    w, x, y, z = pose[3:]
    turn = coal.Quaternion(w, x, y, z)
    if isinstance(shape, Capsule):  # coal's lies along z
        turn = turn * coal.Quaternion(math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    return coal.Transform3s(turn, pose[:3])


def of_coal(coal, shape):
    if isinstance(shape, Box):
        return coal.Box(*(2.0 * half for half in shape.half_extents))
    return (
        coal.Sphere(shape.radius) if isinstance(shape, Sphere) else coal.Capsule(shape.radius, 2.0 * shape.half_length)
    )


@pytest.mark.parametrize("pair", SPATIAL, ids=str)
def test_spatial_distances_and_depths_are_those_of_coal(pair):
    coal = pytest.importorskip("coal", reason="pin, which brings coal, publishes no wheels for this platform")
    a, b = pair
    pose_a, pose_b = poses(3, 3), poses(3, 4)
    found = separation(a, pose_a, b, pose_b)
    bodies = [of_coal(coal, shape) for shape in pair]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = request.epa_tolerance = 1e-8
    request.gjk_max_iterations = request.epa_max_iterations = 512
    expected = np.empty(COUNT)
    for k in range(COUNT):
        result.clear()
        where = [placed(coal, shape, pose[k]) for shape, pose in ((a, pose_a), (b, pose_b))]
        coal.distance(bodies[0], where[0], bodies[1], where[1], request, result)
        expected[k] = result.min_distance
    assert ((expected < 0.0).sum() > 500) and ((expected > 0.0).sum() > 500)
    # Iterative to 1e-8 of a squared length of metres where bodies are apart: 1e-4 of a length at worst, mostly 1e-8.
    difference = np.abs(found - expected)
    assert difference.max() < 1e-4
    assert np.quantile(difference, 0.99) < 1e-6


@pytest.mark.parametrize("pair", [*PLANAR, *SPATIAL], ids=str)
def test_shortcuts_give_the_exact_depth(pair):
    a, b = pair
    dimension = 2 if pair in PLANAR else 3
    pose_a, pose_b = poses(dimension, 5, 2000), poses(dimension, 6, 2000)
    exact = separation(a, pose_a, b, pose_b)
    assert (least_gap(a, pose_a, b, pose_b) <= exact + 1e-14).all()
    np.testing.assert_allclose(overlap(a, pose_a, b, pose_b), np.maximum(0.0, -exact), atol=1e-14)
    assert deepest(a, pose_a, b, pose_b) == pytest.approx(max(0.0, -exact.min()), abs=1e-14)
    apart = np.flatnonzero(exact > 0.0)
    assert deepest(a, pose_a[apart], b, pose_b[apart]) == 0.0


def test_between_round_bodies_the_centre_line_bounds_exactly():
    for (a, b), dimension in ((PLANAR[0], 2), (SPATIAL[0], 3)):
        pose_a, pose_b = poses(dimension, 7, 200), poses(dimension, 8, 200)
        np.testing.assert_allclose(least_gap(a, pose_a, b, pose_b), separation(a, pose_a, b, pose_b), atol=1e-14)


@pytest.mark.parametrize("pair", [*PLANAR, *SPATIAL], ids=str)
def test_overlap_of_bodies_at_one_place(pair):
    a, b = pair
    place = (0.2, 0.1) if pair in PLANAR else (0.2, 0.1, 0.4)
    turns = ((0.3,), (0.9,)) if pair in PLANAR else ((0.8, 0.6, 0.0, 0.0), (0.6, 0.0, 0.8, 0.0))
    here, there = (np.array([[*place, *turn]]) for turn in turns)
    with np.errstate(all="raise"):
        bound = least_gap(a, here, b, there)
    exact = separation(a, here, b, there)
    assert exact < 0.0 and bound <= exact + 1e-14
    assert overlap(a, here, b, there) == pytest.approx(-exact, abs=1e-14)


def test_separate_and_shallower_pairs_not_measured(monkeypatch):
    """A run of 100 000 samples is measured where bodies can overlap, or a report would take minutes."""
    asked = []

    def counted(a, pose_a, b, pose_b):
        asked.append(len(pose_a))
        return separation(a, pose_a, b, pose_b)

    monkeypatch.setattr(geometry, "separation", counted)
    disc, still = Disc(0.5), np.zeros((640, 3))
    away = np.column_stack([np.linspace(0.2, 3.0, 640), np.zeros((640, 2))])  # apart from sample 183 on
    assert overlap(disc, still, disc, away).max() == pytest.approx(0.8) and sum(asked) == 183
    asked.clear()
    assert deepest(disc, still, disc, away) == pytest.approx(0.8) and sum(asked) == geometry.BATCH
    asked.clear()
    assert deepest(disc, still[183:], disc, away[183:]) == 0.0 and not asked


@pytest.mark.parametrize("dimension", [2, 3])
def test_round_body_clear_of_a_corner(dimension):
    """6.6 cm clear of a corner, seen along the line of centres it used to be 1.5 cm deep."""
    half, radius = (1.0, 0.25, 0.5), 0.3
    away = np.array([0.8, 0.6]) if dimension == 2 else np.array([0.8, 0.36, 0.48])
    corner = np.array(half[:dimension])
    box, ball = Box(half[:dimension]), (Disc if dimension == 2 else Sphere)(radius)
    turn = (0.0,) if dimension == 2 else (1.0, 0.0, 0.0, 0.0)
    place = corner + (radius + 0.066) * away
    assert separation(box, np.array([[0.0] * dimension + list(turn)]), ball, np.array([[*place, *turn]]))[0] == (
        pytest.approx(0.066, abs=1e-15)
    )
    gravity = (0.0,) * dimension
    bodies = (
        Body("box", box, motion="fixed"),
        Body("ball", ball, 1.0, 1.0 if dimension == 2 else (1.0,) * 3, (*place, *turn)),
    )
    scene = Scene("s", 1, dimension, bodies, (Pair(),), gravity, 1.0)
    pose = np.array([[body.pose for body in scene.bodies]] * 3)
    twist = np.zeros((3, 2, 3 if dimension == 2 else 6))
    trajectory = Trajectory(np.arange(3) * 0.01, pose, twist, None, 0.01, "completed")
    assert invariants.deepest(scene, trajectory) == ((0.0, ""), (0.0, ""))
    assert metrics.deepest_overlap(scene, trajectory) == 0.0


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("shapes", [*PLANAR, *SPATIAL, (HalfSpace((0.0, 1.0)), Box((0.4, 0.7)))])
def test_pose_without_a_distance(shapes):
    """A NaN after a depth that is a number was passed over, and left an overlap of 0, which passes."""
    a, b = shapes
    d = 3 if shapes in SPATIAL else 2
    turn = (0.0,) if d == 2 else (1.0, 0.0, 0.0, 0.0)
    pose_a, pose_b = (np.array([[0.0] * d + list(turn)] * 70) for _ in range(2))
    pose_b[:, d - 1] = np.linspace(0.3, 9.0, 70)  # from inside to far away
    assert deepest(a, pose_a, b, pose_b) > 0.0
    pose_b[60, 0] = math.nan
    assert np.isnan(overlap(a, pose_a, b, pose_b)).tolist() == [k == 60 for k in range(70)]
    assert math.isnan(deepest(a, pose_a, b, pose_b))
    body = Body("b", b, 1.0, 1.0 if d == 2 else (1.0,) * 3, tuple(pose_b[0]))
    scene = Scene("s", 1, d, (Body("a", a, motion="fixed"), body), (Pair(),), (0.0,) * d, 1.0)
    still = np.zeros((70, 2, 3 if d == 2 else 6))
    trajectory = Trajectory(np.arange(70) * 0.01, np.stack([pose_a, pose_b], 1), still, None, 0.01, "completed")
    assert math.isnan(metrics.deepest_overlap(scene, trajectory))
    assert [math.isnan(value) for value, _ in invariants.deepest(scene, trajectory)] == [True, True]


@pytest.mark.filterwarnings("ignore:invalid value")
def test_depth_of_a_rotation_that_is_nan():
    """Lower bounds of what is round ask for no turn: seventy samples are apart enough to be asked for in turn."""
    pose_a, pose_b = np.zeros((70, 3)), np.zeros((70, 3))
    pose_b[:, 1] = np.linspace(0.1, 2.0, 70)
    assert deepest(ROD, pose_a, ROD, pose_b) == pytest.approx(0.2)  # 0.1 m apart, two radii of 0.15 m
    pose_b[1, 2] = math.nan
    assert np.isfinite(least_gap(ROD, pose_a, ROD, pose_b)).all()
    assert math.isnan(deepest(ROD, pose_a, ROD, pose_b))


def test_distance_from_a_tilted_half_space():
    face, box = HalfSpace((-math.sin(0.3), math.cos(0.3)), 0.25), Box((0.5, 0.5))
    centre = 0.75 * np.array(face.normal)
    touching = np.array([[*centre, 0.3]])
    assert separation(face, np.zeros((1, 3)), box, touching)[0] == pytest.approx(0.0, abs=1e-15)
    assert separation(box, touching, face, np.zeros((1, 3)))[0] == pytest.approx(0.0, abs=1e-15)
    low, high = np.array([[*(0.4 * centre), 0.7]]), np.array([[*(9.0 * centre), 0.7]])
    for pose in (low, high):
        assert least_gap(face, np.zeros((1, 3)), box, pose) == separation(face, np.zeros((1, 3)), box, pose)
        assert least_gap(box, pose, face, np.zeros((1, 3))) == separation(box, pose, face, np.zeros((1, 3)))
