"""Bodies in a line that meet or lie on each other, step by step as DART moves them.

    v  <-  v + g dt
    for each pair that touches, with its approach s and its overlap p:
        u = e s                        where that is a rebound
        u = min(p/100 dt, 1 mm/s)      where it is none
    w + (A + c D) j = u, or j = 0      all at once: w of a pair after the step, j its impulse, c = 1e-5
    x  <-  x + v dt

``A`` is what impulses do to the pairs' speeds. ``D`` is a contact's own response, which of flat boxes is that of one
corner of four: light bodies give way to heavy loads faster than they are pushed out.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np

from adapters.dart.shipped import FASTEST, MIXING, PUSH_OUT, PUSHED_SHARE, THRESHOLD
from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.lift import lift
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: Gap that counts as touching [m], for places of order 1 in doubles.
TOUCHING = 1e-12
#: What corners that share a load unevenly may add, as a share: another compliance. Measured 7e-6 at most.
UNEVEN = MIXING


def in_line_law(metric: str, axis: int) -> Law:
    """What the recurrence makes of ``metric`` for bodies along x (``axis`` 0) or along z (2)."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        motion = _motion(scene, dt, axis)
        value = None if motion is None else measure(scene, motion)[metric][0]
        return None if value is None else (value, UNEVEN * abs(value) + 1e-9)

    return law


@lru_cache(maxsize=32)
def _line(bodies: tuple[Body, ...], axis: int) -> tuple[list[int], Array, Array, Array] | None:
    """Order along the axis, free or not (as 1/m), half lengths, and response of one point over that of all."""
    order = sorted(range(len(bodies)), key=lambda k: _place(bodies[k], axis))
    lightness, half = [], []
    for k in order:
        body = bodies[k]
        if isinstance(body.shape, HalfSpace):
            half.append(0.0)
        elif isinstance(body.shape, Sphere):
            half.append(body.shape.radius)
        elif isinstance(body.shape, Box) and body.pose[3:] == (1.0, 0.0, 0.0, 0.0):
            half.append(body.shape.half_extents[axis])
        else:
            return None
        lightness.append(1.0 / body.mass if body.motion == "free" else 0.0)
    own = [_own(bodies[i], bodies[j]) for i, j in pairwise(order)]
    return order, np.array(lightness), np.array(half), np.array(own)


def _place(body: Body, axis: int) -> float:
    """Place of a body's centre along the axis [m]; of a half-space its face."""
    if isinstance(body.shape, HalfSpace):
        return body.shape.offset
    return body.pose[:3][axis]


def _own(low: Body, high: Body) -> float:
    """Response of one point of contact, over as many points as share the load [1/kg]."""
    boxes = [body for body in (low, high) if isinstance(body.shape, Box)]
    linear = sum(1.0 / body.mass for body in (low, high) if body.motion == "free")
    if not boxes:
        return linear
    arms = [min(body.shape.half_extents[k] for body in boxes if isinstance(body.shape, Box)) for k in (0, 1)]
    for body in boxes:
        if body.motion == "free":
            assert isinstance(body.inertia, tuple)
            linear += arms[1] ** 2 / body.inertia[0] + arms[0] ** 2 / body.inertia[1]
    return linear / 4.0


def _motion(scene: Scene, dt: float, axis: int) -> Trajectory | None:
    spatial = scene if scene.dimension == 3 else lift(scene)
    line = _line(spatial.bodies, axis)
    if line is None or any(any(body.force) or any(body.torque) for body in spatial.bodies):
        return None
    order, lightness, half, own = line
    bodies = [spatial.bodies[k] for k in order]
    x = np.array([_place(body, axis) for body in bodies])
    v = np.array([body.twist[:3][axis] for body in bodies])
    pull = np.where(lightness > 0.0, spatial.gravity[axis], 0.0)
    e = [spatial.material(a.name, b.name).restitution for a, b in pairwise(bodies)]
    reach = half[1:] + half[:-1]
    places, velocities = [x], [v]
    for _ in range(step_count(scene.duration, dt)):
        v = _struck(v + pull * dt, x[1:] - x[:-1] - reach, lightness, own, e, dt)
        x = x + v * dt
        places.append(x)
        velocities.append(v)
    return _told(scene, dt, order, np.array(places), np.array(velocities), axis)


def _struck(v: Array, gap: Array, lightness: Array, own: Array, e: list[float], dt: float) -> Array:
    """Velocities after a step's impulses; contacts that would pull are left out, the worst first."""
    touching = [k for k in range(len(gap)) if gap[k] <= TOUCHING]
    wanted = {}
    for k in touching:
        rebound = min(e[k] * (v[k] - v[k + 1]), FASTEST)
        pushed = min(PUSHED_SHARE * max(0.0, -gap[k]) / dt, PUSH_OUT)
        wanted[k] = max(rebound, pushed) if rebound > THRESHOLD else pushed
    while touching:
        size = len(touching)
        jacobian = np.zeros((size, len(v)))
        for row, k in enumerate(touching):
            jacobian[row, [k, k + 1]] = (-1.0, 1.0)
        matrix = (jacobian * lightness) @ jacobian.T + MIXING * np.diag(own[touching])
        given = np.linalg.solve(matrix, np.array([wanted[k] for k in touching]) - jacobian @ v)
        if given.min() >= 0.0:
            return np.asarray(v + lightness * (jacobian.T @ given))
        touching.pop(int(given.argmin()))
    return v


def _told(scene: Scene, dt: float, order: list[int], places: Array, velocities: Array, axis: int) -> Trajectory:
    """The motion as a trajectory of the scene's own dimension; what is not along the axis stays."""
    up = 0 if axis == 0 else scene.dimension - 1
    pose = np.repeat(np.array([[body.pose for body in scene.bodies]]), len(places), axis=0)
    twist = np.zeros((len(places), len(order), len(scene.bodies[0].twist)))
    for column, k in enumerate(order):
        if not isinstance(scene.bodies[k].shape, HalfSpace):
            pose[:, k, up], twist[:, k, up] = places[:, column], velocities[:, column]
    return Trajectory(np.arange(len(places), dtype=np.float64) * dt, pose, twist, None, dt, "completed")
