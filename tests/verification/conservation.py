"""Gates of what collisions keep: momentum and angular momentum."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from reference_solver.model import Array, Body, Box, Disc, Sphere
from reference_solver.settings import Settings
from tests.verification.gate import Gate
from tests.verification.rotation import rotation_matrix
from tests.verification.space import ROUNDNESS, SPACES, Space, made_by


def gates() -> Iterator[Gate]:
    """Yield every row of conservation."""
    for space in SPACES:
        yield from free_collisions(space)


def swarm(space: Space, count: int, duration: float, seed: int = 7) -> list[Body]:
    """Return balls and boxes thrown at the middle from all sides, so that some arrive at any time of the run."""
    rng = np.random.default_rng(seed)
    bodies = []
    for i in range(count):
        direction = rng.standard_normal(space.dimension)
        direction /= np.linalg.norm(direction)
        speed = rng.uniform(0.5, 1.5)
        place = (2.0 + speed * duration * i / count) * direction
        mass = rng.uniform(0.5, 2.0)
        spin = rng.uniform(-1.0, 1.0, 1 if space.dimension == 2 else 3)
        bodies.append(thrown(space, i % 2 == 0, mass, place, -speed * direction, spin))
    return bodies


def thrown(space: Space, is_ball: bool, mass: float, place: Array, velocity: Array, spin: Array) -> Body:
    """Return a ball or a box with unequal moments in flight."""
    half = (0.4, 0.3, 0.2)
    if space.dimension == 2:
        inertia: Any = ROUNDNESS[2] * mass * 0.3**2 if is_ball else mass * (half[0] ** 2 + half[1] ** 2) / 3.0
        shape: Any = Disc(0.3) if is_ball else Box(half[:2])
        return Body(shape, mass, inertia, (*place, 0.0), (*velocity, *spin))
    squares = np.array(half) ** 2
    inertia = (ROUNDNESS[3] * mass * 0.3**2,) * 3 if is_ball else tuple(mass * (squares.sum() - squares) / 3.0)
    shape = Sphere(0.3) if is_ball else Box(half)
    return Body(shape, mass, inertia, (*place, 1.0, 0.0, 0.0, 0.0), (*velocity, *spin))


def momenta(bodies: list[Body], pose: Array, twist: Array, space: Space) -> tuple[Array, Array, float, float]:
    """Momentum, angular momentum about the origin, and the sums of the sizes of their parts."""
    linear, angular, linear_size, angular_size = np.zeros(3), np.zeros(3), 0.0, 0.0
    for body, q, v in zip(bodies, pose, twist, strict=True):
        place, velocity = np.zeros(3), np.zeros(3)
        place[: space.dimension], velocity[: space.dimension] = q[: space.dimension], v[: space.dimension]
        own = np.array([0.0, 0.0, v[2]]) * body.inertia if space.dimension == 2 else spatial_spin(body, q, v)
        orbital = body.mass * np.cross(place, velocity)
        linear += body.mass * velocity
        angular += orbital + own
        linear_size += body.mass * math.hypot(*velocity)
        angular_size += body.mass * math.hypot(*place) * math.hypot(*velocity) + math.hypot(*own)
    return linear, angular, linear_size, angular_size


def spatial_spin(body: Body, pose: Array, twist: Array) -> Array:
    """Angular momentum of a body about its own centre, world axes."""
    turn = rotation_matrix(pose[3:])
    spin: Array = turn @ (np.array(body.inertia) * (turn.T @ twist[3:]))
    return spin


def free_collisions(space: Space, count: int = 40, steps: int = 10_000, dt: float = 1 / 240) -> Iterator[Gate]:
    """Change of both momenta over the sum of their parts' sizes, with friction and restitution."""
    bodies = swarm(space, count, steps * dt)
    simulation = space.simulation(bodies, Settings.reference(dt), 0.0, 0.6, 0.4)
    record = simulation.record(steps, stride=100, contacts=True)
    start = momenta(bodies, record.pose[0], record.twist[0], space)
    linear = angular = size = 0.0
    for pose, twist in zip(record.pose, record.twist, strict=True):
        now = momenta(bodies, pose, twist, space)
        linear = max(linear, float(np.abs(now[0] - start[0]).max()))
        angular = max(angular, float(np.abs(now[1] - start[1]).max()))
        size = max(size, now[3])
    changed = int((np.abs(np.diff(record.twist, axis=0)).max(axis=2) > 1e-6).sum())
    case = f"{steps} steps, {changed} changes of velocity"
    name = made_by(space, "reference")
    yield Gate.at_most("momentum, relative", case, linear / start[2], 1e-12, name)
    yield Gate.at_most("angular momentum, relative", case, angular / size, 1e-12, name)
