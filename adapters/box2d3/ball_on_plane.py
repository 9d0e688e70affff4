"""The motion of a ball on a plane in Box2D's substeps, as a law, in the plane's axes.

    start of a step:  a gap of up to 2 cm is a contact, in the middle of the gap, at a point that turns with the ball
    n small steps:    v += g h, and what the contact gave before once more
                      stopped so that the gap closes just now, or pushed by a spring where it overlaps; then friction
                      x += v h
                      both once more, without the spring
    end:              v_n = -e v_n(start of the step), if that was an approach above the threshold, and it was stopped

So the rebound follows from the velocity at the start of its step, friction does not depend on it, and a ball that
rotates within a step lifts its contact point. Everything is computed in double precision; the band is the round-off of
single precision.

Longer than a usual law, but it explains 48 rows of the standard suite (bounce and oblique) at any step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from adapters.box2d3.shipped import SEEN_AHEAD, STIFFEST
from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.law.single_precision import ROUNDINGS, UNIT
from adapters.scene import Disc, HalfSpace, Scene
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: ``chosen(scene, dt)``: the settings of a profile by name.
Chosen = Callable[[Scene, float], Mapping[str, Any]]


def ball_law(metric: str, chosen: Chosen, sampled: bool = False) -> Law:
    """A free ball and a fixed plane, under gravity or none.

    Parameters
    ----------
    metric, chosen
        The predicted metric, and the settings.
    sampled
        The metric is a time from samples, known to one sample.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if not _is_told(scene):
            return None
        share = ROUNDINGS * UNIT
        found = [
            measure(scene, _Ball(scene, dt, chosen(scene, dt), height, speed).moved())[metric][0]
            for height, speed in ((0.0, 0.0), (share, 0.0), (-share, 0.0), (0.0, share))
        ]
        value, *others = found
        if value is None or None in others:
            return None
        off = sum(abs(other - value) for other in others if other is not None)
        return value, off + share * (1.0 + abs(value)) + (dt if sampled else 0.0)

    return law


def _is_told(scene: Scene) -> bool:
    if len(scene.bodies) != 2 or scene.dimension != 2:
        return False
    plane, ball = scene.bodies
    plain = isinstance(plane.shape, HalfSpace) and isinstance(ball.shape, Disc) and ball.motion == "free"
    return plain and not any((*ball.force, *ball.torque))


@dataclass
class _Held:
    """Impulses of a contact [N s], and whether it ever pushed in this step."""

    normal: float = 0.0
    friction: float = 0.0
    pushed: bool = False


class _Ball:
    """Place and velocity of a ball along the plane and off it, and its spin."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any], higher: float, faster: float) -> None:
        plane, ball = scene.bodies
        assert isinstance(plane.shape, HalfSpace) and isinstance(ball.shape, Disc)
        assert isinstance(ball.inertia, float | int)
        self.scene, self.dt, self.settings, self.h = scene, dt, settings, dt / settings["substeps"]
        material = scene.material(plane.name, ball.name)
        self.e, self.mu, self.m, self.inertia = material.restitution, material.friction, ball.mass, ball.inertia
        self.normal = np.array(plane.shape.normal)
        self.along = np.array([self.normal[1], -self.normal[0]])
        gravity = np.array(scene.gravity)
        self.gn, self.gt = float(gravity @ self.normal), float(gravity @ self.along)
        place, velocity = np.array(ball.pose[:2]), np.array(ball.twist[:2]) * (1.0 + faster)
        self.radius, self.offset = ball.shape.radius, plane.shape.offset
        self.y = float(place @ self.normal) + higher * self.radius
        self.x, self.turn, self.w = float(place @ self.along), ball.pose[2], ball.twist[2]
        self.v, self.u = float(velocity @ self.normal), float(velocity @ self.along)
        self.held: _Held | None = None
        turns = 2.0 * math.pi * 2.0 * min(settings["hertz"], STIFFEST / self.h)
        a = 2.0 * settings["damping_ratio"] + self.h * turns
        b = self.h * turns * a
        #: Rate of the spring [1/s], and its factors of mass and of accumulated impulse.
        self.spring = (turns / a, b / (1.0 + b), 1.0 / (1.0 + b))

    def moved(self) -> Trajectory:
        """The motion at every step."""
        steps = step_count(self.scene.duration, self.dt)
        rows = [self._row()]
        for _ in range(steps):
            self._step()
            rows.append(self._row())
        return _trajectory(self.scene, self.dt, np.array(rows))

    def _row(self) -> tuple[float, ...]:
        place, velocity = self.x * self.along + self.y * self.normal, self.u * self.along + self.v * self.normal
        return (*place, self.turn, *velocity, self.w)

    def _step(self) -> None:
        gap, before = self.y - self.radius - self.offset, self.v
        if gap >= SEEN_AHEAD / self.settings["units_per_metre"]:
            self.held = None
            for _ in range(self.settings["substeps"]):
                self._fall()
                self._drift()
            return
        held = self.held = self.held or _Held()
        held.pushed, start, turned, arm = False, self.y, self.turn, self.radius + 0.5 * gap

        def left() -> float:
            # The contact point of the ball turns with it.
            return gap + self.y - start + arm * (1.0 - math.cos(self.turn - turned))

        for _ in range(self.settings["substeps"]):
            self._fall()
            self._give(held.normal, held.friction, arm)
            self._stop(held, left(), self.spring)
            self._rub(held, arm)
            self._drift()
            self._stop(held, left(), None)
            self._rub(held, arm)
        if held.pushed and before <= -self.settings["restitution_threshold"]:
            self._push(held, -self.m * (self.v + self.e * before))

    def _fall(self) -> None:
        self.v += self.gn * self.h
        self.u += self.gt * self.h

    def _drift(self) -> None:
        self.y += self.v * self.h
        self.x += self.u * self.h
        self.turn += self.w * self.h

    def _give(self, normal: float, friction: float, arm: float) -> None:
        self.v += normal / self.m
        self.u += friction / self.m
        self.w += friction * arm / self.inertia

    def _stop(self, held: _Held, gap: float, spring: tuple[float, float, float] | None) -> None:
        if gap > 0.0 or spring is None:
            self._push(held, -self.m * (self.v + max(gap, 0.0) / self.h))
        else:
            rate, mass, kept = spring
            speed = max(rate * gap, -self.settings["push_speed"])
            self._push(held, -self.m * mass * (self.v + speed) - kept * held.normal)

    def _push(self, held: _Held, impulse: float) -> None:
        impulse = max(impulse, -held.normal)
        held.normal += impulse
        held.pushed = held.pushed or held.normal > 0.0
        self._give(impulse, 0.0, 0.0)

    def _rub(self, held: _Held, arm: float) -> None:
        lightness, most = 1.0 / self.m + arm * arm / self.inertia, self.mu * held.normal
        wanted = held.friction - (self.u + self.w * arm) / lightness
        wanted = min(max(wanted, -most), most)
        self._give(0.0, wanted - held.friction, arm)
        held.friction = wanted


def _trajectory(scene: Scene, dt: float, rows: Array) -> Trajectory:
    t = np.arange(len(rows), dtype=np.float64) * dt
    pose = np.broadcast_to(np.array([body.pose for body in scene.bodies]), (len(t), 2, 3)).copy()
    twist = np.broadcast_to(np.array([body.twist for body in scene.bodies]), (len(t), 2, 3)).copy()
    pose[:, 1], twist[:, 1] = rows[:, :3], rows[:, 3:]
    return Trajectory(t, pose, twist, None, dt, "completed")
