"""Changes of a world whose run must be the changed run (E72).

A `Change` maps a whole world: x -> l Q x + s + V t with a turn or a mirror Q that maps axes onto axes, in other units.
A turn turns bodies with their axes; a mirror leaves body axes where they are in the mirrored world, and mirrors shapes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference_solver.model import Array, Body, HalfSpace, Model, Polygon, Shape
from reference_solver.settings import Settings


@dataclass(frozen=True)
class Change:
    """A change of the observer, of units, or of place.

    Parameters
    ----------
    dimension
        2 or 3.
    axes, signs
        Q: axis k of the new world is axis ``axes[k]`` of the old one times ``signs[k]``. None: unchanged. With
        determinant -1 ``axes`` must be None.
    shift, boost
        s [m] and V [m/s] in the new world. None: zero.
    length, time, mass
        How many new units one old unit is.
    """

    dimension: int
    axes: tuple[int, ...] | None = None
    signs: tuple[float, ...] | None = None
    shift: tuple[float, ...] | None = None
    boost: tuple[float, ...] | None = None
    length: float = 1.0
    time: float = 1.0
    mass: float = 1.0

    @property
    def matrix(self) -> Array:
        """Q (d, d)."""
        d = self.dimension
        q = np.zeros((d, d))
        q[np.arange(d), self.axes or range(d)] = self.signs or 1.0
        return q

    @property
    def handedness(self) -> float:
        """Determinant of Q: -1 for a mirror."""
        return float(round(np.linalg.det(self.matrix)))

    def polar(self, vectors: Array) -> Array:
        """Q applied to the last axis of ``vectors``; adding zeros is exact."""
        mapped: Array = vectors @ self.matrix.T
        return mapped

    def axial(self, vectors: Array) -> Array:
        """Angular quantities: turned like vectors, and reversed by a mirror; planar ones have one component."""
        return self.handedness * (vectors if self.dimension == 2 else self.polar(vectors))

    def orientation(self, pose: Array) -> Array:
        """Angles (..., 1) or quaternions (..., 4) of the new world."""
        if self.dimension == 2:
            q = self.matrix
            turn = np.arctan2(q[1, 0], q[0, 0]) if self.handedness > 0.0 else 0.0
            return self.handedness * pose[..., 2:] + turn
        if self.handedness > 0.0:
            return turned(quaternion(self.matrix), pose[..., 3:])
        # the vector part of a quaternion lies along the axis of its turn
        return np.concatenate([pose[..., 3:4], self.axial(pose[..., 4:])], axis=-1)

    def pose(self, pose: Array, t: Array) -> Array:
        """Poses (s, n, 3 | 7) at the old times ``t`` (s,)."""
        d = self.dimension
        moved = np.asarray(self.time * t, dtype=np.float64)[:, None, None] * _vector(self.boost, d)
        place = self.length * self.polar(pose[..., :d]) + _vector(self.shift, d) + moved
        return np.concatenate([place, self.orientation(pose)], axis=-1)

    def twist(self, twist: Array) -> Array:
        """Twists (..., 3 | 6)."""
        d, new = self.dimension, np.array(twist, dtype=np.float64)
        new[..., :d] = self.length / self.time * self.polar(twist[..., :d]) + _vector(self.boost, d)
        new[..., d:] = self.axial(twist[..., d:]) / self.time
        return new

    def shape(self, shape: Shape) -> Shape:
        """Return the shape in the new world's units, mirrored where the world is."""
        if isinstance(shape, HalfSpace):
            normal = np.array(shape.normal)
            mirrored = normal if self.handedness > 0.0 else self.polar(normal)
            return HalfSpace(tuple(mirrored), self.length * shape.offset)
        if isinstance(shape, Polygon):
            corners = self.length * np.array(shape.vertices)
            corners = corners if self.handedness > 0.0 else self.polar(corners)[::-1]  # counter-clockwise again
            return Polygon(tuple((float(x), float(y)) for x, y in corners))
        make: Any = type(shape)
        return make(**{name: _plain(self.length * np.array(size)) for name, size in vars(shape).items()})

    def body(self, body: Body) -> Body:
        """Return one body of the new world; what stands fixed moves with a boost."""
        pose = self.pose(np.array([[body.pose]]), np.zeros(1))[0, 0]
        twist = self.twist(np.array(body.twist))
        push = self.mass * self.length / self.time**2
        return dataclasses.replace(
            body,
            shape=self.shape(body.shape),
            mass=self.mass * body.mass,
            inertia=_plain(self.mass * self.length**2 * np.array(body.inertia)),
            pose=tuple(pose),
            twist=tuple(twist),
            motion="prescribed" if body.motion == "fixed" and twist.any() else body.motion,
            force=tuple(push * self.polar(np.array(body.force))),
            torque=_plain(push * self.length * self.axial(np.array(body.torque))),
        )

    def model(self, model: Model) -> Model:
        """Return the new world."""
        pull = self.length / self.time**2 * self.polar(np.array(model.gravity))
        bodies = [self.body(body) for body in model.bodies]
        return Model(model.dimension, bodies, tuple(pull), model.restitution, model.friction)

    def settings(self, settings: Settings) -> Settings:
        """Return the settings in the new units."""
        return dataclasses.replace(settings, dt=self.time * settings.dt, slop=self.length * settings.slop)


def _vector(values: tuple[float, ...] | None, size: int) -> Array:
    return np.zeros(size) if values is None else np.array(values)


def _plain(values: Array) -> Any:
    return float(values) if values.ndim == 0 else tuple(values)


def quaternion(matrix: Array) -> Array:
    """Quaternion (w, x, y, z) of a rotation matrix: the eigenvector of q R(q) = q, from its largest component."""
    m = matrix
    four = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    ) + np.eye(4)
    # four times the outer product of q with itself (S. Shepperd, J. Guidance and Control 1, 1978)
    column = four[:, int(np.argmax(np.diag(four)))]
    unit: Array = column / np.linalg.norm(column)
    return unit


def turned(q: Array, p: Array) -> Array:
    """Product of the quaternion ``q`` (4,) with quaternions ``p`` (..., 4)."""
    w, v = q[0], q[1:]
    scalar = w * p[..., :1] - (p[..., 1:] @ v)[..., None]
    return np.concatenate([scalar, w * p[..., 1:] + p[..., :1] * v + np.cross(v, p[..., 1:])], axis=-1)


def permuted(model: Model, order: Sequence[int]) -> Model:
    """Return the same world with body ``order[i]`` at place i."""
    index = np.array(order)
    pairs = np.ix_(index, index)
    bodies = [model.bodies[i] for i in index]
    return Model(model.dimension, bodies, model.gravity, model.restitution[pairs], model.friction[pairs])
