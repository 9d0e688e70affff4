"""Bullet without any settings; see `adapters.unset`."""

from __future__ import annotations

import math
from functools import partial

from adapters import unset
from adapters.bullet.shipped import LARGEST_FRICTION, LARGEST_SPEED, RESTITUTION_THRESHOLD
from adapters.bullet.simulation import pybullet_here
from adapters.unset import FRICTIONS, HALF_HEIGHT, HALF_WIDTH, RADIUS, RESTITUTIONS, Asked, Told, Unset

#: Half thickness of the ground's box [m].
DEPTH = 5.0


class Bare:
    """A client with one body above a static box."""

    #: Documented; PyBullet has no call for it.
    dt = 1.0 / 240.0

    def __init__(self, asked: Asked) -> None:
        p = self._p = pybullet_here()
        self._client = client = p.connect(p.DIRECT)
        if asked.gravity is not None:
            p.setGravity(0.0, 0.0, -asked.gravity, physicsClientId=client)
        how = {"radius": RADIUS} if asked.shape == "ball" else {"halfExtents": (HALF_WIDTH, HALF_WIDTH, HALF_HEIGHT)}
        kind = p.GEOM_SPHERE if asked.shape == "ball" else p.GEOM_BOX
        floor = p.createCollisionShape(p.GEOM_BOX, halfExtents=(50.0, 50.0, DEPTH), physicsClientId=client)
        own = p.createCollisionShape(kind, **how, physicsClientId=client)
        ground = p.createMultiBody(0.0, floor, -1, (0.0, 0.0, -DEPTH), physicsClientId=client)
        self._body = p.createMultiBody(1.0, own, -1, (0.0, 0.0, asked.height), physicsClientId=client)
        for k, body in enumerate((ground, self._body)):
            if asked.friction is not None:
                p.changeDynamics(body, -1, lateralFriction=asked.friction[k], physicsClientId=client)
            if asked.restitution is not None:
                p.changeDynamics(body, -1, restitution=asked.restitution[k], physicsClientId=client)
        velocity, spin = (asked.along, 0.0, asked.up), (0.0, 0.0, asked.spin)
        p.resetBaseVelocity(self._body, velocity, spin, physicsClientId=client)
        self._lowest = asked.height - asked.gap

    def __del__(self) -> None:
        self._p.disconnect(self._client)

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._p.stepSimulation(physicsClientId=self._client)

    @property
    def contacts(self) -> int:
        """Contacts of the last step."""
        return len(self._p.getContactPoints(physicsClientId=self._client))

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        place, _ = self._p.getBasePositionAndOrientation(self._body, physicsClientId=self._client)
        velocity, spin = self._p.getBaseVelocity(self._body, physicsClientId=self._client)
        return Told(place[2] - self._lowest, velocity[0], velocity[2], spin[2])


def _step() -> float:
    """Step [s]: the speed gained in it by a gravity of 1 m/s^2."""
    world = Bare(Asked(gravity=1.0))
    world.advance(1)
    return -world.told().up


_BREAKS = "PhysicsServerCommandProcessor.cpp:11525"
_GUIDE, _PAIR = "PyBullet Quickstart Guide", "btManifoldResult.cpp:58,70"
_AHEAD = "btSequentialImpulseConstraintSolver.cpp:949-953"
_DRAG = "btMultiBody.cpp:843; grows with the speed, 0.04 (1 + v)"
UNSET = (
    Unset("friction of a pair", "0.25: 0.5 of each body", f"{_GUIDE}, getDynamicsInfo; {_PAIR}", 0.25,
          partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.18, the product", _PAIR, 0.18, partial(unset.friction, Bare, FRICTIONS)),
    Unset("largest friction, of 5 and 5", "10", "btManifoldResult.cpp:58", LARGEST_FRICTION,
          partial(unset.friction, Bare, (5.0, 5.0), "ball", 5.0, Bare.dt), 0.1),
    Unset("restitution of a pair", "0", f"{_GUIDE}, getDynamicsInfo", 0.0, partial(unset.restitution, Bare)),
    Unset("restitution of 0.4 and 0.9", "0.36, the product", _PAIR, 0.36,
          partial(unset.restitution, Bare, RESTITUTIONS)),
    Unset("no rebound below [m/s]", "0.2: restitutionVelocityThreshold", f"{_GUIDE}, setPhysicsEngineParameter",
          RESTITUTION_THRESHOLD, partial(unset.least_rebound, Bare)),
    Unset("from afar half a rebound from [m/s]", "not documented: the remaining gap is subtracted", _AHEAD, None,
          partial(unset.least_rebound, Bare, 3.0)),
    Unset("linear damping [1/s]", "0.04", _DRAG, 0.04, partial(unset.damping, Bare, "along"), 2e-4),
    Unset("angular damping [1/s]", "0.04", _DRAG, 0.04, partial(unset.damping, Bare, "spin"), 2e-4),
    Unset("limit of speed [m/s]", "100 along each axis: maxJointVelocity", "btMultiBody.h, m_maxCoordinateVelocity",
          LARGEST_SPEED, partial(unset.limit, Bare)),
    Unset("at 1 mm/s asleep after [s]", "never: sleeping is asked for by a flag", f"{_GUIDE}, loadURDF", math.inf,
          partial(unset.sleep, Bare)),
    Unset("contacts from this gap on [m]", "0.02 of a size: contactBreakingThreshold", f"{_GUIDE}; {_BREAKS}", None,
          partial(unset.ahead, Bare)),
    Unset("gap at rest [m]", "not documented", _GUIDE, None, partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", "not documented", _GUIDE, None, partial(unset.left, Bare)),
    Unset("gravity, upwards [m/s^2]", "0", f"{_GUIDE}, setGravity", 0.0, partial(unset.gravity, Bare), 1e-9),
    Unset("step [s]", "1/240", f"{_GUIDE}, setTimeStep", 1.0 / 240.0, _step, 1e-9),
)  # fmt: skip
