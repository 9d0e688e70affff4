"""What the replay draws of each shape is the shape: its corners against distances that are known."""

import numpy as np
import pytest

from adapters.scene import Body, Box, Capsule, Cylinder, Disc, HalfSpace, Hull, Polygon, Scene, Sphere
from reports.page.replay import _body

LENGTH, RADIUS = 0.75, 0.2
#: What is round is drawn by 32 corners a turn: its outline stays within this share of the radius.
SAGITTA = 1.0 - np.cos(np.pi / 32)
#: Corners are told to six digits [m]; the largest here is about 1.
TOLD = 1e-6


def drawn(shape, dimension, **place):
    bodies = (Body("it", shape, 1.0, 0.1 if dimension == 2 else (0.1, 0.1, 0.1), **place),)
    return _body(Scene("toy", 1, dimension, bodies, (), (0.0,) * dimension, 1.0, {}), 0)


def corners(shape, dimension):
    found = drawn(shape, dimension)
    assert found["type"] == "corners" and found["name"] == "it"
    return np.array(found["corners"])


def towards(points, directions):
    """How far points reach in directions: the width of a convex shape."""
    return (points @ directions.T).max(axis=0)


def directions(dimension, count=200):
    found = np.random.default_rng(3).normal(size=(count, dimension))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize("dimension", [2, 3])
def test_reach_of_a_capsule_in_every_direction(dimension):
    points, aside = corners(Capsule(LENGTH, RADIUS), dimension), directions(dimension)
    exact = LENGTH * np.abs(aside[:, 0]) + RADIUS
    found = towards(points, aside)
    assert (found <= exact + TOLD).all()
    # About its axis a capsule in space is drawn by eight meridians.
    coarse = SAGITTA if dimension == 2 else 1.0 - np.cos(np.pi / 8) * np.cos(np.pi / 32)
    assert (found >= exact - RADIUS * coarse - TOLD).all()
    nearest = np.maximum(np.abs(points[:, 0]) - LENGTH, 0.0)
    assert np.hypot(nearest, np.linalg.norm(points[:, 1:], axis=1)) == pytest.approx(RADIUS, abs=TOLD)


def test_a_cylinder_reaches_its_two_rims():
    points, aside = corners(Cylinder(LENGTH, RADIUS), 3), directions(3)
    exact = LENGTH * np.abs(aside[:, 0]) + RADIUS * np.linalg.norm(aside[:, 1:], axis=1)
    found = towards(points, aside)
    assert (found <= exact + TOLD).all() and (found >= exact - RADIUS * SAGITTA - TOLD).all()
    assert np.abs(points[:, 0]) == pytest.approx(LENGTH, abs=TOLD)
    assert np.linalg.norm(points[:, 1:], axis=1) == pytest.approx(RADIUS, abs=TOLD)
    assert sorted(points[:, 0])[len(points) // 2 - 1] < 0.0 < sorted(points[:, 0])[len(points) // 2]  # as many on each


def test_polygon_and_hull_by_their_corners():
    triangle = ((-1.0, -1.0), (2.0, -1.0), (-1.0, 2.0))
    assert corners(Polygon(triangle), 2) == pytest.approx(np.array(triangle))
    solid = ((1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))
    assert corners(Hull(solid), 3) == pytest.approx(np.array(solid))


def test_replay_shapes_by_size_and_start():
    told = {"name": "it", "start": [0.5, 1.5, 0.25]}
    place = {"pose": (0.5, 1.5, 0.25)}
    assert drawn(Disc(RADIUS), 2, **place) == told | {"type": "ball", "radius": RADIUS, "dimension": 2}
    assert drawn(Box((0.3, 0.4)), 2, **place) == told | {"type": "box", "half": [0.3, 0.4]}
    ball = drawn(Sphere(RADIUS), 3, pose=(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    assert (ball["type"], ball["radius"], ball["dimension"], ball["start"][2]) == ("ball", RADIUS, 3, 1.0)
    face = drawn(HalfSpace((0.6, 0.8), 0.25), 2, motion="fixed")
    assert (face["type"], face["normal"], face["offset"]) == ("face", [0.6, 0.8], 0.25)
