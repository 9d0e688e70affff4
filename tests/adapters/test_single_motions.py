"""Laws of single motions, condition by condition: a corner that lands, what blows keep, a place that is kept."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.law import single_motions as motions
from adapters.law.single_precision import ROUNDINGS, UNIT
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere

DT = 1 / 64
FLOOR = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
TILT = math.atan2(3.0, 4.0)
#: Half extents 4 and 3 m, so that a side stands upright or level at multiples of 90 degrees only.
BOX = Body("box", Box((4.0, 3.0)), 2.0, 8.0, (1.0, 8.0, 0.3), (0.0, -2.0, 0.0))


def fall(box=BOX, floor=FLOOR, **changes):
    pairs = (Pair(restitution=0.5, friction=0.0),)
    return replace(Scene("own", 1, 2, (floor, box), pairs, (0.0, 0.0), 4.0), **changes)


def test_the_lowest_corner_is_told_from_the_centre():
    for turn, corner in (
        (TILT, (-4.0 * 0.8 + 3.0 * 0.6, 4.0 * 0.6 + 3.0 * 0.8)), (-TILT, (4.0 * 0.8 - 3.0 * 0.6, 4.8)),
        (TILT + math.pi, (-1.4, 4.8)), (TILT + 0.5 * math.pi, (3.0 * 0.8 - 4.0 * 0.6, 3.0 * 0.6 + 4.0 * 0.8)),
    ):  # fmt: skip
        assert motions.lowest(replace(BOX, pose=(7.0, 9.0, turn))) == pytest.approx(corner)


def test_corner_landing_condition_of_a_tilted_box():
    assert motions._falls_on_a_corner(fall())
    for more in (1e-3 * 1.01, 0.5 * math.pi - 2e-3, -0.3):
        assert motions._falls_on_a_corner(fall(replace(BOX, pose=(1.0, 8.0, more))))
    others = [
        fall(replace(BOX, **more)) for more in (
            {"shape": Disc(1.0)}, {"force": (0.1, 0.0)}, {"force": (0.0, 0.1)}, {"torque": (0.1,)},
            {"twist": (0.1, -2.0, 0.0)}, {"twist": (0.0, -2.0, 0.1)}, {"twist": (0.0, 2.0, 0.0)}, {"twist": (0.0,) * 3},
            {"pose": (1.0, 8.0, 0.0)}, {"pose": (1.0, 8.0, 0.9e-3)}, {"pose": (1.0, 8.0, math.pi - 0.9e-3)},
            {"motion": "fixed", "twist": (0.0,) * 3},
        )
    ]  # fmt: skip
    others += [fall(floor=replace(FLOOR, shape=shape)) for shape in (
        HalfSpace((0.0, 1.0), 0.5), HalfSpace((0.6, 0.8)), Disc(1.0))]  # fmt: skip
    others += [fall(gravity=(0.0, -1.0)), fall(gravity=(1.0, 0.0)), fall(pairs=(Pair(restitution=0.5, friction=0.1),))]
    others += [fall(bodies=(FLOOR, BOX, replace(BOX, name="other"))), fall(bodies=(BOX,))]
    assert [motions._falls_on_a_corner(each) for each in others] == [False] * len(others)


def test_box_motion_after_a_corner_landing():
    scene = fall(duration=1.0)
    blow, lever, landing = 6.0, -1.5, 0.5 + 0.5 * DT
    found = motions._landed(scene, DT, landing, blow, lever)
    t = np.arange(65) * DT
    after = np.maximum(t - landing, 0.0)
    assert found.t == pytest.approx(t) and (found.dt, found.finish) == (DT, "completed")
    assert found.pose[:, 1] == pytest.approx(
        np.column_stack([np.full(65, 1.0), 8.0 - 2.0 * t + 3.0 * after, 0.3 - 1.125 * after])
    )
    hit = (t > landing)[:, None]
    assert found.twist[:, 1] == pytest.approx(np.where(hit, (0.0, 1.0, -1.125), (0.0, -2.0, 0.0)))
    assert found.pose[:, 0] == pytest.approx(np.zeros((65, 3))) and not found.twist[:, 0].any()
    rows = found.contacts.rows
    assert list(found.contacts.step) == [33] and list(found.contacts.offset) == [0, 1]
    assert (rows.a[0], rows.b[0], rows.gap[0]) == (0, 1, 0.0)
    assert rows.normal[0] == pytest.approx((0.0, 1.0)) and rows.impulse[0] == pytest.approx((0.0, 6.0))


def corner(scene, dt=DT, units=1.0, skin=0.0, threshold=0.0, metric=lambda path: path.contacts.rows.impulse[0, 1]):
    law = motions.corner_law("blow", lambda scene, dt: (units, skin), threshold)
    return law(scene, dt, lambda scene, path: {"blow": (metric(path),)})


def test_corner_blow_by_its_reduced_mass():
    lever, below = motions.lowest(BOX)
    blow = 1.5 * 2.0 / (1.0 / 2.0 + lever**2 / 8.0)
    share = ROUNDINGS * UNIT
    assert corner(fall()) == (pytest.approx(blow), pytest.approx(2.0 * share * blow, rel=1e-6))
    # A metric that hangs on the lever counts its roundings as well, whatever their sign.
    turn = pytest.approx(lever * blow / 8.0)
    spin = corner(fall(), metric=lambda path: path.twist[-1, 1, 2])
    assert spin == (turn, pytest.approx(3.0 * share * abs(lever * blow / 8.0), rel=1e-4))
    assert corner(fall(), metric=lambda path: None) is None
    plastic = pytest.approx(blow / 1.5)
    for threshold, value in ((2.0, plastic), (2.01, plastic), (1.99, pytest.approx(blow))):
        assert corner(fall(), threshold=threshold)[0] == value
    assert corner(fall(), units=0.5, threshold=1.0)[0] == plastic  # told in lengths of its own
    assert corner(fall(), skin=0.1) is None and corner(fall(), skin=0.1, threshold=2.0)[0] == plastic
    landing = (8.0 - below) / 2.0
    assert corner(fall(duration=landing + 2.0 * DT)) is not None and corner(fall(duration=landing + 0.5 * DT)) is None
    assert corner(fall(replace(BOX, pose=(1.0, below - 0.01, 0.3)))) is None  # overlaps at the start


def balls(*changes, **more):
    own = [Body(name, Disc(0.5), 1.0, 0.1, (2.0 * k, 0.0, 0.0), (1.0 - k, 0.0, 0.0)) for k, name in enumerate("abc")]
    own = [replace(body, **change) for body, change in zip(own, (*changes, {}, {}, {}), strict=False)]
    return replace(Scene("own", 1, 2, tuple(own), (Pair(restitution=1.0, friction=0.0),), (0.0, 0.0), 1.0), **more)


def test_elastic_smooth_balls_keep_momentum_to_round_off():
    law = motions.kept_law("energy")
    assert law(balls(), DT, None) == (0.0, 9.0 * ROUNDINGS * UNIT)
    assert law(balls(bodies=balls().bodies[:2]), DT, None) == (0.0, 6.0 * ROUNDINGS * UNIT)
    spheres = [
        Body(n, Sphere(0.5), 1.0, (0.1,) * 3, (k, 0, 0, 1, 0, 0, 0), (0.0,) * 6) for n, k in (("a", 0), ("b", 2))
    ]
    scene = Scene("own", 1, 3, tuple(spheres), (Pair(restitution=1.0, friction=0.0),), (0.0,) * 3, 1.0)
    assert law(scene, DT, None) is not None
    for other in (
        balls({"shape": Box((0.5, 0.5))}), balls({"motion": "fixed", "twist": (0.0,) * 3}),
        balls({"force": (0.0, 0.1)}), balls({"torque": (0.1,)}), balls(gravity=(0.0, -1.0)),
        balls(pairs=(Pair(restitution=0.999, friction=0.0),)), balls(pairs=(Pair(restitution=1.0, friction=0.1),)),
        balls(pairs=(Pair("a", "b", 0.5, 0.0), Pair(restitution=1.0, friction=0.0))),
    ):  # fmt: skip
        assert law(other, DT, None) is None


def pair(*changes, **more):
    own = balls({"twist": (3.0, 4.0, 2.0)}, *changes, **more)
    return replace(own, bodies=own.bodies[:2])


def test_conserved_quantities_to_round_off_of_the_fastest():
    asked = []

    def measure(scene, path):
        asked.append(path)
        end, start = path.twist[-1], path.twist[0]
        return {"lost": (float((end - start).sum()) * (1 if len(asked) % 2 else -1),)}

    law = motions.booked_law("lost")
    value, band = law(pair(), DT, measure)
    assert value == 0.0 and band == pytest.approx(4.0 * ROUNDINGS * UNIT * 5.0, rel=1e-6)
    assert len(asked) == 4 and {tuple(np.argwhere(each.twist[1] != each.twist[0])[0]) for each in asked} == {
        (0, 0), (0, 1), (1, 0), (1, 1)
    }  # fmt: skip
    for each in asked:
        assert list(each.t) == [0.0, 1.0] and (each.dt, each.finish, each.contacts) == (DT, "completed", None)
        assert (each.pose[0] == each.pose[1]).all() and (each.twist[0] == [b.twist for b in pair().bodies]).all()
    assert law(pair(), DT, lambda scene, path: {"lost": (None,)}) is None
    for other in (
        balls({"twist": (3.0, 4.0, 2.0)}), pair(gravity=(0.0, -1.0)), pair({"force": (0.1, 0.0)}),
        pair({"torque": (0.1,)}), pair({"motion": "fixed", "twist": (0.0,) * 3}), balls(bodies=balls().bodies[:2]),
        pair(pairs=(Pair(restitution=1.0, friction=0.1),)),
    ):  # fmt: skip
        assert law(other, DT, measure) is None


def test_position_kept_where_a_step_is_below_half_a_spacing():
    plate = Body("plate", Box((1.0, 1.0)), motion="fixed")
    box = Body("box", Box((0.5, 0.5)), 1.0, 1.0, (2.0**20, 1.5, 0.0), (1.0, 0.0, 0.0))
    scene = Scene("own", 1, 2, (plate, box), (), (0.0, -9.81), 2.0)

    def told(scene, dt, units=1.0):
        law = motions.standstill_law("way", lambda scene, dt: (units, 0.0))
        return law(scene, dt, lambda scene, path: {"way": (None if path.dt > 1.0 else float(path.t[-1]),)})

    # Above 2^20 singles are 1/8 apart, below it 1/16.
    assert told(scene, 0.0624) == (pytest.approx(2.0, abs=0.07), 0.0) and told(scene, 0.0626) is None
    back = replace(scene, bodies=(plate, replace(box, twist=(-1.0, 0.0, 0.0))))
    assert told(back, 0.0312) is not None and told(back, 0.0313) is None
    assert told(scene, 0.0625) is None  # a tie, which rounds to even
    # Three quarters of a unit to the metre: 1/16 apart there, which is 1/12 m.
    assert told(scene, 0.0416, 0.75) is not None and told(scene, 0.0417, 0.75) is None
    for other in (
        replace(scene, gravity=(0.1, -9.81)), replace(scene, bodies=(plate, replace(box, force=(0.0, 1.0)))),
        replace(scene, bodies=(plate, replace(box, torque=(1.0,)))),
        replace(scene, bodies=(plate, replace(box, twist=(1.0, 0.0, 0.1)))),
        replace(scene, bodies=(plate, replace(box, twist=(1.0, 0.1, 0.0)))),
        replace(scene, bodies=(plate, box, replace(box, name="third"))),
        replace(scene, bodies=(Body("plate", Box((1.0, 1.0)), 1.0, 1.0), box)),
    ):  # fmt: skip
        assert told(other, 0.01) is None
