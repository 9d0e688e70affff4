"""Chipmunk without any settings; see `adapters.unset`."""

from __future__ import annotations

import math
from functools import partial

from adapters import unset
from adapters.chipmunk.shipped import COLLISION_SLOP
from adapters.unset import FRICTIONS, HALF_HEIGHT, HALF_WIDTH, RADIUS, RESTITUTIONS, Asked, Told, Unset

#: Step of its own examples [s]: a space has no default.
STEP = 1.0 / 60.0


class Bare:
    """A space with one body above a static segment."""

    dt = STEP

    def __init__(self, asked: Asked) -> None:
        import pymunk

        self._space = pymunk.Space()
        if asked.gravity is not None:
            self._space.gravity = (0.0, -asked.gravity)
        self._body = pymunk.Body(1.0, 1.0)
        self._body.position = (0.0, asked.height)
        self._body.velocity, self._body.angular_velocity = (asked.along, asked.up), asked.spin
        self._lowest = asked.height - asked.gap
        ground = pymunk.Poly(self._space.static_body, [(-50.0, -50.0), (50.0, -50.0), (50.0, 0.0), (-50.0, 0.0)])
        x, y = HALF_WIDTH, HALF_HEIGHT
        box = [(-x, -y), (x, -y), (x, y), (-x, y)]
        own = pymunk.Circle(self._body, RADIUS) if asked.shape == "ball" else pymunk.Poly(self._body, box)
        for k, shape in enumerate((ground, own)):
            if asked.friction is not None:
                shape.friction = asked.friction[k]
            if asked.restitution is not None:
                shape.elasticity = asked.restitution[k]
        self._space.add(ground, self._body, own)

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._space.step(self.dt)

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        body = self._body
        return Told(body.position.y - self._lowest, body.velocity.x, body.velocity.y, body.angular_velocity)


_SPACE, _PAIR = "cpSpace.c, cpSpaceInit", "cpArbiter.c:334-335"
UNSET = (
    Unset("friction of a pair", "0", "cpShape.c, cpShapeInit", 0.0, partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.18, the product", _PAIR, 0.18, partial(unset.friction, Bare, FRICTIONS)),
    Unset("restitution of a pair", "0", "cpShape.c, cpShapeInit", 0.0, partial(unset.restitution, Bare)),
    Unset("restitution of 0.4 and 0.9", "0.36, the product", _PAIR, 0.36,
          partial(unset.restitution, Bare, RESTITUTIONS)),
    Unset("no rebound below [m/s]", "no threshold", "cpArbiter.c, cpArbiterPreStep", 0.0,
          partial(unset.least_rebound, Bare)),
    Unset("linear damping [1/s]", "0: damping is 1", _SPACE, 0.0, partial(unset.damping, Bare, "along"), 1e-9),
    Unset("angular damping [1/s]", "0: damping is 1", _SPACE, 0.0, partial(unset.damping, Bare, "spin"), 1e-9),
    Unset("limit of speed [m/s]", "none", "cpBody.c, cpBodyUpdateVelocity", math.inf,
          partial(unset.limit, Bare)),
    Unset("at 1 mm/s asleep after [s]", "never: sleep_time_threshold is infinite", _SPACE, math.inf,
          partial(unset.sleep, Bare)),
    Unset("gap at rest [m]", "an overlap: a contact needs one", "cpArbiter.c", None, partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", "0.1: collision_slop", _SPACE, COLLISION_SLOP, partial(unset.left, Bare)),
    Unset("gravity, upwards [m/s^2]", "0", _SPACE, 0.0, partial(unset.gravity, Bare), 1e-9),
    Unset("step [s]", "none: each call has its own", "cpSpaceStep.c"),
)  # fmt: skip
