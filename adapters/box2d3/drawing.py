"""Contacts of Box2D 3.1 from the engine's debug drawing, the only access in its bindings.

The bindings have no call for a body's contacts. The engine draws each contact's points and normals without the bodies,
which follow from the place of the point. The drawn impulses are sums over the solve and the relaxation of each substep,
without restitution: twice the weight of a resting body, and in a blow the impulse of the stop. They do not give a
momentum; they only show that a contact pushed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pyb2d3
from numpy.typing import NDArray

from adapters.engine import Array, EngineError
from adapters.scene import Body, Box, Disc, HalfSpace

#: Point and unit normal of a touching or pushing contact.
Point = tuple[float, float, float, float]
#: Colour of the points of speculative contacts, which do not touch. [b2DrawContacts, b2_colorGray3]
AHEAD = 0x4D4D4D
#: Round-off of the product of two unit normals in single precision, and the arc of a small rotation within a step.
ALONG = 1e-3


class Pen(pyb2d3.DebugDraw):
    """Records points and segments that the engine draws of its contacts."""

    def __init__(self) -> None:
        super().__init__()
        self.draw_shapes = self.draw_joints = False
        self.draw_contacts = True
        self.points: list[tuple[tuple[float, float], bool]] = []
        self.segments: list[tuple[float, float]] = []

    def draw_point(self, p: Any, size: float, color: int) -> None:
        """Record the point, and whether it is only speculative."""
        x, y = p
        self.points.append(((float(x), float(y)), color == AHEAD))

    def draw_segment(self, p1: Any, p2: Any, color: int) -> None:
        """Record the vector: a normal, or an impulse along it."""
        (x, y), (u, v) = p1, p2
        self.segments.append((float(u) - float(x), float(v) - float(y)))

    def drawn(
        self, world: Any, normals: bool
    ) -> tuple[list[tuple[tuple[float, float], bool]], list[tuple[float, float]]]:
        """Points and vectors of all contacts, with their normals or their impulses."""
        self.draw_contact_normals, self.draw_contact_impulses = normals, not normals
        self.points, self.segments = [], []
        world.draw(self, False)
        return self.points, self.segments


def touching(pen: Pen, world: Any) -> list[Point]:
    """Points of contacts that touch, or have pushed within the step, with normals of length 1.

    Raises
    ------
    EngineError
        If the numbers of points and vectors differ.
    """
    points, normals = pen.drawn(world, True)
    # Pushes matter only where points are speculative.
    _, pushes = pen.drawn(world, False) if any(ahead for _, ahead in points) else (points, normals)
    if not len(points) == len(normals) == len(pushes):
        raise EngineError(f"contacts: {len(points)} points are drawn with {len(normals)} normals")
    found = []
    for (place, ahead), (x, y), push in zip(points, normals, pushes, strict=True):
        length = math.hypot(x, y)
        if length > 0.0 and (not ahead or any(push)):
            found.append((*place, x / length, y / length))
    return found


def named(
    points: Array, normals: Array, bodies: Sequence[Body], places: Iterable[Array]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Bodies of k contacts: both touch the plane through the point across the normal, the first one from behind.

    ``places``: position (x, y) [m], cosine and sine of the angle of each body when each contact was found, (4, k).
    """
    (x, y), (nx, ny) = points.T, normals.T
    level, behind, ahead = nx * x + ny * y, [], []
    for body, at in zip(bodies, places, strict=True):
        away = np.maximum(0.0, _distance(body, at, x, y))
        behind.append(away + np.abs(level - _farthest(body, at, nx, ny)))
        ahead.append(away + np.abs(level + _farthest(body, at, -nx, -ny)))
    free = np.array([[body.motion == "free"] for body in bodies])
    possible = (free | free.T) & ~np.eye(len(bodies), dtype=bool)
    costs = (np.where(row[:, None], own + ahead, np.inf) for row, own in zip(possible, behind, strict=True))
    least, second = np.moveaxis(np.array([(cost.min(axis=0), cost.argmin(axis=0)) for cost in costs]), 1, 0)
    first = least.argmin(axis=0)
    return first, second[first, np.arange(len(x))].astype(np.int64)


def _farthest(body: Body, place: Array, nx: Array, ny: Array) -> Array:
    """Extent of a body along a unit direction [m]; a half-space has one along its normal only."""
    shape = body.shape
    if isinstance(shape, HalfSpace):
        along = nx * shape.normal[0] + ny * shape.normal[1] > 1.0 - ALONG
        return np.where(along, shape.offset, np.inf)
    x, y, c, s = place
    centre: Array = nx * x + ny * y
    if not isinstance(shape, Box):
        assert isinstance(shape, Disc)  # the only other shape of this engine
        return centre + shape.radius
    a, b = shape.half_extents
    return np.asarray(centre + a * abs(nx * c + ny * s) + b * abs(ny * c - nx * s))


def _distance(body: Body, place: Array, x: Array, y: Array) -> Array:
    """Signed distance of a point from a body's surface, negative inside [m]."""
    shape = body.shape
    if isinstance(shape, HalfSpace):
        return shape.normal[0] * x + shape.normal[1] * y - shape.offset
    px, py, c, s = place
    u, v = x - px, y - py
    if not isinstance(shape, Box):
        assert isinstance(shape, Disc)
        return np.asarray(np.hypot(u, v) - shape.radius)
    a = abs(c * u + s * v) - shape.half_extents[0]
    b = abs(c * v - s * u) - shape.half_extents[1]
    return np.asarray(np.hypot(np.maximum(a, 0.0), np.maximum(b, 0.0)) + np.minimum(np.maximum(a, b), 0.0))
