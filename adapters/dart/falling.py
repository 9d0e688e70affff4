"""A ball that falls onto a floor and rebounds, step by step as DART makes them.

    v  <-  v - g dt                        gravity first, so that what is thrown back has the step's own in it
    if y <= 0:  u = e |v|                  where that is a rebound, of up to 100 m/s
                u = min(s y/dt, 1 mm/s)    where it is none: a share of the overlap is pushed out
    v  <-  v + (u - v)/(1 + 1e-5)          a contact gives way by 1e-5 of what it is to change, and never pulls
    y  <-  y + v dt

``y`` is the height above the floor, upwards. A rebound gains ``e g dt`` of speed each time.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from adapters.dart.shipped import FASTEST, MIXING, PUSH_OUT, PUSHED_SHARE, THRESHOLD
from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.scene import Body, Disc, HalfSpace, Scene, Sphere
from adapters.shapes import reach
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: Rounding of the recurrence against the engine: some ten thousand roundings of numbers up to 10 (1e-11), times what a
#: bounce makes of an error of its height, 1/e <= 2, of each of some bounces.
ROUND_OFF = 1e-9


@lru_cache(maxsize=64)
def heights(height: float, speed: float, e: float, g: float, steps: int, dt: float) -> tuple[Array, Array]:
    """Heights above the floor [m] and velocities [m/s] after 0 .. ``steps`` steps, each (steps + 1,)."""
    y, v = height, speed
    places, velocities = [y], [v]
    for _ in range(steps):
        v -= g * dt
        if y <= 0.0:
            rebound = min(-e * v, FASTEST)
            target = rebound if rebound > THRESHOLD else min(PUSHED_SHARE * -y / dt, PUSH_OUT)
            v += max(0.0, target - v) / (1.0 + MIXING)
        y += v * dt
        places.append(y)
        velocities.append(v)
    return np.array(places), np.array(velocities)


def falling_law(metric: str) -> Law:
    """What the recurrence makes of ``metric``: a ball above a level floor, thrown or dropped straight."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        up = scene.dimension - 1
        if any(scene.gravity[:up]):
            return None
        floor, ball, *others = scene.bodies
        level = tuple(float(k == up) for k in range(scene.dimension))
        if not isinstance(ball.shape, Disc | Sphere) or floor.shape != HalfSpace(level, 0.0):
            return None
        sideways = [v for k, v in enumerate(ball.twist) if k != up]
        # Without a way sideways or a spin there is no slip, and friction has nothing to do.
        if any((*sideways, *ball.force, *ball.torque)) or not all(_away(ball, other, up) for other in others):
            return None
        e, steps = scene.material(floor.name, ball.name).restitution, step_count(scene.duration, dt)
        radius = ball.shape.radius
        y, v = heights(ball.pose[up] - radius, ball.twist[up], e, -scene.gravity[up], steps, dt)
        pose = np.repeat(np.array([[body.pose for body in scene.bodies]]), steps + 1, axis=0)
        twist = np.zeros((steps + 1, len(scene.bodies), len(ball.twist)))
        pose[:, 1, up], twist[:, 1, up] = y + radius, v  # what moves away stays where it is: nothing here asks for it
        motion = Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, None, dt, "completed")
        value = measure(scene, motion)[metric][0]
        return None if value is None else (value, ROUND_OFF)

    return law


def _away(ball: Body, other: Body, up: int) -> bool:
    """Whether ``other`` starts beside the ball and moves away from it."""
    if isinstance(other.shape, HalfSpace) or not isinstance(ball.shape, Disc | Sphere):
        return False
    between = np.subtract(other.pose[:up], ball.pose[:up])
    apart = ball.shape.radius + reach(other.shape)
    return bool(np.linalg.norm(between) > apart and between @ np.array(other.twist[:up]) >= 0.0)
