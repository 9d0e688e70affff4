"""Sweeps of many manifolds at once have the bits of sweeps of one after the other."""

import math
import struct
from dataclasses import replace

import numba
import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Settings, Simulation
from reference_solver.compilation import config
from reference_solver.lanes import LANES, lanes
from reference_solver.textbook2.state import MANIFOLDS, allocate_wide

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT: there are no lanes")

DT = 1.0 / 240.0


def heap(seed, count=90, layers=6, shapes="disc"):
    """Bodies of many sizes that fall onto each other, some of them fixed or driven."""
    rng, bodies = np.random.default_rng(seed), [Body(HalfSpace((0.0, 1.0)), motion="fixed")]
    across = count // layers
    for k in range(count):
        size = float(rng.uniform(0.3, 0.5))
        shape = {
            "disc": Disc(size),
            "box": Box((size, 0.8 * size)),
            "capsule": Capsule(0.5 * size, 0.5 * size),
        }[str(rng.choice(shapes.split()))]
        place = (float(k % across + rng.uniform(-0.05, 0.05)), float(0.5 + k // across), float(rng.normal()))
        motion = "free" if k >= across else str(rng.choice(["free", "free", "fixed", "prescribed"]))
        inert = {"mass": float(rng.uniform(0.5, 2.0)), "inertia": 0.1} if motion == "free" else {}
        twist = (0.0, 0.0, 0.5) if motion == "prescribed" else (0.0, 0.0, 0.0)
        bodies.append(Body(shape, motion=motion, pose=place, twist=twist, **inert))
    table = np.triu(rng.uniform(0.0, 0.5, (count + 1, count + 1)) * rng.integers(0, 2, (count + 1, count + 1)), 1)
    return Model(2, bodies, gravity=(0.0, -9.81), restitution=table + table.T, friction=0.5)


def wall(rows):
    floor, boxes = Body(HalfSpace((0.0, 1.0)), motion="fixed"), []
    for row in range(rows):
        for k in range(rows - row):
            place = (1.1 * (k - 0.5 * (rows - row - 1)), 0.5 + row, 0.0)
            boxes.append(Body(Box((0.5, 0.5)), mass=1.0, inertia=1.0 / 6.0, pose=place))
    return Model(2, [floor, *boxes], gravity=(0.0, -9.81), restitution=0.0, friction=0.5)


def narrow(model, settings, certified):
    """A simulation that sweeps one manifold after the other."""
    simulation = Simulation(model, settings, certified=certified)
    world = simulation._world
    assert len(world._wide.last) == len(model.bodies)
    world._wide = allocate_wide(0, 0)
    return simulation


@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize(
    ("model", "changes"),
    [
        (heap(1), {}),
        (heap(2, shapes="disc box capsule"), {"iterations": 7}),
        (heap(3, 150, 5, "box"), {"position_correction": "baumgarte", "relaxation": 1.2}),
        (heap(4, 150, 5), {"position_correction": "none", "warm_starting": False}),
        (replace(heap(5), friction=np.zeros((91, 91))), {}),
        (wall(13), {}),
    ],
    ids=["discs", "three shapes", "boxes with Baumgarte", "no correction", "no friction", "wall"],
)
def test_bits_of_manifolds_in_turn(model, changes, certified):
    settings = replace(Settings.classical(DT), **changes)
    wide, plain = Simulation(model, settings, certified=certified), narrow(model, settings, certified)
    blocks = 0
    for _ in range(12):
        wide.advance(20)
        plain.advance(20)
        assert wide.pose.tobytes() == plain.pose.tobytes() and wide.twist.tobytes() == plain.twist.tobytes()
        for name in ("impulse", "gap", "feature", "body_a"):
            assert getattr(wide.contacts(), name).tobytes() == getattr(plain.contacts(), name).tobytes()
        assert wide.certificate == plain.certificate
        blocks += wide._world._wide.points.any()
    assert blocks > 0  # it was used


def test_bodies_and_order_of_manifolds_in_a_block():
    simulation = Simulation(heap(6), Settings.classical(DT), certified=False)
    simulation.advance(150)
    rows, kind = simulation._world._rows, simulation._world._bodies.kind
    wide, count = simulation._world._wide, int(rows.counts[MANIFOLDS])
    slots, done = [], []
    for block in wide.order.tolist():
        if len(done) < count:  # slots without a manifold repeat the first of their block
            slots.append([m for j, m in enumerate(block) if j == 0 or m != block[0]])
            done += slots[-1]
    assert sorted(done) == list(range(count)) and len(slots) < 2 * count / LANES
    bodies = {m: {b for b in rows.integer[rows.manifold[m], :2].tolist() if kind[b, 1] == 1} for m in done}
    for block in slots:
        assert sum(len(bodies[m]) for m in block) == len(set().union(*(bodies[m] for m in block)))
        assert len({int(rows.manifold[m + 1] - rows.manifold[m]) for m in block}) == 1
    place = {m: k for k, block in enumerate(slots) for m in block}
    for b in range(len(kind)):
        met = [place[m] for m in sorted(done) if b in bodies[m]]
        assert met == sorted(set(met))


def test_room_of_small_scenes_and_solves_to_a_residual():
    small = Simulation(wall(4), Settings.classical(DT))
    exact = Simulation(wall(13), Settings.fixed_step(DT))
    assert all(len(each._world._wide.order) == 0 for each in (small, exact))


#: Numbers on which operations differ that are nearly the same.
ODD = (0.0, -0.0, 1.0, -2.5, math.inf, -math.inf, math.nan, 5e-324)


@numba.njit(error_model="numpy")
def operations(x, y, out):
    out[0], out[1], out[2], out[3] = x + y, x - y, x * y, -x
    out[4], out[5], out[6], out[7] = max(x, y), min(x, y), max(x, 0.5), min(0.5, x)
    total = x
    total += y
    total -= 0.25
    out[8] = total


@numba.njit(error_model="numpy")
def of_lanes(one, other, out):
    operations(lanes(one)[0], lanes(other)[0], lanes(out))


def bits(number):
    """Bytes of a float; all that is no number alike: which of them an operation gives is left to the processor."""
    return b"nan" if math.isnan(number) else struct.pack("d", number)


@pytest.mark.parametrize("shift", range(len(ODD)))
def test_lanes_of_odd_numbers(shift):
    """Each has the bits that floats give."""
    one, other = np.array([ODD]), np.roll([ODD], shift)
    found, wanted = np.zeros((2, 9, LANES))
    of_lanes(one, other, found)
    for lane in range(LANES):
        operations(one[0, lane], other[0, lane], wanted[:, lane])
    assert [list(map(bits, row)) for row in found] == [list(map(bits, row)) for row in wanted]
