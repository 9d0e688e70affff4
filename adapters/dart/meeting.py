"""Bodies that fall, collide or lie on each other without slip or spin, step by step as in DART.

    v  <-  v + g dt                    gravity first: a rebound contains that of the step, e g dt
    for each touching pair, with approach speed s and overlap p:
        u = e s                        with restitution, up to 100 m/s
        u = min(p/100 dt, 1 mm/s)      without restitution
    w + (A + c D) j = u, or j = 0      all at once: w of a pair after the step, j its impulse, c = 1e-5
    x  <-  x + v dt

``A`` gives the pairs' speeds per impulse. ``D`` is a contact's own response, for flat boxes that of one corner of four:
light bodies yield to heavy loads faster than they are corrected. Simultaneous blows are solved together, so the speeds
of a rack follow from this law, not from mechanics.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from adapters.dart.shipped import FASTEST, MIXING, PUSH_OUT, PUSHED_SHARE, THRESHOLD
from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.law.single_precision import Held
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.scene.lift import lift
from adapters.scene.shapes import reach
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: Gap that counts as touching [m], for places of order 1 in double precision.
TOUCHING = 1e-12


def meeting_law(metric: str, share: float, least: float) -> Law:
    """``metric`` by the recurrence, to a ``share`` of its size and to ``least``, in its unit."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        motion = _motion(Held(scene), dt)
        value = None if motion is None else measure(scene, motion)[metric][0]
        return None if value is None else (value, share * abs(value) + least)

    return law


def _is_told(scene: Scene, bodies: list[Body]) -> bool:
    """Whether there is no spin or load, and either smooth balls without gravity, or motion along one line only."""
    balls = [body for body in bodies if isinstance(body.shape, Sphere)]
    boxes = [body for body in bodies if isinstance(body.shape, Box) and body.pose[3:] == (1.0, 0.0, 0.0, 0.0)]
    faces = [body for body in bodies if isinstance(body.shape, HalfSpace) and body.motion == "fixed"]
    loaded = any(any((*body.twist[3:], *body.force, *body.torque)) for body in bodies)
    known = len(balls) + len(boxes) + len(faces) == len(bodies)
    if loaded or not known or any(body.motion != "free" for body in balls + boxes):
        return False
    if not boxes and not any(scene.gravity) and not any(friction for _, friction in scene.materials()):
        return True
    # A vertical line through the centres of all: without sideways motion there is no slip and no friction.
    level = all(isinstance(face.shape, HalfSpace) and face.shape.normal == (0.0, 0.0, 1.0) for face in faces)
    still = not any((*scene.gravity[:2], *(speed for body in bodies for speed in body.twist[:2])))
    return level and still and len({body.pose[:2] for body in balls + boxes}) == 1 and not (balls and boxes)


def _leaves(ball: Body, other: Body) -> bool:
    """Whether ``other`` starts beside the ball and moves away from it, without effect here."""
    if other is ball or isinstance(other.shape, HalfSpace) or not isinstance(ball.shape, Sphere):
        return False
    between = np.subtract(other.pose[:2], ball.pose[:2])
    apart = ball.shape.radius + reach(other.shape)
    return bool(np.linalg.norm(between) > apart and between @ np.array(other.twist[:2]) >= 0.0)


@lru_cache(maxsize=32)
def _motion(held: Held, dt: float) -> Trajectory | None:
    """The whole run, in the scene's own dimension; leaving bodies are left at their start."""
    scene = held.scene
    spatial = scene if scene.dimension == 3 else lift(scene)
    bodies, axes = spatial.bodies, [0, 1, 2] if scene.dimension == 3 else [0, 2]
    told = [k for k, body in enumerate(bodies) if not (any(spatial.gravity) and _leaves(bodies[1], body))]
    if not _is_told(spatial, [bodies[k] for k in told]):
        return None
    x = np.array([body.pose[:3] for body in bodies])
    v = np.array([body.twist[:3] if k in told else (0.0,) * 3 for k, body in enumerate(bodies)])
    free = [k in told and body.motion == "free" for k, body in enumerate(bodies)]
    lightness = np.array([1.0 / body.mass if moves else 0.0 for body, moves in zip(bodies, free, strict=True)])
    fall = np.outer(lightness > 0.0, spatial.gravity) * dt
    pairs = [(i, j, m.restitution) for i, j, m in spatial.contact_pairs() if i in told and j in told]
    steps = step_count(scene.duration, dt)
    pose, twist = (np.repeat(np.array([[getattr(body, name) for body in scene.bodies]]), steps + 1, axis=0)
                   for name in ("pose", "twist"))  # fmt: skip
    for step in range(1, steps + 1):
        v = _struck(bodies, x, v + fall, lightness, pairs, dt)
        x = x + v * dt
        pose[step, free, : len(axes)], twist[step, free, : len(axes)] = x[free][:, axes], v[free][:, axes]
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, None, dt, "completed")


def _apart(first: Body, second: Body, between: Array) -> tuple[float, Array]:
    """Gap of two bodies [m], and the direction from the first to the second; ``between`` their centres."""
    a, b = first.shape, second.shape
    if isinstance(b, HalfSpace):
        gap, normal = _apart(second, first, -between)
        return gap, -normal
    if isinstance(a, HalfSpace):
        normal = np.array(a.normal)
        gap = float(normal @ (between + first.pose[:3])) - a.offset
        return gap - (b.half_extents[2] if isinstance(b, Box) else reach(b)), normal
    if isinstance(a, Sphere) and isinstance(b, Sphere):
        length = float(np.linalg.norm(between))
        return length - a.radius - b.radius, between / length
    assert isinstance(a, Box) and isinstance(b, Box)
    return abs(float(between[2])) - a.half_extents[2] - b.half_extents[2], np.sign(between * (0.0, 0.0, 1.0))


def _own(pair: tuple[Body, Body]) -> float:
    """Response of one point of contact, over the number of points that share the load [1/kg]."""
    boxes = [(body, body.shape.half_extents) for body in pair if isinstance(body.shape, Box)]
    linear = sum(1.0 / body.mass for body in pair if body.motion == "free")
    if not boxes:
        return linear
    x, y = (min(half[k] for _, half in boxes) for k in (0, 1))
    moments = [np.broadcast_to(body.inertia, 3) for body, _ in boxes]
    return (linear + sum(float(y * y / moment[0] + x * x / moment[1]) for moment in moments)) / 4.0


def _struck(
    bodies: tuple[Body, ...], x: Array, v: Array, lightness: Array, pairs: list[tuple[int, int, float]], dt: float
) -> Array:
    """Velocities after a step's impulses; contacts with negative impulses are dropped, the worst first."""
    rows, wanted, own = [], [], []
    for i, j, e in pairs:
        gap, normal = _apart(bodies[i], bodies[j], x[j] - x[i])
        if gap > TOUCHING:
            continue
        row = np.zeros_like(v)
        row[i], row[j] = -normal, normal
        rebound = min(-e * float((row * v).sum()), FASTEST)
        rows.append(row)
        wanted.append(rebound if rebound > THRESHOLD else min(PUSHED_SHARE * max(0.0, -gap) / dt, PUSH_OUT))
        own.append(_own((bodies[i], bodies[j])))
    touching = list(range(len(rows)))
    while touching:
        jacobian = np.array([rows[k] for k in touching])
        response = np.einsum("aik,i,bik->ab", jacobian, lightness, jacobian)
        asked = np.array(wanted)[touching] - np.einsum("aik,ik->a", jacobian, v)
        given = np.linalg.solve(response + MIXING * np.diag(np.array(own)[touching]), asked)
        if given.min() >= 0.0:
            return np.asarray(v + lightness[:, None] * np.einsum("a,aik->ik", given, jacobian))
        touching.pop(int(given.argmin()))
    return v
