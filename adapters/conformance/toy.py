"""A correct toy engine in plain numpy: the checks must hold for it, and notice faults in it.

Spatial sequential impulses for balls, boxes and half-spaces: contacts at the old pose, velocity (forces, then
impulses), then position. It has contacts of two balls, and of any shape with a half-space.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import product
from types import MappingProxyType
from typing import Any

import numpy as np

from adapters.engine import Array, Contacts, Declared, Engine, EngineError, EngineFacts, Scheme, Setting, Simulation
from adapters.needs import Needs
from adapters.scene import Body, Box, HalfSpace, Pair, Scene, Sphere

#: A gap up to this counts as touching [m]: a resting box must not lose its contacts to round-off.
TOUCHING = 1e-9


def _settings(needs: Needs, dt: float) -> list[Setting]:
    return [Setting("iterations", 30, "four corners of a box agree to 1e-9")]


class ToyEngine(Engine):
    """See the module's docstring."""

    facts = EngineFacts(
        "toy", "Toy", "numpy", frozenset({3}), Scheme("contacts, velocity, position", +1), customary_dt=1 / 60
    )
    profiles = MappingProxyType({"default": _settings})

    def version(self) -> str:
        """Version of the toy."""
        return "1.0"

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse pairs of bodies without contact detection."""
        for i, j, _ in scene.contact_pairs():
            shapes = [scene.bodies[k].shape for k in (i, j)]
            faces = any(isinstance(shape, HalfSpace) for shape in shapes)
            if not faces and any(isinstance(shape, Box) for shape in shapes) and _near(scene, i, j):
                return f"{scene.bodies[i].name}-{scene.bodies[j].name}: no box against another body"
        return None

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """No deviations."""
        return {}

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world; see `Engine.build`."""
        if not (math.isfinite(dt) and dt > 0):
            raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
        if set(settings) != {"iterations"}:
            raise EngineError(f"settings: the toy has iterations alone, not {', '.join(settings)}")
        count = settings["iterations"]
        if not isinstance(count, int) or count < 1:
            raise EngineError(f"iterations: {count!r} must be a count of at least 1")
        reason = self.refuses(scene, "")
        if scene.dimension != 3 or reason:
            raise EngineError(reason or "dimension: the toy is spatial")
        return ToySimulation(scene, dt, count)


class ToySimulation(Simulation):
    """One world of the toy."""

    def __init__(self, scene: Scene, dt: float, iterations: int) -> None:
        self.scene, self.dt, self.iterations = scene, dt, iterations
        self.poses = np.array([body.pose for body in scene.bodies])
        self.twists = np.array([body.twist for body in scene.bodies])
        self.touching: list[tuple[int, int, Any, Any, Any, float]] = []
        self.material = {(i, j): pair for i, j, pair in scene.contact_pairs()}
        free = np.array([body.motion == "free" for body in scene.bodies])
        self.inverse_mass = free / np.array([body.mass for body in scene.bodies])
        self.inverse_moments = np.array([_inverse_moments(body) for body in scene.bodies])
        self.inverse_inertia: list[Array] = []

    # ---- a step ----

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`."""
        for _ in range(steps):
            self._step(self.dt)

    def _step(self, dt: float) -> None:
        pose, twist = self.poses, self.twists
        turns = [rotation(q) for q in pose[:, 3:]]
        self.inverse_inertia = [r @ np.diag(m) @ r.T for r, m in zip(turns, self.inverse_moments, strict=True)]
        rows = [Row(self, *contact) for contact in self._detect()]
        for i, body in enumerate(self.scene.bodies):
            if body.motion == "free":
                twist[i, :3] += dt * (np.array(self.scene.gravity) + self.inverse_mass[i] * np.array(body.force))
                twist[i, 3:] += dt * self.inverse_inertia[i] @ np.array(body.torque)
        for _ in range(self.iterations):
            if max((row.solve(twist) for row in rows), default=0.0) < 1e-15:
                break  # converged
        self.touching = [(row.a, row.b, row.point, row.axes[0], row.impulse @ row.axes, row.gap) for row in rows]
        for i in range(len(pose)):
            pose[i, :3] += dt * twist[i, :3]
            pose[i, 3:] = turned(pose[i, 3:], dt * twist[i, 3:])

    def _detect(self) -> Iterator[tuple[int, int, Array, Array, float, Pair]]:
        """Contacts (a, b, point, normal from a to b, gap, material)."""
        bodies = self.scene.bodies
        for (i, j), pair in self.material.items():
            faces = [k for k in (i, j) if isinstance(bodies[k].shape, HalfSpace)]
            if not faces:
                yield from self._balls(i, j, pair)
                continue
            face, other, shape = faces[0], j if faces[0] == i else i, bodies[faces[0]].shape
            assert isinstance(shape, HalfSpace)
            n, sign = np.array(shape.normal), 1.0 if face < other else -1.0
            for point in self._extremes(other, -n):
                gap = float(point @ n) - shape.offset
                if gap <= TOUCHING:
                    yield i, j, point, sign * n, gap, pair

    def _balls(self, i: int, j: int, pair: Pair) -> Iterator[tuple[int, int, Array, Array, float, Pair]]:
        a, b = (self.scene.bodies[k].shape for k in (i, j))
        between = self.poses[j, :3] - self.poses[i, :3]
        distance = float(np.linalg.norm(between))
        if distance <= _reach(a) + _reach(b) + TOUCHING:
            if not (isinstance(a, Sphere) and isinstance(b, Sphere)):
                raise EngineError("shape: the toy cannot tell whether a box touches another body")
            n = between / distance
            gap = distance - a.radius - b.radius  # the point is half-way, symmetric in both bodies
            yield i, j, self.poses[i, :3] + (a.radius + 0.5 * gap) * n, n, gap, pair

    def _extremes(self, i: int, direction: Array) -> list[Array]:
        """Points of a body for contacts with a plane: the lowest of a ball, the corners of a box."""
        centre, shape = self.poses[i, :3], self.scene.bodies[i].shape
        if isinstance(shape, Sphere):
            return [centre + shape.radius * direction]
        assert isinstance(shape, Box)
        turn = rotation(self.poses[i, 3:])
        return [centre + turn @ (np.array(shape.half_extents) * signs) for signs in product((-1.0, 1.0), repeat=3)]

    # ---- reading ----

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        return self.poses.copy()

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        return self.twists.copy()

    def contacts(self) -> Contacts:
        """See `Simulation.contacts`."""
        return Contacts.from_rows(self.touching, 3)

    def readback(self) -> dict[str, Any]:
        """Values of the world."""
        held = {
            body.name: {"mass": 1.0 / float(inverse), "inertia": (1.0 / moments).tolist()}
            for body, inverse, moments in zip(self.scene.bodies, self.inverse_mass, self.inverse_moments, strict=True)
            if body.motion == "free"
        }
        return {"dt": self.dt, "iterations": self.iterations, "gravity": list(self.scene.gravity), "bodies": held}


class Row:
    """One contact: a normal and two tangents, with accumulated impulses on body b."""

    def __init__(self, world: ToySimulation, a: int, b: int, point: Array, normal: Array, gap: float, pair: Pair):
        self.a, self.b, self.point, self.gap, self.friction = a, b, point, gap, pair.friction
        side = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.5 else np.array([0.0, 1.0, 0.0])
        first = side - (side @ normal) * normal
        first /= np.linalg.norm(first)
        self.axes = np.array([normal, first, cross(normal, first)])
        arms = [point - world.poses[k, :3] for k in (a, b)]
        #: Rows of the Jacobian (3, 2, 6) and velocity per unit impulse.
        self.jacobian = np.array([[[*(-n), *(-cross(arms[0], n))], [*n, *cross(arms[1], n)]] for n in self.axes])
        self.response = np.zeros_like(self.jacobian)
        for place, k in enumerate((a, b)):
            self.response[:, place, :3] = world.inverse_mass[k] * self.jacobian[:, place, :3]
            self.response[:, place, 3:] = self.jacobian[:, place, 3:] @ world.inverse_inertia[k]
        self.mass = 1.0 / (self.jacobian * self.response).sum(axis=(1, 2))
        self.impulse = np.zeros(3)
        self.bounce = pair.restitution * min(0.0, float((self.jacobian[0] * world.twists[[a, b]]).sum()))

    def solve(self, twist: Array) -> float:
        """One sweep over this contact's axes; the largest change of an impulse [N s]."""
        largest = 0.0
        for axis in (0, 1, 2):
            speed = float((self.jacobian[axis] * twist[[self.a, self.b]]).sum())
            wanted = self.impulse[axis] - self.mass[axis] * (speed + (self.bounce if axis == 0 else 0.0))
            limit = self.friction * self.impulse[0]
            new = max(0.0, wanted) if axis == 0 else min(limit, max(-limit, wanted))
            change = new - self.impulse[axis]
            self.impulse[axis] = new
            if change:
                twist[[self.a, self.b]] += change * self.response[axis]
            largest = max(largest, abs(change))
        return largest


def _inverse_moments(body: Body) -> Array:
    return 1.0 / np.array(body.inertia) if body.motion == "free" else np.zeros(3)


def _reach(shape: Any) -> float:
    return shape.radius if isinstance(shape, Sphere) else math.hypot(*shape.half_extents)


def _near(scene: Scene, i: int, j: int) -> bool:
    a, b = scene.bodies[i], scene.bodies[j]
    return math.dist(a.pose[:3], b.pose[:3]) <= _reach(a.shape) + _reach(b.shape) + TOUCHING


def cross(a: Any, b: Any) -> Array:
    """As np.cross, without its overhead."""
    (ax, ay, az), (bx, by, bz) = a, b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def rotation(q: Any) -> Array:
    """Rotation matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def turned(q: Array, angle: Array) -> Array:
    """Quaternion ``q`` turned by a small rotation vector in world axes: q + (0, angle) q / 2, normalised."""
    w, u = q[0], q[1:]
    new = q + 0.5 * np.concatenate([[-(angle @ u)], w * angle + cross(angle, u)])
    return np.asarray(new / np.linalg.norm(new))
