"""A ball that falls onto a floor of springs, step by step as in Drake.

    x          overlap at the start of the step, 0 if there is none: contacts are found in overlaps only
    m (v' - v + g dt) = j(v')              v' upwards, implicit in the load

    SAP        j = ((x - (dt + tau) v')/((dt + tau) R))+,  R = max(1/(dt (dt + tau) k), near)
    others     j = dt k (x - dt v')+ (1 - d v')+

``near`` bounds the stiffness that a step resolves: beta^2/(4 pi^2) times the root mean square of the inverse masses
along three axes at the contact, which lies half-way into the overlap. There is no restitution: overlaps are pushed out,
with Hunt and Crossley at up to 1/d, with SAP at up to x/(dt + tau).
"""

from __future__ import annotations

import math

import numpy as np

from adapters.drake.shipped import DISSIPATION, NEAR_RIGID, POINT_STIFFNESS, RELAXATION
from adapters.engine import Contacts
from adapters.law import Law, Measure, Prediction
from adapters.scene import HalfSpace, Scene, Sphere
from adapters.scene.lift import lift
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Trajectory

#: Residual of a step's solver, as a share of the fastest speed. Measured 2e-8 at most.
LEFT = 1e-6


def slowest_rebound(profile: str, speed: float, dt: float) -> float:
    """Bound on the rebound speed [m/s] of a ball with impact ``speed``."""
    return speed * dt / (dt + RELAXATION) if profile == "sap" else 1.0 / DISSIPATION


def _pressed(profile: str, lightness: float, rubbed: float, x: float, v: float, dt: float) -> float:
    """Separation speed after a step that starts ``x`` deep and without contact ends with ``v``.

    ``lightness`` and ``rubbed`` [1/kg]: inverse masses along the normal and across it.
    """
    if x <= 0.0:
        return v
    mass = 1.0 / lightness
    if profile == "sap":
        late = dt + RELAXATION
        mean = math.sqrt((lightness**2 + 2.0 * rubbed**2) / 9.0)
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
    """``metric`` by the recurrence: a ball above a level floor, thrown or dropped, or two that overlap.

    Two overlapping balls are equivalent to one, with the reduced mass, that starts inside a floor.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        motion = _motion(scene, dt, profile) or _parted(scene, dt, profile)
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
    told, normal = [], np.eye(scene.dimension)[up]
    for step in range(1, steps + 1):
        free = v + spatial.gravity[2] * dt
        v = _pressed(profile, 1.0 / mass, 1.0 / mass + (radius + 0.5 * min(y, 0.0)) ** 2 / inertia, -y, free, dt)
        y += v * dt
        pose[step, 1, up], twist[step, 1, up] = y + radius, v
        told.append((0, 1, 0.0 * normal, normal, mass * (v - free) * normal, y))
    record = ContactRecord(np.arange(1, steps + 1), np.arange(steps + 1), Contacts.from_rows(told, scene.dimension))
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, record, dt, "completed")


def _parted(scene: Scene, dt: float, profile: str) -> Trajectory | None:
    """Two balls in free space, one beside the other along x, with equal velocities and without rotation."""
    spatial = scene if scene.dimension == 3 else lift(scene)
    if len(scene.bodies) != 2 or any(spatial.gravity):
        return None
    first, second = spatial.bodies
    if not isinstance(first.shape, Sphere) or not isinstance(second.shape, Sphere):
        return None
    pair = spatial.material(first.name, second.name)
    alike = first.twist == second.twist and first.pose[1:] == second.pose[1:] and not any(first.twist[3:])
    loaded = any((*first.force, *first.torque, *second.force, *second.torque))
    if {first.motion, second.motion} != {"free"} or not alike or loaded or pair.restitution > 0.0:
        return None
    reach, steps = first.shape.radius + second.shape.radius, step_count(scene.duration, dt)
    lightness = 1.0 / first.mass + 1.0 / second.mass
    pose = np.repeat(np.array([[body.pose for body in scene.bodies]]), steps + 1, axis=0)
    twist = np.repeat(np.array([[body.twist for body in scene.bodies]]), steps + 1, axis=0)
    pose[:, :, : scene.dimension] += np.arange(steps + 1)[:, None, None] * dt * twist[:, :, : scene.dimension]
    x, v = reach - (second.pose[0] - first.pose[0]), 0.0
    for step in range(1, steps + 1):
        rubbed = lightness
        for body in (first, second):
            assert isinstance(body.shape, Sphere)
            rubbed += (body.shape.radius - 0.5 * max(x, 0.0)) ** 2 / float(np.broadcast_to(body.inertia, 3)[0])
        before, v = v, _pressed(profile, lightness, rubbed, x, v, dt)
        x -= v * dt
        for k, (body, way) in enumerate(((first, -1.0), (second, 1.0))):
            change = way * (v - before) / (lightness * body.mass)
            twist[step:, k, 0] += change
            pose[step:, k, 0] += change * dt * np.arange(1, steps + 2 - step)
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, None, dt, "completed")
