"""What collides: a model's bodies as arrays, and the models that the oracle takes."""

from __future__ import annotations

from typing import Any

import numpy as np

from reference_solver.model import Array, Body, Box, Capsule, HalfSpace, Model, Polygon

BALL, PLANE, BOX = 0, 1, 2

#: Relative difference of principal moments up to which a sphere turns freely without a torque-free precession.
ISOTROPIC = 1e-12


class Bodies:
    """Constant data of n bodies in d dimensions, r = 1 or 3 components of rotation.

    Parameters
    ----------
    model
        Discs or spheres, half-spaces that do not turn, and at most one planar box.

    Raises
    ------
    ValueError
        For a model whose flight or contact has no closed form here, naming the body.
    """

    def __init__(self, model: Model) -> None:
        bodies = model.bodies
        self.count, self.dimension = len(bodies), model.dimension
        self.kind = np.array([_kind(body) for body in bodies], np.int64)
        if np.count_nonzero(self.kind == BOX) > 1:
            raise ValueError("bodies: more than one box; contacts between boxes have no closed form")
        for index, body in enumerate(bodies):
            _require_closed_form(f"bodies[{index}]", body, model.dimension)
        free = np.array([body.motion == "free" for body in bodies])
        self.free = free
        self.inverse_mass = np.array([1.0 / b.mass if b.motion == "free" else 0.0 for b in bodies])
        self.inverse_inertia = np.array([1.0 / _moment(b) if b.motion == "free" else 0.0 for b in bodies])
        self.radius = np.array([getattr(b.shape, "radius", 0.0) for b in bodies])
        self.half_extents = np.array([getattr(b.shape, "half_extents", (0.0, 0.0))[:2] for b in bodies])
        self.reach = np.maximum(self.radius, np.hypot(*self.half_extents.T))
        self.normal = np.array([_normal(body) for body in bodies])
        self.offset = np.array([getattr(b.shape, "offset", 0.0) for b in bodies])
        self.restitution, self.friction = model.restitution, model.friction
        self.load = np.array([_acceleration(body, model.gravity) for body in bodies])
        self.turning_load = self.inverse_inertia[:, None] * np.array([_numbers(b.torque) for b in bodies])
        #: Pairs that the ball kernel skips: immovable pairs, boxes, and pairs at rest (added and removed by `Rest`).
        self.skipped = np.zeros((self.count, self.count), np.uint8)
        self.skipped[np.ix_(~free, ~free)] = 1
        self.skipped[self.kind == BOX] = self.skipped[:, self.kind == BOX] = 1
        self.box = int(np.argmax(self.kind == BOX)) if (self.kind == BOX).any() else -1

    def spatial(self) -> bool:
        """Whether there are three dimensions."""
        return self.dimension == 3

    def turn(self, lever: Array, vector: Array) -> Array:
        """Return lever x vector: (1,) planar, (3,) spatial."""
        if self.dimension == 3:
            return np.cross(lever, vector)
        return np.array([lever[0] * vector[1] - lever[1] * vector[0]])


def _kind(body: Body) -> int:
    if isinstance(body.shape, HalfSpace):
        return PLANE
    return BOX if isinstance(body.shape, Box) else BALL


def _numbers(value: Any) -> Array:
    return np.atleast_1d(np.array(value, dtype=np.float64))


def _moment(body: Body) -> float:
    return float(_numbers(body.inertia)[0])


def _acceleration(body: Body, gravity: tuple[float, ...]) -> Array:
    if body.motion != "free":
        return np.zeros(len(gravity))
    return np.array(gravity) + np.array(body.force) / body.mass


def _normal(body: Body) -> Array:
    """Outward normal of a half-space in world axes; zero for other shapes."""
    if not isinstance(body.shape, HalfSpace):
        return np.zeros(body.dimension)
    normal = np.array(body.shape.normal)
    if body.dimension == 2:
        if body.pose[2] == 0.0:
            return normal
        c, s = np.cos(body.pose[2]), np.sin(body.pose[2])
        return np.array([c * normal[0] - s * normal[1], s * normal[0] + c * normal[1]])
    w, v = body.pose[3], np.array(body.pose[4:])
    return normal + 2.0 * np.cross(v, np.cross(v, normal) + w * normal)


def _require_closed_form(name: str, body: Body, dimension: int) -> None:
    spin = np.atleast_1d(np.array(body.twist)[dimension:])
    if isinstance(body.shape, Capsule | Polygon):
        raise ValueError(f"{name}: contacts of a {type(body.shape).__name__} have no closed form here")
    if isinstance(body.shape, HalfSpace) and spin.any():
        raise ValueError(f"{name}: a half-space that turns has no closed-form contacts here")
    if isinstance(body.shape, Box):
        if dimension == 3 or body.motion != "free":
            raise ValueError(f"{name}: only a free planar box has closed-form contacts here")
        if np.any(body.torque):
            raise ValueError(f"{name}: a box under torque has no closed-form contacts here")
    if dimension == 3 and body.motion == "free":
        moments = np.array(body.inertia)
        if np.ptp(moments) > ISOTROPIC * moments.max():
            raise ValueError(f"{name}: unequal principal moments have no closed-form rotation here")
