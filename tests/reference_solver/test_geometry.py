"""The certificate's own geometry: bounds from both sides on thousands of poses, and another library's answers.

A gap g >= 0 is proven by two points of the bodies that are g apart (it is no larger) and by a direction along which
the bodies are g apart (it is no smaller). An overlap is proven by a direction along which g parts them, and by the
hull of all differences of corners, whose nearest face is that far from the origin.
"""

import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from reference_solver import Box, Capsule, Disc, HalfSpace, Polygon, Sphere
from reference_solver.geometry import gap, nearest, reach, rotation

HEXAGON = Polygon.about_centroid(((1.0, 0.0), (0.5, 0.6), (-0.3, 0.7), (-0.8, 0.1), (-0.4, -0.5), (0.6, -0.4)))
PLANAR = [Disc(0.4), Box((0.7, 0.2)), Capsule(0.5, 0.1), HEXAGON, Box((1.0, 1.0))]
SPATIAL = [Sphere(0.4), Box((0.7, 0.2, 0.4)), Capsule(0.5, 0.1), Box((0.5, 0.5, 0.5))]
PAIRS = [(a, b) for shapes in (PLANAR, SPATIAL) for a in shapes for b in shapes]
#: Round-off of coordinates of a few metres.
NOISE = 2e-14


def dimension_of(*shapes):
    return 3 if any(isinstance(s, Sphere) or len(getattr(s, "half_extents", ())) == 3 for s in shapes) else 2


def poses(d, count, seed, spread, coarse=False):
    """Random poses; ``coarse``: places and turns from a few values, so that features are parallel and ties are many."""
    random = np.random.default_rng(seed)
    place = random.normal(scale=spread, size=(count, d))
    if d == 2:
        turn = random.uniform(-math.pi, math.pi, size=(count, 1))
        if coarse:
            place, turn = np.round(2.0 * place) / 2.0, np.round(turn * 4.0 / math.pi) * math.pi / 4.0
    else:
        turn = random.normal(size=(count, 4))
        if coarse:
            place, turn = np.round(2.0 * place) / 2.0, np.round(turn)
            turn[np.abs(turn).sum(axis=1) == 0.0, 0] = 1.0
        turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    return np.concatenate([place, turn], axis=1)


def corners(shape, d):
    if isinstance(shape, Polygon):
        return np.array(shape.vertices)
    if isinstance(shape, Box):
        return np.array(np.meshgrid(*((-h, h) for h in shape.half_extents))).reshape(d, -1).T
    if isinstance(shape, Capsule):
        return np.array([[-shape.half_length, *(0.0,) * (d - 1)], [shape.half_length, *(0.0,) * (d - 1)]])
    return np.zeros((1, d))


def in_world(shape, pose, d):
    return pose[:d] + corners(shape, d) @ rotation(pose).T


def radius(shape):
    return 0.0 if isinstance(shape, Box | Polygon) else shape.radius


def outside(shape, pose, point, d):
    """How far a point is outside a body, from the hull of its corners; for what has an inside."""
    local = rotation(pose).T @ (point - pose[:d])
    if isinstance(shape, Box):
        return np.linalg.norm(np.maximum(np.abs(local) - shape.half_extents, 0.0))
    if isinstance(shape, Polygon):
        hull = ConvexHull(np.array(shape.vertices))
        return max(0.0, (hull.equations[:, :2] @ local + hull.equations[:, 2]).max())
    if isinstance(shape, Capsule):
        local[0] -= np.clip(local[0], -shape.half_length, shape.half_length)
    return max(0.0, np.linalg.norm(local) - shape.radius)


@pytest.mark.few(30)
@pytest.mark.parametrize("coarse", [False, True], ids=["random", "parallel"])
@pytest.mark.parametrize("pair", range(len(PAIRS)), ids=lambda k: "-".join(type(s).__name__ for s in PAIRS[k]))
def test_no_larger_and_no_smaller(pair, coarse):
    a, b = PAIRS[pair]
    d = dimension_of(a, b)
    if d == 2 and {type(a), type(b)} == {Capsule} and pair >= len(PLANAR) ** 2:
        d = 3
    where_a, where_b = poses(d, 120, 2 * pair, 0.7, coarse), poses(d, 120, 2 * pair + 1, 0.7, coarse)
    found = nearest(a, where_a, b, where_b)
    assert np.linalg.norm(found.normal, axis=1) == pytest.approx(1.0, abs=1e-12)
    for k in range(len(where_a)):
        far, near = in_world(a, where_a[k], d), in_world(b, where_b[k], d)
        n, g = found.normal[k], found.gap[k]
        parted = (near @ n).min() - (far @ n).max() - radius(a) - radius(b)
        assert parted == pytest.approx(g, abs=NOISE), (a, b, where_a[k], where_b[k])
        assert outside(a, where_a[k], found.point_a[k], d) <= NOISE
        assert outside(b, where_b[k], found.point_b[k], d) <= NOISE
        if g + radius(a) + radius(b) > 1e-9:
            assert found.point_b[k] - found.point_a[k] == pytest.approx(g * n, abs=NOISE)
        else:
            differences = (near[:, None] - far[None]).reshape(-1, d)
            if len(differences) > d and np.linalg.matrix_rank(differences - differences[0], 1e-9) == d:
                deepest = ConvexHull(differences, qhull_options="QJ").equations[:, d].max()
                assert g + radius(a) + radius(b) == pytest.approx(deepest, abs=1e-9)  # hulls are joggled by 1e-11


@pytest.mark.parametrize("pair", [(a, b) for a in SPATIAL for b in SPATIAL], ids=lambda p: type(p[0]).__name__)
def test_another_library_agrees(pair):
    """Coal's GJK and EPA stop at 1e-6."""
    coal = pytest.importorskip("coal", reason="pin publishes no wheels for this platform")
    shapes = {
        Sphere: lambda s: coal.Sphere(s.radius),
        Box: lambda s: coal.Box(*(2.0 * h for h in s.half_extents)),
        Capsule: lambda s: coal.Capsule(s.radius, 2.0 * s.half_length),  # along z
    }
    along_x = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    where = [poses(3, 300, 77 + k, 0.6) for k in range(2)]
    found = gap(pair[0], where[0], pair[1], where[1])
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    for k, mine in enumerate(found):
        placed = []
        for shape, pose in zip(pair, (where[0][k], where[1][k]), strict=True):
            turn = rotation(pose) @ (along_x if isinstance(shape, Capsule) else np.eye(3))
            placed += [shapes[type(shape)](shape), coal.Transform3s(turn, pose[:3])]
        result = coal.DistanceResult()
        coal.distance(*placed, request, result)
        assert mine == pytest.approx(result.min_distance, abs=1e-5)


@pytest.mark.parametrize("d", [2, 3])
def test_distance_of_a_half_space_and_the_lowest_point(d):
    normal = np.arange(1.0, d + 1.0)
    plane = HalfSpace(tuple(normal / np.linalg.norm(normal)), 0.3)
    for shape in PLANAR if d == 2 else SPATIAL:
        floor, where = poses(d, 50, 5, 1.0), poses(d, 50, 6, 1.0)
        found, turned = nearest(plane, floor, shape, where), nearest(shape, where, plane, floor)
        for k in range(50):
            n = rotation(floor[k]) @ np.array(plane.normal)
            lowest = ((in_world(shape, where[k], d) - floor[k, :d]) @ n).min() - radius(shape) - plane.offset
            assert found.gap[k] == pytest.approx(lowest, abs=NOISE)
            assert found.normal[k] == pytest.approx(n, abs=NOISE)
        assert turned.gap == pytest.approx(found.gap, abs=NOISE)
        assert turned.normal == pytest.approx(-found.normal, abs=NOISE)


def test_order_and_place_do_not_matter():
    """Swapped bodies turn the normal round; a shift by powers of two far away leaves gaps what they are."""
    a, b = Box((0.7, 0.2, 0.4)), Capsule(0.5, 0.1)
    where_a, where_b = poses(3, 200, 1, 0.8), poses(3, 200, 2, 0.8)
    there, back = nearest(a, where_a, b, where_b), nearest(b, where_b, a, where_a)
    assert there.gap == pytest.approx(back.gap, abs=NOISE)
    shift = np.array([2.0**20, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    moved = gap(a, where_a + shift, b, where_b + shift)
    assert moved == pytest.approx(there.gap, abs=4e-10)  # poses themselves are rounded to 2^-33 m there


def test_distance_at_one_pose_and_shapes_of_two_dimensions():
    assert gap(Disc(0.5), (0, 0, 0), Box((1.0, 0.5)), (2, 0, 0)) == 0.5
    assert isinstance(gap(Disc(0.5), (0, 0, 0), Disc(0.5), (2, 0, 0)), float)
    assert reach(Box((3.0, 4.0))) == 5.0 and reach(HalfSpace((0.0, 1.0))) == math.inf
    assert reach(Capsule(1.0, 0.5)) == 1.5 and reach(Box((2.0, 3.0, 6.0))) == 7.0
    with pytest.raises(ValueError, match="half-spaces"):
        gap(HalfSpace((0.0, 1.0)), (0, 0, 0), HalfSpace((0.0, 1.0)), (0, 0, 0))
    with pytest.raises(ValueError, match="pose"):
        gap(Disc(0.5), (0, 0), Disc(0.5), (2, 0))
    with pytest.raises(ValueError, match="none of"):
        gap("disc", (0, 0, 0), Disc(0.5), (2, 0, 0))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("other", [Disc(0.05), Capsule(0.3, 0.05)])
def test_distance_on_the_line_of_a_capsule(d, other):
    """Square to the line both are apart by round-off, of either sign: that is no overlap of the cores."""
    a = Capsule(0.5, 0.1)
    half = other.half_length if isinstance(other, Capsule) else 0.0
    if d == 3 and isinstance(other, Disc):
        other = Sphere(0.05)
    where = poses(d, 500, 7, 1.0)
    turn = rotation(where)
    for side in (1.0, -1.0):
        there = where.copy()
        there[:, :d] += side * 1.2 * turn[:, :, 0]
        found = nearest(a, where, other, there)
        assert found.gap == pytest.approx(1.2 - 0.5 - half - 0.15, abs=NOISE)
        assert found.normal == pytest.approx(side * turn[:, :, 0], abs=NOISE)
        assert nearest(other, there, a, where).gap == pytest.approx(found.gap, abs=NOISE)
    inside = where.copy()
    inside[:, :d] += 0.3 * turn[:, :, 0]
    assert gap(a, where, other, inside) == pytest.approx(-0.15, abs=NOISE)
