"""Worlds that are stepped side by side have the bits that each has alone, whatever is beside them."""

import dataclasses
import itertools
import math
import struct

import numba
import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Settings, Simulation, Sphere
from reference_solver.compilation import config
from reference_solver.lanes import LANES, all_of, any_of, lanes, where

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT: each world is stepped by itself")

DT = 1.0 / 240.0
FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")


def box(half_extents, pose, twist=(0.0, 0.0, 0.0), mass=1.0):
    x, y = half_extents
    return Body(Box(half_extents), mass=mass, inertia=mass * (x * x + y * y) / 3.0, pose=pose, twist=twist)


def column(n=5, friction=0.5, width=0.5, lean=0.0, gap=0.0):
    boxes = [box((width, 0.5), (lean * k, (1.0 + gap) * k + 0.5, 0.0)) for k in range(n)]
    return Model(2, [FLOOR, *boxes], gravity=(0.0, -9.81), restitution=0.0, friction=friction)


def ball(height, restitution, spin):
    body = Body(Disc(0.5), mass=0.5, inertia=0.0625, pose=(0.0, height, 0.0), twist=(0.3, 0.0, spin))
    return Model(2, [body, FLOOR], gravity=(0.0, -9.81), restitution=restitution, friction=0.4)


SHAPES = {
    "disc": lambda size: Disc(size),
    "box": lambda size: Box((size, 0.7 * size)),
    "capsule": lambda size: Capsule(size, 0.5 * size),
    "kite": lambda size: Polygon(((size, 0.0), (0.0, size), (-size, 0.0), (0.0, -size))),
    "floor": lambda size: HalfSpace((0.0, 1.0), 0.0),
}


def jumble(kinds, motions, seed, tables):
    """Bodies above each other, turned and moved at random, with one law for all pairs or one for each."""
    rng, bodies = np.random.default_rng(seed), []
    for k, (kind, motion) in enumerate(zip(kinds, motions, strict=True)):
        place = 0.0 if kind == "floor" else 1.0
        pose = place * np.array([rng.normal(0.0, 0.4), 0.5 + 0.7 * k, rng.choice([0.0, rng.normal()])])
        twist = place * rng.normal(size=3) * (motion != "fixed")
        inert = {"mass": rng.uniform(0.5, 3.0), "inertia": rng.uniform(0.05, 0.5)} if motion == "free" else {}
        shape = SHAPES[kind](float(rng.uniform(0.25, 0.5)))
        bodies.append(Body(shape, motion=motion, pose=tuple(pose.tolist()), twist=tuple(twist.tolist()), **inert))
    n = len(kinds)
    laws = [np.triu(rng.uniform(0.0, 0.9, (n, n)) * rng.integers(0, 2, (n, n)), 1) for _ in range(2)]
    restitution, friction = (law + law.T for law in laws) if tables else rng.uniform(0.1, 0.9, 2).tolist()
    return Model(2, bodies, gravity=(float(rng.choice([0.0, 1.0])), -9.81), restitution=restitution, friction=friction)


def alone(model, parameters, settings, steps, stride):
    """Poses and twists of each world, as `Simulation` records them."""
    for told in parameters:
        record = Simulation(model(**told), settings, certified=False).record(steps, stride)
        yield record.t, record.pose, record.twist


def require_same_bits(model, parameters, settings, steps, stride=1, threads=2):
    found = Simulation.many(model, parameters, settings, threads).record(steps, stride)
    for w, (t, pose, twist) in enumerate(alone(model, parameters, settings, steps, stride)):
        assert found.t.tobytes() == t.tobytes()
        assert found.pose[w].tobytes() == pose.tobytes(), (w, parameters[w])
        assert found.twist[w].tobytes() == twist.tobytes(), (w, parameters[w])
    return found


COLUMNS = [{"friction": 0.2 + 0.05 * k, "width": 0.4 + 0.02 * k, "lean": 0.02 * k, "gap": 0.001 * k} for k in range(11)]


@pytest.mark.parametrize("threads", [1, 2])
def test_columns_have_the_bits_of_one(threads):
    found = require_same_bits(column, COLUMNS, Settings.classical(DT), 150, 10, threads)
    ends = {pose.tobytes() for pose in found.pose[:, -1]}
    assert len(ends) == len(COLUMNS)  # worlds differ: a lane that is read for another would show


@pytest.mark.parametrize("correction", ["none", "split", "baumgarte"])
def test_bouncing_balls_have_the_bits_of_one(correction):
    settings = Settings(dt=DT, solver="scalar", iterations=7, residual=None, position_correction=correction)
    told = [{"height": 0.6 + 0.1 * k, "restitution": 0.08 * k, "spin": 3.0 - k} for k in range(9)]
    require_same_bits(ball, told, settings, 300, 7)


@pytest.mark.parametrize("tables", [False, True], ids=["one law", "a law for each pair"])
@pytest.mark.parametrize("seed", range(6))
def test_jumbled_bodies_have_the_bits_of_one(seed, tables):
    rng = np.random.default_rng(seed)
    kinds = ["floor", *rng.choice(["disc", "box", "capsule", "kite"] if seed % 2 else ["disc", "box"], 5)]
    motions = ["fixed", "free", *rng.choice(["free", "free", "free", "fixed", "prescribed"], 4)]
    order = rng.permutation(len(kinds))  # a body before the floor is the first of their pair
    kinds, motions = [kinds[k] for k in order], [motions[k] for k in order]
    told = [{"kinds": kinds, "motions": motions, "seed": 100 * seed + w, "tables": tables} for w in range(8)]
    require_same_bits(jumble, told, Settings.classical(DT, iterations=1 + seed), 100, 9)


def pile(seed):
    rng, walls = np.random.default_rng(seed), [HalfSpace((1.0, 0.0), -2.0), HalfSpace((-1.0, 0.0), -2.0)]
    discs = [
        Body(Disc(0.3), mass=1.0, inertia=0.045, pose=(rng.uniform(-1.6, 1.6), 0.5 + 0.4 * k, 0.0)) for k in range(20)
    ]
    bodies = [FLOOR, *(Body(wall, motion="fixed") for wall in walls), *discs]
    return Model(2, bodies, gravity=(0.0, -9.81), restitution=0.0, friction=0.5)


def test_piles_that_have_little_in_common_go_on_alone_with_the_same_bits():
    told = [{"seed": seed} for seed in range(LANES)]
    worlds = Simulation.many(pile, told, Settings.classical(DT), threads=1)
    ((_, members),) = worlds._members
    worlds.advance(5)
    assert not members.apart
    worlds.advance(395)
    assert len(members.apart) == LANES
    later = worlds.record(20, 4)
    for w, each in enumerate(told):
        single = Simulation(pile(**each), Settings.classical(DT), certified=False)
        single.advance(400)
        record = single.record(20, 4)
        assert later.pose[w].tobytes() == record.pose.tobytes() and later.twist[w].tobytes() == record.twist.tobytes()


def test_room_grows_where_more_touches_than_was_expected():
    """Discs in one heap from the start: each touches all others."""

    def heap(shift):
        places = itertools.product(range(4), range(4))
        discs = [
            Body(Disc(0.5), mass=1.0, inertia=0.1, pose=(0.1 * x + shift * y, 0.6 + 0.1 * y, 0.0)) for x, y in places
        ]
        return Model(2, [FLOOR, *discs], gravity=(0.0, -9.81), restitution=0.0, friction=0.5)

    require_same_bits(heap, [{"shift": 0.01 * k} for k in range(8)], Settings.classical(DT), 30, 3)


def test_few_worlds_go_on_alone():
    """Lanes cost what two worlds cost: with seven of eight empty nothing is won."""
    worlds = Simulation.many(column, COLUMNS[:1], Settings.classical(DT))
    worlds.advance(3)
    ((_, members),) = worlds._members
    assert len(members.apart) == 1


def test_what_does_not_fit_together_is_stepped_alone():
    """In space, with steps that are cut at events, and where bodies are of different kinds."""

    def balls(restitution):
        here = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        floor = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=here, twist=(0.0,) * 6, force=(0.0,) * 3)
        sphere = Body(Sphere(0.5), mass=1.0, inertia=(0.1, 0.1, 0.1), pose=(0.0, 0.0, 0.6, 1.0, 0.0, 0.0, 0.0))
        return Model(3, [floor, sphere], gravity=(0.0, 0.0, -9.81), restitution=restitution, friction=0.0)

    told = [{"restitution": e} for e in (0.0, 0.5, 0.9)]
    require_same_bits(balls, told, Settings.classical(DT), 60, 5)
    falls = [{"height": 0.7, "restitution": e, "spin": 1.0} for e in (0.0, 0.5)]
    require_same_bits(ball, falls, Settings.reference(DT), 60, 5)
    mixed = [{"kinds": ["floor", kind], "motions": ["fixed", "free"], "seed": 3, "tables": False} for kind in SHAPES]
    require_same_bits(jumble, mixed[:4], Settings.classical(DT), 60, 5)


def test_states_between_calls_are_those_of_one_call():
    settings = Settings.classical(DT)
    one, several = (Simulation.many(column, COLUMNS[:3], settings) for _ in range(2))
    one.advance(90)
    for steps in (1, 0, 64, 25):
        several.advance(steps)
    assert one.pose.tobytes() == several.pose.tobytes() and one.twist.tobytes() == several.twist.tobytes()
    assert one.time == several.time == 90 * DT and len(one) == 3
    assert several.record(3, 5).pose.shape == (3, 1, 6, 3)


def test_a_world_whose_numbers_overflow_changes_no_other():
    told = [{"height": 0.6, "restitution": 0.5, "spin": spin} for spin in (0.0, 1e308, 2.0)]
    require_same_bits(ball, told, Settings.classical(DT), 80, 8)


@pytest.mark.parametrize("kind", ["box", "capsule"])
def test_a_world_without_numbers_changes_no_other(kind):
    """A body at infinity, whose bounds are no numbers: its world ends as it does alone, the others as they do."""

    def column_of(speed):
        model = jumble(["floor", kind, "box", kind], ["fixed", "prescribed", "free", "free"], 7, False)
        bodies = [*model.bodies]
        bodies[1] = dataclasses.replace(bodies[1], twist=(speed, 0.0, 0.0))
        return dataclasses.replace(model, bodies=tuple(bodies))

    # m/s; the first is at infinity after 254 steps.
    told = [{"speed": speed} for speed in (1.7e308, 0.0, 1.0, 0.5, 1.7e308, 2.0, -1.0, 0.1)]
    found = Simulation.many(column_of, told, Settings.classical(DT), 1).record(400, 10)
    for w, (_, pose, twist) in enumerate(alone(column_of, told, Settings.classical(DT), 400, 10)):
        assert np.array_equal(found.pose[w], pose, equal_nan=True), w
        assert np.array_equal(found.twist[w], twist, equal_nan=True), w
    assert np.isfinite(found.pose[1]).all() and not np.isfinite(found.pose[0]).all()


@pytest.mark.parametrize(
    ("told", "threads", "said"),
    [
        ([], None, "parameters: there must be at least one set"),
        ([{"n": 2}, {"n": 3}], None, "parameters[1]: 4 bodies in 2 dimensions, but parameters[0] gives 3 bodies"),
        ([{"n": 2}], 0, "threads: 0 must be a whole number of at least 1"),
        ([{"n": 2}], 1.5, "threads: 1.5 must be a whole number of at least 1"),
    ],
)
def test_bad_input_names_the_field(told, threads, said):
    with pytest.raises(ValueError) as caught:
        Simulation.many(column, told, Settings.classical(DT), threads)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize("call", [lambda w: w.advance(-1), lambda w: w.record(-1), lambda w: w.record(4, 0)])
def test_counts_are_checked(call):
    with pytest.raises(ValueError, match=r"^(steps|stride): .* must be a whole number of at least [01]$"):
        call(Simulation.many(column, [{"n": 2}], Settings.classical(DT)))


WHICH = (
    "add", "subtract", "multiply", "divide", "max", "min", "max with a float", "min with a float", "less", "at most",
    "more", "at least", "equal", "unequal", "negative", "size", "root", "copysign", "cosine", "sine", "both", "either",
    "not", "more in place", "any", "each",
)  # fmt: skip
#: Numbers on which operations differ that are nearly the same.
ODD = (0.0, -0.0, 1.0, -2.5, math.inf, -math.inf, math.nan, 5e-324)


@numba.njit(error_model="numpy")
def operations(x, y, out):
    out[0], out[1], out[2], out[3] = x + y, x - y, x * y, x / y
    out[4], out[5], out[6], out[7] = max(x, y), min(x, y), max(x, 0.5), min(0.5, x)
    out[8], out[9] = where(x < y, 1.0, 2.0), where(x <= y, 1.0, 2.0)
    out[10], out[11] = where(x > y, x, y), where(x >= 1.0, 1.0, y)
    out[12], out[13] = where(x == y, 1.0, 2.0), where(x != y, 1.0, 2.0)
    out[14], out[15], out[16], out[17] = -x, abs(x), math.sqrt(x), math.copysign(x, y)
    out[18], out[19] = math.cos(x), math.sin(x)
    out[20], out[21] = where((x < y) & (x > -1.0), 1.0, 2.0), where((x < y) | (x > 1.0), 1.0, 2.0)
    out[22] = where(x < y, 2.0, 1.0)
    total = x
    total += y
    total -= 0.25
    total *= y
    out[23] = total
    out[24], out[25] = where(any_of(x < y), x, y), where(all_of(x < y), x, y)


@numba.njit(error_model="numpy")
def of_lanes(one, other, out):
    x, y = lanes(one)[0], lanes(other)[0]
    operations(x, y, lanes(out))
    return any_of(x < y), all_of(x < y)


def bits(number):
    """Bytes of a float; all that is no number alike: which of them an operation gives is left to the processor."""
    return b"nan" if math.isnan(number) else struct.pack("d", number)


@pytest.mark.parametrize("shift", range(len(ODD)))
def test_each_lane_holds_what_floats_give(shift):
    one, other = np.array([ODD]), np.roll([ODD], shift)
    found, wanted = np.zeros((2, len(WHICH), LANES))
    some, every = of_lanes(one, other, found)
    assert (some, every) == ((one < other).any(), (one < other).all())
    for lane in range(LANES):
        operations(one[0, lane], other[0, lane], wanted[:, lane])
    for name, left, right, k in zip(WHICH, found, wanted, itertools.count()):
        if name in ("any", "each"):
            right = one[0] if (some, every)[k - WHICH.index("any")] else other[0]
        assert list(map(bits, left)) == list(map(bits, right)), name


def test_uncompiled_functions_of_lanes_take_plain_truths():
    assert where(True, 1.0, 2.0) == 1.0 and where(False, 1.0, 2.0) == 2.0
    assert any_of(True) and not any_of(False) and all_of(True) and not all_of(False)
