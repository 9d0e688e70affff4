"""What adapters do alike before a world is made, and what their readbacks have in common."""

from dataclasses import replace
from operator import mul
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from adapters.checked_engine import CheckedEngine
from adapters.engine import EngineError, EngineFacts, Scheme
from adapters.readback import free_parts, pair_materials
from adapters.scene import Body, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.scene.means import mean, means, no_means
from adapters.scene.meeting import common_material
from adapters.settings import number, whole

FLOOR = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")
BALLS = tuple(Body(name, Disc(0.5), 2.0, 0.25, (2.0 * k, 0.5, 0.0)) for k, name in enumerate("ab"))
SCENE = Scene("floor", 1, 2, (FLOOR, *BALLS), (Pair("*", "*", 0.5, 0.25),), (0.0, -9.81), 1.0)
SPATIAL = Scene("ball", 1, 3, (Body("ball", Sphere(0.5), 1.0, (0.1,) * 3),), (), (0.0,) * 3, 1.0)
SETTINGS = {"iterations": 10, "slop": 0.5}


class Planar(CheckedEngine):
    facts = EngineFacts("planar", "Planar", "numpy", frozenset({2}), Scheme("forces", 1), 0.01, precision="single")
    module = "numpy"
    kinds = MappingProxyType({"iterations": whole(1, 100), "slop": number(0.0, 1.0)})
    profiles = MappingProxyType({})
    simulation = staticmethod(lambda scene, dt, settings: SimpleNamespace(scene=scene, dt=dt, settings=settings))

    def declares(self, profile, needs, dt):
        return {}

    def too_coarse(self, scene, dt):
        return "dt: too long" if dt > 0.1 else None


def test_world_built_from_the_checked_scene():
    made = Planar().build(SCENE, 0.01, SETTINGS)
    assert (made.scene, made.dt, made.settings) == (SCENE, 0.01, SETTINGS) and made.settings is not SETTINGS
    Planar().check_settings(SETTINGS)


@pytest.mark.parametrize(("scene", "dt", "changes", "said"), [
    (SPATIAL, 0.01, {}, "dimension: planar is planar and cannot run a spatial scene"),
    (SCENE, 0.0, {}, "dt: 0.0 must be a positive, finite number of seconds"),
    (SCENE, 0.01, {"slop": 2.0}, "slop: 2.0 must be a number from 0 to 1"),
    (SCENE, 0.01, {"skin": 1.0}, "skin: planar has no such setting, it has iterations, slop"),
    (SCENE, 0.2, {}, "dt: too long"),
    (replace(SCENE, bodies=(FLOOR, replace(BALLS[0], mass=1e-31), BALLS[1])), 0.01, {},
     "a.mass: 1e-31 cannot be represented in single precision"),
])  # fmt: skip
def test_faults_refused_before_a_world_is_built(scene, dt, changes, said):
    with pytest.raises(EngineError) as refused:
        Planar().build(scene, dt, {**SETTINGS, **changes})
    assert str(refused.value) == said


def test_light_bodies_kept_in_double_precision():
    class Double(Planar):
        facts = replace(Planar.facts, precision="double")

    light = replace(SCENE, bodies=(FLOOR, replace(BALLS[0], mass=1e-31)))
    assert Planar().refuses(light, "") and Double().refuses(light, "") is None


def test_version_of_an_importable_package():
    assert Planar().version() == np.__version__
    absent = type("Absent", (Planar,), {"module": "no_such_engine"})()
    with pytest.raises(ImportError):
        absent.version()


def test_readbacks_name_free_bodies_and_pairs():
    assert list(free_parts(SCENE, "xyz")) == [("a", "y"), ("b", "z")]
    found = pair_materials(SCENE, ([1.0, 0.5, 0.25], mul), ([1.0, 0.5, 0.25], mean))
    assert found == {
        "floor-a": {"restitution": 0.5, "friction": 0.75},
        "floor-b": {"restitution": 0.25, "friction": 0.625},
        "a-b": {"restitution": 0.125, "friction": 0.375},
    }


def test_common_material_of_all_pairs():
    assert common_material(SCENE) == (0.5, 0.25)
    assert common_material(replace(SCENE, pairs=(*SCENE.pairs, Pair("a", "b", 0.5, 0.5)))) is None
    assert common_material(replace(SCENE, bodies=BALLS[:1])) is None


def test_a_table_without_means_is_refused_by_name():
    pairs = tuple(Pair(a, b, 0.0, mu) for a, b, mu in (("floor", "a", 1.0), ("floor", "b", 0.0), ("a", "b", 0.0)))
    scene = replace(SCENE, pairs=pairs, bodies=(FLOOR, BALLS[0], replace(BALLS[1], pose=(0.0, 1.5, 0.0))))
    assert means(scene, "friction") is None
    refusal = "pairs: friction of a pair is the mean of two values here; no values per body give this table"
    assert no_means(scene) == refusal
    assert no_means(SCENE) is None
