"""One ``b2World`` and its readings.

Velocities first, then positions: poses and impulses after a step belong together; points and gaps belong to the poses
before it. Lengths in the engine have the units of the profile; readings are in metres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.copied import Copied
from adapters.engine import Array, Contacts, EngineError
from adapters.readback import free_parts, pair_materials
from adapters.scene import Body, Box, Disc, HalfSpace, Scene
from adapters.scene.ground import reach
from adapters.scene.meeting import common_material


class Box2DSimulation(Copied):
    """One ``b2World``; bodies in the scene's order.

    ``module`` is the engine's module, or a recorder of its calls (`adapters.recording`).
    """

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any], module: Any = None) -> None:
        from adapters.box2d.listening import Listener

        self.box2d = module or import_module("Box2D")
        self.scene, self.dt, self.settings = scene, dt, settings
        self.units = float(settings["units_per_metre"])
        self.metres = (1.0 / self.units, 1.0 / self.units, 1.0)
        gravity = self._vector(scene.gravity)
        self.world: Any = self.box2d.b2World(gravity=gravity)
        self.world.continuousPhysics = settings["continuous"]
        self.reach = reach(scene)
        self.single = common_material(scene)
        self.bodies = [self._made(index, body) for index, body in enumerate(scene.bodies)]
        early = (gravity[0] * dt, gravity[1] * dt) if settings["early_restitution"] else None
        materials = {(i, j): (m.restitution, m.friction) for i, j, m in scene.contact_pairs()}
        radii = [float(body.fixtures[0].shape.radius) for body in self.bodies]
        needed = {} if self.single and early is None else materials
        self.listener = self.world.contactListener = Listener(radii, needed, early)
        self.loads = [
            (self.bodies[i], self._vector(body.force), body.torque[0] * self.units**2)
            for i, body in enumerate(scene.bodies)
            if body.is_loaded
        ]

    def _vector(self, v: tuple[float, ...]) -> tuple[float, float]:
        return (v[0] * self.units, v[1] * self.units)

    def _made(self, index: int, asked: Body) -> Any:
        make = {
            "free": self.world.CreateDynamicBody,
            "fixed": self.world.CreateStaticBody,
            "prescribed": self.world.CreateKinematicBody,
        }[asked.motion]
        if isinstance(asked.shape, HalfSpace):
            (nx, ny), offset = asked.shape.normal, asked.shape.offset
            turn = 0.0 if 0.0 in (nx, ny) else math.atan2(-nx, ny)
            body = make(position=self._vector((offset * nx, offset * ny)), angle=turn)
        else:
            x, y, theta = asked.pose
            body = make(position=self._vector((x, y)), angle=theta, allowSleep=False)
        body.userData = index
        restitution, friction = self.single or (0.0, 0.0)
        body.CreateFixture(
            self.box2d.b2FixtureDef(shape=self._shape(asked), density=1.0, restitution=restitution, friction=friction)
        )
        if asked.motion == "free":
            assert isinstance(asked.inertia, float | int)
            inertia = asked.inertia * self.units**2
            body.massData = self.box2d.b2MassData(mass=asked.mass, I=inertia, center=(0.0, 0.0))
        if asked.motion != "fixed":
            vx, vy, omega = asked.twist
            body.linearVelocity, body.angularVelocity = self._vector((vx, vy)), omega
        return body

    def _shape(self, asked: Body) -> Any:
        shape = asked.shape
        if isinstance(shape, Disc):
            return self.box2d.b2CircleShape(radius=shape.radius * self.units)
        if isinstance(shape, Box):
            made = self.box2d.b2PolygonShape(box=self._vector(shape.half_extents))
        else:
            assert isinstance(shape, HalfSpace)
            # In its own frame, with the surface through its origin, so single precision loses nothing; and without
            # rotation if along an axis of the world, because a single-precision angle has an error of 4e-8.
            wide = self.reach * self.units
            nx, ny = shape.normal if 0.0 in shape.normal else (0.0, 1.0)
            made = self.box2d.b2PolygonShape(box=(wide, wide, (-nx * wide, -ny * wide), 0.0))
        made.radius = self.settings["skin"]
        return made

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`; the listener works in the last step only, whose contacts are read."""
        step, dt, listener = self.world.Step, self.dt, self.listener
        counts = self.settings["iterations"], self.settings["position_iterations"]
        listener.rows, listener.hears = [], False
        for k in range(steps):
            listener.hears = self.observed and k == steps - 1
            for body, force, torque in self.loads:
                body.ApplyForceToCenter(force, True)
                body.ApplyTorque(torque, True)
            step(dt, *counts)
        if listener.failure is not None:
            raise EngineError(f"contacts: {type(listener.failure).__name__}: {listener.failure}")

    def copy_pose(self) -> list[float]:
        """Position [m] and angle [rad] of each body, (samples, bodies, 3)."""
        return [number for body in self.bodies for number in (*body.position, body.angle)]

    def poses_of(self, copies: Sequence[list[float]]) -> Array:
        """See `Copied.poses_of`; a half-space's own pose is the origin, wherever its polygon is."""
        poses = super().poses_of(copies) * self.metres
        poses[:, [isinstance(body.shape, HalfSpace) for body in self.scene.bodies]] = 0.0
        return poses

    def copy_twist(self) -> list[float]:
        """Velocity and angular velocity of each body."""
        return [number for body in self.bodies for number in (*body.linearVelocity, body.angularVelocity)]

    def twists_of(self, copies: Sequence[list[float]]) -> Array:
        """See `Copied.twists_of`."""
        return super().twists_of(copies) * self.metres

    def copy_contacts(self) -> list[tuple[float, ...]]:
        """Rows of the listener, which begins a new list with each call of `advance`."""
        return self.listener.rows

    def contacts_of(self, copies: Sequence[list[tuple[float, ...]]]) -> tuple[NDArray[np.int64], Contacts]:
        """Up to two points per pair; a pair with a continuous collision within the step has them twice."""
        counts, found = super().contacts_of(copies)
        metre = self.metres[0]
        return counts, replace(found, point=found.point * metre, impulse=found.impulse * metre, gap=found.gap * metre)

    def readback(self) -> dict[str, Any]:
        """Values of the world, its bodies and shapes."""
        world, units = self.world, self.units
        held: dict[str, Any] = {
            "dt": self.dt,
            "gravity": [g / units for g in world.gravity],
            "continuous": bool(world.continuousPhysics),
            "warm_starting": bool(world.warmStarting),
            "sub_stepping": bool(world.subStepping),
            "bodies": {
                name: {
                    "mass": body.mass,
                    "inertia": body.inertia / units**2,
                    "size": self._size(body.fixtures[0].shape),
                    "may_sleep": bool(body.sleepingAllowed),
                    "damping": [body.linearDamping, body.angularDamping],
                }
                for name, body in free_parts(self.scene, self.bodies)
            },
        }
        if self.single:
            fixtures = [body.fixtures[0] for body in self.bodies]
            held["pairs"] = pair_materials(
                self.scene,
                ([own.restitution for own in fixtures], max),
                ([own.friction for own in fixtures], lambda a, b: math.sqrt(a * b)),
            )
        return held

    def _size(self, shape: Any) -> list[float]:
        """Radius, or half extents without the skin [m]."""
        if hasattr(shape, "vertices"):
            return [float(x) / self.units for x in np.max(np.abs(shape.vertices), axis=0)]
        return [float(shape.radius) / self.units]
