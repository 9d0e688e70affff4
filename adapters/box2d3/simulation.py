"""One Box2D 3.1 world and its readings.

A step consists of substeps, each velocity first: poses and velocities belong together; contacts belong to the poses
before the step. Lengths in the engine have the units of the profile; readings are in metres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib import import_module
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.box2d3.translation import frictions, restitutions
from adapters.copied import Copied, by_pair
from adapters.engine import Array, Contacts
from adapters.readback import free_parts, pair_materials
from adapters.scene import Body, Box, Disc, HalfSpace, Scene
from adapters.scene.ground import reach


class Box2D3Simulation(Copied):
    """One world; bodies in the scene's order.

    ``module`` is the engine's module, or a recorder of its calls (`adapters.recording`).
    """

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any], module: Any = None) -> None:
        from adapters.box2d3 import drawing

        self.pyb2d3 = module or import_module("pyb2d3")
        self.scene, self.dt, self.settings = scene, dt, settings
        units = self.units = float(settings["units_per_metre"])
        self.world: Any = self.pyb2d3.World(
            gravity=self._vector(scene.gravity),
            restitution_threshold=settings["restitution_threshold"] * units,
            maximum_linear_speed=settings["maximum_speed"] * units,
        )
        self.world.set_contact_tuning(settings["hertz"], settings["damping_ratio"], settings["push_speed"] * units)
        self.world.continuous_enabled = settings["continuous"]
        self.world.sleeping_enabled = False
        self.reach = reach(scene)
        self.restitutions, self.frictions = restitutions(scene) or [], frictions(scene) or []
        self.bodies = [self._made(index, body) for index, body in enumerate(scene.bodies)]
        self.loads = [
            (self.bodies[i], self._vector(body.force), body.torque[0] * units**2)
            for i, body in enumerate(scene.bodies)
            if body.is_loaded
        ]
        self.drawing, self.pen = drawing, drawing.Pen()
        self.before = self.copy_pose()

    def _vector(self, v: tuple[float, ...]) -> tuple[float, float]:
        return v[0] * self.units, v[1] * self.units

    def _made(self, index: int, asked: Body) -> Any:
        pyb2d3 = self.pyb2d3
        make = {
            "free": self.world.create_dynamic_body,
            "fixed": self.world.create_static_body,
            "prescribed": self.world.create_kinematic_body,
        }[asked.motion]
        if isinstance(asked.shape, HalfSpace):
            (nx, ny), offset = asked.shape.normal, asked.shape.offset
            x, y = offset * nx, offset * ny
            # Without rotation if along an axis of the world, because single precision is not exact.
            c, s = (1.0, 0.0) if 0.0 in (nx, ny) else (ny, -nx)
        else:
            x, y, theta = asked.pose
            c, s = math.cos(theta), math.sin(theta)
        turn = pyb2d3.Rot()
        turn.c, turn.s = c, s
        body = make(position=self._vector((x, y)), rotation=turn, enable_sleep=False)
        material = pyb2d3.surface_material(restitution=self.restitutions[index], friction=self.frictions[index])
        body.create_shape(pyb2d3.shape_def(density=1.0, material=material), self._shape(asked))
        if asked.motion == "free":
            assert isinstance(asked.inertia, float | int)
            held = body.mass_data
            held.mass, held.center = asked.mass, (0.0, 0.0)
            held.rotational_inertia = asked.inertia * self.units**2
            body.mass_data = held
        if asked.motion != "fixed":
            vx, vy, omega = asked.twist
            body.linear_velocity, body.angular_velocity = self._vector((vx, vy)), omega
        return body

    def _shape(self, asked: Body) -> Any:
        pyb2d3, shape = self.pyb2d3, asked.shape
        if isinstance(shape, Disc):
            return pyb2d3.circle(radius=shape.radius * self.units)
        if isinstance(shape, Box):
            return pyb2d3.box(*self._vector(shape.half_extents))
        assert isinstance(shape, HalfSpace)
        # In its own frame, with the surface through its origin, so single precision loses nothing.
        nx, ny = shape.normal if 0.0 in shape.normal else (0.0, 1.0)
        wide = self.reach * self.units
        return pyb2d3.box(wide, wide, center=(-nx * wide, -ny * wide))

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`; forces are cleared by every step."""
        step, dt, count = self.world.step, self.dt, self.settings["substeps"]
        for k in range(steps):
            for body, force, torque in self.loads:
                body.apply_force_to_center(force)
                body.apply_torque(torque)
            if self.observed and k == steps - 1:
                self.before = self.copy_pose()
            step(dt, count)

    def copy_pose(self) -> list[float]:
        """Position [m], cosine and sine of the angle of each body."""
        placed, units = [(body.position, body.rotation) for body in self.bodies], self.units
        return [number for place, turn in placed for number in (place.x / units, place.y / units, turn.c, turn.s)]

    def poses_of(self, copies: Sequence[list[float]]) -> Array:
        """See `Copied.poses_of`; a half-space's own pose is the origin."""
        poses = super().poses_of(copies)
        poses[..., 2] = np.vectorize(math.atan2)(poses[..., 3], poses[..., 2])  # numpy's depends on the machine
        poses[:, [isinstance(body.shape, HalfSpace) for body in self.scene.bodies]] = 0.0
        return poses[..., :3]

    def copy_twist(self) -> list[float]:
        """Velocity [m/s] and angular velocity of each body."""
        moving, units = [(body.linear_velocity, body.angular_velocity) for body in self.bodies], self.units
        return [number for v, omega in moving for number in (v.x / units, v.y / units, omega)]

    def copy_contacts(self) -> tuple[list[Any], list[float]]:
        """Points and normals of contacts in the last step, and places of the bodies before it."""
        return self.drawing.touching(self.pen, self.world), self.before

    def contacts_of(self, copies: Sequence[tuple[list[Any], list[float]]]) -> tuple[NDArray[np.int64], Contacts]:
        """Points and normals of contacts; impulses and gaps are not available (NaN)."""
        found, before = zip(*copies, strict=True)
        counts = np.array([len(rows) for rows in found], np.int64)
        told = np.array(list(chain.from_iterable(found)), float).reshape(-1, 4) / (self.units, self.units, 1.0, 1.0)
        sample = np.repeat(np.arange(len(counts)), counts)
        places = (own.T[:, sample] for own in np.moveaxis(super().poses_of(before), 1, 0))
        i, j = self.drawing.named(told[:, :2], told[:, 2:], self.scene.bodies, places)
        return counts, by_pair(counts, np.column_stack([i, j, told, np.full((len(told), 3), np.nan)]))

    def readback(self) -> dict[str, Any]:
        """Values of the world, its bodies and shapes; the bindings cannot read springs and speeds."""
        world, units = self.world, self.units
        held: dict[str, Any] = {
            "dt": self.dt,
            "gravity": [float(g) / units for g in world.gravity],
            "restitution_threshold": float(world.restitution_threshold) / units,
            "continuous": bool(world.continuous_enabled),
            "may_sleep": bool(world.sleeping_enabled),
            "bodies": {
                name: {
                    "mass": float(body.mass),
                    "inertia": float(body.mass_data.rotational_inertia) / units**2,
                    "damping": [float(body.linear_damping), float(body.angular_damping)],
                }
                for name, body in free_parts(self.scene, self.bodies)
            },
        }
        shapes = [body.shapes[0] for body in self.bodies]
        restitutions, frictions = [float(own.restitution) for own in shapes], [float(own.friction) for own in shapes]
        held["pairs"] = pair_materials(self.scene, (restitutions, max), (frictions, lambda a, b: math.sqrt(a * b)))
        return held

    def close(self) -> None:
        """Close the world: there is room for 128."""
        self.bodies, self.loads = [], []
        self.world.destroy()
