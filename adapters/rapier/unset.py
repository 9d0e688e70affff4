"""Rapier without any settings; see `adapters.unset`."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

from adapters import unset
from adapters.unset import FRICTIONS, HALF_HEIGHT, HALF_WIDTH, RADIUS, RESTITUTIONS, Asked, Told, Unset


class Bare:
    """A world with one body above a half-space."""

    def __init__(self, asked: Asked) -> None:
        rapier3d: Any = import_module("rapier3d")
        made: dict[str, Any] = {} if asked.gravity is None else {"gravity": (0.0, 0.0, -asked.gravity)}
        self._world: Any = rapier3d.PhysicsWorld(**made)
        place = rapier3d.Isometry3((0.0, 0.0, asked.height), rapier3d.Rotation3(1.0, 0.0, 0.0, 0.0))
        ground = self._world.add_body(rapier3d.RigidBody.fixed())
        builder = rapier3d.RigidBody.dynamic(position=place)
        builder = builder.linvel((asked.along, 0.0, asked.up)).angvel((0.0, 0.0, asked.spin))
        self._body = self._world.add_body(builder)
        numbers: list[dict[str, Any]] = [{}, {}]
        for name, values in (("friction", asked.friction), ("restitution", asked.restitution)):
            for k, value in enumerate(values or ()):
                numbers[k][name] = value
        self._world.add_collider(rapier3d.Collider.halfspace((0.0, 0.0, 1.0), **numbers[0]), ground)
        box = (HALF_WIDTH, HALF_WIDTH, HALF_HEIGHT)
        ball = asked.shape == "ball"
        own = rapier3d.Collider.ball(RADIUS, **numbers[1]) if ball else rapier3d.Collider.cuboid(*box, **numbers[1])
        self._world.add_collider(own, self._body)
        self._lowest = asked.height - asked.gap
        self.dt = float(self._world.integration_parameters.dt)

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._world.step()

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        body = self._world.rigid_bodies[self._body]
        return Told(body.translation.z - self._lowest, body.linvel.x, body.linvel.z, body.angvel.z)


_COLLIDER, _BODY, _RULE = "rapier3d, ColliderBuilder", "rapier3d, RigidBodyBuilder", "rapier3d, CoefficientCombineRule"
_STEP, _ASLEEP = "rapier3d, IntegrationParameters", "rapier3d, RigidBodyActivation"
UNSET = (
    Unset("friction of a pair", "0.5", _COLLIDER, 0.5, partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.55, the mean", _RULE, 0.55, partial(unset.friction, Bare, FRICTIONS)),
    Unset("restitution of a pair", "0", _COLLIDER, 0.0, partial(unset.restitution, Bare)),
    Unset("restitution of 0.4 and 0.9", "0.65, the mean", _RULE, 0.65, partial(unset.restitution, Bare, RESTITUTIONS)),
    Unset("no rebound below [m/s]", "no threshold", _STEP, 0.0, partial(unset.least_rebound, Bare)),
    Unset("linear damping [1/s]", "0", _BODY, 0.0, partial(unset.damping, Bare, "along"), 1e-5),
    Unset("angular damping [1/s]", "0", _BODY, 0.0, partial(unset.damping, Bare, "spin"), 1e-5),
    Unset("limit of speed [m/s]", "400: normalized_max_linear_velocity", "IntegrationParameters", 400.0,
          partial(unset.limit, Bare)),
    Unset("at 1 mm/s asleep after [s]", "0.5, below 5 cm/s and 0.5 rad/s", _ASLEEP, 0.5,
          partial(unset.sleep, Bare), 0.05),
    Unset("gap at rest [m]", "an overlap: springs of 60 Hz against static bodies", _STEP, None,
          partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", "not documented", _STEP, None, partial(unset.left, Bare)),
    Unset("gravity, upwards [m/s^2]", "not documented", "rapier3d, PhysicsWorld", None, partial(unset.gravity, Bare)),
    Unset("step [s]", "1/60", _STEP, 1.0 / 60.0, lambda: Bare(Asked()).dt, 1e-6),
)  # fmt: skip
