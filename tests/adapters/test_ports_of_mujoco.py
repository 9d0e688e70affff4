"""Ports of MuJoCo, each in an environment beside MuJoCo C of its release (``make ports``)."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.conformance import items
from adapters.mujoco.mjx import MujocoMjxEngine
from adapters.mujoco.port import ORIGINAL
from adapters.mujoco.warp import MujocoWarpEngine
from adapters.needs import needs
from adapters.scene import Body, HalfSpace, Pair, Scene, Sphere
from adapters.stepping import run
from adapters.trajectory import Sampling

UPRIGHT, DT = (1.0, 0.0, 0.0, 0.0), 1.0 / 240.0
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0), 0.0), motion="fixed", pose=(0.0, 0.0, 0.0, *UPRIGHT))
PORTS = [
    pytest.param(engine, marks=pytest.mark.optional(engine.name)) for engine in (MujocoWarpEngine(), MujocoMjxEngine())
]


def ball(mu, speed=1.0):
    """A ball that strikes a floor at 2 m/s, with a ``speed`` along it [m/s]."""
    body = Body("ball", Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.6, *UPRIGHT), (speed, 0.0, -2.0, 0.0, 0.0, 0.0))
    return Scene("fall", 1, 3, (FLOOR, body), (Pair(friction=mu),), (0.0, 0.0, -9.81), 0.25)


def ran(engine, scene, profile="default", **changes):
    settings = {each.name: each.value for each in engine.settings(profile, needs(scene), DT)} | changes
    return run(engine, scene, DT, settings, Sampling(contacts_from=0.0))


@pytest.mark.parametrize(
    "item",
    [
        pytest.param(item, marks=pytest.mark.optional(engine.name), id=f"{engine.name}-{item}")
        for engine in (MujocoWarpEngine(), MujocoMjxEngine())
        for item in items(engine)
    ],
)
def test_conformance(item):
    item.hold()


@pytest.mark.parametrize("engine", PORTS)
def test_rough_ball_as_in_c(engine):
    here, there = ran(ORIGINAL, ball(0.3)), ran(engine, ball(0.3))
    within = 1e-5 if engine.facts.precision == "single" else 1e-9
    assert np.abs(here.pose - there.pose).max() < within
    assert len(there.contacts.rows.a) == len(here.contacts.rows.a) > 20
    assert np.allclose(there.contacts.rows.impulse, here.contacts.rows.impulse, atol=10.0 * within)


@pytest.mark.optional("mujoco_warp")
def test_flat_pyramid_in_warp():
    """In single precision its edges are alike; C moves the ball by its law."""
    engine = MujocoWarpEngine()
    for mu in (0.0, 1e-5, 1e-3):
        assert ran(engine, ball(mu, 0.0)).finish == "diverged"
        assert ran(ORIGINAL, ball(mu, 0.0)).finish == "completed"
    for mu, changes in ((0.01, {}), (0.0, {"smooth_condim": 1}), (0.0, {"cone": "elliptic"})):
        here, there = (ran(each, ball(mu, 0.0), **changes) for each in (ORIGINAL, engine))
        assert np.abs(here.pose - there.pose).max() < 1e-6


@pytest.mark.optional("mujoco_mjx")
def test_pair_without_friction_in_mjx():
    """C has friction 1e-5 in its rows, the port has 0."""
    engine, within = MujocoMjxEngine(), {}
    for name, mu, changes in (("none", 0.0, {}), ("that of C", 1e-5, {}), ("no rows", 0.0, {"smooth_condim": 1})):
        here, there = (ran(each, ball(mu), **changes) for each in (ORIGINAL, engine))
        within[name] = np.abs(here.pose - there.pose).max()
    assert within["none"] > 1e-3 and within["that of C"] < 1e-6 and within["no rows"] < 1e-9


@pytest.mark.optional("mujoco_mjx")
@pytest.mark.parametrize("rough", [False, True])
def test_elliptic_cones_of_pairs_without_friction_in_mjx(rough):
    """Scenes with and without a cone; tuned: elliptic cones, no friction rows of pairs without friction."""
    scene = ball(0.0)
    if rough:
        far = replace(scene.bodies[1], name="far", pose=(3.0, 0.0, 0.6, *UPRIGHT))
        scene = replace(scene, bodies=(*scene.bodies, far), pairs=(*scene.pairs, Pair("floor", "far", friction=0.3)))
    here, there = (ran(each, scene, "tuned") for each in (ORIGINAL, MujocoMjxEngine()))
    assert np.abs(here.pose - there.pose).max() < 1e-9


@pytest.mark.optional("mujoco_mjx")
def test_precision_of_mjx():
    engine = MujocoMjxEngine()
    double, single = (ran(engine, ball(0.3), precision=word) for word in ("double", "single"))
    assert 1e-9 < np.abs(double.pose - single.pose).max() < 1e-5
    assert math.isclose(double.readback["tolerance"], 1e-8)
