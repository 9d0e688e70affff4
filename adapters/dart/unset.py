"""DART without any settings; see `adapters.unset`."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from adapters import unset
from adapters.dart.shipped import THRESHOLD
from adapters.unset import FRICTIONS, HALF_HEIGHT, HALF_WIDTH, RADIUS, RESTITUTIONS, Asked, Told, Unset

#: Half thickness of the ground's box [m].
DEPTH = 5.0


class Bare:
    """A world with one body above a welded box."""

    def __init__(self, asked: Asked) -> None:
        import dartpy

        self._world: Any = dartpy.simulation.World()
        if asked.gravity is not None:
            self._world.setGravity([0.0, 0.0, -asked.gravity])
        box = [2.0 * HALF_WIDTH, 2.0 * HALF_WIDTH, 2.0 * HALF_HEIGHT]
        own = dartpy.dynamics.SphereShape(RADIUS) if asked.shape == "ball" else dartpy.dynamics.BoxShape(box)
        floor = dartpy.dynamics.BoxShape([100.0, 100.0, 2.0 * DEPTH])
        for k, (shape, height) in enumerate(((floor, -DEPTH), (own, asked.height))):
            skeleton = dartpy.dynamics.Skeleton(f"body {k}")
            pair = skeleton.createFreeJointAndBodyNodePair() if k else skeleton.createWeldJointAndBodyNodePair()
            joint, node = pair
            part = node.createShapeNode(shape)
            part.createCollisionAspect()
            material = part.createDynamicsAspect()
            if asked.friction is not None:
                material.setFrictionCoeff(asked.friction[k])
            if asked.restitution is not None:
                material.setRestitutionCoeff(asked.restitution[k])
            place = dartpy.math.Isometry3()
            place.set_translation([0.0, 0.0, height])
            if k:
                joint.setTransform(place)
                joint.setLinearVelocity([asked.along, 0.0, asked.up])
                joint.setAngularVelocity([0.0, 0.0, asked.spin])
            else:
                joint.setTransformFromParentBodyNode(place)
            self._world.addSkeleton(skeleton)
        self._node = node
        self._lowest = asked.height - asked.gap
        self.dt = float(self._world.getTimeStep())

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._world.step()

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        place = np.asarray(self._node.getWorldTransform().translation()).ravel()
        velocity = np.asarray(self._node.getLinearVelocity()).ravel()
        spin = np.asarray(self._node.getAngularVelocity()).ravel()
        return Told(float(place[2]) - self._lowest, float(velocity[0]), float(velocity[2]), float(spin[2]))


_SHAPE, _PAIR, _CONTACT = "DynamicsAspect", "ContactConstraint", "ContactConstraint, bouncing velocity threshold"
_RESTS = "DeactivationOptions.hpp; World.cpp"
UNSET = (
    Unset("friction of a pair", "1", _SHAPE, 1.0, partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.2, the smaller", _PAIR, 0.2, partial(unset.friction, Bare, FRICTIONS)),
    Unset("restitution of a pair", "0", _SHAPE, 0.0, partial(unset.restitution, Bare)),
    Unset("restitution of 0.4 and 0.9", "0.36, the product", _PAIR, 0.36,
          partial(unset.restitution, Bare, RESTITUTIONS)),
    Unset("no rebound below [m/s]", "0.1", _CONTACT, THRESHOLD, partial(unset.least_rebound, Bare)),
    Unset("linear damping [1/s]", "0", "FreeJoint", 0.0, partial(unset.damping, Bare, "along"), 1e-9),
    Unset("angular damping [1/s]", "0", "FreeJoint", 0.0, partial(unset.damping, Bare, "spin"), 1e-9),
    Unset("limit of speed [m/s]", "none", "FreeJoint", math.inf,
          partial(unset.limit, Bare)),
    Unset("in flight at 1 mm/s asleep after [s]", "never: only bodies in contact can sleep", _RESTS, math.inf,
          partial(unset.sleep, Bare)),
    Unset("rolling slower than 1 mm/s asleep after [s]", "0.5: mTimeUntilSleep, below a tenth of 1 cm/s", _RESTS, 0.5,
          partial(unset.sleep, Bare, rolls=True), 2e-3),
    Unset("gap at rest [m]", "not documented", _PAIR, None, partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", "not documented: corrected at up to 1 mm/s", _PAIR, None,
          partial(unset.left, Bare)),
    Unset("gravity, upwards [m/s^2]", "-9.81", "World", -9.81, partial(unset.gravity, Bare), 1e-6),
    Unset("step [s]", "0.001", "World.getTimeStep", 0.001, lambda: Bare(Asked()).dt, 1e-12),
)  # fmt: skip
