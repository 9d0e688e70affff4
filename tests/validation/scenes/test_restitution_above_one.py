"""A ball that gains speed: blows one by one against the closed form, planted faults; who may ask for it at all."""

from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made

from adapters import registry
from adapters.needs import needs
from adapters.scene import Pair, Scene, SceneError, scene_from_dict
from adapters.scene.drives import asked_abilities
from adapters.scene.lift import lift
from adapters.scene.meeting import meeting_pairs
from adapters.trajectory import Trajectory

DT = 1 / 240
SIZES = (0.1, 0.01, 0.001)


def thrown(scene, dt=DT, e=None, late=0.0):
    """A ball that moves step by step and is turned, ``e`` times as fast, in the step in which it would touch."""
    p, half = scene.params, 2.0
    e = p["e"] if e is None else e
    n = round(scene.duration / dt)
    pose, twist = np.zeros((n + 1, 3, 3)), np.zeros((n + 1, 3, 3))
    x, v = 0.0, p["v"]
    twist[0, 2, 0] = v
    for k in range(1, n + 1):
        if abs(x + v * dt) > half + late * abs(v) * dt and x * v > 0.0:
            v = -e * v
        x += v * dt
        pose[k, 2, 0], twist[k, 2, 0] = x, v
    return Trajectory(np.arange(n + 1) * dt, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("params", [{}, {"e": 1.5}, {"e": 2.0}, {"v": 0.1}, {"e": 1.0}])
@pytest.mark.parametrize("late", [0.0, 1.0, 2.0])
def test_rebound_above_one_in_every_phase(params, late):
    canonical, scene = made("restitution_above_one", **params)
    assert failing(canonical, scene, thrown(scene, late=late)) == set()


@pytest.mark.parametrize("params", [{}, {"e": 1.5}])
def test_truth_of_the_replay_by_successive_blows(params):
    canonical, scene = made("restitution_above_one", **params)
    fine = thrown(scene, 1e-5)
    place = canonical.track(scene).position
    off = [abs(place(t)[0] - x) for t, x in zip(fine.t[::500], fine.pose[::500, 2, 0], strict=True)]
    assert max(off) < 1e-3
    assert fine.twist[-1, 2, 0] == pytest.approx(-scene.params["v"] * scene.params["e"] ** 5)


@pytest.mark.parametrize("size", SIZES)
def test_wrong_gain_and_a_speed_across_fail(size):
    canonical, scene = made("restitution_above_one")
    for e in (1.1 * (1.0 - size), 1.1 * (1.0 + size)):
        assert "growth" in failing(canonical, scene, thrown(scene, e=e))
    askew = thrown(scene)
    askew.twist[-1, 2, 1] = 1e-3 * size
    assert failing(canonical, scene, askew) == {"astray"}


def test_clamped_restitution_and_resting_ball_detected():
    canonical, scene = made("restitution_above_one")
    assert failing(canonical, scene, thrown(scene, e=1.0)) == {"growth", "blows"}
    tired = thrown(scene)
    tired.twist[-1] *= 0.99
    assert failing(canonical, scene, tired) == {"growth"}
    stopped = thrown(scene)
    stopped.twist[100:, 2] = 0.0
    assert failing(canonical, scene, stopped) == {"growth", "blows"}


def test_declaration_of_restitution_above_one_and_its_note():
    _, scene = made("restitution_above_one")
    with pytest.raises(SceneError, match=r"restitution: 1\.1 must lie in \[0, 1\]"):
        replace(scene, gaining=False)
    with pytest.raises(SceneError, match=r"restitution: 2\.1 must lie in \[0, 2\]"):
        replace(scene, pairs=(Pair(restitution=2.1),))
    assert scene_from_dict(scene.as_dict()).hash() == scene.hash()
    passive = made("restitution_above_one", e=1.0)[1]
    assert "gaining" not in passive.as_dict() and list(asked_abilities(passive)) == []


def test_restitution_above_one_only_for_declared_adapters():
    _, scene = made("restitution_above_one")
    assert list(asked_abilities(scene)) == [("pairs", "restitution above 1")]
    assert list(asked_abilities(lift(scene))) == [("pairs", "restitution above 1")]
    assert needs(scene).restitution == 1.1
    for name in ("chipmunk", "bullet"):
        assert "restitution above 1" in registry.facts(name).abilities
    for name in ("reference", "mujoco"):
        assert "restitution above 1" not in registry.facts(name).abilities


def test_no_reach_limit_for_bodies_that_gain_energy():
    _, scene = made("restitution_above_one")
    assert isinstance(scene, Scene) and len(meeting_pairs(replace(scene, duration=1e-3))) == 2
    assert len(meeting_pairs(replace(made("restitution_above_one", e=1.0)[1], duration=1e-3))) < 2
