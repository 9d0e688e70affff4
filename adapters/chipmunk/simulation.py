"""One ``pymunk.Space`` and its readings.

Position is advanced first, with the old velocity, so pose, contacts and impulses read after a step belong to the
same instant, and free fall lags the parabola by g t dt / 2. Line numbers are those of Munk2D's ``src/``.
"""

from __future__ import annotations

from collections.abc import Mapping
from operator import mul
from typing import Any

import numpy as np

from adapters.chipmunk.profiles import UNSET
from adapters.chipmunk.releases import Point, points_of, shape_key
from adapters.chipmunk.start import overlap_displacement, touching_pairs
from adapters.chipmunk.translation import factors, made_body, made_shape
from adapters.copied import Copied
from adapters.engine import EngineError
from adapters.readback import free_parts, pair_materials
from adapters.scene import Scene
from adapters.scene.drives import velocity_over


class ChipmunkSimulation(Copied):
    """One ``pymunk.Space``; bodies in the scene's order."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        import pymunk

        self.scene, self.dt = scene, dt
        self.space = pymunk.Space(threaded=False)
        gx, gy = scene.gravity
        self.space.gravity = (gx, gy)
        self.space.iterations = settings["iterations"]
        self.space.collision_slop = settings["collision_slop"]
        self.space.collision_bias = settings["collision_bias"]
        self.space.collision_persistence = settings["collision_persistence"]
        for name in UNSET:
            if name in settings:
                setattr(self.space, name, settings[name])
        self.bodies = [made_body(body) for body in scene.bodies]
        self.shapes = [made_shape(scene, a, b, 0.0) for a, b in zip(scene.bodies, self.bodies, strict=True)]
        for asked, shape in zip(scene.bodies, self.shapes, strict=True):
            if any(asked.surface_velocity):
                shape.surface_velocity = asked.surface_velocity
        self.made = 0
        self.driven = [(b, a) for a, b in zip(scene.bodies, self.bodies, strict=True) if a.course is not None]
        for body, asked in self.driven:
            body.velocity = velocity_over(asked, dt, 0)
        self._set_materials()
        if settings["start_overlap"] > 0.0:
            self._overlap_start(settings["start_overlap"])
        for body, shape in zip(self.bodies, self.shapes, strict=True):
            self.space.add(body, shape)
        self.index = {shape_key(shape): i for i, shape in enumerate(self.shapes)}
        self.free = [body.motion == "free" for body in scene.bodies]
        self.loaded = [
            (self.bodies[i], body.force, body.torque[0]) for i, body in enumerate(scene.bodies) if body.is_loaded
        ]

    def _set_materials(self) -> None:
        for quantity, attribute in (("restitution", "elasticity"), ("friction", "friction")):
            chosen = factors(self.scene, quantity)
            if chosen is None:
                raise EngineError(f"pairs: no product of two factors represents the {quantity} of this scene")
            for shape, value in zip(self.shapes, chosen, strict=True):
                setattr(shape, attribute, value)

    def _overlap_start(self, overlap: float) -> None:
        """Move free bodies so that every touching pair overlaps by ``overlap``, if possible."""
        touching = touching_pairs(self.scene)
        shift = overlap_displacement(self.scene, touching, overlap)
        if shift is None:
            self.initial_change = (
                "none: no displacement gives all touching pairs an overlap of "
                f"{overlap:.3g} m, so the scene starts as given",
            )
            return
        if not touching:
            return
        for body, moved in zip(self.bodies, shift, strict=True):
            if moved.any():
                body.position = (body.position.x + moved[0], body.position.y + moved[1])
        self.initial_change = (
            f"{len(touching)} touching pairs start {overlap:.3g} m deep instead of touching; "
            f"the largest displacement is {np.linalg.norm(shift, axis=1).max():.3g} m",
        )

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`."""
        step, dt = self.space.step, self.dt
        for _ in range(steps):
            for body, force, torque in self.loaded:
                body.force, body.torque = force, torque
            for body, asked in self.driven:
                body.velocity = velocity_over(asked, dt, self.made)
            self.made += 1
            step(dt)

    # Copies of states are lists of numbers: thousands of tuples that stay are work for the garbage collector.

    def copy_pose(self) -> list[float]:
        """Position and angle of each body."""
        told: list[float] = []
        for body in self.bodies:
            told += (*body.position, body.angle)
        return told

    def copy_twist(self) -> list[float]:
        """Velocity and angular velocity of each body."""
        told: list[float] = []
        for body in self.bodies:
            told += (*body.velocity, body.angular_velocity)
        return told

    def copy_contacts(self) -> list[Point]:
        """Up to two points per pair; impulses per point."""
        points: list[Point] = []
        failures: list[Exception] = []
        places = [body.position for body in self.bodies]

        def collect(arbiter: Any, i: int) -> None:
            try:  # pymunk prints and drops exceptions of a callback
                points.extend(points_of(arbiter, i, self.index, self.free, places))
            except Exception as error:
                failures.append(error)

        for i, body in enumerate(self.bodies):
            if self.free[i]:
                body.each_arbiter(collect, i)
        if failures:
            raise EngineError(f"contacts: {type(failures[0]).__name__}: {failures[0]}")
        return points

    def readback(self) -> dict[str, Any]:
        """Values of the space, its bodies and shapes."""
        space = self.space
        return {
            "dt": self.dt,
            "gravity": list(space.gravity),
            "iterations": space.iterations,
            "collision_slop": space.collision_slop,
            "collision_bias": space.collision_bias,
            "collision_persistence": space.collision_persistence,
            "damping": space.damping,
            "sleep_time_threshold": str(space.sleep_time_threshold),
            "last_step": space.current_time_step,
            "bodies": {
                name: {"mass": shape.body.mass, "inertia": shape.body.moment, "size": _size(shape)}
                for name, shape in free_parts(self.scene, self.shapes)
            },
            "pairs": pair_materials(
                self.scene, ([own.elasticity for own in self.shapes], mul), ([own.friction for own in self.shapes], mul)
            ),
        }


def _size(shape: Any) -> list[float]:
    """Radius, or half extents, in the engine [m]."""
    if hasattr(shape, "get_vertices"):
        return [float(x) for x in np.max(np.abs(shape.get_vertices()), axis=0)]
    return [float(shape.radius)]
