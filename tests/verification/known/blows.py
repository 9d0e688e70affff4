"""Known motions with rebounds: balls in rooms and on slopes, event by event; clusters that are hit, all at once.

Every blow is solved here: of one ball by its two cases, sticking and slipping; of a cluster by trying all sets of
pairs that are pressed.
"""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Array, Body, Model
from reference_solver.shapes import Disc, HalfSpace, Sphere
from tests.verification.known.motion import Motion, complementary, integrated, spun
from tests.verification.space import GRAVITY, ROUNDNESS

Rng = np.random.Generator

#: Where a rebound is slower than this it is the last [m/s]: all that would come after it go less than its square far,
#: and slower ones are the round-off of the place where they begin. Slip below ROLLS is none, slip above SLIPS lasts.
LAST, ROLLS, SLIPS = 1e-7, 1e-8, 0.3


def turned(vector: Array) -> Array:
    """Return a spin (1,) or (3,) with three numbers, about z in the plane."""
    return vector if len(vector) == 3 else np.array([0.0, 0.0, vector[0]])


def crossed(spin: Array, arm: Array) -> Array:
    """Return spin x arm, (d,)."""
    d = len(arm)
    return np.asarray(np.cross(turned(spin), np.append(arm, [0.0] * (3 - d)))[:d])


def moment(arm: Array, force: Array) -> Array:
    """Return arm x force, (1,) or (3,)."""
    d = len(arm)
    found = np.cross(np.append(arm, [0.0] * (3 - d)), np.append(force, [0.0] * (3 - d)))
    return np.asarray(found if d == 3 else found[2:])


def struck(v: Array, w: Array, normal: Array, radius: float, e: float, mu: float) -> tuple[Array, Array]:
    """Return velocity and spin of a uniform ball after it has hit a plane that looks along ``normal`` (O12).

    ``p_n = (1 + e) |u_n|`` for a mass of one; friction is what stops the slip, ``-u_t k/(1 + k)``, or all of mu p_n.
    """
    k = ROUNDNESS[len(v)]
    approach = float(v @ normal)
    slip = v - approach * normal - radius * crossed(w, normal)
    pressed = -(1.0 + e) * approach
    rub = -slip * k / (1.0 + k)
    size = float(np.linalg.norm(rub))
    if size > mu * pressed:
        rub *= mu * pressed / size
    return v + pressed * normal + rub, w + moment(-radius * normal, rub) / (k * radius**2)


class Flight:
    """A ball of mass 1 among planes: it flies, hits one plane after another, and comes to rest on one of them."""

    def __init__(self, planes: Array, radius: float, gravity: Array, e: float, mu: float) -> None:
        self.planes, self.radius, self.gravity, self.e, self.mu = planes, radius, gravity, e, mu

    def goes(self, x: Array, v: Array, w: Array, q: Array, time: float) -> tuple[Array, Array, int] | None:
        """Return place and orientation after ``time`` [s] and how many blows there were; None where it is no truth.

        None where blows on two planes nearly coincide, or where it comes to rest on a plane and does not simply slide
        or roll on from there.
        """
        d, blows = len(x), 0
        while True:
            falls = [self._next(x, v, n, at) for n, at in zip(self.planes[:, :d], self.planes[:, d], strict=True)]
            first = int(np.argmin(falls))
            rest = sorted(falls)[1] if len(falls) > 1 else math.inf
            if min(falls) < time and rest - falls[first] < 1e-6:
                return None
            t = min(falls[first], time)
            x, v, q = x + t * v + 0.5 * t * t * self.gravity, v + t * self.gravity, self._turned(q, w, t)
            time -= t
            if time <= 0.0:
                return x, q, blows
            n = self.planes[first, :d]
            x = x + (self.planes[first, d] + self.radius - n @ x) * n
            # The last one takes the momentum of all that would follow (E22): friction acts on no more than that.
            lasts = -self.e * float(v @ n) >= LAST
            v, w = struck(v, w, n, self.radius, self.e if lasts else 0.0, self.mu)
            blows += 1
            if not lasts:
                end = self._lies(x, v - (v @ n) * n, w, q, n, time)
                return None if end is None else (*end, blows)

    def _next(self, x: Array, v: Array, n: Array, at: float) -> float:
        gap, rate, bend = max(float(n @ x) - at - self.radius, 0.0), float(n @ v), float(n @ self.gravity)
        # The fall through zero, without a difference of nearly equal numbers (O3).
        under = rate * rate - 2.0 * bend * gap
        if under < 0.0:
            return math.inf
        root = math.sqrt(under)
        if rate < 0.0:
            return max(2.0 * gap / (root - rate), 0.0)
        return (rate + root) / -bend if bend < 0.0 else math.inf

    def _turned(self, q: Array, w: Array, t: float) -> Array:
        if len(w) == 1:
            return q + w * t
        size = float(np.linalg.norm(w))
        axis, half = w / (size or 1.0), 0.5 * size * t
        s, v = math.cos(half), math.sin(half) * axis
        return np.array([s * q[0] - v @ q[1:], *(s * q[1:] + q[0] * v + np.cross(v, q[1:]))])

    def _lies(self, x: Array, v: Array, w: Array, q: Array, n: Array, time: float) -> tuple[Array, Array] | None:
        """It slides on, its friction against the slip, or it rolls: the slip must not end meanwhile."""
        d, r, k = len(x), self.radius, ROUNDNESS[len(x)]
        load = -float(n @ self.gravity)
        along = self.gravity + load * n
        slip = v - r * crossed(w, n)
        rolls = float(np.linalg.norm(slip)) < ROLLS
        if load <= 0.0 or (rolls and np.linalg.norm(along) * k / (1.0 + k) > 0.9 * self.mu * load and self.mu > 0.0):
            return None

        def rub(state: Array) -> Array:
            if self.mu == 0.0:
                return np.zeros(d)
            if rolls:
                return -along * k / (1.0 + k)
            slip = state[-2 * d : -d] - r * crossed(state[len(q) : -2 * d], n)
            return -self.mu * load * slip / float(np.linalg.norm(slip))

        def rate(state: Array) -> Array:
            w, force = state[len(q) : -2 * d], rub(state)
            turns = w if d == 2 else spun(state[:4], w)
            return np.concatenate([turns, moment(-r * n, force) / (k * r * r), along + force, state[-2 * d : -d]])

        def lasts(state: Array) -> float:
            if self.mu == 0.0 or rolls:
                return 1.0
            return float(np.linalg.norm(state[-2 * d : -d] - r * crossed(state[len(q) : -2 * d], n))) - SLIPS

        start = np.concatenate([q, w, v, x])
        if lasts(start) <= 0.0:
            return None
        end, left = integrated(rate, start, time, lasts)
        clear = [p[:d] @ end[-d:] - p[d] - r for p in self.planes if not np.array_equal(p[:d], n)]
        if left > 0.0 or min(clear, default=1.0) < 0.01:
            return None
        return end[-d:], end[: len(q)]


def _ball(d: int, radius: float, mass: float, x: Array, v: Array, w: Array) -> Body:
    size = ROUNDNESS[d] * mass * radius**2
    upright = (0.0,) if d == 2 else (1.0, 0.0, 0.0, 0.0)
    return Body(
        Disc(radius) if d == 2 else Sphere(radius),
        mass,
        size if d == 2 else (size,) * 3,
        (*x, *upright),
        (*v, *w),
    )


def _fixed(plane: Array) -> Body:
    d = len(plane) - 1
    pose = (0.0,) * 3 if d == 2 else (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    return Body(HalfSpace(tuple(float(c) for c in plane[:d]), float(plane[d])), pose=pose, motion="fixed")


def _lasting(d: int, rng: Rng, planes: Array, gravity: Array, e: float, mu: float, least: int) -> Motion | None:
    radius = float(rng.uniform(0.1, 0.3))
    v, w = rng.uniform(-3.0, 3.0, d), rng.uniform(-20.0, 20.0, 1 if d == 2 else 3)
    x = rng.uniform(-0.3, 0.3, d)
    if (planes[:, :d] @ x - planes[:, d] - radius).min() < 0.01:
        return None
    q, time = np.array([0.0] if d == 2 else [1.0, 0.0, 0.0, 0.0]), float(rng.uniform(0.6, 1.2))
    found = Flight(planes, radius, gravity, e, mu).goes(x, v, w, q, time)
    if found is None or found[2] < least:
        return None
    bodies = [*(_fixed(plane) for plane in planes), _ball(d, radius, 10.0 ** rng.uniform(-6.0, 6.0), x, v, w)]
    return Motion(Model(d, bodies, tuple(gravity), e, mu), time, np.concatenate([found[0], found[1]]))


def in_a_room(d: int, rng: Rng) -> Motion:
    """Return a ball that flies about between walls, floor and ceiling, with friction and spin: blow after blow."""
    while True:
        normals = np.concatenate([np.eye(d), -np.eye(d)]) + 0.2 * rng.normal(size=(2 * d, d))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        planes = np.column_stack([normals, -rng.uniform(0.4, 0.8, 2 * d)])
        gravity = np.array([*np.zeros(d - 1), -float(rng.choice([0.0, GRAVITY]))])
        found = _lasting(d, rng, planes, gravity, float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.0, 1.0)), 4)
        if found is not None:
            return found


def down_a_slope(d: int, rng: Rng) -> Motion:
    """Return a ball whose rebounds on a slope come to their end (O16), and which slides or rolls on from there."""
    while True:
        normal = np.array([*rng.uniform(-0.4, 0.4, d - 1), 1.0])
        plane = np.array([[*(normal / np.linalg.norm(normal)), -0.6]])
        mu = float(rng.choice([0.0, rng.uniform(0.05, 0.2), rng.uniform(0.5, 1.0)]))
        found = _lasting(d, rng, plane, np.array([*np.zeros(d - 1), -GRAVITY]), float(rng.uniform(0.05, 0.6)), mu, 8)
        if found is not None:
            return found


def struck_cluster(d: int, rng: Rng) -> Motion:
    """Return balls that touch, in a row or anyhow, one of which another hits: all pairs at once (E21), then flight.

    ``u+ = W p + u-``, ``0 <= p`` against ``u+ + e u- >= 0`` over all pairs that touch. Masses over six decades.
    """
    while True:
        count, e = int(rng.integers(2, 5)), rng.uniform(0.0, 1.0)
        radii, masses = rng.uniform(0.1, 0.3, count + 1), 10.0 ** rng.uniform(-3.0, 3.0, count + 1)
        places, straight = [np.zeros(d)], rng.uniform() < 0.4
        way = rng.normal(size=d)
        for i in range(1, count + 1):
            to = int(rng.integers(i)) if not straight else i - 1
            way = rng.normal(size=d) if not straight else way
            places.append(places[to] + (radii[to] + radii[i]) * way / np.linalg.norm(way))
        x = np.array(places)
        pairs = [(i, j) for i in range(count + 1) for j in range(i + 1, count + 1)]
        gaps = np.array([np.linalg.norm(x[j] - x[i]) - radii[i] - radii[j] for i, j in pairs])
        touching = [pair for pair, gap in zip(pairs, gaps, strict=True) if abs(gap) < 1e-9]
        if len(touching) != count or gaps.min() < -1e-9:
            continue
        v = np.zeros((count + 1, d))
        v[count] = rng.uniform(1.0, 4.0) * (x[next(a for a, b in touching if b == count)] - x[count])
        v[count] += 0.3 * rng.normal(size=d)
        normals = np.array([(x[j] - x[i]) / np.linalg.norm(x[j] - x[i]) for i, j in touching])
        rows = np.zeros((count, (count + 1) * d))
        for row, (i, j), n in zip(rows, touching, normals, strict=True):
            row[i * d : (i + 1) * d], row[j * d : (j + 1) * d] = -n, n
        inverse = np.repeat(1.0 / masses, d)
        u = rows @ v.ravel()
        if u[-1] > -0.3:
            continue
        size = np.sqrt(np.diag((rows * inverse) @ rows.T))  # one number for all masses
        scaled = (rows * inverse) @ rows.T / np.outer(size, size)
        try:
            p = complementary(scaled, (u + e * np.minimum(u, 0.0)) / size) / size
        except ValueError:  # beyond what can be solved here: a chain of very light ones between heavy ones
            continue
        after = v + (inverse * (rows.T @ p)).reshape(v.shape)
        ahead, time = float(rng.uniform(0.02, 0.1)), 0.0
        time = ahead + float(rng.uniform(0.05, 0.15))
        # Nothing is met on the way there, nor afterwards.
        met = False
        for t in np.linspace(0.0, 1.0, 21)[1:]:
            for i, j in pairs:
                to, fro = (
                    x[j] - x[i] - t * ahead * (v[j] - v[i]),
                    x[j] - x[i] + t * (time - ahead) * (after[j] - after[i]),
                )
                least = 0.0 if (i, j) not in touching else -1e-9
                met |= (np.linalg.norm(to) - radii[i] - radii[j] < least) or (
                    np.linalg.norm(fro) - radii[i] - radii[j] < least
                )
        if not met:
            break
    start, end = x - ahead * v, x + (time - ahead) * after
    still = np.zeros(1 if d == 2 else 3)
    bodies = [_ball(d, r, m, at, speed, still) for r, m, at, speed in zip(radii, masses, start, v, strict=True)]
    upright = [0.0] if d == 2 else [1.0, 0.0, 0.0, 0.0]
    truth = np.array([[*at, *upright] for at in end])
    return Motion(Model(d, bodies, (0.0,) * d, e, 0.0), time, truth)
