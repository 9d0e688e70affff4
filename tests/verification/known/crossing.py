"""A known motion of lines that cross: their common normal turns as they do (E36)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from reference_solver.model import Array, Body, Model
from reference_solver.shapes import Capsule
from tests.verification.known.motion import Motion, integrated, spun
from tests.verification.rotation import rotation_matrix
from tests.verification.space import GRAVITY

Rng = np.random.Generator

#: Step of the derivatives [s]: with a complex one nothing is subtracted, so that none is too small.
COMPLEX = 1e-30
#: What is left of a rod beyond the crossing, and least sine of the angle at it.
SPARE, CROSSED = 0.05, 0.3


def crossing(centre: Any, along: Any, radius: float) -> tuple[Any, Any]:
    """Return the normal towards a rod from one along y through the origin, and its lever to the point of contact.

    Any numbers, complex ones as well: an analytic function of both. The nearest points of both lines have the
    difference ``d n``, n square to both; ``centre + s along`` is the rod's.
    """
    across = np.array([along[2], 0.0 * along[1], -along[0]])  # y x along
    across = across / np.sqrt(across @ across)
    distance = across @ centre
    across = across if distance.real > 0.0 else -across
    # (centre + s along - d n) has neither an x nor a z.
    plane = along * np.array([1.0, 0.0, 1.0])
    s = -(plane @ (centre - abs(distance.real) / distance.real * distance * across)) / (plane @ plane)
    return across, s * along - radius * across


def crossed_rods(rng: Rng) -> Motion:
    """Return a smooth rod that slides, turns and tips on a fixed one, which it crosses at one point.

    ``m v' = m g + N n``, ``I w' = -w x I w + r x N n`` with the N that keeps ``n.(v + w x r)`` at zero: its rate is
    that of the velocities, and those of n and of the lever r as both lines go on, which `crossing` tells.
    """
    while True:
        radii, half = rng.uniform(0.05, 0.15, 2), rng.uniform(0.4, 0.7)
        thin, long = half**2 / 3.0 + 0.25 * radii[1] ** 2, 0.5 * radii[1] ** 2
        moments = np.array([long, thin, thin])
        turn, lean = rng.uniform(-0.9, 0.9), rng.uniform(-0.2, 0.2)
        q = _about(2, turn, _about(1, lean, np.array([1.0, 0.0, 0.0, 0.0])))
        along = rotation_matrix(q)[:, 0]
        normal = np.array([along[2], 0.0, -along[0]])
        normal *= np.sign(normal[2]) / np.linalg.norm(normal)
        centre = radii.sum() * normal + rng.uniform(-0.15, 0.15) * along + np.array([0.0, rng.uniform(-0.2, 0.2), 0.0])
        v, w = rng.uniform(-0.5, 0.5, 3), rng.uniform(-1.5, 1.5, 3)
        n, arm = crossing(centre, along, radii[1])
        v -= (n @ (v + np.cross(w, arm))) * n
        rod = _Rod(moments, radii[1], half)
        start, time = np.concatenate([q, w, v, centre]), float(rng.uniform(0.1, 0.3))
        if rod.lasts(start) <= 0.0:
            continue
        end, left = integrated(rod.rate, start, time, rod.lasts)
        if left > 0.0:
            time = 0.95 * (time - left)
            end, _ = integrated(rod.rate, start, time) if time > 0.04 else (end, 0.0)
        if time > 0.04:
            break
    upright = math.sqrt(0.5)
    fixed = Body(Capsule(1.0, radii[0]), pose=(0.0, 0.0, 0.0, upright, 0.0, 0.0, upright), motion="fixed")
    free = Body(Capsule(half, radii[1]), 1.0, tuple(moments), (*centre, *q), (*v, *w))
    truth = np.concatenate([end[10:], end[:4] / np.linalg.norm(end[:4])])
    return Motion(Model(3, [fixed, free], (0.0, 0.0, -GRAVITY), 0.0, 0.0), time, truth)


def _about(axis: int, angle: float, q: Array) -> Array:
    """Orientation (4,) turned about a world axis."""
    turn = np.zeros(3)
    turn[axis] = math.sin(0.5 * angle)
    w = math.cos(0.5 * angle)
    return np.array([w * q[0] - turn @ q[1:], *(w * q[1:] + q[0] * turn + np.cross(turn, q[1:]))])


class _Rod:
    """The free rod, of mass 1; states are q (4,), w, v and place (3,) each."""

    def __init__(self, moments: Array, radius: float, half: float) -> None:
        self.moments, self.radius, self.half = moments, radius, half

    def solved(self, state: Array) -> tuple[float, Array, Array]:
        """Return N and the rates of w and v."""
        q, w, v, centre = state[:4] / np.linalg.norm(state[:4]), state[4:7], state[7:10], state[10:]
        turn = rotation_matrix(q)
        along, inertia = turn[:, 0], turn @ np.diag(self.moments) @ turn.T
        n, arm = crossing(centre, along, self.radius)
        moved = crossing(centre + 1j * COMPLEX * v, along + 1j * COMPLEX * np.cross(w, along), self.radius)
        n_rate, arm_rate = (x.imag / COMPLEX for x in moved)
        inverse = np.linalg.inv(inertia)
        pull, free = np.array([0.0, 0.0, -GRAVITY]), -inverse @ np.cross(w, inertia @ w)
        lever = np.cross(arm, n)
        bends = n @ (pull + np.cross(free, arm) + np.cross(w, arm_rate)) + n_rate @ (v + np.cross(w, arm))
        load = -float(bends) / float(1.0 + lever @ inverse @ lever)
        return load, np.asarray(free + inverse @ lever * load), np.asarray(pull + load * n)

    def rate(self, state: Array) -> Array:
        """Return the rates of all."""
        _, bent, gained = self.solved(state)
        return np.concatenate([spun(state[:4], state[4:7]), bent, gained, state[7:10]])

    def lasts(self, state: Array) -> float:
        """Return what must stay above zero: the load, what is left of the rod, and the angle of the lines."""
        along = rotation_matrix(state[:4] / np.linalg.norm(state[:4]))[:, 0]
        _, arm = crossing(state[10:], along, self.radius)
        spare = self.half - abs(float(arm @ along)) - SPARE
        return min(self.solved(state)[0] - 0.2, spare, math.hypot(along[0], along[2]) - CROSSED)
