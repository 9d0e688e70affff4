"""Distances and mass properties of capsules, polygons, cylinders and hulls against closed forms and integrals."""

import itertools
import math

import numpy as np
import pytest

from adapters.scene import Box, Capsule, Cylinder, Disc, HalfSpace, Hull, Polygon, SceneError, Sphere
from validation.files.mass_properties import moments, volume
from validation.files.scene_files import stated_from_text
from validation.geometry import deepest, overlap, separation
from validation.solids import hull_properties

BRICK = Hull(tuple(itertools.product((-0.5, 0.5), (-0.4, 0.4), (-0.3, 0.3))))
LEVEL = (1.0, 0.0, 0.0, 0.0)


def at(x, y, z, attitude=LEVEL):
    return np.array([[x, y, z, *attitude]])


def test_distances_of_a_box_as_a_hull():
    pytest.importorskip("coal")
    random = np.random.default_rng(3)
    for _ in range(40):
        q = random.normal(size=4)
        pose = at(*random.uniform(-1.2, 1.2, 3), q / np.linalg.norm(q))
        for other in (Sphere(0.2), Box((0.3, 0.2, 0.4)), Capsule(0.3, 0.1)):
            asked = separation(BRICK, at(0, 0, 0), other, pose)
            assert asked == pytest.approx(separation(Box((0.5, 0.4, 0.3)), at(0, 0, 0), other, pose), abs=1e-7)


def test_a_cylinder_s_distance_in_closed_form():
    pytest.importorskip("coal")
    cylinder = Cylinder(0.5, 0.3)
    assert separation(cylinder, at(0, 0, 0), Sphere(0.1), at(1.0, 0, 0)) == pytest.approx([0.4], abs=1e-9)
    assert separation(cylinder, at(0, 0, 0), Sphere(0.1), at(0, 0.7, 0)) == pytest.approx([0.3], abs=1e-7)
    rim = math.hypot(0.3, 0.4) - 0.1
    assert separation(cylinder, at(0, 0, 0), Sphere(0.1), at(0.8, 0.7, 0)) == pytest.approx([rim], abs=1e-7)
    floor = HalfSpace((0.0, 0.0, 1.0), 0.25)
    for lean in (0.0, 0.3, math.pi / 2):
        pose = at(0, 0, 1.0, (math.cos(lean / 2), 0.0, -math.sin(lean / 2), 0.0))
        truth = 0.75 - 0.5 * math.sin(lean) - 0.3 * math.cos(lean)
        assert separation(cylinder, pose, floor, at(0, 0, 0)) == pytest.approx([truth], abs=1e-9)
        assert separation(floor, at(0, 0, 0.1), cylinder, pose) == pytest.approx([truth - 0.1], abs=1e-9)
    for q in np.random.default_rng(5).normal(size=(5, 4)):  # turned about its axis as well it is the same body
        q /= np.linalg.norm(q)
        rise = 2.0 * (q[1] * q[3] - q[0] * q[2])  # of its axis
        truth = 0.75 - 0.5 * abs(rise) - 0.3 * math.sqrt(1.0 - rise**2)
        assert separation(cylinder, at(0, 0, 1.0, q), floor, at(0, 0, 0)) == pytest.approx([truth], abs=1e-9)
    sunk = np.concatenate([at(0, 0, z) for z in (1.0, 0.5, 0.6)])
    depth = overlap(cylinder, sunk, floor, np.tile(at(0, 0, 0), (3, 1)))
    assert depth == pytest.approx([0.0, 0.05, 0.0], abs=1e-9)
    assert deepest(cylinder, sunk, floor, np.tile(at(0, 0, 0), (3, 1))) == pytest.approx(0.05, abs=1e-9)


def test_lowest_corner_of_a_hull_over_a_face(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "coal", None)
    floor = HalfSpace((0.0, 0.0, 1.0))
    assert separation(floor, at(0, 0, 0), BRICK, at(0, 0, 1.0)) == pytest.approx([0.7])
    with pytest.raises(ModuleNotFoundError):
        separation(Cylinder(0.5, 0.3), at(0, 0, 0), BRICK, at(0, 0, 1.0))


def test_depth_of_a_polygon_in_a_face():
    square = Polygon(((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)))
    floor, poses = HalfSpace((0.0, 1.0)), np.array([[0.0, 0.4, 0.0], [0.0, 0.4, math.pi / 4], [0.0, 2.0, 0.0]])
    expected = [0.1, math.sqrt(0.5) - 0.4, 0.0]
    assert overlap(floor, np.zeros((3, 3)), square, poses) == pytest.approx(expected, abs=1e-12)


def integral(inside, low, high, dimension, count):
    """Area or volume, and moments about the axes, by counting cells."""
    axes = [np.linspace(a, b, count, endpoint=False) + 0.5 * (b - a) / count for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dimension)
    grid = grid[inside(grid)]
    cell = np.prod([(b - a) / count for a, b in zip(low, high, strict=True)])
    squares = cell * (grid**2).sum(axis=0)
    return cell * len(grid), squares


def test_mass_properties_by_integration():
    def within(r, h):
        return lambda p: np.hypot(np.maximum(np.abs(p[:, 0]) - h, 0.0), np.linalg.norm(p[:, 1:], axis=1)) <= r

    flat, solid = Capsule(0.4, 0.3), Capsule(0.4, 0.3)
    area, (xx, yy) = integral(within(0.3, 0.4), (-0.7, -0.3), (0.7, 0.3), 2, 800)
    assert volume(flat, 2) == pytest.approx(area, rel=2e-3)
    assert moments(flat, 2.0, 2) == pytest.approx(2.0 * (xx + yy) / area, rel=2e-3)
    whole, (xx, yy, zz) = integral(within(0.3, 0.4), (-0.7, -0.3, -0.3), (0.7, 0.3, 0.3), 3, 120)
    assert volume(solid, 3) == pytest.approx(whole, rel=5e-3)
    assert moments(solid, 2.0, 3) == pytest.approx([2.0 * m / whole for m in (yy + zz, zz + xx, xx + yy)], rel=5e-3)

    def inside(p):
        return (np.abs(p[:, 0]) <= 0.4) & (np.hypot(p[:, 1], p[:, 2]) <= 0.3)

    whole, (xx, yy, zz) = integral(inside, (-0.4, -0.3, -0.3), (0.4, 0.3, 0.3), 3, 120)
    assert volume(Cylinder(0.4, 0.3)) == pytest.approx(whole, rel=5e-3)
    found = moments(Cylinder(0.4, 0.3), 2.0, 3)
    assert found == pytest.approx([2.0 * m / whole for m in (yy + zz, zz + xx, xx + yy)], rel=5e-3)


def test_mass_moments_of_a_solid_ball_and_a_disc():
    assert moments(Sphere(0.5), 3.0, 3) == pytest.approx((0.3,) * 3)
    assert moments(Disc(0.5), 3.0, 2) == pytest.approx(0.375)
    for measure in (volume, lambda shape: moments(shape, 1.0, 2)):
        with pytest.raises(ValueError, match="a half-space has no "):
            measure(HalfSpace((0.0, 1.0)))


def test_mass_properties_of_corners():
    assert volume(BRICK) == pytest.approx(0.48)
    assert moments(BRICK, 3.0, 3) == pytest.approx(moments(Box((0.5, 0.4, 0.3)), 3.0, 3))
    rectangle = Polygon(((0.5, 0.25), (-0.5, 0.25), (-0.5, -0.25), (0.5, -0.25)))
    assert moments(rectangle, 3.0, 2) == pytest.approx(moments(Box((0.5, 0.25)), 3.0, 2))
    # A right-angled corner of legs 1: volume 1/6, centroid 1/4, second moments 3/80 of the volume, products -1/80.
    whole, centre, tensor = hull_properties(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float) + 5.0)
    assert whole == pytest.approx(1 / 6) and centre == pytest.approx([5.25] * 3)
    assert tensor * 6 == pytest.approx(np.where(np.eye(3) > 0, 3 / 80, -1 / 80))
    # A pyramid of side 2 and height 4: its centroid is a quarter of the way up, the mean of its corners a fifth.
    pyramid = np.array([(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0), (0, 0, 4)], float)
    whole, centre, tensor = hull_properties(pyramid + (3.0, -2.0, 1.0))
    assert whole == pytest.approx(16 / 3) and centre == pytest.approx([3.0, -2.0, 2.0])
    assert tensor == pytest.approx(16 / 3 * np.diag([4 / 20, 4 / 20, 3 * 16 / 80]), abs=1e-12)
    with pytest.raises(SceneError, match="number 4 lies within"):
        hull_properties(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.1, 0.1, 0.1)], float))


FILE = """
name = "odd"
dimension = {d}
gravity = {gravity}
duration = 0.1
[[bodies]]
name = "odd"
shape = {{ type = "{kind}", {sizes} }}
density = 2.0
"""


def read(kind, sizes, d, tmp_path):
    text = FILE.format(d=d, gravity=[0.0] * d, kind=kind, sizes=sizes)
    return stated_from_text(text, tmp_path / "odd.toml")


def test_centroid_of_a_file_s_corners(tmp_path):
    found = read("polygon", "vertices = [[0, 0], [3, 0], [0, 3]]", 2, tmp_path)
    body = found.scene.bodies[0]
    assert body.mass == pytest.approx(9.0) and body.shape.vertices[0] == pytest.approx((-1.0, -1.0))
    assert body.inertia == pytest.approx(9.0 * 18.0 / 18.0)  # m (a^2 + b^2) / 18
    assert any("centroid (1, 1) is now the body's centre" in note for note in found.notes)
    corners = str([list(np.add(v, (2.0, 0.0, 1.0)).tolist()) for v in BRICK.vertices])
    solid = read("hull", f"vertices = {corners}", 3, tmp_path).scene.bodies[0]
    assert solid.mass == pytest.approx(0.96)
    assert solid.inertia == pytest.approx(moments(Box((0.5, 0.4, 0.3)), 0.96, 3))
    assert np.array(solid.shape.vertices) == pytest.approx(np.array(BRICK.vertices))


@pytest.mark.parametrize(("kind", "sizes", "d", "said"), [
    ("polygon", "vertices = [[0, 0], [0, 3], [3, 0]]", 2, "odd.shape.vertices: must enclose an area, counter-"),
    ("polygon", "vertices = [[0, 0], [3, 0]]", 2, "bodies.0.shape.polygon.vertices"),
    ("hull", "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]", 3, "odd.shape.vertices: lie in one plane"),
    ("hull", "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]", 3, "the main axes of inertia are not"),
    ("capsule", "radius = 1", 2, "half_length"),
    ("cylinder", "radius = 1, half_length = 1", 2, "odd.shape: a Cylinder cannot be used in 2-D"),
])  # fmt: skip
def test_refusal_of_corners_that_are_none(kind, sizes, d, said, tmp_path):
    with pytest.raises(SceneError, match=said.replace("(", r"\(")) as refusal:
        read(kind, sizes, d, tmp_path)
    assert len(str(refusal.value).splitlines()) == 1
