"""A scene for Chipmunk: one value per body for materials of pairs, bodies, shapes, a slab for a half-space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from adapters.needs import needs
from adapters.scene import Body, Box, Capsule, Disc, HalfSpace, Polygon, Scene
from adapters.scene.meeting import Meeting, representable

#: A half-space is one thick static polygon. Detection is not swept, so a body deeper than half the depth in one step
#: leaves on the wrong side: 1 km is safe to 1e5 m/s at 1/240 s. Results do not depend on either number (the ten-box
#: column is bit-identical for depths 10 m .. 10 km and half widths 1 km .. 10 km).
GROUND_DEPTH = 1e3
GROUND_HALF_WIDTH = 1e4
#: Error of the product of two factors by the rounding of logarithms, exponentials and a product
#: (relative; 7e-15, well below the 1e-12 of every check of a single contact).
FACTOR_ROUNDING = 32.0 * np.finfo(float).eps


def factors(scene: Scene, quantity: str) -> list[float] | None:
    """One number per body whose products are the pairs' ``quantity``, or None if there are none.

    The immovable partner has 1 if possible, so a value is exact; otherwise factors solve ``log f_i + log f_j = log
    value`` over all pairs, or over those that can touch (a root of the value if all are equal).
    """
    return representable(scene, lambda pairs: _factors(scene, pairs, quantity))


def _factors(scene: Scene, meetings: Sequence[Meeting], quantity: str) -> list[float] | None:
    pairs = [(i, j, float(getattr(material, quantity))) for i, j, material in meetings]
    n = len(scene.bodies)
    to_immovable = [1.0] * n
    for i, j, value in pairs:
        for body, partner in ((i, j), (j, i)):
            if scene.bodies[body].motion == "free" and scene.bodies[partner].motion != "free":
                to_immovable[body] = value
    for candidate in (to_immovable, _factors_by_logarithm(n, pairs)):
        if all(abs(candidate[i] * candidate[j] - value) <= FACTOR_ROUNDING * value for i, j, value in pairs):
            return candidate
    return None


def _factors_by_logarithm(n: int, pairs: list[tuple[int, int, float]]) -> list[float]:
    """Least-squares factors of the positive pairs; a body without a positive pair gets 0."""
    positive = [(i, j, value) for i, j, value in pairs if value > 0.0]
    if len({value for _, _, value in positive}) == 1:
        root = math.sqrt(positive[0][2])
        used = {k for i, j, _ in positive for k in (i, j)}
        return [root if k in used else 0.0 for k in range(n)]
    rows = np.zeros((len(positive), n))
    for row, (i, j, _) in enumerate(positive):
        rows[row, [i, j]] = 1.0
    logs = np.linalg.lstsq(rows, np.log([value for _, _, value in positive]), rcond=None)[0]
    return [float(np.exp(logs[k])) if rows[:, k].any() else 0.0 for k in range(n)]


def moment(body: Body) -> float:
    """Planar inertia [kg m^2]; scenes are validated, so a free planar body has one value."""
    assert isinstance(body.inertia, float | int)
    return float(body.inertia)


def leaves_ground(scene: Scene, dt: float) -> str | None:
    """Why the ground's polygon is too small for ``scene``, or None."""
    if not any(isinstance(body.shape, HalfSpace) for body in scene.bodies):
        return None
    speed = needs(scene).top_speed
    if speed * dt > 0.5 * GROUND_DEPTH:
        return f"dt: at {speed:.3g} m/s a body passes {0.5 * GROUND_DEPTH:g} m of ground in one step, undetected"
    return None


def made_body(asked: Body) -> Any:
    """Body with mass, state and kind, in no space yet."""
    import pymunk

    if asked.motion == "free":
        body = pymunk.Body(asked.mass, moment(asked))
    else:
        kind = pymunk.Body.STATIC if asked.motion == "fixed" else pymunk.Body.KINEMATIC
        body = pymunk.Body(body_type=kind)
    x, y, theta = asked.pose
    body.position, body.angle = (x, y), theta
    if asked.motion != "fixed":
        vx, vy, omega = asked.twist
        body.velocity, body.angular_velocity = (vx, vy), omega
    return body


def made_shape(scene: Scene, asked: Body, body: Any, skin: float) -> Any:
    """Shape of ``asked``, a body of ``scene``, grown by ``skin`` [m] on all sides."""
    import pymunk

    shape = asked.shape
    if isinstance(shape, Disc):
        return pymunk.Circle(body, shape.radius + skin)
    if isinstance(shape, Capsule):
        ends = ((-shape.half_length, 0.0), (shape.half_length, 0.0))
        return pymunk.Segment(body, *ends, shape.radius + skin)
    return pymunk.Poly(body, corners(scene, asked), radius=skin)


def corners(scene: Scene, asked: Body) -> list[tuple[float, float]]:
    """Corners of the polygon of a shape, in body axes."""
    shape = asked.shape
    if isinstance(shape, Box):
        hx, hy = shape.half_extents
        return [(-hx, -hy), (hx, -hy), (hx, hy), (-hx, hy)]
    if isinstance(shape, Polygon):
        return list(shape.vertices)
    assert isinstance(shape, HalfSpace)
    return _ground(shape, _middle(scene, asked, shape))


def _middle(scene: Scene, asked: Body, shape: HalfSpace) -> float:
    """Middle of the bodies along a half-space's face, to a half width of the slab [m]: 0 unless they are far away."""
    x, y, theta = asked.pose
    nx, ny = shape.normal
    c, s = math.cos(theta), math.sin(theta)
    along = [
        (c * dx + s * dy) * ny - (c * dy - s * dx) * nx
        for dx, dy in ((body.pose[0] - x, body.pose[1] - y) for body in scene.bodies if body.motion == "free")
    ]
    # The median: a single far body does not move the slab.
    return GROUND_HALF_WIDTH * round(sorted(along)[len(along) // 2] / GROUND_HALF_WIDTH) if along else 0.0


def _ground(shape: HalfSpace, middle: float) -> list[tuple[float, float]]:
    """Corners of a thick slab whose upper face is the half-space's, about ``middle`` along it."""
    nx, ny = shape.normal
    corners = []
    for along, depth in ((-1.0, GROUND_DEPTH), (-1.0, 0.0), (1.0, 0.0), (1.0, GROUND_DEPTH)):
        height, side = shape.offset - depth, middle + along * GROUND_HALF_WIDTH
        corners.append((height * nx + side * ny, height * ny - side * nx))
    return corners
