"""A ball that falls onto a floor of springs, step by step as Drake makes it.

    x          overlap at the start of the step, 0 where there is none: a contact is found in overlaps alone
    m (v' - v + g dt) = j(v')              v' upwards, implicit in the load

    SAP        j = ((x - (dt + tau) v')/((dt + tau) R))+,  R = max(1/(dt (dt + tau) k), near)
    others     j = dt k (x - dt v')+ (1 - d v')+

``near`` bounds the stiffness that a step resolves, beta^2/(4 pi^2) of the root mean square of what an impulse of 1 does
along three axes at the contact, which lies half-way into the overlap. Nothing here is solved for a rebound: what
overlaps is pushed out, by Hunt and Crossley at up to 1/d, by SAP at up to x/(dt + tau).
"""

from __future__ import annotations

import math

import numpy as np

from adapters.drake.shipped import DISSIPATION, NEAR_RIGID, POINT_STIFFNESS, RELAXATION
from adapters.law import Law, Measure, Prediction
from adapters.lift import lift
from adapters.scene import HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: What a step's solver leaves of a speed, as a share of the fastest. Measured 2e-8 at most.
LEFT = 1e-6


def slowest_rebound(profile: str, speed: float, dt: float) -> float:
    """Bound on the speed [m/s] at which a ball that came in at ``speed`` is pushed out."""
    return speed * dt / (dt + RELAXATION) if profile == "sap" else 1.0 / DISSIPATION


def _pressed(profile: str, mass: float, radius: float, inertia: float, x: float, v: float, dt: float) -> float:
    """Velocity after a step that starts ``x`` deep and would end with ``v``."""
    if x <= 0.0:
        return v
    if profile == "sap":
        late = dt + RELAXATION
        slip = 1.0 + mass * (radius - 0.5 * x) ** 2 / inertia
        mean = math.sqrt((1.0 + 2.0 * slip * slip) / 9.0) / mass
        soft = max(1.0 / (dt * late * POINT_STIFFNESS), NEAR_RIGID**2 / (4.0 * math.pi**2) * mean)
        # m (v' - v) = (x/late - v')/soft
        return max(v, (mass * v + x / (late * soft)) / (mass + 1.0 / soft))
    stiff, most = dt * POINT_STIFFNESS, min(x / dt, 1.0 / DISSIPATION)
    if v >= most:
        return v
    # m (v' - v) = dt k (x - dt v') (1 - d v'): the root below both bounds.
    a = stiff * dt * DISSIPATION
    b = -(stiff * (dt + x * DISSIPATION) + mass)
    c = stiff * x + mass * v
    return 2.0 * c / (-b + math.sqrt(b * b - 4.0 * a * c))


def landing_law(metric: str, profile: str) -> Law:
    """What the recurrence makes of ``metric``: a ball above a level floor, thrown or dropped straight."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        motion = _motion(scene, dt, profile)
        value = None if motion is None else measure(scene, motion)[metric][0]
        if value is None:
            return None
        fastest = max(1.0, abs(scene.bodies[1].twist[scene.dimension - 1]))
        return value, LEFT * fastest * (1.0 + abs(value))

    return law


def _motion(scene: Scene, dt: float, profile: str) -> Trajectory | None:
    spatial = scene if scene.dimension == 3 else lift(scene)
    if len(scene.bodies) != 2 or any(spatial.gravity[:2]):
        return None
    floor, ball = spatial.bodies
    if floor.shape != HalfSpace((0.0, 0.0, 1.0), 0.0) or not isinstance(ball.shape, Sphere) or ball.motion != "free":
        return None
    if any((*ball.twist[:2], *ball.twist[3:], *ball.force, *ball.torque)):
        return None
    if spatial.material(floor.name, ball.name).restitution > 0.0:
        return None
    radius, mass = ball.shape.radius, ball.mass
    inertia = float(np.broadcast_to(ball.inertia, 3)[0])
    up, steps = scene.dimension - 1, step_count(scene.duration, dt)
    pose = np.repeat(np.array([[body.pose for body in scene.bodies]]), steps + 1, axis=0)
    twist = np.repeat(np.array([[body.twist for body in scene.bodies]]), steps + 1, axis=0)
    y, v = ball.pose[2] - radius, ball.twist[2]
    for step in range(1, steps + 1):
        v = _pressed(profile, mass, radius, inertia, -y, v + spatial.gravity[2] * dt, dt)
        y += v * dt
        pose[step, 1, up], twist[step, 1, up] = y + radius, v
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, None, dt, "completed")
