"""Scenes of the conformance kit are what their first lines say: who touches, who lies on whom, who meets whom when."""

import math
from itertools import combinations

import numpy as np
import pytest

from adapters.conformance import scenes
from validation.geometry import separation

MADE = {
    make.__name__: make()
    for make in (
        scenes.resting, scenes.striking, scenes.flying, scenes.glancing, scenes.rolling, scenes.sliding,
        scenes.odd_pairs, scenes.carried, scenes.leaning,
    )
}  # fmt: skip


def gap(scene, one, other, t=0.0):
    """Distance of two bodies after a free flight of ``t`` [s] without gravity [m]."""
    a, b = ({body.name: body for body in scene.bodies}[name] for name in (one, other))
    poses = [np.array([body.pose]) + t * np.array([body.twist]) for body in (a, b)]
    return float(separation(a.shape, poses[0], b.shape, poses[1])[0])


@pytest.mark.parametrize("name", MADE)
def test_no_initial_overlap_in_kit_scenes(name):
    scene = MADE[name]
    for a, b in combinations([body.name for body in scene.bodies], 2):
        assert gap(scene, a, b) > -1e-12, (a, b)
    assert scene.name.startswith("check_") and scene.name == scene.name.lower()


def test_resting_bodies_of_kit_scenes_touch_their_support():
    lying = MADE["leaning"]
    assert gap(lying, "floor", "lower") == pytest.approx(0.0, abs=1e-12)
    assert gap(lying, "lower", "upper") == pytest.approx(0.0, abs=1e-12)
    height = {body.name: body.pose[1] for body in lying.bodies}
    assert height["lower"] < height["upper"] and gap(lying, "floor", "upper") > 0.1
    for name in ("resting", "sliding"):
        assert gap(MADE[name], "floor", "box") == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "one", "other"),
    [("striking", "light", "heavy"), ("glancing", "light", "heavy"), ("rolling", "left", "right"),
     ("carried", "piston", "ball"), ("resting", "floor", "ball"), ("rolling", "floor", "ball")],
)  # fmt: skip
def test_colliding_bodies_of_a_kit_scene_apart_at_the_start(name, one, other):
    scene = MADE[name]
    assert gap(scene, one, other) > 1e-6
    assert min(gap(scene, one, other, t) for t in np.linspace(0.0, scene.duration, 200)) < 0.0


def test_odd_pairs_without_values_per_body():
    """No number per body makes e_ab, e_bc and e_ac: their logarithms would have to add up."""
    scene = MADE["odd_pairs"]
    e = {(a, b): scene.material(a, b).restitution for a, b in combinations("abc", 2)}
    assert e["a", "c"] == 0.0 and e["a", "b"] > 0.0 and e["b", "c"] > 0.0
    assert all(math.dist(a.pose[:2], b.pose[:2]) > 1.5 for a, b in combinations(scene.bodies, 2))
