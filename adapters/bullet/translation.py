"""A scene for Bullet: values per body, boxes for half-spaces, moments."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from adapters.scene import Body, Box, Capsule, Cylinder, HalfSpace, Hull, Scene, Sphere
from adapters.scene.meeting import Meeting, representable

#: Half thickness of the box for a half-space [m]: more than the motion in any step, and thin enough that contact
#: distances, computed relative to its centre, are exact to 1e-14 m.
FLOOR_DEPTH = 20.0
#: Bullet's capsules and cylinders lie along their z axis, ours along the body's x: quaternion (x, y, z, w).
Z_TO_X = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))
#: Half width of that box beyond the outermost body [m]: a body may slide 100 m on it.
FLOOR_REACH = 200.0


def factors(scene: Scene, coefficient: str) -> list[float] | None:
    """Values per body whose products are the coefficients of all pairs, or of those that meet; None if there are none.

    Bullet multiplies the coefficients of two bodies (btManifoldResult.cpp:58,70). With one free body its partners have
    the pair's value and it has 1, which is exact. Otherwise the logarithms of the positive pairs solve a linear system,
    and a pair of 0 needs a body without a positive pair.
    """
    return representable(scene, lambda pairs: _factors(scene, pairs, coefficient))


def _factors(scene: Scene, meetings: Sequence[Meeting], coefficient: str) -> list[float] | None:
    pairs = [(i, j, float(getattr(material, coefficient))) for i, j, material in meetings]
    free = [i for i, body in enumerate(scene.bodies) if body.motion == "free"]
    shares = [0.0] * len(scene.bodies)
    if len(free) == 1:
        shares[free[0]] = 1.0
        for i, j, value in pairs:
            shares[i if j == free[0] else j] = value
        return shares
    values = {value for _, _, value in pairs}
    if len(values) == 1:
        return [math.sqrt(values.pop())] * len(scene.bodies)
    positive = [(i, j, value) for i, j, value in pairs if value > 0.0]
    rows = np.zeros((len(positive), len(scene.bodies)))
    for row, (i, j, _) in enumerate(positive):
        rows[row, i] = rows[row, j] = 1.0
    logs = np.linalg.lstsq(rows, np.log([value for _, _, value in positive]), rcond=None)[0]
    for body in np.flatnonzero(rows.any(axis=0)):
        shares[body] = float(np.exp(logs[body]))
    # 1e-12: round-off of the logarithms; anything larger means that no product represents the table.
    return shares if all(abs(shares[i] * shares[j] - value) <= 1e-12 for i, j, value in pairs) else None


def _turn_up_to(normal: tuple[float, ...]) -> tuple[float, float, float, float]:
    """Quaternion (x, y, z, w) that turns the z axis into ``normal``."""
    x, y, z = normal
    if z <= -1.0 + 1e-15:
        return (1.0, 0.0, 0.0, 0.0)
    q = np.array([-y, x, 0.0, 1.0 + z])
    qx, qy, qz, qw = (float(c) for c in q / np.linalg.norm(q))
    return (qx, qy, qz, qw)


def placement(body: Body, scene: Scene) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Sizes (half extents, radius, radius and length), position and quaternion (x, y, z, w) for Bullet."""
    w, x, y, z = body.pose[3:]
    if isinstance(body.shape, Sphere):
        return (body.shape.radius,), body.pose[:3], (x, y, z, w)
    if isinstance(body.shape, Box):
        return body.shape.half_extents, body.pose[:3], (x, y, z, w)
    if isinstance(body.shape, Capsule | Cylinder):
        return (body.shape.radius, 2.0 * body.shape.half_length), body.pose[:3], (x, y, z, w)
    if isinstance(body.shape, Hull):
        return (), body.pose[:3], (x, y, z, w)
    assert isinstance(body.shape, HalfSpace)
    width = FLOOR_REACH + max(math.hypot(*other.pose[:3]) for other in scene.bodies)
    centre = tuple((body.shape.offset - FLOOR_DEPTH) * n for n in body.shape.normal)
    return (width, width, FLOOR_DEPTH), centre, _turn_up_to(body.shape.normal)


def moments(body: Body, mass: float) -> tuple[float, ...]:
    """Principal moments as stated; equal ones for a prescribed body, so that its spin does not precess."""
    if body.motion == "free":
        assert isinstance(body.inertia, tuple)
        return body.inertia
    size = FLOOR_DEPTH if isinstance(body.shape, HalfSpace) else body.shape.smallest_size
    return (mass * size**2,) * 3
