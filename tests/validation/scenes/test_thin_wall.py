"""A fast ball against a thin plate: what comes back, what passes, and the law of methods that do not sweep."""

import numpy as np
import pytest
from planted import failing, made, still

from adapters.law.unswept import passing_law
from adapters.stepping import step_count
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE

DT = 1 / 240


def thrown(scene, dt=DT, swept=True, e=None):
    """A ball stepped in a line; unless it is swept it is found only where a step ends in the plate."""
    p = scene.params
    e = p["e"] if e is None else e
    n = step_count(scene.duration, dt) + 1
    pose, twist = still(scene, n)
    x, v = -p["radius"] - p["v"] * p["delay"], p["v"]
    for k in range(n):
        pose[k, 1, 0], twist[k, 1, 0] = x, v
        x += dt * v
        inside = -p["radius"] <= x <= p["thickness"] + p["radius"]
        if v > 0.0 and (inside or (swept and x > -p["radius"])):
            v = -e * v
    return Trajectory(np.arange(n) * dt, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("v", [1.0, 20.0, 200.0, 1e4])
def test_late_found_rebound_passes(v, dt, dimension):
    canonical, scene = made("thin_wall", dimension, v=v)
    assert failing(canonical, scene, thrown(scene, dt)) == set()


@pytest.mark.parametrize("size", [0.1, 0.01, 0.001])
def test_wrong_rebound_or_depth_beyond_a_step(size):
    canonical, scene = made("thin_wall")
    assert failing(canonical, scene, thrown(scene, e=0.5 * (1.0 - size))) == {"rebound_ratio"}
    deep = thrown(scene)
    k = int(np.argmax(deep.pose[:, 1, 0]))
    deep.pose[k, 1, 0] = -scene.params["radius"] + 20.0 * DT + size
    assert failing(canonical, scene, deep) == {"beyond"}


def test_ball_passing_through_fails_both_checks():
    canonical, scene = made("thin_wall", v=200.0)
    passed = thrown(scene, swept=False)
    assert failing(canonical, scene, passed) == {"rebound_ratio", "beyond"}
    assert canonical.measure(scene, passed)["rebound_ratio"] == (-1.0, "")


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 960])
@pytest.mark.parametrize("v", [20.0, 33.0, 60.0, 100.0, 200.0, 500.0])
def test_passage_through_a_thin_wall_without_sweeping(v, dt):
    canonical, scene = made("thin_wall", v=v)
    measured = canonical.measure(scene, thrown(scene, dt, swept=False))
    passes = measured["rebound_ratio"][0] == -1.0
    for metric in ("rebound_ratio", "beyond"):
        predicted = passing_law(metric)(scene, dt, canonical.measure)
        assert (predicted is not None) is passes
        if predicted is not None:
            value, band = predicted
            assert abs(measured[metric][0] - value) <= band and band < 1e-9


@pytest.mark.parametrize("name", ["impact", "head_on", "off_centre", "slide"])
def test_thin_wall_law_silent_on_other_scenes(name):
    canonical = CATALOGUE[name]
    assert passing_law("rebound_ratio")(canonical.scene(2, {}), DT, canonical.measure) is None
