"""Builders that write one world in the plane and in space: gates are stated once and measured in both dimensions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference_solver.model import Array, Body, Box, Disc, HalfSpace, Model, Sphere
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation

#: Standard test value [m/s^2]; gates are ratios or carry its unit.
GRAVITY = 9.81

#: I / (m R^2) of a uniform disc and of a uniform solid sphere.
ROUNDNESS = {2: 0.5, 3: 0.4}


@dataclass(frozen=True)
class Space:
    """The plane or space, seen along one horizontal axis and upwards.

    A planar spin (counter-clockwise, x towards y) is a spatial spin about -y (x towards z).
    """

    dimension: int

    @property
    def name(self) -> str:
        """``planar`` or ``spatial``."""
        return {2: "planar", 3: "spatial"}[self.dimension]

    @property
    def up(self) -> int:
        """Index of the upward axis in positions and velocities."""
        return self.dimension - 1

    def vector(self, along: float, up: float) -> tuple[float, ...]:
        """Return a vector in world axes."""
        return (along, up) if self.dimension == 2 else (along, 0.0, up)

    def pose(self, along: float, up: float, angle: float = 0.0) -> tuple[float, ...]:
        """Return a pose, turned by ``angle`` [rad] from the horizontal axis towards the upward one."""
        if self.dimension == 2:
            return (along, up, angle)
        return (along, 0.0, up, math.cos(0.5 * angle), 0.0, -math.sin(0.5 * angle), 0.0)

    def twist(self, along: float = 0.0, up: float = 0.0, spin: float = 0.0) -> tuple[float, ...]:
        """Return a twist [m/s, rad/s]."""
        return (along, up, spin) if self.dimension == 2 else (along, 0.0, up, 0.0, -spin, 0.0)

    def spin(self, twist: Array) -> Array:
        """Return the spin in this plane of ``twist`` (..., 3 | 6)."""
        return twist[..., 2] if self.dimension == 2 else -twist[..., 4]

    def floor(self, angle: float = 0.0, offset: float = 0.0, **fields: Any) -> Body:
        """Return a half-space through the origin, its surface turned by ``angle`` [rad]."""
        normal = self.vector(-math.sin(angle), math.cos(angle))
        return Body(HalfSpace(normal, offset), pose=self.pose(0.0, 0.0), **{"motion": "fixed", **fields})

    def wall(self, side: float, offset: float, velocity: float = 0.0) -> Body:
        """Return a half-space that looks along ``side`` (+-1) times the horizontal axis."""
        shape = HalfSpace(self.vector(side, 0.0), offset)
        if velocity == 0.0:
            return Body(shape, pose=self.pose(0.0, 0.0), motion="fixed")
        return Body(shape, pose=self.pose(0.0, 0.0), twist=self.twist(velocity), motion="prescribed")

    def ball(
        self, along: float, up: float, twist: tuple[float, ...] = (), radius: float = 0.5, mass: float = 1.0
    ) -> Body:
        """Return a uniform disc or solid sphere."""
        moment = ROUNDNESS[self.dimension] * mass * radius**2
        inertia: Any = moment if self.dimension == 2 else (moment,) * 3
        shape = Disc(radius) if self.dimension == 2 else Sphere(radius)
        return Body(shape, mass, inertia, self.pose(along, up), twist or self.twist())

    def box(
        self,
        along: float,
        up: float,
        twist: tuple[float, ...] = (),
        half: tuple[float, float] = (0.5, 0.5),
        mass: float = 1.0,
        angle: float = 0.0,
        **fields: Any,
    ) -> Body:
        """Return a uniform box, in space as deep as it is wide."""
        a, b = half
        if self.dimension == 2:
            shape, inertia = Box(half), mass * (a * a + b * b) / 3.0
        else:
            across, about_up = mass * (a * a + b * b) / 3.0, mass * 2.0 * a * a / 3.0
            shape, inertia = Box((a, a, b)), (across, across, about_up)  # type: ignore[assignment]
        return Body(shape, mass, inertia, self.pose(along, up, angle), twist or self.twist(), **fields)

    def simulation(
        self,
        bodies: Sequence[Body],
        settings: Settings,
        gravity: float = 0.0,
        restitution: float = 0.0,
        friction: float = 0.0,
        tilt: float = 0.0,
    ) -> Simulation:
        """Return a simulation with gravity [m/s^2] turned by ``tilt`` [rad] towards the horizontal axis."""
        pull = self.vector(gravity * math.sin(tilt), -gravity * math.cos(tilt))
        model = Model(self.dimension, bodies, pull, np.float64(restitution), np.float64(friction))
        return Simulation(model, settings)

    def column(self, masses: Sequence[float], shape: str = "box") -> list[Body]:
        """Return a floor and touching unit bodies on it, the lowest first [kg]."""
        make = self.box if shape == "box" else self.ball
        return [self.floor(), *(make(0.0, 0.5 + i, mass=m) for i, m in enumerate(masses))]


#: Both dimensions, in the order in which rows are shown.
SPACES = (Space(2), Space(3))


def made_by(space: Space, profile: str) -> str:
    """Return the name under which a gate of a profile is listed."""
    return f"{profile}, {space.name}"
