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
from adapters.chipmunk.releases import point_impulses
from adapters.chipmunk.start import overlap_displacement, touching_pairs
from adapters.chipmunk.translation import factors, made_body, made_shape
from adapters.drives import velocity_over
from adapters.engine import Array, Contacts, EngineError, Row, Simulation
from adapters.readback import free_parts, pair_materials
from adapters.scene import Scene


class ChipmunkSimulation(Simulation):
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
        self.index = {id(shape): i for i, shape in enumerate(self.shapes)}
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

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        return np.array([(*body.position, body.angle) for body in self.bodies], float)

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        return np.array([(*body.velocity, body.angular_velocity) for body in self.bodies], float)

    def contacts(self) -> Contacts:
        """Up to two points per pair, sorted by pair; impulses per point."""
        rows: list[Row] = []
        failures: list[Exception] = []
        for i, body in enumerate(self.bodies):
            if self.scene.bodies[i].motion != "free":
                continue

            def collect(arbiter: Any, i: int = i) -> None:
                try:  # pymunk prints and drops exceptions of a callback
                    j = self.index[id(arbiter.shapes[1])]
                    if i < j or self.scene.bodies[j].motion != "free":
                        rows.extend(_contact_rows(arbiter, i, j))
                except Exception as error:
                    failures.append(error)

            body.each_arbiter(collect)
        if failures:
            raise EngineError(f"contacts: {type(failures[0]).__name__}: {failures[0]}")
        return Contacts.by_pair(rows, 2)

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


def _contact_rows(arbiter: Any, i: int, j: int) -> list[tuple[int, int, Any, Any, Any, float]]:
    """Rows of one arbiter seen from body ``i``, each with the impulse on the second body at its point."""
    points = arbiter.contact_point_set
    (nx, ny), rows = points.normal, []
    for point, impulse in zip(points.points, point_impulses(arbiter, len(points.points)), strict=True):
        middle = (0.5 * (point.point_a.x + point.point_b.x), 0.5 * (point.point_a.y + point.point_b.y))
        rows.append((i, j, middle, (nx, ny), impulse, point.distance))
    return rows
