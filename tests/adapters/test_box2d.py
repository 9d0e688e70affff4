"""The Box2D adapter and the law of blows in single precision, on small scenes with known answers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from driven import driven

from adapters.box2d import Box2DEngine
from adapters.box2d.laws import BLOWS, DEVIATIONS
from adapters.box2d.profiles import FINEST, units
from adapters.conformance import items
from adapters.engine import EngineError
from adapters.law import exactly
from adapters.law.single_precision import Method, rounded_law
from adapters.needs import needs
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene
from validation.catalogue import CATALOGUE

pytestmark = pytest.mark.optional("box2d")
ENGINE = Box2DEngine()
DT = 1.0 / 240.0
settings, drive = driven(ENGINE, "tuned")
FLOOR = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")


def resting(*pairs, **changes):
    box = replace(Body("box", Box((0.5, 0.25)), 3.0, 0.4, (0.0, 0.25, 0.0)), **changes)
    return Scene("rest", 1, 2, (FLOOR, box), pairs or (Pair(friction=0.5),), (0.0, -9.81), 0.5)


@pytest.mark.parametrize("item", items(ENGINE), ids=str)
def test_conformance(item):
    item.hold()


def test_default_of_a_fresh_world_and_polygon():
    import Box2D

    chosen, world = settings(resting(), "default"), Box2D.b2World()
    assert chosen["continuous"] == world.continuousPhysics and world.warmStarting
    assert chosen["skin"] == pytest.approx(Box2D.b2PolygonShape(box=(1, 1)).radius) == pytest.approx(0.01)
    assert Box2D.b2_velocityThreshold == 1.0 and Box2D.b2_linearSlop == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("changes", "field"),
    [({"iterations": 0}, "iterations"), ({"position_iterations": 1.5}, "position"),
     ({"skin": -1.0}, "skin"), ({"skin": math.nan}, "skin"), ({"units_per_metre": 0.0}, "units_per_metre"),
     ({"continuous": 1}, "continuous"), ({"early_restitution": None}, "early_restitution"), ({"slop": 0.1}, "slop")],
)  # fmt: skip
def test_refusal_of_a_bad_setting_by_name(changes, field):
    with pytest.raises(EngineError, match=rf"^{field}[^\n]*\Z"):
        ENGINE.build(resting(), DT, settings(resting(), **changes))


def test_refusal_of_a_missing_setting_or_a_mass_per_body():
    chosen = settings(resting())
    del chosen["skin"]
    with pytest.raises(EngineError, match=r"^skin: "):
        ENGINE.build(resting(), DT, chosen)
    assert ENGINE.refuses(resting(mass=1e-40), "tuned").startswith("box.mass: ")


def test_length_unit_at_most_a_metre():
    slow = needs(Scene("slow", 1, 2, (FLOOR, Body("ball", Disc(0.5))), (Pair(),), (0.0, 0.0), 1.0))
    assert units(slow, DT) == FINEST
    assert units(replace(slow, top_speed=100.0), DT) == 2.0
    assert units(replace(slow, top_speed=1e4), DT) == 1.0
    assert units(replace(slow, regime="impact", top_speed=10.0, mass_ratio=400.0), DT) == 2.0


def test_rest_height_of_boxes_shipped_and_tuned():
    for profile, low, high in (("default", 0.0148, 0.0201), ("tuned", -2e-5, 2e-4)):
        assert low < drive(resting(), profile).pose[-1, 1, 1] - 0.25 < high


@pytest.mark.parametrize("unit", [1.0, 8.0])
def test_newtons_of_forces_in_any_unit(unit):
    pushed = resting(force=(2.0, 0.0), torque=(0.1,))
    found = drive(replace(pushed, pairs=(Pair(),)), units_per_metre=unit)
    assert found.twist[-1, 1, 0] == pytest.approx(2.0 / 3.0 * 0.5, rel=1e-5)
    weight = found.contacts.impulse_between(0, 1)[-60:, 1].mean() / DT
    assert weight == pytest.approx(3.0 * 9.81, rel=1e-4)


def test_each_pair_has_its_own_material():
    bodies = (FLOOR, *(Body(name, Disc(0.5), 1.0, 0.125, (3.0 * k, 0.52, 0.0), (2.0, -2.0, 0.0))
                       for k, name in enumerate("abc")))  # fmt: skip
    pairs = tuple(Pair("floor", name, e, mu) for name, e, mu in (("a", 0.9, 0.1), ("b", 0.4, 0.2), ("c", 0.0, 0.05)))
    found = drive(Scene("pairs", 1, 2, bodies, pairs, (0.0, 0.0), 0.1))
    for k, pair in enumerate(pairs, start=1):
        assert found.twist[-1, k, 1] == pytest.approx(2.0 * pair.restitution, abs=1e-5)
        assert found.twist[-1, k, 0] == pytest.approx(2.0 - pair.friction * 2.0 * (1 + pair.restitution), abs=1e-5)


def test_normal_of_a_wall_along_an_axis():
    """A turn by a single angle would miss it by 4e-8, which many blows blow up."""
    bodies = (Body("wall", HalfSpace((1.0, 0.0)), motion="fixed"), Body("ball", Disc(0.5), pose=(0.6, 0.0, 0.0),
              twist=(-2.0, 0.0, 0.0)))  # fmt: skip
    found = drive(Scene("wall", 1, 2, bodies, (Pair(restitution=1.0),), (0.0, 0.0), 0.2))
    assert found.twist[-1, 1, 0] == 2.0 and not found.twist[:, 1, 1].any()


# ---- law -------------------------------------------------------------------------------------------------------------


def law_of(scene_name, metric):
    return next(law for law in DEVIATIONS if law.scene == scene_name and law.metric == exactly(metric)
                and law.profiles == ("tuned",))  # fmt: skip


def textbook(e, speed):
    return e


@pytest.mark.parametrize("name", BLOWS)
def test_law_band_of_single_precision(name):
    """Its motion is computed here, the truth by the scene: independent of each other."""
    canonical, spoken = CATALOGUE[name], 0
    for variation in canonical.variations("standard"):
        for dimension in canonical.dimensions:
            scene = canonical.scene(dimension, variation.params)
            truth = canonical.exact(scene)
            for metric in set(BLOWS[name]) & set(truth):
                found = rounded_law(metric, Method(textbook, 1000))(scene, DT, canonical.measure)
                if found is not None and truth[metric] is not None:
                    spoken += 1
                    assert abs(found[0] - truth[metric]) <= 1e-9 * max(1.0, abs(truth[metric])), (variation, metric)
                    assert 0.0 < found[1] < 0.02, (variation, metric)
    assert spoken


def test_law_silent_about_loads_and_successive_blows():
    falling = CATALOGUE["bounce"].scene(2)
    assert rounded_law("rest_time", Method(textbook))(falling, DT, CATALOGUE["bounce"].measure) is None
    cradle = CATALOGUE["cradle"].scene(2, {"n": 4.0, "apart": 0.05})
    assert rounded_law("speed[1]", Method(textbook))(cradle, DT, CATALOGUE["cradle"].measure) is not None
    assert rounded_law("speed[1]", Method(textbook))(cradle, 0.05, CATALOGUE["cradle"].measure) is None


def test_threshold_of_the_law_equal_to_the_engine_s():
    impact = CATALOGUE["impact"]
    for v, expected in ((1.0, 0.0), (1.001, 1.0)):
        scene = impact.scene(2, {"v": v, "e": 1.0})
        law = next(d for d in DEVIATIONS if d.scene == "impact" and d.profiles == ("default",))
        value, band = law.law(scene, DT, impact.measure)
        assert value == pytest.approx(expected, abs=1e-12) and band < 1e-4
        found = impact.measure(scene, drive(scene, "default"))["rebound_ratio"][0]
        assert abs(found - value) <= band


def test_law_band_against_a_planted_fault_of_a_thousandth():
    impact = CATALOGUE["impact"]
    scene = impact.scene(2, {"v": 6.0, "e": 0.8})
    wrong = replace(scene, pairs=(Pair(restitution=0.8 * 0.999),))
    value, band = law_of("impact", "rebound_ratio").law(scene, DT, impact.measure)
    assert abs(impact.measure(scene, drive(wrong))["rebound_ratio"][0] - value) > band
    assert np.isfinite(band)
