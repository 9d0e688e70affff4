"""Balls that meet in free space, whole racks of them, step by step as DART moves them.

    for each pair that touches, with its approach s and its overlap p:
        u = e s                        where that is a rebound
        u = min(p/100 dt, 1 mm/s)      where it is none
    w + (1 + c) A j = u, or j = 0      all at once: w of a pair after the step, j its impulse, c = 1e-5 on the diagonal
    x  <-  x + v dt

``A`` is what impulses do to the pairs' speeds. Balls are smooth and do not turn; what is fixed is a half-space. A blow
that others follow before it is over is shared: speeds of a rack are those of this law and of no law of mechanics.
"""

from __future__ import annotations

import numpy as np

from adapters.dart.shipped import FASTEST, MIXING, PUSH_OUT, PUSHED_SHARE, THRESHOLD
from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.scene import Disc, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: Gap that counts as touching [m], for places of order 1 in doubles.
TOUCHING = 1e-12
#: Rounding of the recurrence against the engine: roundings of 1e-16 of some hundred steps, times what twenty blows in
#: turn make of an error across a gap of a thousandth of a radius.
ROUND_OFF = 1e-8


def balls_law(metric: str) -> Law:
    """What the recurrence makes of ``metric``."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if not _simple(scene):
            return None
        motion = _motion(scene, dt)
        value = measure(scene, motion)[metric][0]
        return None if value is None else (value, ROUND_OFF * (1.0 + abs(value)))

    return law


def _simple(scene: Scene) -> bool:
    """Whether smooth balls that do not spin move between half-spaces at rest, and nothing pulls at them."""
    dimension = scene.dimension
    for body in scene.bodies:
        round_one = isinstance(body.shape, Disc | Sphere) and body.motion == "free"
        at_rest = isinstance(body.shape, HalfSpace) and body.motion == "fixed" and not any(body.twist)
        if not (round_one or at_rest) or any((*body.twist[dimension:], *body.force, *body.torque)):
            return False
    return not any(scene.gravity) and not any(friction for _, friction in scene.materials())


def _motion(scene: Scene, dt: float) -> Trajectory:
    """The whole run."""
    dimension, bodies = scene.dimension, scene.bodies
    x = np.array([body.pose[:dimension] for body in bodies])
    v = np.array([body.twist[:dimension] for body in bodies])
    lightness = np.array([1.0 / body.mass if body.motion == "free" else 0.0 for body in bodies])
    pairs = [(i, j, material.restitution) for i, j, material in scene.contact_pairs()]
    steps = step_count(scene.duration, dt)
    pose = np.repeat(np.array([[body.pose for body in bodies]]), steps + 1, axis=0)
    twist = np.repeat(np.array([[body.twist for body in bodies]]), steps + 1, axis=0)
    for step in range(1, steps + 1):
        v = _struck(scene, x, v, lightness, pairs, dt)
        x = x + v * dt
        pose[step, :, :dimension], twist[step, :, :dimension] = x, v
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, None, dt, "completed")


def _apart(scene: Scene, x: Array, i: int, j: int) -> tuple[float, Array]:
    """Gap of two bodies [m], and the direction from the first to the second."""
    first, second = scene.bodies[i].shape, scene.bodies[j].shape
    if isinstance(first, HalfSpace) and isinstance(second, Disc | Sphere):
        normal = np.array(first.normal)
        return float(normal @ x[j]) - first.offset - second.radius, normal
    if isinstance(second, HalfSpace):
        gap, normal = _apart(scene, x, j, i)
        return gap, -normal
    assert isinstance(first, Disc | Sphere) and isinstance(second, Disc | Sphere)
    between = x[j] - x[i]
    length = float(np.linalg.norm(between))
    return length - first.radius - second.radius, between / length


def _struck(
    scene: Scene, x: Array, v: Array, lightness: Array, pairs: list[tuple[int, int, float]], dt: float
) -> Array:
    """Velocities after a step's impulses; contacts that would pull are left out, the worst first."""
    touching: list[int] = []
    rows: list[Array] = []
    wanted: list[float] = []
    for i, j, e in pairs:
        if lightness[i] + lightness[j] == 0.0:
            continue
        gap, normal = _apart(scene, x, i, j)
        if gap > TOUCHING:
            continue
        row = np.zeros_like(v)
        row[i], row[j] = -normal, normal
        rebound = min(-e * float((row * v).sum()), FASTEST)
        touching.append(len(rows))
        rows.append(row)
        wanted.append(rebound if rebound > THRESHOLD else min(PUSHED_SHARE * max(0.0, -gap) / dt, PUSH_OUT))
    while touching:
        jacobian = np.array([rows[k] for k in touching])
        response = np.einsum("aik,i,bik->ab", jacobian, lightness, jacobian)
        asked = np.array([wanted[k] for k in touching]) - np.einsum("aik,ik->a", jacobian, v)
        given = np.linalg.solve(response + MIXING * np.diag(np.diag(response)), asked)
        if given.min() >= 0.0:
            return np.asarray(v + lightness[:, None] * np.einsum("a,aik->ik", given, jacobian))
        touching.pop(int(given.argmin()))
    return v
