"""A box or a ball that slips over a level floor with a friction pyramid, step by step as in DART.

    vz  <-  vz - g dt                     then stopped, or corrected, in a contact: meeting.py
    for each axis of the floor by itself, with its slip s and the floor's push n of this step:
        j = min(mu n, m |s|/(1 + k))      k = m r^2/I of a ball, 0 of a box, which does not turn
        v <- v - j/m,  s <- s - (1 + k) j/m
    x   <-  x + v dt

An exact touch may be found in the first or in the second step: the band covers both.
"""

from __future__ import annotations

import numpy as np

from adapters.dart.shipped import MIXING, PUSH_OUT, PUSHED_SHARE
from adapters.engine import Array, Contacts
from adapters.law import Law, Measure, Prediction
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Trajectory

#: Gap at the start without contact [m]: round-off of places of order 1.
ROUNDED = 1e-15
#: Effect of compliance on loads and slips, and of a lever arm shorter by the overlap of one step of a fall: the
#: friction's share of it, times ten for metrics of two speeds.
SHARE = 10.0 * MIXING


def pyramid_law(metric: str) -> Law:
    """``metric`` by the recurrence."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if not _simple(scene):
            return None
        found = [measure(scene, _motion(scene, dt, gap))[metric][0] for gap in (0.0, ROUNDED)]
        if found[0] is None or found[1] is None:
            return None
        low, high = found[0], found[1]
        body = scene.bodies[-1]
        arm = scene.gravity[2] * dt * dt / body.shape.radius if isinstance(body.shape, Sphere) else 0.0
        band = 0.5 * abs(high - low) + (SHARE + abs(arm)) * (1.0 + abs(low))
        return 0.5 * (low + high), band

    return law


def _simple(scene: Scene) -> bool:
    """Whether a ball, or an unrotated box, slips on the floor that it touches, without other loads."""
    if scene.dimension != 3 or len(scene.bodies) != 2 or any(scene.gravity[:2]):
        return False
    floor, body = scene.bodies
    if floor.shape != HalfSpace((0.0, 0.0, 1.0), 0.0) or any((*body.force, *body.torque, body.twist[2])):
        return False
    if isinstance(body.shape, Box):
        return body.pose[3:] == (1.0, 0.0, 0.0, 0.0) and not any(body.twist[3:]) and _height(body) == 0.0
    return isinstance(body.shape, Sphere) and _height(body) == 0.0


def _height(body: Body) -> float:
    shape = body.shape
    assert isinstance(shape, Box | Sphere)
    return body.pose[2] - (shape.radius if isinstance(shape, Sphere) else shape.half_extents[2])


def _motion(scene: Scene, dt: float, gap: float) -> Trajectory:
    floor, body = scene.bodies
    mu, g, steps = scene.material(floor.name, body.name).friction, -scene.gravity[2], step_count(scene.duration, dt)
    radius, k = 0.0, 0.0
    if isinstance(body.shape, Sphere):
        radius = body.shape.radius
        k = body.mass * radius**2 / float(np.broadcast_to(body.inertia, 3)[0])
    spin = np.array(body.twist[3:])
    v, u = np.array(body.twist[:2]), radius * np.array([-spin[1], spin[0]])
    x, height, fall = np.array(body.pose[:2]), gap, 0.0
    pose = np.repeat(np.array([[each.pose for each in scene.bodies]]), steps + 1, axis=0)
    twist = np.repeat(np.array([[each.twist for each in scene.bodies]]), steps + 1, axis=0)
    impulse = np.zeros((steps + 1, 3))
    for step in range(1, steps + 1):
        fall -= g * dt
        pushed = 0.0
        if height <= 0.0:
            pushed = max(0.0, min(PUSHED_SHARE * -height / dt, PUSH_OUT) - fall) / (1.0 + MIXING)
        fall += pushed
        height += fall * dt
        slip: Array = v + u
        given = np.sign(slip) * np.minimum(mu * pushed, np.abs(slip) / (1.0 + k))
        v, u = v - given, u - k * given
        x = x + v * dt
        pose[step, 1, :2], twist[step, 1, :2] = x, v
        impulse[step] = body.mass * np.array((*-given, pushed))
        if radius:
            twist[step, 1, 3:5] = (u[1] / radius, -u[0] / radius)
    first, unknown = np.zeros(steps + 1, np.int64), np.full((steps + 1, 3), np.nan)
    rows = Contacts(first, first + 1, unknown, unknown, impulse, unknown[:, 0])
    contacts = ContactRecord(np.arange(steps + 1), np.arange(steps + 2), rows)
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, contacts, dt, "completed")
