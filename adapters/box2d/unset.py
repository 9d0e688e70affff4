"""Box2D 2.3 without any settings; see `adapters.unset`."""

from __future__ import annotations

from functools import partial
from typing import Any

from adapters import unset
from adapters.box2d.shipped import (
    LINEAR_SLOP,
    MAX_TRANSLATION,
    POLYGON_RADIUS,
    POSITION_ITERATIONS,
    VELOCITY_ITERATIONS,
    VELOCITY_THRESHOLD,
)
from adapters.unset import FRICTIONS, HALF_HEIGHT, HALF_WIDTH, RADIUS, RESTITUTIONS, Asked, Told, Unset


class Bare:
    """A world with one body above a static box."""

    #: Step of the manual [s]: a world has no default.
    dt = 1.0 / 60.0

    def __init__(self, asked: Asked) -> None:
        import Box2D

        made: dict[str, Any] = {} if asked.gravity is None else {"gravity": (0.0, -asked.gravity)}
        self._world = Box2D.b2World(**made)
        floor = Box2D.b2PolygonShape(box=(50.0, 5.0, (0.0, -5.0), 0.0))
        own = Box2D.b2CircleShape(radius=RADIUS) if asked.shape == "ball" else Box2D.b2PolygonShape(
            box=(HALF_WIDTH, HALF_HEIGHT)
        )  # fmt: skip
        ground = self._world.CreateStaticBody()
        self._body = self._world.CreateDynamicBody(position=(0.0, asked.height))
        for k, (body, shape) in enumerate(((ground, floor), (self._body, own))):
            how: dict[str, Any] = {} if asked.friction is None else {"friction": asked.friction[k]}
            how |= {} if asked.restitution is None else {"restitution": asked.restitution[k]}
            body.CreateFixture(Box2D.b2FixtureDef(shape=shape, density=1.0, **how))
        self._body.linearVelocity, self._body.angularVelocity = (asked.along, asked.up), asked.spin
        self._lowest = asked.height - asked.gap

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._world.Step(self.dt, VELOCITY_ITERATIONS, POSITION_ITERATIONS)

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        body = self._body
        velocity, height = body.linearVelocity, float(body.position[1])
        return Told(height - self._lowest, float(velocity[0]), float(velocity[1]), float(body.angularVelocity))


_FIXTURE, _PAIR, _COMPILED = "b2Fixture.h, b2FixtureDef", "b2Contact.h, b2MixFriction, b2MixRestitution", "b2Settings.h"
_BODY = "b2Body.h, b2BodyDef"
UNSET = (
    Unset("friction of a pair", "0.2", _FIXTURE, 0.2, partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.424, root of the product", _PAIR, 0.18**0.5,
          partial(unset.friction, Bare, FRICTIONS)),
    Unset("restitution of a pair", "0", _FIXTURE, 0.0, partial(unset.restitution, Bare)),
    Unset("restitution of 0.4 and 0.9", "0.9, the larger", _PAIR, 0.9, partial(unset.restitution, Bare, RESTITUTIONS)),
    Unset("no rebound below [m/s]", "1: b2_velocityThreshold", _COMPILED, VELOCITY_THRESHOLD,
          partial(unset.least_rebound, Bare)),
    Unset("linear damping [1/s]", "0", _BODY, 0.0, partial(unset.damping, Bare, "along"), 1e-6),
    Unset("angular damping [1/s]", "0", _BODY, 0.0, partial(unset.damping, Bare, "spin"), 1e-6),
    Unset("limit of speed [m/s]", "120: b2_maxTranslation, 2 m a step", "b2Settings.h", MAX_TRANSLATION / Bare.dt,
          partial(unset.limit, Bare), 1e-3),
    Unset("at 1 mm/s asleep after [s]", "0.5: b2_timeToSleep, below 1 cm/s and 2 degrees/s", _COMPILED, 0.5,
          partial(unset.sleep, Bare), 2.0 * Bare.dt),
    Unset("gap at rest [m]", "0.015: two skins of 1 cm, less the slop of 5 mm", _COMPILED,
          2.0 * POLYGON_RADIUS - LINEAR_SLOP, partial(unset.rest, Bare), 2e-3),
    Unset("left of 0.2 m of overlap [m]", "-0.005: the slop of 5 mm lies within the skin of 1 cm", _COMPILED,
          LINEAR_SLOP - POLYGON_RADIUS, partial(unset.left, Bare), 2e-3),
    Unset("gravity, upwards [m/s^2]", "-10 in the bindings", "pybox2d, b2World", -10.0, partial(unset.gravity, Bare)),
    Unset("step [s]", "none: each call has its own", "b2World.h, Step"),
)  # fmt: skip
