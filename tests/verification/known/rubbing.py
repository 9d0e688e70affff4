"""Known motions of what rubs: boxes that spin on their bases, slabs on slabs, rods that slide down in a V."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from reference_solver.model import Array, Body, Model
from reference_solver.shapes import Box, Capsule, HalfSpace
from tests.verification.known.motion import Motion, integrated
from tests.verification.known.planar import plane
from tests.verification.space import GRAVITY, Space

Rng = np.random.Generator

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def _slab(a: float, b: float, h: float, mass: float, z: float, turn: float, twist: tuple[float, ...]) -> Body:
    moments = tuple(mass / 3.0 * x for x in (b * b + h * h, a * a + h * h, a * a + b * b))
    q = (math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn))
    return Body(Box((a, b, h)), mass, moments, (0.0, 0.0, z, *q), twist)


def spinning_boxes(count: int, rng: Rng) -> Motion:
    """Return a box that spins on a floor about its upright axis, and of two a smaller one that spins on it."""
    while True:
        sizes = [(rng.uniform(0.3, 0.5), rng.uniform(0.3, 0.5), rng.uniform(0.05, 0.15))]
        sizes.append((rng.uniform(0.08, 0.2), rng.uniform(0.08, 0.2), rng.uniform(0.05, 0.15)))
        if count == 2 and math.hypot(*sizes[1][:2]) > 0.9 * min(sizes[0][:2]):
            continue
        masses, mus, w = 10.0 ** rng.uniform(-2.0, 2.0, count), rng.uniform(0.05, 0.6, count), rng.uniform(-8, 8, count)
        found = spun_down(sizes[:count], masses, mus, w, rng.uniform(-1.5, 1.5, count), float(rng.uniform(0.3, 0.8)))
        if found is not None:
            return found


def spun_down(
    sizes: list[tuple[float, float, float]], masses: Array, mus: Array, w: Array, starts: Array, time: float
) -> Motion | None:
    """Return boxes of half extents ``sizes`` on each other, turned by ``starts`` [rad] and spinning with w [rad/s].

    Corners are all as far off, R, and opposite ones push opposite ways, so that ``I w' = -mu m g R`` however they share
    the weight; an upper box is turned on, and turns the lower one back, by ``mu' m' g R'`` until both turn alike. None
    as `layers`.
    """
    count = len(sizes)
    moments = [m * (a * a + b * b) / 3.0 for m, (a, b, _) in zip(masses, sizes, strict=True)]
    limits = [mus[k] * masses[k:].sum() * GRAVITY * math.hypot(*sizes[k][:2]) for k in range(count)]
    turns = layers(moments, limits, list(w), time)
    if turns is None:
        return None
    z, bodies, truth = 0.0, [], []
    for k, (a, b, h) in enumerate(sizes):
        bodies.append(_slab(a, b, h, masses[k], z + h, starts[k], (0.0,) * 5 + (w[k],)))
        half = 0.5 * (starts[k] + turns[k])
        truth.append([0.0, 0.0, z + h, math.cos(half), 0.0, 0.0, math.sin(half)])
        z += 2.0 * h
    return Motion(_stacked(3, bodies, mus), time, np.array(truth))


def slabs(space: Space, rng: Rng) -> Motion:
    """Return slabs on a floor that slide on each other, with masses over six decades, until they stop or go along.

    Between two of them ``mu W`` against the slip, W the weight above; those that do not slip keep together while that
    suffices.
    """
    while True:
        count = int(rng.integers(2, 4))
        masses, mus = 10.0 ** rng.uniform(-3.0, 3.0, count), rng.uniform(0.02, 0.5, count)
        v = rng.uniform(-2.0, 2.0, count)
        if rng.uniform() < 0.5:
            v[: int(rng.integers(count))] = 0.0
        limits = [mus[k] * masses[k:].sum() * GRAVITY for k in range(count)]
        time = float(rng.uniform(0.2, 0.5))
        found = layers(list(masses), limits, list(v), time)
        if found is not None:
            break
    h, bodies, truth = 0.02, [], []
    for k in range(count):
        a = 4.0 - 0.9 * k  # whatever slides stays over what carries it
        z = h * (2 * k + 1)
        if space.dimension == 2:
            bodies.append(space.box(0.0, z, space.twist(v[k]), (a, h), masses[k]))
        else:
            bodies.append(_slab(a, 0.5 - 0.1 * k, h, masses[k], z, 0.0, space.twist(v[k])))
        truth.append(space.pose(found[k], z))
    return Motion(_stacked(space.dimension, bodies, mus), time, np.array(truth))


def _stacked(d: int, bodies: list[Body], mus: Array) -> Model:
    """Return bodies on a floor; mus are those of each with what carries it."""
    up, pose = ((0.0, 1.0), (0.0,) * 3) if d == 2 else ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, *UPRIGHT))
    floor = Body(HalfSpace(up), pose=pose, motion="fixed")
    friction = np.zeros((len(bodies) + 1,) * 2)
    for k, mu in enumerate(mus):
        friction[k, k + 1] = friction[k + 1, k] = mu
    return Model(d, [floor, *bodies], tuple(-GRAVITY * x for x in up), 0.0, friction)


def layers(inertia: list[float], limits: list[float], speeds: list[float], time: float) -> list[float] | None:
    """Return how far each layer goes in ``time`` [s]: each rubs on the one below with ``limits``, the first on a floor.

    Accelerations are constant between the ends of slips. None where two of those nearly coincide, or where a layer that
    keeps with the next is within a hundredth of slipping.
    """
    n, speed, way = len(inertia), np.array(speeds), np.zeros(len(inertia))
    slip = np.diff(speed, prepend=0.0)
    stuck = slip == 0.0
    while time > 0.0:
        found = _accelerations(inertia, limits, slip, stuck)
        if found is None:
            return None
        bent, stuck = found
        apart = np.diff(bent, prepend=0.0)
        ends = [-slip[k] / apart[k] if not stuck[k] and slip[k] * apart[k] < 0.0 else math.inf for k in range(n)]
        first = int(np.argmin(ends))
        t = min(ends[first], time)
        if t < time and sum(end - t < 1e-6 for end in ends) > 1:
            return None
        way += speed * t + 0.5 * bent * t * t
        speed = speed + bent * t
        slip, time = slip + apart * t, time - t
        if time > 0.0:
            slip[first] = 0.0
        slip = np.where(stuck, 0.0, slip)
        stuck = slip == 0.0
    return [float(x) for x in way]


def _accelerations(inertia: list[float], limits: list[float], slip: Array, stuck: Array) -> tuple[Array, Array] | None:
    """Accelerations (n,) and which layers go on with the one below, by trying all ways of those without slip."""
    n = len(inertia)
    for ways in product((0.0, 1.0, -1.0), repeat=int(stuck.sum())):
        way = np.sign(slip)
        way[stuck] = ways
        held = stuck & (way == 0.0)
        # Unknown: accelerations and the forces f of each layer's underside; m_k a_k = f_k - f_(k+1).
        rows, right = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
        for k in range(n):
            rows[k, k], rows[k, n + k] = inertia[k], -1.0
            if k + 1 < n:
                rows[k, n + k + 1] = 1.0
            if held[k]:
                rows[n + k, k] = 1.0
                if k:
                    rows[n + k, k - 1] = -1.0
            else:
                rows[n + k, n + k], right[n + k] = 1.0, -way[k] * limits[k]
        size = np.array([*inertia, *(1.0 if held[k] else limits[k] for k in range(n))])
        rows[:, n:] *= size[:n]
        rows, right = rows / size[:, None], right / size
        found = np.linalg.solve(rows, right)
        bent, force = found[:n], found[n:] * size[:n]
        apart = np.diff(bent, prepend=0.0)
        share = np.abs(force) / np.array(limits)
        begins = stuck & ~held
        if (share[held] <= 1.0).all() and (apart[begins] * way[begins] > 0.0).all():
            if (share[held] > 0.99).any():
                return None
            return bent, held
    return None


def rod_in_a_v(space: Space, rng: Rng) -> Motion:
    """Return a rod with round ends that slides down in a V, one end on each side: a trammel, with friction.

    The centre follows from the angle q, ``n_i.(c + s_i l u(q)) = r``; loads and q'' solve ``m c'' = F`` and the moments
    about c, friction against the slip of each end.
    """
    while True:
        slopes, mu = rng.uniform(0.4, 1.1, 2), float(rng.choice([0.0, rng.uniform(0.02, 0.2)]))
        half, radius, mass = rng.uniform(0.2, 0.5), rng.uniform(0.05, 0.15), 10.0 ** rng.uniform(-3.0, 3.0)
        normals = np.array([(math.sin(slopes[0]), math.cos(slopes[0])), (-math.sin(slopes[1]), math.cos(slopes[1]))])
        state, time = np.array([rng.uniform(-0.7, 0.7), rng.uniform(-3.0, 3.0)]), float(rng.uniform(0.1, 0.5))
        trammel = Trammel(normals, half, radius, mu)
        if trammel.lasts(state) <= 0.0:
            continue
        end, left = integrated(trammel.rate, state, time, trammel.lasts)
        if time - left < 0.05:
            continue
        if left > 0.0:
            time = 0.95 * (time - left)
            end, _ = integrated(trammel.rate, state, time)
        break
    (x, y), (vx, vy) = trammel.centre(state[0]), trammel.turns(state[0]) * state[1]
    q, (truth_x, truth_y) = end[0], trammel.centre(end[0])
    moment = mass * trammel.moment
    moments = moment if space.dimension == 2 else (0.5 * mass * radius**2, moment, moment)
    pose, twist = space.pose(x, y, state[0]), space.twist(vx, vy, state[1])
    rod = Body(Capsule(half, radius), mass, moments, pose, twist)
    pull = space.vector(0.0, -GRAVITY)
    model = Model(space.dimension, [*(plane(space, n) for n in normals), rod], pull, 0.0, mu)
    return Motion(model, time, np.array(space.pose(float(truth_x), float(truth_y), float(q))))


class Trammel:
    """A rod of mass 1 whose left end is on the first of two planes through the origin, its right end on the second."""

    def __init__(self, normals: Array, half: float, radius: float, mu: float) -> None:
        self.normals, self.half, self.radius, self.mu = normals, half, radius, mu
        self.moment = (half + radius) ** 2 / 3.0
        self.inverse = np.linalg.inv(normals)

    def _place(self, u: Array, constant: float) -> Array:
        """Return the centre, or what its derivative has of ``u``, that of the rod's direction."""
        ends = np.array([-1.0, 1.0]) * self.half
        return np.asarray(self.inverse @ (constant - ends * (self.normals @ u)))

    def centre(self, q: float) -> Array:
        """Return the centre (2,) at the angle q."""
        return self._place(np.array([math.cos(q), math.sin(q)]), self.radius)

    def turns(self, q: float) -> Array:
        """Return dc/dq (2,)."""
        return self._place(np.array([-math.sin(q), math.cos(q)]), 0.0)

    def solved(self, state: Array) -> tuple[Array, Array, float]:
        """Return loads (2,), slips (2,) and the angular acceleration."""
        q, w = state
        u = np.array([math.cos(q), math.sin(q)])
        slope, bent = self.turns(q), self._place(-u, 0.0)
        arms = np.array([-self.half * u, self.half * u]) - self.radius * self.normals
        along = np.column_stack([-self.normals[:, 1], self.normals[:, 0]])
        turning = np.column_stack([-arms[:, 1], arms[:, 0]])
        slips = w * (along * (slope + turning)).sum(axis=1)
        pushes = self.normals - self.mu * np.sign(slips)[:, None] * along
        rows = np.zeros((3, 3))
        rows[:2, :2], rows[:2, 2] = pushes.T, -slope
        rows[2] = [*(arm[0] * push[1] - arm[1] * push[0] for arm, push in zip(arms, pushes, strict=True)), -self.moment]
        found = np.linalg.solve(rows, [*(bent * w * w + np.array([0.0, GRAVITY])), 0.0])
        return found[:2], slips, float(found[2])

    def rate(self, state: Array) -> Array:
        """Return (q', q'')."""
        return np.array([state[1], self.solved(state)[2]])

    def lasts(self, state: Array) -> float:
        """Return what must stay above zero: loads, and slips where there is friction; and that both ends touch."""
        loads, slips, _ = self.solved(state)
        u = np.array([math.cos(state[0]), math.sin(state[0])])
        higher = min(self.normals[0] @ u, -self.normals[1] @ u)  # the other end of each
        slip = float(np.abs(slips).min()) - 0.02 if self.mu > 0.0 else 1.0
        return float(min(loads.min() / GRAVITY - 0.02, slip, higher - 0.02))
