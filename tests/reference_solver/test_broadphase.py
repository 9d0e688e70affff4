"""The grid finds the pairs whose boxes overlap, all of them, each once and in order: compared with all pairs."""

from itertools import combinations

import numba
import numpy as np
import pytest

from reference_solver.compilation import KERNEL, OPTIONS
from reference_solver.model import Body, Disc, HalfSpace, Model, Sphere
from reference_solver.needs import ALL_PAIRS_LIMIT, needs
from reference_solver.planar.state import allocate_bodies as planar_bodies
from reference_solver.spatial.state import allocate_bodies as spatial_bodies
from reference_solver.stepping.broadphase import allocate_boxes, boxes_part, pair_bodies


def world(dimension, n):
    """Bodies of which every seventh does not move; a half-space is first."""
    if dimension == 2:
        shapes = [HalfSpace((0.0, 1.0)), *[Disc(0.5)] * (n - 1)]
        place, inertia, allocate = (0.0,) * 3, 1.0, planar_bodies
    else:
        shapes = [HalfSpace((0.0, 0.0, 1.0)), *[Sphere(0.5)] * (n - 1)]
        place, inertia, allocate = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (1.0,) * 3, spatial_bodies
    bodies = [
        Body(shape, 1.0, inertia, place, motion="fixed" if i % 7 == 0 else "free") for i, shape in enumerate(shapes)
    ]
    model = Model(dimension, bodies, (0.0,) * dimension, 0.0, 0.0)
    return allocate(model, needs(model)), np.array([body.motion == "free" for body in bodies])


@numba.njit(**OPTIONS, **KERNEL)
def find(bodies, boxes, count):
    return pair_bodies(bodies, boxes_part(boxes, count), 1)


def expected(boxes, free, count):
    found = []
    for i, j in combinations(range(count), 2):
        if (free[i] or free[j]) and np.all(boxes.low[i] <= boxes.high[j]) and np.all(boxes.low[j] <= boxes.high[i]):
            found.append((i, j))
    return found


def spread_out(rng, n, dimension, case):
    """Lower and upper corners (n, d)."""
    centre, width = rng.uniform(-4.0, 4.0, (n, dimension)), rng.uniform(0.3, 1.0, (n, dimension))
    if case == "sizes from 1 mm to 1 km":
        width *= 10.0 ** rng.uniform(-3.0, 3.0, (n, 1))
    elif case == "one size on a lattice":
        centre, width = np.round(centre), np.ones((n, dimension))
    elif case == "powers of two that touch":
        width = 2.0 ** rng.integers(-3, 4, (n, 1)) * np.ones((1, dimension))
        centre = np.round(4.0 * centre) / 4.0
    elif case == "far away":
        centre += rng.choice([-1e12, 0.0, 3e7, 1e15], (n, 1))
    elif case == "points":
        centre, width = np.round(centre), np.zeros((n, dimension))
    low, high = centre - 0.5 * width, centre + 0.5 * width
    if case == "unbounded ones":
        for i in rng.choice(n, 5, replace=False):
            high[i, rng.integers(dimension) :] = np.inf
            low[i, : rng.integers(1, dimension + 1)] = -np.inf
    return low, high


CASES = (
    "alike",
    "sizes from 1 mm to 1 km",
    "one size on a lattice",
    "powers of two that touch",
    "far away",
    "points",
    "unbounded ones",
)


@pytest.mark.few(6)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("case", CASES)
def test_the_grid_finds_what_all_pairs_have(dimension, case):
    rng, n = np.random.default_rng(CASES.index(case)), 150
    bodies, free = world(dimension, n)
    boxes = allocate_boxes(n, dimension, n * n)
    for count in (n, ALL_PAIRS_LIMIT + 1, 100):
        boxes.low[:], boxes.high[:] = spread_out(rng, n, dimension, case)
        truth = expected(boxes, free, count)
        found = find(bodies, boxes, count)
        assert [(key >> 32, key & 0xFFFFFFFF) for key in boxes.candidate[:found].tolist()] == truth


def test_too_little_room_is_told_and_nothing_is_written_behind_it():
    bodies, free = world(2, 100)
    boxes = allocate_boxes(100, 2, 40)
    boxes.low[:], boxes.high[:] = -1.0, 1.0
    assert len(expected(boxes, free, 100)) > 40
    assert find(bodies, boxes, 100) == 41
