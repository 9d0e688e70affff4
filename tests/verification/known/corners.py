"""A known motion of a corner that rebounds while its body turns, until its rebounds are over (E22)."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Array, Model
from tests.verification.known.motion import Motion, integrated
from tests.verification.space import GRAVITY, Space

Rng = np.random.Generator

#: Speed at which a series of rebounds is over [m/s]: the square of it over g is what that leaves out.
LAST = 1e-7
#: Least height of all other corners and least slip until the end [m, m/s], and halvings of an interval: to the last
#: place.
CLEAR, SLIPS, HALVINGS = 1e-3, 0.05, 60


class Box:
    """A box of mass 1 and half extents ``half`` that slips to the right on one corner; states are q, w, x, vx, y, vy.

    With s from the corner to the centre: the corner's velocity is ``(vx + w s_y, vy - w s_x)``, and an impulse p on it,
    with its friction ``-mu p``, changes w by ``-p (s_x + mu s_y)/I``.
    """

    def __init__(self, half: tuple[float, float], friction: float) -> None:
        self.half, self.mu = half, friction
        self.inertia = (half[0] ** 2 + half[1] ** 2) / 3.0

    def lever(self, q: float) -> tuple[float, float]:
        """Return s (2,)."""
        a, b = self.half
        return -a * math.cos(q) - b * math.sin(q), -a * math.sin(q) + b * math.cos(q)

    def slip(self, state: Array) -> float:
        """Return the corner's speed along the floor [m/s]."""
        return float(state[3] + state[1] * self.lever(state[0])[1])

    def approach(self, state: Array) -> float:
        """Return the rate of the corner's height [m/s]."""
        return float(state[5] - state[1] * self.lever(state[0])[0])

    def height(self, state: Array) -> float:
        """Return the corner's height [m]."""
        return float(state[4] - self.lever(state[0])[1])

    def struck(self, state: Array, e: float) -> Array:
        """Return the state after the corner has hit the floor."""
        x, y = self.lever(state[0])
        p = -(1.0 + e) * self.approach(state) / (1.0 + x * (x + self.mu * y) / self.inertia)
        change = np.array([0.0, -p * (x + self.mu * y) / self.inertia, 0.0, -self.mu * p, 0.0, p])
        return np.asarray(state + change)

    def flown(self, state: Array, t: float) -> Array:
        """Return the state after a flight."""
        q, w, x, vx, y, vy = state
        return np.array([q + w * t, w, x + vx * t, vx, y + vy * t - 0.5 * GRAVITY * t * t, vy - GRAVITY * t])

    def rate(self, state: Array) -> Array:
        """Return the rates of all while the corner slips on the floor: ``vy = w s_x``."""
        q, w, _, vx, _, _ = state
        x, y = self.lever(q)
        turns = -x - self.mu * y
        bent = (GRAVITY - y * w * w) * turns / (self.inertia - x * turns)
        load = GRAVITY + x * bent - y * w * w
        return np.array([w, bent, vx, -self.mu * load, w * x, load - GRAVITY])

    def lasts(self, state: Array) -> float:
        """Return what must stay above zero: slip, and the height of all other corners."""
        a, b = self.half
        c, s = math.cos(state[0]), math.sin(state[0])
        others = [state[4] + s * i + c * j for i, j in ((-a, -b), (a, b), (-a, b))]
        return min(self.slip(state) - SLIPS, min(others) - CLEAR)

    def back(self, state: Array, time: float) -> float:
        """Return when the corner is back [s], at most ``time``: nothing bends its height by more than g + w^2 r."""
        bends = GRAVITY + state[1] ** 2 * math.hypot(*self.half)
        step = 0.5 * max(self.approach(state), 0.0) / bends or 1e-3
        t = step
        while self.height(self.flown(state, t)) > 0.0:
            t += step
            if t >= time:
                return time
        low, high = t - step, t
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.height(self.flown(state, middle)) > 0.0 else (low, middle)
        return high

    def goes(self, state: Array, e: float, time: float) -> Array | None:
        """Return the state after ``time`` [s]; None where the slip ends, another corner touches or no series ends."""
        while True:
            t = self.back(state, time)
            state, time = self.flown(state, t), time - t
            if time <= 0.0 or self.lasts(state) < 0.0:
                return None
            over = -self.approach(state) < LAST
            state = self.struck(state, 0.0 if over else e)
            if over:
                state, left = integrated(self.rate, state, time, self.lasts)
                return state if left == 0.0 else None


def falls_on_a_corner(space: Space, rng: Rng) -> Motion:
    """Return a box that comes down on a corner, in space an edge, rebounds on it while it turns, and slides on."""
    while True:
        half = (float(rng.uniform(0.15, 0.4)), float(rng.uniform(0.3, 0.6)))
        mu, e, time = float(rng.choice([0.0, rng.uniform(0.05, 0.3)])), rng.uniform(0.3, 0.9), rng.uniform(0.15, 0.6)
        box, lean = Box(half, mu), rng.uniform(0.1, 0.6)
        q, w = -math.atan2(half[0], half[1]) - lean, float(rng.uniform(-1.0, 8.0))
        x, y = box.lever(q)
        start = np.array([q, w, x, rng.uniform(2.0, 4.0), y + rng.uniform(0.005, 0.03), w * x - rng.uniform(0.0, 0.3)])
        if box.lasts(start) < 0.0:
            continue
        end = box.goes(start, e, time)
        if end is not None:
            break
    body = space.box(start[2], start[4], space.twist(start[3], start[5], w), half, 1.0, q)
    model = Model(space.dimension, [space.floor(), body], space.vector(0.0, -GRAVITY), e, mu)
    return Motion(model, time, np.array(space.pose(end[2], end[4], end[0])))
