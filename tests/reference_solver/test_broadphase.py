"""The grid finds the pairs whose boxes overlap, all of them, each once and in order: compared with all pairs."""

from itertools import combinations

import numba
import numpy as np
import pytest

from reference_solver.compilation import KERNEL
from reference_solver.model import Body, Disc, HalfSpace, Model, Sphere
from reference_solver.needs import ALL_PAIRS_LIMIT
from reference_solver.textbook.broadphase import allocate_boxes, pair_bodies


def world(dimension, n):
    """Bodies of which every seventh does not move; a half-space is first."""
    if dimension == 2:
        shapes = [HalfSpace((0.0, 1.0)), *[Disc(0.5)] * (n - 1)]
        place, inertia = (0.0,) * 3, 1.0
    else:
        shapes = [HalfSpace((0.0, 0.0, 1.0)), *[Sphere(0.5)] * (n - 1)]
        place, inertia = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (1.0,) * 3
    bodies = [
        Body(shape, 1.0, inertia, place, motion="fixed" if i % 7 == 0 else "free") for i, shape in enumerate(shapes)
    ]
    return Model(dimension, bodies, (0.0,) * dimension, 0.0, 0.0)


@numba.njit(**KERNEL)
def find(boxes):
    return pair_bodies(boxes, 1)


def expected(boxes):
    found, free = [], boxes.free
    for i, j in combinations(range(len(free)), 2):
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
def test_pairs_of_the_grid_against_all_pairs(dimension, case):
    rng = np.random.default_rng(CASES.index(case))
    for n in (150, ALL_PAIRS_LIMIT + 1, 100):
        boxes = allocate_boxes(world(dimension, n), n * n)
        boxes.low[:], boxes.high[:] = spread_out(rng, n, dimension, case)
        found = find(boxes)
        assert [(key >> 32, key & 0xFFFFFFFF) for key in boxes.candidate[:found].tolist()] == expected(boxes)


def test_too_little_room_for_pairs():
    boxes = allocate_boxes(world(2, 100), 40)
    boxes.low[:], boxes.high[:] = -1.0, 1.0
    assert len(expected(boxes)) > 40
    assert find(boxes) == 41
