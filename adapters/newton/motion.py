"""Bodies among fixed planes, step by step as Newton's XPBD makes them: the recurrence behind its laws.

    v += dt g,  x += dt v;  then sweeps, in each of which every contact that is d < 0 deep asks for

        along the normal    l = r (-d)/(dt K)                     r the relaxation, 1/K the mass that the contact feels
        across it           min(r |slip|/(dt K'), mu l)           slip of its two points since the step began
        about the normal    min(r |w_n|/K'', mu_t l),  and against rolling  min(r |w_t|/K''', mu_r l)

    and a body gets the mean of them, in velocity and place alike; what is slower than 0.1 mm/s is stopped.

Rebounds come last, for contacts that were found deep: those that approached at more than 2 g dt are given e times their
approach, 8 sweeps over the contacts of a pair, twice, of which a body gets the mean over its pairs. Contacts are found
where the step begins, of corners and planes or of two balls that are nearer than twice the gap, and keep their normals.
[xpbd/kernels.py and restitution_kernels.py of newton 1.8.0]

Nothing here is Newton's own code: it is what its formulas make of a scene, in doubles and in singles. The difference of
these two is what the band of a law is made of.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from adapters.engine import Contacts as EngineContacts
from adapters.law import Law, Measure, Prediction
from adapters.lift import lift, lower_contacts, lower_pose, lower_twist
from adapters.means import means
from adapters.needs import needs
from adapters.newton.profiles import PROFILES
from adapters.newton.shipped import LEAST_APPROACH, STOPPED
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Trajectory

#: Sweeps over the contacts of one pair in each sweep over rebounds. [_restitution_manifold_inner_iterations]
INNER = 8
#: How many times the difference between doubles and singles a metric may be off. The engine's order of the same
#: operations is another draw of the same roundings; of two draws the larger is below a fifth of their scatter once in
#: forty, and 32 times that are six scatters.
ROUNDINGS = 32.0
#: Starts from which singles are asked, as shares of places: each has other roundings, of an overlap over dt first.
STARTS = (0.0, 3.0 * 2.0**-23)
#: Share of a value beyond which a band says nothing about it.
VAGUE = 0.02
#: Most bodies, and sweeps over all steps, that are followed: what is judged is judged in seconds.
MOST_BODIES, MOST_SWEEPS = 12, 6000

Numbers = np.ndarray[Any, np.dtype[Any]]


def cross(a: Numbers, b: Numbers) -> Numbers:
    """Vector products row by row."""
    ax, ay, az = a.T
    bx, by, bz = b.T
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]).T


def dot(a: Numbers, b: Numbers) -> Numbers:
    """Scalar products row by row."""
    return np.asarray((a * b).sum(axis=1))


def turns(q: Numbers) -> Numbers:
    """Rotations (n, 3, 3) from bodies to the world, of quaternions (n, 4: w, x, y, z)."""
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def out(turn: Numbers, v: Numbers) -> Numbers:
    """Vectors (n, 3) of bodies in the world."""
    return np.asarray((turn * v[:, None, :]).sum(axis=2))


def into(turn: Numbers, v: Numbers) -> Numbers:
    """Vectors (n, 3) of the world in bodies."""
    return np.asarray((turn * v[:, :, None]).sum(axis=1))


@dataclass
class Contacts:
    """Contacts of a step: from body ``a`` to ``b``; points and arms in body axes, the last body is the world."""

    a: Numbers
    b: Numbers
    normal: Numbers
    #: Points between which overlaps are told, and arms of the surfaces' points between which slips are.
    points: tuple[Numbers, Numbers]
    arms: tuple[Numbers, Numbers]
    thick: Numbers
    friction: Numbers
    restitution: Numbers

    def of(self, chosen: Numbers) -> Contacts:
        """Some of them."""
        return Contacts(
            self.a[chosen], self.b[chosen], self.normal[chosen], (self.points[0][chosen], self.points[1][chosen]),
            (self.arms[0][chosen], self.arms[1][chosen]), self.thick[chosen], self.friction[chosen],
            self.restitution[chosen],
        )  # fmt: skip


class Motion:
    """Free balls and boxes among fixed half-spaces, their state and steps; the last row of an array is the world."""

    def __init__(
        self, scene: Scene, dt: float, chosen: Mapping[str, Any], kind: type[np.floating[Any]], off: float
    ) -> None:
        self.chosen, self.kind, self.scene = chosen, kind, scene
        self.dt = kind(dt)
        self.free = [k for k, body in enumerate(scene.bodies) if body.motion == "free"]
        self.planes = [k for k, body in enumerate(scene.bodies) if body.motion != "free"]
        self.gravity = np.array(scene.gravity, kind)
        self.pull = kind(np.linalg.norm(scene.gravity))
        bodies = [scene.bodies[k] for k in self.free]

        def rows(of: Callable[[Body], Any], last: Any) -> Numbers:
            return np.array([*(of(body) for body in bodies), last], kind)

        self.lightness = rows(lambda body: 1.0 / body.mass, 0.0)
        self.inertia = rows(lambda body: tuple(np.broadcast_to(body.inertia, 3)), (1.0,) * 3)
        self.softness = rows(lambda body: tuple(1.0 / np.broadcast_to(body.inertia, 3)), (0.0,) * 3)
        self.force, self.torque = rows(lambda body: body.force, (0.0,) * 3), rows(lambda body: body.torque, (0.0,) * 3)
        self.x = rows(lambda body: body.pose[:3], (0.0,) * 3)
        self.q = rows(lambda body: body.pose[3:], (1.0, 0.0, 0.0, 0.0))
        self.x = self.x * kind(1.0 + off)
        self.v, self.w = rows(lambda body: body.twist[:3], (0.0,) * 3), rows(lambda body: body.twist[3:], (0.0,) * 3)
        self.corners = [_corners(body).astype(kind) for body in bodies]
        self.radii = [body.shape.radius if isinstance(body.shape, Sphere) else 0.0 for body in bodies]
        self.reach = kind(2.0 * chosen["gap"])

    def step(self) -> None:
        """One step of the solver."""
        kind, turn = self.kind, turns(self.q)
        self.told: dict[tuple[int, int], Numbers] = {}
        touching = self._found(turn)
        moving = (self.lightness > 0)[:, None]
        spin = into(turn, self.w)
        self.v = self.v + self.dt * (self.force * self.lightness[:, None] + self.gravity * moving)
        self.x = self.x + self.dt * self.v
        pull = into(turn, self.torque) - cross(spin, self.inertia * spin)
        self.w = out(turn, spin + pull * self.softness * self.dt)
        self._rotate(self.w)
        before = (turns(self.q), self.v, self.w)
        deep = np.zeros(len(touching.a), bool)
        idle = 0
        for _ in range(self.chosen["iterations"] if len(touching.a) else 0):
            found = self._sweep(touching)
            deep |= found
            idle = 0 if found.any() else idle + 1
            if idle == 2:  # nothing that a sweep looks at has changed
                break
        self._stop()
        if self.chosen["rebounds"] and deep.any():
            self._rebound(before, touching.of(deep))
        assert self.x.dtype == kind == self.w.dtype

    def _found(self, turn: Numbers) -> Contacts:
        """Contacts where the step begins."""
        rows: list[tuple[Any, ...]] = []
        world = len(self.free)
        zero = np.zeros(3, self.kind)
        for i, k in enumerate(self.free):
            for j in self.planes:
                shape = self.scene.bodies[j].shape
                assert isinstance(shape, HalfSpace)
                normal, pair = np.array(shape.normal, self.kind), self.scene.material(*self._names(k, j))
                for corner in self.corners[i]:
                    place = self.x[i] + turn[i] @ corner
                    height = place @ normal - self.kind(shape.offset)
                    if height - self.kind(self.radii[i]) < self.reach:
                        foot = place - height * normal
                        arm = corner if not self.radii[i] else -self.kind(self.radii[i]) * (turn[i].T @ normal)
                        rows.append((world, i, normal, foot, corner, foot, arm, self.radii[i], pair))
            for i2 in range(i + 1, world):
                between = self.x[i2] - self.x[i]
                far = np.sqrt(between @ between)
                thick = self.radii[i] + self.radii[i2]
                if self.radii[i] and self.radii[i2] and far - self.kind(thick) < self.reach:
                    normal, pair = between / far, self.scene.material(*self._names(k, self.free[i2]))
                    ends = (
                        self.kind(self.radii[i]) * (turn[i].T @ normal),
                        self.kind(-self.radii[i2]) * (turn[i2].T @ normal),
                    )
                    rows.append((i, i2, normal, zero, zero, *ends, thick, pair))
        if not rows:
            none = np.zeros((0, 3), self.kind)
            index, flat = np.zeros(0, int), np.zeros(0, self.kind)
            return Contacts(index, index, none, (none, none), (none, none), flat, flat, flat)
        a, b, normals, p, q, r, s, thicks, pairs = zip(*rows, strict=True)

        def some(values: Any) -> Numbers:
            return np.array(values, self.kind)

        return Contacts(
            np.array(a), np.array(b), some(normals), (some(p), some(q)), (some(r), some(s)), some(thicks),
            some([pair.friction for pair in pairs]), some([pair.restitution for pair in pairs]),
        )  # fmt: skip

    def _names(self, i: int, j: int) -> tuple[str, str]:
        return self.scene.bodies[i].name, self.scene.bodies[j].name

    def _rotate(self, spin: Numbers) -> None:
        """Turn by ``dt spin``, to first order."""
        w, x, y, z = self.q.T
        a, b, c = (self.kind(0.5) * self.dt * spin).T
        change = [-a * x - b * y - c * z, a * w + b * z - c * y, b * w + c * x - a * z, c * w + a * y - b * x]
        q = self.q + np.array(change).T
        self.q = q / np.sqrt(dot(q, q))[:, None]

    def _felt(self, turn: Numbers, a: Numbers, b: Numbers, levers: tuple[Numbers, Numbers], linear: bool) -> Numbers:
        """K: what an impulse of 1 does to the velocity that it acts on, by its levers about two bodies."""
        total = self.lightness[a] + self.lightness[b] if linear else self.kind(0.0)
        for body, lever in zip((a, b), levers, strict=True):
            own = into(turn[body], lever)
            total = total + dot(own, own * self.softness[body])
        return np.asarray(total)

    def _sweep(self, all_of_them: Contacts) -> Numbers:
        """One sweep over all contacts; which of them overlapped."""
        turn, chosen = turns(self.q), self.chosen
        share = self.kind(chosen["relaxation"]) / self.dt
        a, b = all_of_them.a, all_of_them.b
        ends = [self.x[k] + out(turn[k], p) for k, p in zip((a, b), all_of_them.points, strict=True)]
        depth = dot(all_of_them.normal, ends[1] - ends[0]) - all_of_them.thick
        deep = depth < 0
        linear, angular = np.zeros_like(self.x), np.zeros_like(self.x)
        count = np.zeros(len(self.x), self.kind)
        if deep.any():
            held, depth = all_of_them.of(deep), depth[deep]
            a, b, normal = held.a, held.b, held.normal
            levers = (-cross(ends[0][deep] - self.x[a], normal), cross(ends[1][deep] - self.x[b], normal))
            press = -depth * share / self._felt(turn, a, b, levers, True)
            push, twist = press[:, None] * normal, [press[:, None] * lever for lever in levers]
            if (held.friction > 0).any():
                arms = [out(turn[k], arm) for k, arm in zip((a, b), held.arms, strict=True)]
                slip = self.x[b] + arms[1] - self.x[a] - arms[0]
                slip = slip - dot(slip, normal)[:, None] * normal
                size, across = _sized(slip)
                levers = (-cross(arms[0], across), cross(arms[1], across))
                felt = self._felt(turn, a, b, levers, True)
                grip = -np.minimum(size * share / felt, held.friction * press)[:, None]
                push = push + grip * across
                twist = [each + grip * lever for each, lever in zip(twist, levers, strict=True)]
                spin = self.w[b] - self.w[a]
                about = dot(spin, normal)
                speed, axis = _sized(spin - about[:, None] * normal)
                rough = held.friction > 0
                for turning, along, arm in (
                    (about, normal, chosen["torsional"]), (speed, axis, chosen["rolling"])
                ):  # fmt: skip
                    most = press * self.kind(arm) * rough
                    felt = self._felt(turn, a, b, (along, along), False)
                    felt = np.where(felt > 0, felt, 1)  # nothing turns
                    resisted = np.clip(self.kind(chosen["relaxation"]) * turning / felt, -most, most)[:, None] * along
                    twist = [twist[0] + resisted, twist[1] - resisted]
            for k in range(len(a)):
                for body, sign, part in ((a[k], -1, twist[0][k]), (b[k], 1, twist[1][k])):
                    linear[body] += sign * push[k]
                    angular[body] += part
                    count[body] += 1
            for k in range(len(a)):
                # Told is what a body gets, the mean of its contacts; between two, by the mean number.
                many = [count[body] for body in (a[k], b[k]) if self.lightness[body] > 0]
                each = push[k] * (self.kind(len(many)) / sum(many) if chosen["weighted"] else self.kind(1))
                pair = (int(a[k]), int(b[k]))
                self.told[pair] = self.told.get(pair, np.zeros(3, self.kind)) + each
        self._take(turn, linear, angular, np.maximum(count, 1) if chosen["weighted"] else np.ones_like(count))
        return np.asarray(deep)

    def _take(self, turn: Numbers, linear: Numbers, angular: Numbers, count: Numbers) -> None:
        """Change velocities and places by the mean of what contacts ask for, and stop what is slow."""
        change = linear * (self.lightness / count)[:, None]
        self.x, self.v = self.x + self.dt * change, self.v + change
        spin, gained = into(turn, self.w), into(turn, angular / count[:, None]) * self.softness
        gyro = cross(gained, self.inertia * (spin + gained)) + cross(spin, self.inertia * gained)
        turned = out(turn, gained - self.dt * gyro * self.softness)
        self._rotate(turned)
        self.w = self.w + turned
        self._stop()

    def _stop(self) -> None:
        """What is slow stands still."""
        least = self.kind(STOPPED * STOPPED)
        self.v = self.v * (dot(self.v, self.v) >= least)[:, None]
        self.w = self.w * (dot(self.w, self.w) >= least)[:, None]

    def _rebound(self, before: tuple[Numbers, Numbers, Numbers], held: Contacts) -> None:
        """Speeds at which contacts part, by how they came before the sweeps; pair by pair."""
        turn, old_v, old_w = before
        least = self.kind(LEAST_APPROACH) * self.pull * self.dt
        a, b, normal = held.a, held.b, held.normal
        levers = [cross(out(turn[k], arm), normal) for k, arm in zip((a, b), held.arms, strict=True)]
        came = dot(normal, old_v[b] - old_v[a]) + dot(levers[1], old_w[b]) - dot(levers[0], old_w[a])
        target = np.where(came < -least, -held.restitution * came, np.where(came > least, came, self.kind(0.0)))
        felt = self._felt(turn, a, b, (levers[0], levers[1]), True)
        soft = [out(turn[k], into(turn[k], lever) * self.softness[k]) for k, lever in zip((a, b), levers, strict=True)]
        pairs = sorted(set(zip(a.tolist(), b.tolist(), strict=True)))
        for outer in range(self.chosen["rebound_iterations"]):
            gained_v, gained_w = np.zeros_like(self.v), np.zeros_like(self.w)
            fired = np.zeros(len(self.x), self.kind)
            for i, j in pairs:
                rows = [int(k) for k in np.flatnonzero((a == i) & (b == j))]
                v, w = {i: self.v[i], j: self.v[j]}, {i: self.w[i], j: self.w[j]}

                def parts(k: int, v: Any = v, w: Any = w, i: int = i, j: int = j) -> Any:
                    return normal[k] @ (v[j] - v[i]) + levers[1][k] @ w[j] - levers[0][k] @ w[i]

                bound = {k: min((target[k] - parts(k)) / felt[k], 0.0) if outer == 0 else 0.0 for k in rows}
                total = dict.fromkeys(rows, self.kind(0.0))
                acted = False
                for _ in range(INNER):
                    for k in rows:
                        speed = parts(k)
                        if target[k] == 0 and abs(speed) <= least:
                            continue
                        new = max(total[k] + (target[k] - speed) / felt[k], bound[k])
                        change, total[k] = new - total[k], new
                        acted = acted or change != 0
                        v[i], w[i] = v[i] - change * self.lightness[i] * normal[k], w[i] - change * soft[0][k]
                        v[j], w[j] = v[j] + change * self.lightness[j] * normal[k], w[j] + change * soft[1][k]
                if acted:
                    for body in (i, j):
                        gained_v[body] += v[body] - self.v[body]
                        gained_w[body] += w[body] - self.w[body]
                        fired[body] += 1
            each = np.maximum(fired, 1)[:, None]
            self.v, self.w = self.v + gained_v / each, self.w + gained_w / each


def _sized(rows: Numbers) -> tuple[Numbers, Numbers]:
    """Lengths of vectors and their directions; of nothing nothing."""
    size = np.sqrt(dot(rows, rows))
    return size, rows / np.where(size > 0, size, 1)[:, None]


def _corners(body: Body) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Corners of a box in its axes [m]; a ball's centre."""
    if isinstance(body.shape, Box):
        return np.array(list(product(*((-half, half) for half in body.shape.half_extents))))
    return np.zeros((1, 3))


def followed(scene: Scene) -> bool:
    """Whether the recurrence speaks about a spatial scene: fixed half-spaces, and balls or one box that move freely."""
    free = [body for body in scene.bodies if body.motion == "free"]
    rest = [body for body in scene.bodies if body.motion != "free"]
    balls = all(isinstance(body.shape, Sphere) for body in free)
    box = len(free) == 1 and isinstance(free[0].shape, Box)
    flat = all(
        body.motion == "fixed" and isinstance(body.shape, HalfSpace) and not any(body.surface_velocity)
        for body in rest
    )  # fmt: skip
    told = means(scene, "restitution") is not None and means(scene, "friction") is not None
    return 0 < len(free) <= MOST_BODIES and (balls or box) and flat and told


class _Key:
    """A scene as an argument of a cached function: scenes hold a dictionary and have no hash of their own."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.told = scene, repr(scene)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self.told == other.told

    def __hash__(self) -> int:
        return hash(self.told)


@lru_cache(maxsize=512)  # a tenth of a megabyte each: rows of a cell need not follow each other
def _moved(key: _Key, dt: float, profile: str, single: bool, off: float) -> Trajectory | None:
    scene = key.scene
    spatial = scene if scene.dimension == 3 else lift(scene)
    steps = step_count(scene.duration, dt)
    chosen = {setting.name: setting.value for setting in PROFILES[profile](needs(scene), dt)}
    # Balls settle within a sweep or two, or are not in contact: of boxes every sweep counts.
    boxes = any(isinstance(body.shape, Box) for body in spatial.bodies)
    if not followed(spatial) or steps * (chosen["iterations"] if boxes else 2) > MOST_SWEEPS:
        return None
    motion = Motion(spatial, dt, chosen, np.float32 if single else np.float64, off)
    pose = np.repeat(np.array([[each.pose for each in spatial.bodies]], float), steps + 1, axis=0)
    twist = np.repeat(np.array([[each.twist for each in spatial.bodies]], float), steps + 1, axis=0)
    rows: list[list[tuple[int, int, Any, Any, Any, float]]] = []
    numbers, floor = [*motion.free, motion.planes[0] if motion.planes else -1], np.zeros(3)
    for k in range(1, steps + 1):
        motion.step()
        unknown = np.nan if chosen["rebounds"] else 1.0
        rows.append(
            [(numbers[a], numbers[b], floor, floor, unknown * push, 0.0) for (a, b), push in motion.told.items()]
        )
        pose[k, motion.free] = np.hstack([motion.x, motion.q])[:-1]
        twist[k, motion.free] = np.hstack([motion.v, motion.w])[:-1]
    told = None
    if len(motion.planes) <= 1:  # whose impulse it is, is clear
        offset = np.cumsum([0, *(len(each) for each in rows)]).astype(np.int64)
        held = EngineContacts.from_rows([row for each in rows for row in each], 3)
        held = lower_contacts(held) if scene.dimension == 2 else held
        told = ContactRecord(np.arange(1, steps + 1, dtype=np.int64), offset, held)
    if scene.dimension == 2:
        pose = np.array([lower_pose(each)[0] for each in pose])
        twist = np.array([lower_twist(each)[0] for each in twist])
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, told, dt, "completed")


def moved(scene: Scene, dt: float, profile: str, single: bool = False, off: float = 0.0) -> Trajectory | None:
    """The motion of a scene, every step, in doubles or singles; None for a scene that is not `followed`.

    ``off``: share of their places by which bodies start elsewhere.
    """
    return _moved(_Key(scene), dt, profile, single, off)


def motion_law(metric: str, profile: str) -> Law:
    """What the recurrence makes of ``metric``; nothing where single numbers make too much of a difference."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        exact = moved(scene, dt, profile)
        if exact is None:
            return None
        value = measure(scene, exact)[metric][0]
        if value is None:
            return None
        apart = 2.0**-24 * abs(value)
        for off in STARTS:
            rounded = moved(scene, dt, profile, True, off)
            other = None if rounded is None else measure(scene, rounded)[metric][0]
            if other is None:
                return None
            apart = max(apart, abs(value - other))
        band = ROUNDINGS * apart
        return (value, band) if 0.0 < band <= VAGUE * abs(value) else None

    return law
