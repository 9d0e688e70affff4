"""Ports of MuJoCo, each in an environment beside MuJoCo C of its release (``make ports``)."""

import math

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


def ball(mu, duration=0.25):
    body = Body("ball", Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.6, *UPRIGHT), (1.0, 0.0, -2.0, 0.0, 0.0, 0.0))
    return Scene("fall", 1, 3, (FLOOR, body), (Pair(friction=mu),), (0.0, 0.0, -9.81), duration)


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
    assert np.allclose(there.contacts.rows.impulse, here.contacts.rows.impulse, atol=1e3 * within)


@pytest.mark.optional("mujoco_warp")
def test_smooth_ball_as_shipped_in_warp():
    """C has friction 1e-5 in the rows of a pair without friction; the port has 0, and divides by it."""
    engine = MujocoWarpEngine()
    assert ran(engine, ball(0.0)).finish == "diverged"
    for scene, changes in ((ball(1e-5), {}), (ball(0.0), {"smooth_condim": 1})):
        found = ran(engine, scene, **changes)
        assert found.finish == "completed"
        assert np.abs(found.pose - ran(ORIGINAL, scene, **changes).pose).max() < 1e-4


@pytest.mark.optional("mujoco_mjx")
def test_smooth_ball_as_shipped_in_mjx():
    engine = MujocoMjxEngine()
    assert np.abs(ran(engine, ball(0.0)).pose - ran(ORIGINAL, ball(0.0)).pose).max() > 1e-3
    here, there = (ran(each, ball(0.0), smooth_condim=1) for each in (ORIGINAL, engine))
    assert np.abs(there.pose - here.pose).max() < 1e-9


@pytest.mark.optional("mujoco_mjx")
def test_precision_of_mjx():
    engine = MujocoMjxEngine()
    double, single = (ran(engine, ball(0.3), precision=word) for word in ("double", "single"))
    assert 1e-9 < np.abs(double.pose - single.pose).max() < 1e-5
    assert math.isclose(double.readback["tolerance"], 1e-8)
