"""Box3D without any settings, by its own defaults; see `adapters.unset`."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

from adapters import unset
from adapters.box3d.shipped import MAXIMUM_SPEED, RESTITUTION_THRESHOLD, SUBSTEPS
from adapters.unset import FRICTIONS, HALF_HEIGHT, HALF_WIDTH, RADIUS, RESTITUTIONS, Asked, Told, Unset


class Bare:
    """A world with one body above a static box; y is up, as for its gravity."""

    #: Step of the manual [s]: a world has no default.
    dt = 1.0 / 60.0

    def __init__(self, asked: Asked) -> None:
        core = import_module("robox3d.core.world")
        lib, ffi = self._lib, _ = core.lib, core.ffi
        world = lib.b3DefaultWorldDef()
        if asked.gravity is not None:
            world.gravity.y = -asked.gravity
        self._world: Any = lib.b3CreateWorld(ffi.addressof(world))
        ball, (x, y) = asked.shape == "ball", (HALF_WIDTH, HALF_HEIGHT)
        ground = lib.b3MakeOffsetBoxHull(50.0, 5.0, 50.0, ffi.new("b3Vec3*", (0.0, -5.0, 0.0))[0])
        for k, hull in enumerate((ground, None if ball else lib.b3MakeBoxHull(x, y, x))):
            made = lib.b3DefaultBodyDef()
            if k:
                made.type, made.position.y = lib.b3_dynamicBody, asked.height
                made.linearVelocity.x, made.linearVelocity.y = asked.along, asked.up
                made.angularVelocity.y = asked.spin
            self._body = lib.b3CreateBody(self._world, ffi.addressof(made))
            shape = lib.b3DefaultShapeDef()
            if asked.friction is not None:
                shape.baseMaterial.friction = asked.friction[k]
            if asked.restitution is not None:
                shape.baseMaterial.restitution = asked.restitution[k]
            how = ffi.addressof(shape)
            if hull is None:
                lib.b3CreateSphereShape(self._body, how, ffi.new("b3Sphere*", {"radius": RADIUS}))
            else:
                kept = ffi.new("b3BoxHull*", hull)
                lib.b3CreateHullShape(self._body, how, ffi.addressof(kept.base))
        self._lowest = asked.height - asked.gap

    def __del__(self) -> None:
        self._lib.b3DestroyWorld(self._world)

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._lib.b3World_Step(self._world, self.dt, SUBSTEPS)

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        lib, body = self._lib, self._body
        velocity = lib.b3Body_GetLinearVelocity(body)
        height = lib.b3Body_GetPosition(body).y - self._lowest
        return Told(height, velocity.x, velocity.y, lib.b3Body_GetAngularVelocity(body).y)


_SHAPE, _WORLD, _BODY = "types.c, b3DefaultSurfaceMaterial", "types.c, b3DefaultWorldDef", "types.c, b3DefaultBodyDef"
_PAIR = "types.h, b3WorldDef: frictionCallback, restitutionCallback"
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
    Unset("limit of speed [m/s]", "400: b3WorldDef.maximumLinearSpeed", _WORLD, MAXIMUM_SPEED,
          partial(unset.limit, Bare)),
    Unset("at 1 mm/s asleep after [s]", "0.5: B3_TIME_TO_SLEEP, below sleepThreshold, 5 cm/s", f"constants.h; {_BODY}",
          0.5, partial(unset.sleep, Bare), 2.0 * Bare.dt),
    Unset("gap at rest [m]", "an overlap: springs of 60 Hz against static bodies", _WORLD, None,
          partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", "not documented", "constants.h, B3_LINEAR_SLOP: 5 mm", None,
          partial(unset.left, Bare)),
    Unset("gravity, upwards [m/s^2]", "-10, along y", _WORLD, -10.0, partial(unset.gravity, Bare)),
    Unset("step [s]", "none: each call has its own", "box3d.h, b3World_Step"),
)  # fmt: skip
