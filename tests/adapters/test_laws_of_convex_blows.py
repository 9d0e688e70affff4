"""The law of convex blows says nothing where contacts are stiff, loaded or in space, and asks settings at its step."""

import pytest

from adapters.mujoco import convex_blows
from adapters.mujoco.predictions import PROFILES, settings_of
from validation.catalogue import CATALOGUE


@pytest.mark.parametrize("name", ["starved", "stack"])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 960])
def test_a_scene_that_is_none_of_its_own_has_no_prediction_by_any_profile(monkeypatch, name, dt):
    asked = []

    def settings(profile, scene, step):
        asked.append((profile, scene.name, scene.dimension, step))
        return settings_of(profile, scene, step)

    def measure(scene, trajectory):
        raise AssertionError("no motion is predicted")

    monkeypatch.setattr(convex_blows, "settings_of", settings)
    canonical = CATALOGUE[name]
    for profile in PROFILES:
        for dimension in canonical.dimensions:
            law = convex_blows.convex_blow_law(profile, next(iter(canonical.exact(canonical.scene(dimension)))))
            assert law(canonical.scene(dimension), dt, measure) is None
            assert asked.pop() == (profile, name, dimension, dt) and not asked
