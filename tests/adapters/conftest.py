"""A toy engine in plain numpy, healthy or with one planted fault.

Spatial sequential impulses for balls, boxes and half-spaces: contacts at the old pose, velocity (forces, then
impulses), then position. It knows balls against balls and anything against a half-space.
"""

import math
from functools import cache
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from adapters.engine import Contacts, Engine, EngineError, EngineFacts, Scheme, Setting, Simulation
from adapters.scene import Box, HalfSpace, Sphere

#: Every fault that can be planted; "" is health.
FAULTS = (
    "",
    "restitution ignored",
    "friction applied twice",
    "friction 2 % low",
    "impulses reported 2 % low",
    "friction reported 2 % low",
    "gravity sign",
    "half against full extents",
    "state sampled one step late",
    "world shared between builds",
    "disc inertia given to a sphere",
    "hidden damping of 4 %",
    "angle sign",
    "mass ignored",
    "impulse of the wrong body",
    "torque sign",
    "step of its own",
    "spin damped",
    "principal axes swapped",
    "start not as the scene says",
    "bodies in another order",
    "normal points from the second body",
    "bodies not in order of the scene",
    "unknown settings ignored",
    "setting without a reason",
    "refusal of several lines",
    "nothing read back",
)
#: A gap up to this counts as touching [m]: a resting box must not lose its contacts to round-off.
TOUCHING = 1e-9


class ToyEngine(Engine):
    facts = EngineFacts(
        "toy", "Toy", "numpy", frozenset({3}), Scheme("contacts, velocity, position", +1), customary_dt=1 / 60
    )

    def __init__(self, fault=""):
        assert fault in FAULTS, fault
        self.fault = fault
        self.shared = SimpleNamespace()

    @property
    def profiles(self):
        because = "" if self.fault == "setting without a reason" else "four corners of a box agree to 1e-9"
        return {"default": lambda needs, dt: [Setting("iterations", 30, because)]}

    def version(self):
        return "1.0"

    def refuses(self, scene, profile):
        if profile == "default" and len({pair for _, _, pair in scene.contact_pairs()}) > 1:
            return "pairs:\nno" if self.fault == "refusal of several lines" else None
        return None

    def declares(self, profile, needs, dt):
        return {}

    def build(self, scene, dt, settings):
        if not (math.isfinite(dt) and dt > 0):
            raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
        if set(settings) != {"iterations"} and self.fault != "unknown settings ignored":
            raise EngineError(f"settings: the toy has iterations alone, not {', '.join(settings)}")
        world = self.shared if self.fault == "world shared between builds" else SimpleNamespace()
        return ToySimulation(scene, dt, settings["iterations"], self.fault, world)


class ToySimulation(Simulation):
    def __init__(self, scene, dt, iterations, fault, world):
        self.scene, self.dt, self.iterations, self.fault, self.world = scene, dt, iterations, fault, world
        world.pose = np.array([body.pose for body in scene.bodies])
        world.twist = np.array([body.twist for body in scene.bodies])
        world.before = (world.pose.copy(), world.twist.copy())
        world.contacts = []
        if fault == "start not as the scene says":
            world.pose[1:, 2] += 1e-3
        self.material = {(i, j): pair for i, j, pair in scene.contact_pairs()}
        free = np.array([body.motion == "free" for body in scene.bodies])
        mass = np.array([1.0 if fault == "mass ignored" else body.mass for body in scene.bodies])
        self.inverse_mass = free / mass
        self.inverse_moments = np.array([self._inverse_moments(body) for body in scene.bodies])

    def _inverse_moments(self, body):
        if body.motion != "free":
            return np.zeros(3)
        moments = np.array(body.inertia)
        if self.fault == "disc inertia given to a sphere" and isinstance(body.shape, Sphere):
            moments = np.full(3, 0.5 * body.mass * body.shape.radius**2)
        return 1.0 / (moments[[1, 0, 2]] if self.fault == "principal axes swapped" else moments)

    # ---- a step ----

    def advance(self, steps):
        for _ in range(steps):
            self.world.before = (self.world.pose.copy(), self.world.twist.copy())
            self._step(1 / 240 if self.fault == "step of its own" else self.dt)

    def _step(self, dt):
        pose, twist = self.world.pose, self.world.twist
        contacts = list(self._detect())
        rotations = [rotation(q) for q in pose[:, 3:]]
        self.inverse_inertia = [r @ np.diag(m) @ r.T for r, m in zip(rotations, self.inverse_moments, strict=True)]
        rows = [Row(self, *contact) for contact in contacts]
        gravity = np.array(self.scene.gravity) * (-1 if self.fault == "gravity sign" else 1)
        for i, body in enumerate(self.scene.bodies):
            if body.motion == "free":
                torque = np.array(body.torque) * (-1 if self.fault == "torque sign" else 1)
                twist[i, :3] += dt * (gravity + self.inverse_mass[i] * np.array(body.force))
                twist[i, 3:] += dt * self.inverse_inertia[i] @ torque
        friction_times = 2 if self.fault == "friction applied twice" else 1
        if self.fault == "friction 2 % low":
            for row in rows:
                row.friction *= 0.98
        for _ in range(self.iterations):
            if max((row.solve(twist, friction_times) for row in rows), default=0.0) < 1e-15:
                break  # nothing moves any more
        self.world.contacts = [(row.a, row.b, row.point, row.axes[0], row.total(), row.gap) for row in rows]
        if self.fault == "hidden damping of 4 %":
            twist[:, :3] *= 1 - 0.04 * dt
        if self.fault == "spin damped":
            twist[:, 3:] *= 1 - 0.04 * dt
        for i in range(len(pose)):
            pose[i, :3] += dt * twist[i, :3]
            pose[i, 3:] = turned(pose[i, 3:], dt * twist[i, 3:])

    def _detect(self):
        """Contacts (a, b, point, normal from a to b, gap)."""
        bodies = self.scene.bodies
        for (i, j), pair in self.material.items():
            kinds = {i: bodies[i].shape, j: bodies[j].shape}
            faces = [k for k in (i, j) if isinstance(kinds[k], HalfSpace)]
            if faces:
                face, other = faces[0], j if faces[0] == i else i
                n, sign = np.array(kinds[face].normal), 1.0 if face < other else -1.0
                for point in self._extremes(other, -n):
                    gap = float(point @ n) - kinds[face].offset
                    if gap <= TOUCHING:
                        yield i, j, point, sign * n, gap, pair
            else:
                yield from self._balls(i, j, pair)

    def _balls(self, i, j, pair):
        shapes = [self.scene.bodies[k].shape for k in (i, j)]
        between = self.world.pose[j, :3] - self.world.pose[i, :3]
        distance = float(np.linalg.norm(between))
        reach = sum(s.radius if isinstance(s, Sphere) else math.hypot(*s.half_extents) for s in shapes)
        if distance <= reach + TOUCHING:
            if not all(isinstance(shape, Sphere) for shape in shapes):
                raise EngineError("shape: the toy cannot tell whether a box touches another body")
            n = between / distance
            yield i, j, self.world.pose[i, :3] + shapes[0].radius * n, n, distance - reach, pair

    def _extremes(self, i, direction):
        """Points of a body that may touch a plane: the lowest of a ball, the corners of a box."""
        centre, shape = self.world.pose[i, :3], self.scene.bodies[i].shape
        if isinstance(shape, Sphere):
            return [centre + shape.radius * direction]
        assert isinstance(shape, Box)
        half = np.array(shape.half_extents) * (0.5 if self.fault == "half against full extents" else 1.0)
        turn = rotation(self.world.pose[i, 3:])
        return [centre + turn @ (half * signs) for signs in product((-1.0, 1.0), repeat=3)]

    # ---- reading ----

    def pose(self):
        pose = (self.world.before[0] if self.fault == "state sampled one step late" else self.world.pose).copy()
        if self.fault == "angle sign":
            pose[:, 4:] *= -1
        return pose[::-1] if self.fault == "bodies in another order" else pose

    def twist(self):
        twist = self.world.before[1] if self.fault == "state sampled one step late" else self.world.twist
        return (twist[::-1] if self.fault == "bodies in another order" else twist).copy()

    def contacts(self):
        found = Contacts.from_rows(self.world.contacts, 3)
        if self.fault == "impulse of the wrong body":
            found.impulse[:] *= -1
        if self.fault == "impulses reported 2 % low":
            found.impulse[:] *= 0.98
        if self.fault == "friction reported 2 % low":
            normal = (found.impulse * found.normal).sum(axis=1, keepdims=True) * found.normal
            found.impulse[:] = normal + 0.98 * (found.impulse - normal)
        if self.fault == "normal points from the second body":
            found.normal[:] *= -1
        if self.fault == "bodies not in order of the scene":
            return Contacts(found.b, found.a, found.point, found.normal, found.impulse, found.gap)
        return found

    def readback(self):
        if self.fault == "nothing read back":
            return {}
        return {"dt": self.dt, "iterations": self.iterations, "inverse_mass": self.inverse_mass.tolist()}


class Row:
    """One contact: a normal and two tangents, with accumulated impulses on body b."""

    def __init__(self, world, a, b, point, normal, gap, pair):
        self.a, self.b, self.point, self.gap, self.friction = a, b, point, gap, pair.friction
        side = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.5 else np.array([0.0, 1.0, 0.0])
        first = side - (side @ normal) * normal
        first /= np.linalg.norm(first)
        self.axes = np.array([normal, first, cross(normal, first)])
        arms = [point - world.world.pose[k, :3] for k in (a, b)]
        #: Rows of the Jacobian (3, 2, 6) and velocity per unit impulse.
        self.jacobian = np.array([[[*(-n), *(-cross(arms[0], n))], [*n, *cross(arms[1], n)]] for n in self.axes])
        self.response = np.zeros_like(self.jacobian)
        for side_of, k in enumerate((a, b)):
            self.response[:, side_of, :3] = world.inverse_mass[k] * self.jacobian[:, side_of, :3]
            self.response[:, side_of, 3:] = self.jacobian[:, side_of, 3:] @ world.inverse_inertia[k]
        self.mass = 1.0 / (self.jacobian * self.response).sum(axis=(1, 2))
        self.impulse = np.zeros(3)
        approach = min(0.0, float((self.jacobian[0] * world.world.twist[[a, b]]).sum()))
        e = 0.0 if world.fault == "restitution ignored" else pair.restitution
        self.bounce = e * approach
        self.applied = np.zeros(3)

    def solve(self, twist, friction_times):
        largest = 0.0
        for axis in (0, 1, 2):
            speed = float((self.jacobian[axis] * twist[[self.a, self.b]]).sum())
            wanted = self.impulse[axis] - self.mass[axis] * (speed + (self.bounce if axis == 0 else 0.0))
            limit = self.friction * self.impulse[0]
            new = max(0.0, wanted) if axis == 0 else min(limit, max(-limit, wanted))
            change = (new - self.impulse[axis]) * (1 if axis == 0 else friction_times)
            self.impulse[axis] = new
            self.applied[axis] += change
            if change:
                twist[[self.a, self.b]] += change * self.response[axis]
            largest = max(largest, abs(change))
        return largest

    def total(self):
        return self.applied @ self.axes


def cross(a, b):
    """What np.cross gives, without its overhead."""
    (ax, ay, az), (bx, by, bz) = a, b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def rotation(q):
    """Rotation matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def turned(q, angle):
    """Quaternion ``q`` turned by a small rotation vector in world axes: q + (0, angle) q / 2, normalised."""
    w, u = q[0], q[1:]
    new = q + 0.5 * np.concatenate([[-(angle @ u)], w * angle + cross(angle, u)])
    return new / np.linalg.norm(new)


@cache
def toy_engine(fault=""):
    """One engine per fault, so that its receipts are measured once; an engine holds no state of a world."""
    return ToyEngine(fault)


@pytest.fixture
def toy():
    """`toy(fault)` is a toy engine with a planted fault, `toy()` a healthy one."""
    return toy_engine


@pytest.fixture
def toy_class():
    """The healthy toy's class, for tests that change one method."""
    return ToyEngine


@pytest.fixture
def faults():
    """Every fault that can be planted."""
    return FAULTS[1:]
