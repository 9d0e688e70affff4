"""Pairs that can touch: none is left out, few are for nothing, and the work grows as the number of bodies."""

import math
import time

import numpy as np
import pytest

from adapters.scene import Body, Box, Capsule, Cylinder, Disc, HalfSpace, Hull, Pair, Polygon, Scene, Sphere
from adapters.scene.near import near_pairs, start_overlap
from adapters.scene.shapes import reach
from reference_solver.geometry import gap


def cloud(dimension, count, seed, spread, fixed=0.2):
    """Balls and boxes of sizes over three powers of ten, some of them fixed, and a floor in the middle of the list."""
    rng = np.random.default_rng(seed)
    bodies = []
    for k in range(count):
        size = 10.0 ** rng.uniform(-2.0, 1.0)
        round_shape = Disc(size) if dimension == 2 else Sphere(size)
        shape = round_shape if rng.random() < 0.5 else Box((size,) * dimension)
        turn = (0.3,) if dimension == 2 else (1.0, 0.0, 0.0, 0.0)
        place = tuple(map(float, rng.normal(0.0, spread, dimension)))
        inertia = 1.0 if dimension == 2 else (1.0, 1.0, 1.0)
        motion = "fixed" if rng.random() < fixed else "free"
        bodies.append(Body(f"b{k}", shape, 1.0, inertia, (*place, *turn), motion=motion))
    normal = (0.0, 1.0) if dimension == 2 else (0.0, 0.0, 1.0)
    bodies.insert(count // 2, Body("floor", HalfSpace(normal), motion="fixed"))
    return Scene("cloud", 1, dimension, tuple(bodies), (Pair(),), (0.0,) * dimension, 1.0)


def moving(scene, samples, seed, speed):
    """Poses (s, n, p) of bodies that all go somewhere."""
    rng, d = np.random.default_rng(seed), scene.dimension
    pose = np.tile(np.array([body.pose for body in scene.bodies])[None], (samples, 1, 1))
    pose[:, :, :d] += np.linspace(0.0, 1.0, samples)[:, None, None] * rng.normal(0.0, speed, pose[0, :, :d].shape)
    return pose


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("seed", "spread", "samples"), [(1, 30.0, 1), (2, 1e3, 50), (3, 3.0, 7), (4, 1e18, 3)])
def test_touching_pairs_found_once_and_in_order(dimension, seed, spread, samples):
    scene = cloud(dimension, 60, seed, spread)
    pose = moving(scene, samples, seed, spread)
    found = list(near_pairs(scene, pose))
    assert found == sorted(set(found)) and all(i < j for i, j in found)
    for i in range(len(scene.bodies)):
        for j in range(i + 1, len(scene.bodies)):
            a, b = scene.bodies[i], scene.bodies[j]
            if a.motion != "free" and b.motion != "free":
                assert (i, j) not in found
                continue
            apart = np.linalg.norm(pose[:, i, :dimension] - pose[:, j, :dimension], axis=1)
            touching = (apart <= reach(a.shape) + reach(b.shape)).any()
            if touching or isinstance(a.shape, HalfSpace) or isinstance(b.shape, HalfSpace):
                assert (i, j) in found


def test_body_with_a_nan_position_may_touch_all():
    scene = cloud(2, 6, 5, 1e6, fixed=0.0)
    pose = moving(scene, 2, 5, 0.0)
    pose[1, 0, 0] = math.nan
    assert [pair for pair in near_pairs(scene, pose) if 0 in pair] == [(0, j) for j in range(1, 7)]


def columns(count):
    """Boxes in columns of five on a floor, as in a hall."""
    side = math.ceil(math.sqrt(count / 5))
    bodies = [Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")]
    for k in range(count):
        column, height = divmod(k, 5)
        place = (0.5 * (column % side), 0.5 * (column // side), 0.1 + 0.2 * height)
        bodies.append(Body(f"b{k}", Box((0.1, 0.1, 0.1)), 1.0, (1.0, 1.0, 1.0), (*place, 1.0, 0.0, 0.0, 0.0)))
    return Scene("columns", 1, 3, tuple(bodies), (Pair(),), (0.0, 0.0, -9.81), 0.1)


def test_linear_cost_and_pairs_of_columns():
    """A floor meets each, a box meets few others: as many pairs a body in a hall of 320 as in one of 5000."""
    shares, times = [], []
    for count in (320, 5000):
        scene = columns(count)
        pose = np.tile(np.array([body.pose for body in scene.bodies])[None], (24, 1, 1))
        begun = time.process_time()
        shares.append(len(list(near_pairs(scene, pose))) / count)
        times.append(time.process_time() - begun)
    assert shares[1] <= 1.1 * shares[0] < 6.0
    assert times[1] / times[0] < 5.0 * (5000 / 320) ** 1.2  # fivefold: room for a busy machine; n^2 would be 244


# ---- how deep bodies start in each other ----

PLANAR = (Disc(0.3), Box((0.4, 0.2)), Capsule(0.3, 0.1), Polygon(((-0.3, -0.2), (0.3, -0.2), (0.0, 0.4))))
SPATIAL = (Sphere(0.3), Box((0.4, 0.2, 0.3)), Capsule(0.3, 0.1))


def two(shapes, poses, floor=None):
    """Two free bodies, one of them a floor if ``floor`` is its normal."""
    d = 2 if len(poses[0]) == 3 else 3
    inertia = 1.0 if d == 2 else (1.0, 1.0, 1.0)
    bodies = [
        Body(f"b{k}", shape, 1.0, inertia, pose) for k, (shape, pose) in enumerate(zip(shapes, poses, strict=True))
    ]
    if floor is not None:
        bodies[1] = Body("floor", HalfSpace(floor), motion="fixed")
    return Scene("two", 1, d, tuple(bodies), (Pair(),), (0.0,) * d, 1.0)


def pose_of(rng, dimension, size):
    """Draw a place within ``size`` and a turn."""
    turn = rng.normal(size=1 if dimension == 2 else 4)
    turn = turn if dimension == 2 else turn / np.linalg.norm(turn)
    return tuple(map(float, (*rng.uniform(-size, size, dimension), *turn)))


@pytest.mark.parametrize(("dimension", "shapes"), [(2, PLANAR), (3, SPATIAL)])
def test_overlap_at_the_start_against_the_true_one(dimension, shapes):
    rng = np.random.default_rng(3)
    for _ in range(300):
        chosen = [shapes[k] for k in rng.integers(len(shapes), size=2)]
        poses = [pose_of(rng, dimension, 0.4) for _ in chosen]
        depth = -gap(chosen[0], poses[0], chosen[1], poses[1])
        found = start_overlap(two(chosen, poses)).get((0, 1), 0.0)
        assert found >= depth - 1e-14
        if all(isinstance(shape, Disc | Sphere) for shape in chosen):
            assert found == pytest.approx(max(depth, 0.0), abs=1e-14)
        floor = (0.6, 0.8) if dimension == 2 else (0.6, 0.0, 0.8)
        scene = two(chosen, poses, floor)
        depth = -gap(chosen[0], poses[0], scene.bodies[1].shape, scene.bodies[1].pose)
        assert start_overlap(scene).get((0, 1), 0.0) == pytest.approx(max(depth, 0.0), abs=1e-14)


@pytest.mark.parametrize("turn", [0.0, 0.3, 2.0])
def test_overlap_of_boxes_meeting_with_a_face_and_of_solids(turn):
    along, across = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
    for depth in (1e-6, 0.01, -0.01):
        place = tuple(map(float, 0.1 * along + (0.5 - depth) * across))
        scene = two((Box((0.4, 0.2)), Box((0.3, 0.3))), ((0.0, 0.0, turn), (*place, turn)))
        assert start_overlap(scene).get((0, 1), 0.0) == pytest.approx(max(depth, 0.0), abs=1e-14)
    corners = tuple((x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1))
    poses = ((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.13, 0.0, 1.0, 0.0, 0.0, 0.0))
    assert start_overlap(two((Cylinder(0.3, 0.04), Hull(corners)), poses)) == {(0, 1): pytest.approx(0.01)}
