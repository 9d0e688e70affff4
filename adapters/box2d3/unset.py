"""Box2D 3.1 without any settings; see `adapters.unset`."""

from __future__ import annotations

from functools import partial
from typing import Any

from adapters import unset
from adapters.box2d3.shipped import MAXIMUM_SPEED, RESTITUTION_THRESHOLD, SUBSTEPS
from adapters.unset import FRICTIONS, HALF_HEIGHT, HALF_WIDTH, RADIUS, RESTITUTIONS, Asked, Told, Unset


class Bare:
    """A world with one body above a static box."""

    #: Step of the manual [s]: a world has no default.
    dt = 1.0 / 60.0

    def __init__(self, asked: Asked) -> None:
        import pyb2d3

        made: dict[str, Any] = {} if asked.gravity is None else {"gravity": (0.0, -asked.gravity)}
        self._world: Any = pyb2d3.World(**made)
        ground = self._world.create_static_body()
        self._body = self._world.create_dynamic_body(position=(0.0, asked.height))
        floor = pyb2d3.box(50.0, 5.0, center=(0.0, -5.0))
        own = pyb2d3.circle(radius=RADIUS) if asked.shape == "ball" else pyb2d3.box(HALF_WIDTH, HALF_HEIGHT)
        for k, (body, shape) in enumerate(((ground, floor), (self._body, own))):
            how: dict[str, Any] = {} if asked.friction is None else {"friction": asked.friction[k]}
            how |= {} if asked.restitution is None else {"restitution": asked.restitution[k]}
            said = {"material": pyb2d3.surface_material(**how)} if how else {}
            body.create_shape(pyb2d3.shape_def(density=1.0, **said), shape)
        self._body.linear_velocity, self._body.angular_velocity = (asked.along, asked.up), asked.spin
        self._lowest = asked.height - asked.gap

    def __del__(self) -> None:
        self._world.destroy()

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._world.step(self.dt, SUBSTEPS)

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        (_, y), (along, up) = self._body.position, self._body.linear_velocity
        return Told(float(y) - self._lowest, float(along), float(up), float(self._body.angular_velocity))


_SHAPE, _WORLD, _BODY = "types.c, b2DefaultSurfaceMaterial", "types.c, b2DefaultWorldDef", "types.c, b2DefaultBodyDef"
_PAIR = "types.h, b2WorldDef: frictionCallback, restitutionCallback"
UNSET = (
    Unset("friction of a pair", "0.6", _SHAPE, 0.6, partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.424, root of the product", _PAIR, 0.18**0.5,
          partial(unset.friction, Bare, FRICTIONS)),
    Unset("restitution of a pair", "0", _SHAPE, 0.0, partial(unset.restitution, Bare)),
    Unset("restitution of 0.4 and 0.9", "0.9, the larger", _PAIR, 0.9, partial(unset.restitution, Bare, RESTITUTIONS)),
    Unset("no rebound below [m/s]", "1: restitutionThreshold", _WORLD, RESTITUTION_THRESHOLD,
          partial(unset.least_rebound, Bare)),
    Unset("linear damping [1/s]", "0", _BODY, 0.0, partial(unset.damping, Bare, "along"), 1e-5),
    Unset("angular damping [1/s]", "0", _BODY, 0.0, partial(unset.damping, Bare, "spin"), 1e-5),
    Unset("limit of speed [m/s]", "400: b2WorldDef.maximumLinearSpeed", "types.c, b2DefaultWorldDef", MAXIMUM_SPEED,
          partial(unset.limit, Bare)),
    Unset("at 1 mm/s asleep after [s]", "0.5: B2_TIME_TO_SLEEP, below sleepThreshold, 5 cm/s", f"core.h; {_BODY}", 0.5,
          partial(unset.sleep, Bare), 2.0 * Bare.dt),
    Unset("gap at rest [m]", "an overlap: springs of 60 Hz against static bodies", _WORLD, None,
          partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", "not documented", "constants.h, B2_LINEAR_SLOP: 5 mm", None,
          partial(unset.left, Bare)),
    Unset("gravity, upwards [m/s^2]", "-10", _WORLD, -10.0, partial(unset.gravity, Bare)),
    Unset("step [s]", "none: each call has its own", "box2d.h, b2World_Step"),
)  # fmt: skip
