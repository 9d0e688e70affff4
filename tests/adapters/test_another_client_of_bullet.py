"""A world of Bullet beside one of somebody else's: whoever calls without naming his client means client 0."""

from dataclasses import replace

import pytest

pytest.importorskip("pybullet", reason="pybullet has no wheel for this Python")

import pybullet

from adapters import Sampling, needs, run
from adapters.bullet import BulletEngine
from adapters.engine import EngineError
from adapters.scene import SceneError
from adapters.scene.lift import lift
from validation.catalogue import CATALOGUE

ENGINE = BulletEngine()
DT = 1.0 / 240.0
PARAMETERS = ("fixedTimeStep", "numSolverIterations", "numSubSteps", "gravityAccelerationX", "gravityAccelerationY",
              "gravityAccelerationZ", "contactERP", "restitutionVelocityThreshold")  # fmt: skip


@pytest.fixture
def client_0():
    """Client 0, of somebody else's; of another test's, if that has left one."""
    found = pybullet.connect(pybullet.DIRECT)
    yield 0
    pybullet.disconnect(found)


def seen(scene, profile):
    """All that a world shows of a scene: states, contacts, what it says that it holds, and how it ended."""
    settings = {each.name: each.value for each in ENGINE.settings(profile, needs(scene), DT)}
    found = run(ENGINE, scene, DT, settings, Sampling(1, 0.0))
    told = found.contacts.rows
    return (found.state_hash(), found.finish, repr(found.readback), found.initial_change,
            [getattr(told, name).tobytes() for name in ("impulse", "normal", "point", "gap")])  # fmt: skip


def scenes():
    """The start of every scene that Bullet takes: boxes, hulls, belts, loads, drives."""
    for canonical in CATALOGUE.values():
        scene = canonical.scene(canonical.dimensions[-1])
        yield replace(scene if scene.dimension == 3 else lift(scene), duration=12 * DT)


@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_initial_bits_beside_another_client_s_world(profile, request):
    alone = {}
    for scene in scenes():
        try:
            alone[scene.name] = scene, seen(scene, profile)
        except (EngineError, SceneError):  # it cannot be asked
            continue
    assert len(alone) > 0.7 * len(CATALOGUE)
    other = request.getfixturevalue("client_0")
    before = pybullet.getPhysicsEngineParameters(physicsClientId=other)
    for name, (scene, told) in alone.items():
        assert seen(scene, profile) == told, name
        assert pybullet.getNumBodies(physicsClientId=other) == 0, name
    assert pybullet.getPhysicsEngineParameters(physicsClientId=other) == before
