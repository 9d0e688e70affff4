"""`Engine.build_many`: the first world moves as it does alone, and others as their own scenes say."""

from dataclasses import replace

import numpy as np
import pytest

from adapters.engine import EngineError
from adapters.needs import needs
from adapters.registry import load
from validation.bench.units import many
from validation.posed import resolve

DT = 1.0 / 240.0
PROFILES = [("reference", "classical", 2), ("mujoco", "default", 3)]


def scene_of(name, dimension, **params):
    return resolve(name).scene(dimension, params)


def settings_of(engine, profile, scene):
    return {setting.name: setting.value for setting in engine.settings(profile, needs(scene), DT)}


@pytest.mark.parametrize(("name", "profile", "dimension"), PROFILES)
@pytest.mark.parametrize("first", [0, 3])
def test_world_among_many_moves_as_alone(name, profile, dimension, first):
    engine, scenes = load(name), many(scene_of("incline", dimension), 6)
    settings = settings_of(engine, profile, scenes[0])
    together = engine.build_many(scenes[first:] + scenes[:first], DT, settings, 2)
    alone = engine.build(scenes[first], DT, settings)
    together.advance(90)
    alone.advance(90)
    assert np.array_equal(together.pose(), alone.pose()) and np.array_equal(together.twist(), alone.twist())
    assert not np.array_equal(together.pose(), engine.build(scenes[first], DT, settings).pose())  # it has moved
    with pytest.raises(EngineError, match="contacts: many worlds keep none"):
        together.contacts()
    together.close()


def test_mujoco_steps_one_world_where_its_adapter_acts_between_steps():
    engine, plain = load("mujoco"), scene_of("incline", 3)
    settings = settings_of(engine, "default", plain)
    free = next(k for k, body in enumerate(plain.bodies) if body.motion == "free")

    def changed(k, **fields):
        bodies = [replace(body, **fields) if i == k else body for i, body in enumerate(plain.bodies)]
        return replace(plain, bodies=tuple(bodies))

    pushed, turned = changed(free, force=(1.0, 0.0, 0.0)), changed(free, torque=(0.0, 0.0, 1.0))
    belt = changed(1 - free, surface_velocity=(1.0, 0.0, 0.0))
    for other in (pushed, turned, belt):
        assert engine.build_many([plain, other], DT, settings, 2) is None
    with pytest.raises(EngineError, match="dt"):
        engine.build_many([plain], 0.0, settings, 2)
