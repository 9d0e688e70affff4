"""Shared contact laws: blows in free space in single precision, and the distance from a plane by rounding.

    o->   o      |        straight flight, blow, straight flight: nothing else changes a velocity, so
          o  o-> |        the result of an engine follows from the scene up to a few roundings

Most checks of impacts have tolerances of double precision. A single-precision engine misses them by some units of
2^-24, which is no fault of its contact model. The motion is computed here in doubles, event by event; the band is the
effect of the roundings on the metric.

There is no prediction where blows follow each other within a few steps, or the engine's iterations do not converge.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from adapters.engine import Array, Contacts
from adapters.law import Law, Measure, Prediction
from adapters.scene import Box, HalfSpace, Pair, Scene, Shape, Sphere
from adapters.scene.lift import lift, lower_contacts, lower_twist, size_across
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Trajectory

#: Relative round-off in single precision.
UNIT = 2.0**-24
#: Round-off of a place after a thousand steps, as a share of the distance.
PLACES = 1000.0 * UNIT
#: Roundings of a velocity or an impulse in one blow: a relative speed of two bodies with their spins (8 operations), a
#: mass (8), an impulse and what it does to both (8); as much again for iterations that correct last digits.
ROUNDINGS = 48
#: Least number of steps between two blows of a body: a step finds a contact late, and the next may still find it.
APART = 4.0
#: Roundings of a position across a plane: one in each of a thousand velocity updates, and five times that for the order
#: of additions, as in the tolerance for doubles.
UPDATES = 5.0 * 1000.0
#: Gap that counts as touching [m], for positions of order 1 in doubles.
TOUCHING = 1e-9

#: Least and largest mass or moment whose square and inverse are single-precision numbers.
SMALLEST, LARGEST = 1e-30, 1e30

#: ``restitution(e, speed)``: the engine's value at an approach of ``speed`` [m/s].
Restitution = Callable[[float, float], float]


def without_a_place(scene: Scene) -> str | None:
    """The first mass or moment of a free body outside single precision, in one line; None if there is none."""
    for body in scene.bodies:
        moments = body.inertia if isinstance(body.inertia, tuple) else (body.inertia,)
        for name, value in (("mass", body.mass), *(("inertia", moment) for moment in moments)):
            if body.motion == "free" and not SMALLEST <= value <= LARGEST:
                return f"{body.name}.{name}: {value:g} cannot be represented in single precision"
    return None


@dataclass(frozen=True)
class Threshold:
    """Restitution above an approach speed [m/s], 0 below; at that speed by ``rebounds_at``."""

    speed: float
    rebounds_at: bool = False

    def __call__(self, e: float, speed: float) -> float:
        """Restitution at an approach of ``speed``."""
        return e if speed > self.speed or (self.rebounds_at and speed == self.speed) else 0.0


@dataclass(frozen=True)
class Method:
    """Properties of an engine's method that affect a blow.

    Parameters
    ----------
    restitution
        Effective value of a pair's coefficient.
    sweeps
        Iterations over simultaneous contacts; 0: no prediction for several at once.
    unit
        Relative round-off of its numbers.
    rebound_after_friction
        Friction is limited by the impulse of compression only: restitution is applied after friction.
    ahead
        Distance from which a step finds a contact [m]: no prediction for a blow that a step misses, so that the next
        finds an overlap.
    """

    restitution: Restitution
    sweeps: int = 0
    unit: float = UNIT
    rebound_after_friction: bool = False
    ahead: float = math.inf


@dataclass
class _Contact:
    a: int
    b: int
    normal: Array
    arms: tuple[Array, Array]
    e: float
    mu: float


def rounded_law(metric: str, method: Method) -> Law:
    """Prediction of ``metric`` for blows without gravity or load; None where a blow is not simple."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        found = _motion(Held(scene), dt, method)
        if found is None:
            return None
        motion, blows = found
        value = measure(scene, motion)[metric][0]
        share = ROUNDINGS * blows * method.unit
        return None if value is None else (value, _band(scene, motion, share, metric, value, measure))

    return law


def late_rebound_law(metric: str, chosen: Callable[[Scene, float], Mapping[str, Any]]) -> Law:
    """`rounded_law` of an engine that applies restitution after friction, from its ``restitution_threshold`` [m/s] on.

    ``chosen`` gives its settings for a scene and a step.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        threshold = Threshold(chosen(scene, dt)["restitution_threshold"], rebounds_at=True)
        return rounded_law(metric, Method(threshold, rebound_after_friction=True))(scene, dt, measure)

    return law


def plane_law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
    """Distance of an embedded 2-D scene from its plane in single precision [m]: 0 by symmetry, except for rounding.

    Mirrored points have coordinates as large as the scene, and each velocity update rounds one to `UNIT` of its size:
    the difference between left and right is a speed across the plane. A thousand updates, and a factor of five for the
    order of additions, give `UPDATES` such units. Amplification by the motion is not included, so a body that tips over
    or is thrown out of its plane needs another cause.
    """
    if scene.dimension != 2:
        return None
    return 0.0, UPDATES * UNIT * size_across(scene)


def _band(scene: Scene, motion: Trajectory, share: float, metric: str, value: float, measure: Measure) -> float:
    """Sum of the effects of roundings of each body's velocities and each pair's impulses on the metric."""
    total = 0.0
    for rounded in _rounded(motion, share):
        other = measure(scene, rounded)[metric][0]
        total += math.inf if other is None else abs(other - value)
    # Positions and times are rounded too, which shifts a blow but changes no velocity; a value itself is rounded once.
    return total + share * (1.0 + abs(value))


def _rounded(motion: Trajectory, share: float) -> Iterator[Trajectory]:
    """The motion with the rounding error of one number: a component of a body's velocity, or the impulses of a pair."""
    size = motion.twist.shape[2]
    linear = motion.dimension
    for body in range(motion.twist.shape[1]):
        speed = np.abs(motion.twist[:, body, :linear]).max()
        spin = np.abs(motion.twist[:, body, linear:]).max()
        for k in range(size):
            off = share * float(speed if k < linear else spin)
            if off > 0.0:
                twist = motion.twist.copy()
                twist[1:, body, k] += off
                yield replace(motion, twist=twist)
    assert motion.contacts is not None
    rows = motion.contacts.rows
    for k in range(rows.impulse.shape[1]):
        impulse = rows.impulse.copy()
        impulse[:, k] += share * np.linalg.norm(rows.impulse, axis=1)
        yield replace(motion, contacts=replace(motion.contacts, rows=replace(rows, impulse=impulse)))


# ---- the motion ------------------------------------------------------------------------------------------------------


class Held:
    """A scene as an argument of a cached function, as scenes are not hashable."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.hash = scene, scene.hash()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Held) and self.hash == other.hash

    def __hash__(self) -> int:
        return hash(self.hash)


@lru_cache(maxsize=64)
def _motion(key: Held, dt: float, method: Method) -> tuple[Trajectory, int] | None:
    """Trajectory of all steps, and the number of blows; None without a prediction."""
    scene = key.scene if key.scene.dimension == 3 else lift(key.scene)
    if any(scene.gravity) or any(any(body.force) or any(body.torque) for body in scene.bodies):
        return None
    flight = _Flight(scene, method)
    last: dict[int, float] = {}
    blows: list[tuple[float, list[tuple[_Contact, Array]]]] = []
    states = [(0.0, flight.x.copy(), flight.v.copy())]
    while (event := flight.next_blow()) is not None and event[0] < scene.duration:
        time, contacts = event
        free = {k for c in contacts for k in (c.a, c.b) if scene.bodies[k].motion == "free"}
        if any(time - last.get(k, -math.inf) < APART * dt for k in free) or len(blows) > 100:
            return None
        late = time - dt * math.floor(time / dt)
        if any(-flight._closing(c) * late > method.ahead for c in contacts):
            return None
        given = flight.strike(time, contacts)
        if given is None:
            return None
        blows.append((time, given))
        last.update(dict.fromkeys(free, time))
        states.append((time, flight.x.copy(), flight.v.copy()))
    if not blows:
        return None
    return _sampled(key.scene, dt, states, blows), len(blows)


def _sampled(
    scene: Scene, dt: float, states: list[tuple[float, Array, Array]], blows: list[tuple[float, list[Any]]]
) -> Trajectory:
    """The motion at every step, with the blows of each step as contacts; rotations stay as at the start."""
    steps = step_count(scene.duration, dt)
    t = np.arange(steps + 1, dtype=np.float64) * dt
    which = np.searchsorted([time for time, _, _ in states], t, side="right") - 1
    times = np.array([states[k][0] for k in which])
    twist = np.array([states[k][2] for k in which])
    start = np.array([body.pose for body in (scene if scene.dimension == 3 else lift(scene)).bodies])
    pose = np.broadcast_to(start, (len(t), *start.shape)).copy()
    pose[:, :, :3] = np.array([states[k][1] for k in which]) + twist[:, :, :3] * (t - times)[:, None, None]
    rows, offset = [], [0]
    for k in range(1, steps + 1):
        rows += [
            (c.a, c.b, np.zeros(3), c.normal, impulse, 0.0)
            for time, given in blows
            if t[k - 1] <= time < t[k]
            for c, impulse in given
        ]
        offset.append(len(rows))
    contacts = Contacts.from_rows(rows, 3)
    if scene.dimension == 2:
        flat = np.array([body.pose for body in scene.bodies])
        contacts, twist = lower_contacts(contacts), np.array([lower_twist(each) for each in twist])
        places = pose[:, :, [0, 2]]
        pose = np.concatenate([places, np.broadcast_to(flat[:, 2:], (*places.shape[:2], 1))], axis=2)
    record = ContactRecord(np.arange(1, steps + 1), np.array(offset, np.int64), contacts)
    return Trajectory(t, pose, twist, record, dt, "completed")


class _Flight:
    """Bodies in straight flight until they touch: balls with anything, and boxes that land flat."""

    def __init__(self, scene: Scene, method: Method) -> None:
        self.scene, self.method, self.time = scene, method, 0.0
        self.x = np.array([body.pose[:3] for body in scene.bodies])
        self.v = np.array([body.twist for body in scene.bodies])
        free = np.array([body.motion == "free" for body in scene.bodies])
        self.lightness = free / np.array([body.mass for body in scene.bodies])
        # Boxes are treated only before they turn, along the world's axes.
        self.mobility = free[:, None] / np.array([np.broadcast_to(body.inertia, 3) for body in scene.bodies])
        self.straight = all(
            body.pose[3:] == (1.0, 0.0, 0.0, 0.0) for body in scene.bodies if isinstance(body.shape, Box)
        )

    def next_blow(self) -> tuple[float, list[_Contact]] | None:
        """Time of the next blow and all contacts at that time; None if there is none."""
        times = {
            (i, j): found
            for i, j in combinations(range(len(self.scene.bodies)), 2)
            if (found := self._meeting(i, j)) is not None
        }
        if not times:
            return None
        meeting = [time for time, c in times.values() if -self._closing(c) > TOUCHING]
        if not meeting:  # touching bodies that do not separate are at relative rest
            return None
        return self.time + min(meeting), [c for time, c in times.values() if time <= min(meeting) + TOUCHING]

    def _meeting(self, i: int, j: int) -> tuple[float, _Contact] | None:
        """Time until two bodies touch [s] and how; also those that touch now and do not separate."""
        a, b = self.scene.bodies[i], self.scene.bodies[j]
        if "free" not in (a.motion, b.motion):
            return None
        if isinstance(b.shape, HalfSpace) or (isinstance(b.shape, Box) and isinstance(a.shape, Sphere)):
            i, j, a, b = j, i, b, a
        relative = self.v[j, :3] - self.v[i, :3]
        between = self.x[j] - self.x[i]
        if isinstance(a.shape, HalfSpace):
            normal = np.array(a.shape.normal)
            reach = b.shape.radius if isinstance(b.shape, Sphere) else self._flat(b.shape, normal)
            gap, base = float(normal @ self.x[j]) - a.shape.offset - reach, -normal * reach
            arms = (np.zeros(3), base if isinstance(b.shape, Sphere) else np.zeros(3))
        elif isinstance(a.shape, Sphere) and isinstance(b.shape, Sphere):
            return self._balls(i, j, between, relative)
        elif isinstance(a.shape, Box) and isinstance(b.shape, Sphere):
            k = int(np.argmax(np.abs(between) - np.array(a.shape.half_extents)))
            normal = np.zeros(3)
            normal[k] = math.copysign(1.0, between[k])
            gap = abs(float(between[k])) - a.shape.half_extents[k] - b.shape.radius
            on_face = between - normal * (b.shape.radius + gap)
            arms = (on_face, -normal * b.shape.radius)
        else:
            return None
        speed = -float(normal @ relative)
        if speed < -TOUCHING or (speed <= TOUCHING and abs(gap) > TOUCHING) or gap < -TOUCHING:
            return None
        material = self.scene.material(a.name, b.name)
        wait = gap / speed if speed > TOUCHING else 0.0
        return max(0.0, wait), _Contact(i, j, normal, arms, material.restitution, material.friction)

    def _flat(self, shape: Shape, normal: Array) -> float:
        assert isinstance(shape, Box)
        return float(np.abs(normal) @ np.array(shape.half_extents))

    def _balls(self, i: int, j: int, between: Array, relative: Array) -> tuple[float, _Contact] | None:
        a, b = (self.scene.bodies[k].shape for k in (i, j))
        assert isinstance(a, Sphere) and isinstance(b, Sphere)
        reach, speed2 = a.radius + b.radius, float(relative @ relative)
        closing = -float(between @ relative)
        gap = float(np.linalg.norm(between)) - reach
        if closing < -TOUCHING * reach or gap < -TOUCHING:
            return None
        wait = 0.0
        if gap > TOUCHING:
            root = closing**2 - speed2 * float(between @ between - reach**2)
            if closing <= TOUCHING * reach or root < 0.0:
                return None
            wait = (closing - math.sqrt(root)) / speed2
        normal = between + wait * relative
        normal /= np.linalg.norm(normal)
        material = self.scene.material(self.scene.bodies[i].name, self.scene.bodies[j].name)
        return wait, _Contact(i, j, normal, (a.radius * normal, -b.radius * normal), *_numbers(material))

    def strike(self, time: float, contacts: list[_Contact]) -> list[tuple[_Contact, Array]] | None:
        """Advance to ``time`` and solve the contacts: impulses on second bodies, or None if not simple."""
        if not self.straight and any(isinstance(self.scene.bodies[c.a].shape, Box) for c in contacts):
            return None
        self.x += (time - self.time) * self.v[:, :3]
        self.time = time
        turned = {k for k, body in enumerate(self.scene.bodies) if isinstance(body.shape, Box) and self.v[k, 3:].any()}
        if any(c.a in turned or c.b in turned for c in contacts):
            return None
        if all(self._alone(c, contacts) for c in contacts):
            return self._swept(contacts, 1)
        if not self.method.sweeps or any(c.mu > 0.0 for c in contacts):
            return None
        before = self.v.copy()
        backwards = self._swept(contacts[::-1], self.method.sweeps)
        other, self.v = self.v, before
        forwards = self._swept(contacts, self.method.sweeps)
        # Not converged to round-off: the result depends on the unknown order of contacts.
        return forwards if np.abs(other - self.v).max() <= self.method.unit and backwards else None

    def _alone(self, c: _Contact, contacts: list[_Contact]) -> bool:
        """Whether no other simultaneous contact has a free body of this one."""
        free = {k for k in (c.a, c.b) if self.lightness[k] > 0.0}
        return all(other is c or not free & {other.a, other.b} for other in contacts)

    def _swept(self, contacts: list[_Contact], sweeps: int) -> list[tuple[_Contact, Array]]:
        """Sequential impulses: normal, then friction, which only balls have."""
        approach = [-self._closing(c) for c in contacts]
        wanted = [
            self.method.restitution(c.e, s) * s if s > 0.0 else 0.0 for c, s in zip(contacts, approach, strict=True)
        ]
        normal = [0.0] * len(contacts)
        for _ in range(sweeps):
            for k, c in enumerate(contacts):
                push = max(0.0, normal[k] + (wanted[k] - self._closing(c)) / self._response(c, c.normal))
                self._push(c, (push - normal[k]) * c.normal)
                normal[k] = push
        given = []
        for k, (c, jn) in enumerate(zip(contacts, normal, strict=True)):
            slip = self._slip(c)
            speed, rub = float(np.linalg.norm(slip)), np.zeros(3)
            if c.mu > 0.0 and speed > 0.0:
                # A contact of a ball: the stopping impulse is the approach over the response.
                stop = max(0.0, approach[k]) / self._response(c, c.normal)
                pressed = stop if self.method.rebound_after_friction else jn
                rub = -slip / speed * min(c.mu * pressed, speed / self._response(c, slip / speed))
                self._push(c, rub)
            given.append((c, jn * c.normal + rub))
        return given

    def _point_speed(self, k: int, arm: Array) -> Array:
        return np.asarray(self.v[k, :3] + np.cross(self.v[k, 3:], arm))

    def _relative(self, c: _Contact) -> Array:
        return self._point_speed(c.b, c.arms[1]) - self._point_speed(c.a, c.arms[0])

    def _closing(self, c: _Contact) -> float:
        return float(self._relative(c) @ c.normal)

    def _slip(self, c: _Contact) -> Array:
        relative = self._relative(c)
        return np.asarray(relative - (relative @ c.normal) * c.normal)

    def _response(self, c: _Contact, axis: Array) -> float:
        total = 0.0
        for k, arm in zip((c.a, c.b), c.arms, strict=True):
            turn = np.cross(arm, axis)
            total += self.lightness[k] + float(turn @ (self.mobility[k] * turn))
        return total

    def _push(self, c: _Contact, impulse: Array) -> None:
        for k, arm, sign in ((c.a, c.arms[0], -1.0), (c.b, c.arms[1], 1.0)):
            self.v[k, :3] += sign * self.lightness[k] * impulse
            self.v[k, 3:] += sign * self.mobility[k] * np.cross(arm, impulse)


def _numbers(material: Pair) -> tuple[float, float]:
    return material.restitution, material.friction
