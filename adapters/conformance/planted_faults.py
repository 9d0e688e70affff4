"""Faults of a given size for any engine.

`validation.questions.detection` computes from them which faults each check and property check notices. Faults of a toy
engine, each with the check that must notice it, are in `adapters.conformance.faults`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from adapters.engine import Array, Contacts, Declared, Engine, EngineError, Simulation
from adapters.needs import Needs
from adapters.scene import Body, Box, Capsule, Cylinder, Disc, Hull, Polygon, Scene, Sphere

#: Faults of a given size for any engine, in its input...
TOLD = ("mass", "inertia", "gravity", "friction", "restitution", "extent", "step")
#: ... or in its output.
REPORTED = (
    "velocity", "impulse", "damping", "drift", "climb", "twirl", "tremble", "flicker", "lasting", "uneven", "late",
    "pull", "order",
)  # fmt: skip
SIZED = TOLD + REPORTED


class Planted(Engine):
    """An engine with one wrong parameter: its input or output is ``(1 - size)`` times the right value.

    Parameters
    ----------
    fault
        One of `SIZED`: of the input (`TOLD`) or of the output (`REPORTED`). Added motion is no share of a parameter:
        ``drift`` moves every body along x by ``size`` times 1 m/s and ``climb`` upwards, like a position correction
        that never ends, and ``twirl`` turns it by ``size`` times 1 rad/s in the plane of x and the vertical;
        ``tremble`` adds ``size`` times 1 m/s along x with alternating sign; ``flicker`` changes the impulses
        alternately by that share; ``lasting`` still reports a share of the last impulses after contact; ``uneven``
        reduces impulses by a share that grows with the index of the body; ``damping`` reduces all speeds by the share
        in a second.
    size
        Relative error, 0.02 for two per cent.
    """

    def __init__(self, inner: Engine, fault: str, size: float) -> None:
        if fault not in SIZED:
            raise EngineError(f"fault: {fault!r} is none of {', '.join(SIZED)}")
        self.inner, self.fault, self.factor = inner, fault, 1.0 - size
        self.facts, self.profiles = inner.facts, inner.profiles

    def version(self) -> str:
        """Version of the engine."""
        return self.inner.version()

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """The engine's refusal."""
        return self.inner.refuses(scene, profile)

    def too_coarse(self, scene: Scene, dt: float) -> str | None:
        """The engine's refusal of too long steps."""
        return self.inner.too_coarse(scene, dt)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Declarations of the correct engine: a fault is not declared."""
        return self.inner.declares(profile, needs, dt)

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Build the world from the faulty input."""
        told = dt * self.factor if self.fault == "step" else dt
        return _Misread(self.inner.build(self._told(scene), told, settings), self.fault, self.factor, dt)

    def _told(self, scene: Scene) -> Scene:
        k = self.factor
        if self.fault == "gravity":
            return replace(scene, gravity=tuple(k * g for g in scene.gravity))
        if self.fault in ("friction", "restitution"):
            pairs = tuple(replace(p, **{self.fault: k * getattr(p, self.fault)}) for p in scene.pairs)
            return replace(scene, pairs=pairs)
        return replace(scene, bodies=tuple(self._body(b) if b.motion == "free" else b for b in scene.bodies))

    def _body(self, body: Body) -> Body:
        k, shape = self.factor, body.shape
        if self.fault == "mass":
            return replace(body, mass=k * body.mass)
        if self.fault == "inertia":
            moments = body.inertia
            if isinstance(moments, tuple):
                return replace(body, inertia=(k * moments[0], k * moments[1], k * moments[2]))
            return replace(body, inertia=k * moments)
        if self.fault == "extent" and isinstance(shape, Box):
            return replace(body, shape=Box(tuple(k * h for h in shape.half_extents)))
        if self.fault == "extent" and isinstance(shape, Capsule | Cylinder):
            return replace(body, shape=type(shape)(shape.half_length, k * shape.radius))
        if self.fault == "extent" and isinstance(shape, Polygon | Hull):
            corners: Any = tuple(tuple(k * x for x in vertex) for vertex in shape.vertices)
            return replace(body, shape=type(shape)(corners))
        if self.fault == "extent" and isinstance(shape, Disc | Sphere):
            return replace(body, shape=type(shape)(k * shape.radius))
        return body


class _Misread(Simulation):
    """A simulation with a fault of `REPORTED` in its output."""

    def __init__(self, inner: Simulation, fault: str, factor: float, dt: float) -> None:
        self.inner, self.fault, self.factor, self.dt = inner, fault, factor, dt
        self.size = 1.0 - factor
        self.steps = 0
        self.initial_change = inner.initial_change
        #: Positions and velocities of the last steps, newest last, as far back as the delay.
        self.past: deque[tuple[Array, Array]] = deque(maxlen=math.ceil(self.size / dt) + 1)
        self._keep()
        #: The last contacts; none before the first.
        self.told: Contacts | None = None

    def advance(self, steps: int) -> None:
        self.steps += steps
        if self.fault != "late":
            self.inner.advance(steps)
            return
        for _ in range(steps):
            self.inner.advance(1)
            self._keep()

    def _keep(self) -> None:
        if self.fault == "late":
            self.past.append((self.inner.pose().copy(), self.inner.twist().copy()))

    def pose(self) -> Array:
        pose = self.inner.pose()
        if self.fault in ("drift", "climb"):
            pose = pose.copy()
            up = 1 if pose.shape[1] == 3 else 2
            pose[:, 0 if self.fault == "drift" else up] += self.size * self.dt * self.steps
        if self.fault == "late":
            return self._late(pose)
        if self.fault == "pull":
            pose = pose.copy()
            pose[:, : _axes(pose)] += self.size * self.dt * self.steps * _inwards(pose)
        return _turned(pose, self.size * self.dt * self.steps) if self.fault == "twirl" else pose

    def _late(self, pose: Array) -> Array:
        """Positions from the velocities of ``size`` seconds ago, interpolated between steps."""
        d, lag = _axes(pose), min(self.size / self.dt, float(self.steps))
        whole = math.floor(lag)
        led = [
            self.past[-1 - back][0][:, :d] + back * self.dt * self.past[-1 - back][1][:, :d]
            for back in (whole, math.ceil(lag))
        ]
        late = pose.copy()
        late[:, :d] = led[0] + (lag - whole) * (led[1] - led[0])
        return late

    def twist(self) -> Array:
        twist = self.inner.twist()
        if self.fault == "velocity":
            return self.factor * twist
        if self.fault == "damping":
            return twist * float(self.factor ** (self.steps * self.dt))
        if self.fault == "tremble":
            twist = twist.copy()
            twist[:, 0] += self._turn() * self.size
        if self.fault == "pull":
            pose = self.inner.pose()
            twist = twist.copy()
            twist[:, : _axes(pose)] += self.size * _inwards(pose)
        if self.fault == "order":
            last = max(1, len(twist) - 1)
            twist = twist * (1.0 - self.size * np.arange(len(twist)) / last)[:, None]
        if self.fault == "twirl":
            twist = twist.copy()
            if twist.shape[1] == 3:
                twist[:, 2] += self.size
            else:
                twist[:, 4] -= self.size
        return twist

    def contacts(self) -> Contacts:
        found = self.inner.contacts()
        if self.fault == "impulse":
            return replace(found, impulse=self.factor * found.impulse)
        if self.fault == "flicker":
            return replace(found, impulse=(1.0 + self._turn() * self.size) * found.impulse)
        if self.fault == "uneven":
            last = max(1, len(self.inner.twist()) - 1)
            return replace(found, impulse=(1.0 - self.size * found.b / last)[:, None] * found.impulse)
        if self.fault == "lasting":
            if len(found.a) == 0 and self.told is not None:
                return replace(self.told, impulse=self.size * self.told.impulse)
            self.told = replace(found, impulse=found.impulse.copy())  # a simulation may return its own arrays
        return found

    def _turn(self) -> float:
        """Sign of this step: one step +1, the next -1."""
        return 1.0 if self.steps % 2 else -1.0

    def readback(self) -> dict[str, Any]:
        return self.inner.readback()

    def close(self) -> None:
        self.inner.close()


def _axes(pose: Array) -> int:
    """Number of position columns of a pose: two in 2-D, three in 3-D."""
    return 2 if pose.shape[1] == 3 else 3


def _inwards(pose: Array) -> Array:
    """Unit vectors (n, axes) from each body to the centre of all; zero for a body there."""
    way = pose[:, : _axes(pose)].mean(axis=0) - pose[:, : _axes(pose)]
    far = np.linalg.norm(way, axis=1, keepdims=True)
    unit: Array = np.divide(way, far, out=np.zeros_like(way), where=far > 0.0)
    return unit


def _turned(pose: Array, angle: float) -> Array:
    """Poses turned by ``angle`` from x towards the vertical: about +z in the plane, about -y in space."""
    pose = pose.copy()
    if pose.shape[1] == 3:
        pose[:, 2] += angle
        return pose
    c, s = math.cos(0.5 * angle), -math.sin(0.5 * angle)
    w, x, y, z = pose[:, 3:].T
    # The product (c, 0, s, 0) (w, x, y, z): a rotation in world axes is the left factor.
    pose[:, 3:] = np.column_stack([c * w - s * y, c * x + s * z, c * y + s * w, c * z - s * x])
    return pose
