"""Metamorphic relations: what a changed world must do, given what the unchanged one did (E72).

A `Change` maps a whole world: x' = a Q x + s + V t with a turn or a mirror Q that maps axes onto axes, in other units.
A turn turns bodies with their axes; a mirror leaves body axes where they are in the mirrored world, and mirrors shapes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference_solver.model import Array, Body, HalfSpace, Model, Polygon, Shape
from reference_solver.records import Record
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation


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


def run(model: Model, settings: Settings, steps: int) -> Record:
    """Return every state of a run."""
    return Simulation(model, settings).record(steps)


def defect(change: Change, model: Model, settings: Settings, steps: int) -> float:
    """Largest difference between the changed world's run and the changed run, in old units [m, rad, m/s, rad/s]."""
    d, old = model.dimension, run(model, settings, steps)
    new = run(change.model(model), change.settings(settings), steps)
    expected = change.pose(old.pose, old.t)
    if d == 3:  # q and -q are one orientation
        expected[..., 3:] *= np.where((expected[..., 3:] * new.pose[..., 3:]).sum(axis=-1) < 0.0, -1.0, 1.0)[..., None]
    pose = np.abs(new.pose - expected)
    twist = np.abs(new.twist - change.twist(old.twist))
    pose[..., :d] /= change.length
    twist[..., :d] *= change.time / change.length
    twist[..., d:] *= change.time
    return float(max(pose.max(), twist.max()))


def permuted(model: Model, order: Sequence[int]) -> Model:
    """Return the same world with body ``order[i]`` at place i."""
    index = np.array(order)
    pairs = np.ix_(index, index)
    bodies = [model.bodies[i] for i in index]
    return Model(model.dimension, bodies, model.gravity, model.restitution[pairs], model.friction[pairs])


def canonical_order(model: Model) -> list[int]:
    """Order of the bodies that does not depend on how they were numbered.

    Rows are solved in the order of (A, B, feature), so that the last bits of an answer depend on the numbers of the
    bodies; sorted by what they are, where they are and how they move, equal worlds get equal bits.
    """
    keys = [
        (body.motion, type(body.shape).__name__, repr(body.shape), body.pose, body.twist, body.mass, body.inertia)
        for body in model.bodies
    ]
    return sorted(range(len(keys)), key=keys.__getitem__)


def permutation_defect(model: Model, order: Sequence[int], settings: Settings, steps: int) -> float:
    """Largest difference between a run and the run of the renumbered world."""
    old, new = run(model, settings, steps), run(permuted(model, order), settings, steps)
    index = np.array(order)
    pose, twist = new.pose - old.pose[:, index], new.twist - old.twist[:, index]
    return float(max(np.abs(pose).max(), np.abs(twist).max()))


def doubled(model: Model, change: Change) -> Model:
    """Return a world with a changed second copy of every free body; the others serve both copies."""
    free = [i for i, body in enumerate(model.bodies) if body.motion == "free"]
    index = np.array([*range(len(model.bodies)), *free])
    pairs = np.ix_(index, index)
    bodies = [*model.bodies, *(change.body(model.bodies[i]) for i in free)]
    return Model(model.dimension, bodies, model.gravity, model.restitution[pairs], model.friction[pairs])


def copies_defect(model: Model, change: Change, settings: Settings, steps: int) -> float:
    """Largest difference of either copy from the world alone."""
    old, new = run(model, settings, steps), run(doubled(model, change), settings, steps)
    n = len(model.bodies)
    free = [i for i, body in enumerate(model.bodies) if body.motion == "free"]
    pose, twist = change.pose(old.pose, old.t)[:, free], change.twist(old.twist)[:, free]
    first = max(np.abs(new.pose[:, :n] - old.pose).max(), np.abs(new.twist[:, :n] - old.twist).max())
    second = max(np.abs(new.pose[:, n:] - pose).max(), np.abs(new.twist[:, n:] - twist).max())
    return float(max(first, second))


def reversed_defect(model: Model, settings: Settings, steps: int) -> float:
    """How far a world is from its start after ``steps`` steps, all velocities turned round, and as many again."""
    there = Simulation(model, settings)
    start = there.pose, there.twist
    there.advance(steps)
    bodies = [
        dataclasses.replace(body, pose=tuple(pose), twist=tuple(-twist))
        for body, pose, twist in zip(model.bodies, there.pose, there.twist, strict=True)
    ]
    back = Simulation(dataclasses.replace(model, bodies=bodies), settings)
    back.advance(steps)
    return float(max(np.abs(back.pose - start[0]).max(), np.abs(back.twist + start[1]).max()))
