"""Known motions over edges and corners: balls and rods that roll or slip off a box, boxes that slide off a table."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from reference_solver.model import Array, Body, Model
from reference_solver.shapes import Box, Sphere
from tests.verification.known.motion import Motion, integrated, spun
from tests.verification.known.planar import STICKS
from tests.verification.space import GRAVITY, Space

Rng = np.random.Generator
Mask = NDArray[np.bool_]

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
#: I / (m r^2) of a uniform sphere.
ROUND = 0.4
#: Share of the limit of friction at which a ball that rolls counts as rolling, and slip that counts as slip [m/s].
GRIPS, SLIPS = 0.9, 0.3
#: A ball that has left a box stays this far off it [m].
CLEAR = 1e-3


class Rolling:
    """A uniform ball of mass 1 on a fixed box about the origin, on a face, an edge or a corner of it.

    With n from the nearest point of the box to the centre, which turns along the directions P in which the centre
    lies beyond the box, ``n' = P v/r``: rolling is ``v = r w x n`` and, from ``I w' = r F x n``,
    ``I w' + m r^2 (w' - n (n.w')) = m r (r w x n' - g) x n``; slipping is ``F = N (n - mu s/|s|)`` along the slip
    ``s = v - r w x n``, with ``N = -m (n.g + r |n'|^2)`` either way. States are q (4,), w, v and place (3,) each.
    """

    def __init__(self, half: Array, radius: float, gravity: Array, friction: float, rolls: bool) -> None:
        self.half, self.radius, self.gravity, self.friction, self.rolls = half, radius, gravity, friction, rolls

    def normal(self, state: Array, beyond: Mask) -> tuple[Array, Array]:
        """Return n and its rate."""
        place, v = state[10:], state[7:10]
        n: Array = np.zeros(3)
        turns: Array = np.zeros(3)
        n[beyond] = (place - np.sign(place) * self.half)[beyond]
        turns[beyond] = v[beyond] / self.radius
        n /= math.sqrt(n @ n)
        return n, turns

    def load(self, state: Array, beyond: Mask) -> float:
        """Return N."""
        n, turns = self.normal(state, beyond)
        return float(-n @ self.gravity - self.radius * (turns @ turns))

    def slip(self, state: Array, beyond: Mask) -> Array:
        """Return the slip (3,)."""
        n, _ = self.normal(state, beyond)
        return np.asarray(state[7:10] - self.radius * np.cross(state[4:7], n))

    def force(self, state: Array, beyond: Mask) -> tuple[Array, Array]:
        """Return the force of contact and the rate of the spin."""
        n, turns = self.normal(state, beyond)
        r, w, moment = self.radius, state[4:7], ROUND * self.radius**2
        if self.rolls:
            right = r * np.cross(r * np.cross(w, turns) - self.gravity, n)
            # Of (I + m r^2) - m r^2 n n^T the inverse is known: n is an axis of it.
            bent = right / (moment + r * r) + n * float(n @ right) * (1.0 / moment - 1.0 / (moment + r * r))
            return np.asarray(r * np.cross(bent, n) + r * np.cross(w, turns) - self.gravity), bent
        slip = self.slip(state, beyond)
        size = float(np.linalg.norm(slip))
        force = self.load(state, beyond) * (n - self.friction * slip / (size or 1.0))
        return force, r * np.cross(force, n) / moment

    def lasts(self, state: Array, beyond: Mask) -> float:
        """Return what must stay above zero while it slips or rolls as it does."""
        if not self.rolls:
            return float(np.linalg.norm(self.slip(state, beyond))) - SLIPS if self.friction > 0.0 else 1.0
        n, _ = self.normal(state, beyond)
        force, _ = self.force(state, beyond)
        pressed = float(force @ n)
        return GRIPS * self.friction * pressed - float(np.linalg.norm(force - pressed * n))

    def goes(self, state: Array, time: float) -> tuple[Array, float, int]:
        """Return the state after ``time`` [s], what is left of it where it does not last, and the edges it came to."""
        beyond = np.abs(state[10:]) >= self.half
        passed = 0
        while True:
            rate, ends = partial(self._rate, beyond=beyond), partial(self._ends, beyond=beyond)
            # mypy infers no type of a lambda with a default, which binds this turn's ends
            state, time = integrated(rate, state, time, lambda s, ends=ends: min(ends(s)))  # type: ignore[misc]
            if time == 0.0:
                return state, 0.0, passed
            load, lasts, *_ = ends(state)
            if lasts < 0.0:
                return state, time, passed
            if load < 0.0:
                return *self._flies(state, time), passed
            beyond = beyond | (np.abs(state[10:]) >= self.half)
            passed += 1

    def _ends(self, state: Array, beyond: Mask) -> list[float]:
        left = self.half - np.abs(state[10:])
        return [self.load(state, beyond), self.lasts(state, beyond), *left[~beyond], *-left[beyond]]

    def _rate(self, state: Array, beyond: Mask) -> Array:
        force, bent = self.force(state, beyond)
        return np.concatenate([spun(state[:4], state[4:7]), bent, force + self.gravity, state[7:10]])

    def _flies(self, state: Array, time: float) -> tuple[Array, float]:
        """Fly on; nothing of the time is used where it meets the box again."""
        for t in np.linspace(0.1, 1.0, 10) * time:
            place = state[10:] + t * state[7:10] + 0.5 * t * t * self.gravity
            gap = np.linalg.norm(place - np.clip(place, -self.half, self.half)) - self.radius
            if gap < min(CLEAR, 1e-2 * t):
                return state, time
        turned, _ = integrated(lambda q: spun(q, state[4:7]), state[:4], time)
        return np.concatenate([turned, state[4:7], state[7:10] + time * self.gravity, place]), 0.0


def ball_over_a_box(way: str, rng: Rng) -> Motion:
    """Return a ball that rolls, slips, or goes without friction over an edge of a fixed box, and over a corner of it.

    It comes in any direction, spins about any axis, under gravity that leans, and flies in the end; where it rolls, or
    slips, the motion ends before it does not.
    """
    while True:
        half, radius = rng.uniform(0.3, 0.6, 3), float(rng.uniform(0.15, 0.35))
        mu = {"rolls": STICKS, "slips": float(rng.uniform(0.05, 0.3)), "smooth": 0.0}[way]
        gravity = np.array([*rng.uniform(-1.5, 1.5, 2), -GRAVITY])
        world = Rolling(half, radius, gravity, mu, way == "rolls")
        place = np.array([*(half[:2] - rng.uniform(0.02, 0.25, 2)), half[2] + radius])
        v = np.array([*rng.uniform(-0.4, 1.2, 2), 0.0])
        w = rng.uniform(-15.0, 15.0, 3) if way == "slips" else rng.uniform(-3.0, 3.0, 3)
        if way == "rolls":
            w[:2] = -v[1] / radius, v[0] / radius
        start, time = np.concatenate([UPRIGHT, w, v, place]), float(rng.uniform(0.3, 0.6))
        if world.lasts(start, np.abs(place) >= half) <= 0.0:
            continue
        end, left, passed = world.goes(start, time)
        if left > 0.0:
            time = 0.95 * (time - left)
            if time < 0.05:
                continue
            end, left, passed = world.goes(start, time)
        if left == 0.0 and passed > 0:
            break
    ball = Body(Sphere(radius), 1.0, (ROUND * radius**2,) * 3, (*place, *UPRIGHT), (*v, *w))
    box = Body(Box(tuple(float(x) for x in half)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
    truth = np.concatenate([end[10:], end[:4] / np.linalg.norm(end[:4])])
    return Motion(Model(3, [box, ball], tuple(gravity), 0.0, mu), time, truth)


def off_the_table(space: Space, rng: Rng) -> Motion:
    """Return a box that slides off a table: one end of what it lies on passes, then it tips about the edge, sliding.

    Flat it slows down by mu g, pressed most mu h ahead of its centre (h half its height): it tips when that passes the
    edge. With s from the centre to the edge along the base, axes u along and n off the base,
    ``s'' = mu N/m + g sin(q) + s q'^2 - h q''``, ``N = m (g cos(q) - 2 s' q' - s q'' - h q'^2)`` and
    ``I q'' = N (s - mu h)``.
    """
    while True:
        a, h, mu = rng.uniform(0.3, 0.6), rng.uniform(0.1, 0.3), rng.uniform(0.05, 0.4)
        at, v, time = -a * rng.uniform(0.3, 1.5), rng.uniform(0.8, 2.5), float(rng.uniform(0.3, 0.6))
        way = -mu * h - at  # until it tips
        if way <= 0.02 or v * v - 2.0 * mu * GRAVITY * way < 0.25:
            continue
        slower = math.sqrt(v * v - 2.0 * mu * GRAVITY * way)
        late = (v - slower) / (mu * GRAVITY)
        if late > 0.8 * time:
            continue
        moment = (a * a + h * h) / 3.0
        rate, load = _tips(h, mu, moment)

        def lasts(state: Array, load: Callable[[Array], float] = load, end: float = 0.02 - a) -> float:
            return min(load(state) - 0.1, -state[2] - 0.1, 1.2 + state[1], state[0] - end)

        start = np.array([mu * h, 0.0, -slower, 0.0])
        end, left = integrated(rate, start, time - late, lasts)
        if left > 0.0:
            time = late + 0.95 * (time - late - left)
            end, _ = integrated(rate, start, time - late)
        break
    s, q = float(end[0]), float(end[1])
    x, y = -s * math.cos(q) - h * math.sin(q), -s * math.sin(q) + h * math.cos(q)
    table = space.box(-2.0, -0.5, half=(2.0, 0.5), mass=0.0, motion="fixed")
    if space.dimension == 2:
        box = space.box(at, h, space.twist(v), (a, h))
    else:
        b = float(rng.choice([rng.uniform(0.2, 0.8), 3.0]))  # all on the table, or wider than it
        moments = ((b * b + h * h) / 3.0, moment, (a * a + b * b) / 3.0)
        box = Body(Box((a, b, h)), 1.0, moments, space.pose(at, h), space.twist(v))
    pull = space.vector(0.0, -GRAVITY)
    return Motion(Model(space.dimension, [table, box], pull, 0.0, mu), time, np.array(space.pose(x, y, q)))


def _tips(h: float, mu: float, moment: float) -> tuple[Callable[[Array], Array], Callable[[Array], float]]:
    """Rates of (s, q, s', q') and the load, for a mass of one."""

    def solved(state: Array) -> tuple[float, float]:
        s, q, ds, w = state
        # N (1 + s (s - mu h)/I) = g cos q - 2 s' w - h w^2
        load = (GRAVITY * math.cos(q) - 2.0 * ds * w - h * w * w) / (1.0 + s * (s - mu * h) / moment)
        return load, load * (s - mu * h) / moment

    def rate(state: Array) -> Array:
        s, q, ds, w = state
        load, bent = solved(state)
        return np.array([ds, w, mu * load + GRAVITY * math.sin(q) + s * w * w - h * bent, bent])

    return rate, lambda state: solved(state)[0]


def slides_over_a_corner(rng: Rng) -> Motion:
    """Return a box that slides straight on over the corner of a table, until it is about to tip.

    All of its base slips one way: it slows down by mu g, however the base shares its weight. It lies while what it is
    pressed on most, mu h ahead of its centre, is inside what table and base share.
    """
    while True:
        a, b, h = rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5), rng.uniform(0.05, 0.2)
        mu, speed, heading, yaw = rng.uniform(0.05, 0.5), rng.uniform(0.8, 2.5), *rng.uniform(0.2, 1.3, 2)
        ahead = np.array([math.cos(heading), math.sin(heading)])
        at, time = -rng.uniform(0.15, 0.6, 2), float(rng.uniform(0.2, 0.6))
        stops = speed / (mu * GRAVITY)
        # Until the pressed point is 1 cm from the edges x = 0 and y = 0.
        for k in range(2):
            room = -0.01 - at[k] - mu * h * ahead[k]
            under = speed**2 - 2.0 * mu * GRAVITY * room / ahead[k]
            if room < 0.0:
                time = 0.0
            elif under > 0.0:
                time = min(time, (speed - math.sqrt(under)) / (mu * GRAVITY))
        moved = min(time, stops)
        end = at + ahead * (speed * moved - 0.5 * mu * GRAVITY * moved**2)
        turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        corners = np.array([(-a, -b), (-a, b), (a, -b), (a, b)]) @ turn.T
        off = [(corners + place > 0.0).any(axis=1).sum() for place in (at, end)]
        if time > 0.05 and off[1] > off[0] and (corners + at).min() > -1.9:
            break
    q = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
    table = Body(Box((1.0, 1.0, 0.2)), pose=(-1.0, -1.0, -0.2, *UPRIGHT), motion="fixed")
    moments = ((b * b + h * h) / 3.0, (a * a + h * h) / 3.0, (a * a + b * b) / 3.0)
    box = Body(Box((a, b, h)), 1.0, moments, (*at, h, *q), (*(speed * ahead), 0.0, 0.0, 0.0, 0.0))
    return Motion(Model(3, [table, box], (0.0, 0.0, -GRAVITY), 0.0, mu), time, np.array([*end, h, *q]))
