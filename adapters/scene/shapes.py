"""Shapes of bodies, and checks of the numbers of a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any


class SceneError(ValueError):
    """A scene is invalid; the message names the field in one line."""


def check_finite(name: str, values: Any) -> None:
    """Raise `SceneError` unless a number, or every one of a tuple, is finite."""
    for value in values if isinstance(values, tuple) else (values,):
        if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
            raise SceneError(f"{name}: {value!r} is not a finite number")


def check_positive(name: str, values: Any) -> None:
    """Raise `SceneError` unless a number, or every one of a tuple, is finite and above 0."""
    check_finite(name, values)
    for value in values if isinstance(values, tuple) else (values,):
        if value <= 0.0:
            raise SceneError(f"{name}: {value!r} must be greater than 0")


def check_length(name: str, values: tuple[float, ...], length: int) -> None:
    """Raise `SceneError` unless there are so many components."""
    if len(values) != length:
        raise SceneError(f"{name}: has {len(values)} components, needs {length}")


@dataclass(frozen=True)
class _Round:
    radius: float

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the radius is positive and finite."""
        check_positive(f"{owner}.shape.radius", self.radius)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * self.radius


class Disc(_Round):
    """Planar disc of ``radius`` [m]."""


class Sphere(_Round):
    """Ball of ``radius`` [m]."""


@dataclass(frozen=True)
class Box:
    """Box given by its HALF extents [m], two (planar) or three (spatial), along its body axes."""

    half_extents: tuple[float, ...]

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless all half extents are positive and finite."""
        check_positive(f"{owner}.shape.half_extents", self.half_extents)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * min(self.half_extents)


@dataclass(frozen=True)
class HalfSpace:
    """Everything with ``normal . x <= offset`` [m] is solid, in world axes; ``normal`` is a unit vector.

    The pose of its body is empty: normal and offset define its place, for a prescribed body at the start.
    """

    normal: tuple[float, ...]
    offset: float = 0.0

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the normal has length 1 (to 1e-9) and the offset is finite."""
        check_finite(f"{owner}.shape.normal", self.normal)
        check_finite(f"{owner}.shape.offset", self.offset)
        if abs(math.hypot(*self.normal) - 1.0) > 1e-9:
            raise SceneError(f"{owner}.shape.normal: {self.normal!r} must have length 1")

    @property
    def smallest_size(self) -> float:
        """A half-space has no finite extent."""
        return math.inf


@dataclass(frozen=True)
class Capsule:
    """All points within ``radius`` [m] of the segment from -half_length to +half_length [m] on the body's x axis."""

    half_length: float
    radius: float

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless both lengths are positive and finite."""
        check_positive(f"{owner}.shape.half_length", self.half_length)
        check_positive(f"{owner}.shape.radius", self.radius)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * self.radius

    @property
    def reach(self) -> float:
        """Distance of the outermost point from the centre [m]."""
        return self.half_length + self.radius


@dataclass(frozen=True)
class Cylinder:
    """Cylinder of ``radius`` about the body's x axis, from -half_length to +half_length [m]; spatial."""

    half_length: float
    radius: float

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless both lengths are positive and finite."""
        check_positive(f"{owner}.shape.half_length", self.half_length)
        check_positive(f"{owner}.shape.radius", self.radius)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * min(self.half_length, self.radius)

    @property
    def reach(self) -> float:
        """Distance of the outermost point from the centre [m]."""
        return math.hypot(self.half_length, self.radius)


@dataclass(frozen=True)
class Polygon:
    """Planar convex polygon: 3 to 64 ``vertices`` in body axes [m], counter-clockwise, the centroid at the origin."""

    vertices: tuple[tuple[float, float], ...]

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the vertices turn left all the way round once, about their centroid."""
        label = f"{owner}.shape.vertices"
        check_points(label, self.vertices, 2, 3)
        turns = 0.0
        for k, (bx, by) in enumerate(self.vertices):
            (ax, ay), (cx, cy) = self.vertices[k - 1], self.vertices[(k + 1) % len(self.vertices)]
            (ux, uy), (vx, vy) = (bx - ax, by - ay), (cx - bx, cy - by)
            turn = math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)
            if not 0.0 < turn < math.pi:
                raise SceneError(f"{label}: not convex and counter-clockwise at number {k}, {(bx, by)!r}")
            turns += turn
        if turns > 3.0 * math.pi:
            raise SceneError(f"{label}: go round the centre more than once")
        centre = area_and_centroid(self.vertices)[1]
        if math.hypot(*centre) > CENTRED * self.reach:
            raise SceneError(f"{label}: their centroid is {centre!r}, it must be the origin")

    @property
    def smallest_size(self) -> float:
        """Twice the smallest distance of an edge from the centroid [m]."""
        heights = []
        for k, (bx, by) in enumerate(self.vertices):
            ax, ay = self.vertices[k - 1]
            heights.append((ax * by - ay * bx) / math.hypot(bx - ax, by - ay))
        return 2.0 * min(heights)

    @property
    def reach(self) -> float:
        """Distance of the outermost point from the centre [m]."""
        return max(math.hypot(*vertex) for vertex in self.vertices)


@dataclass(frozen=True)
class Hull:
    """Convex hull of 4 to 64 ``vertices`` in body axes [m]; spatial, its centre of mass is the origin."""

    vertices: tuple[tuple[float, float, float], ...]

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the vertices are finite, different, and not all in one plane."""
        label = f"{owner}.shape.vertices"
        check_points(label, self.vertices, 3, 4)
        if self.smallest_size <= 1e-6 * self.reach:
            raise SceneError(f"{label}: lie in one plane, or almost")

    @property
    def smallest_size(self) -> float:
        """Smallest extent along the axes of largest and smallest spread [m]; at least the true one."""
        import numpy as np

        points = np.array(self.vertices)
        points = points - points.mean(axis=0)
        along = points @ np.linalg.svd(points)[2].T
        return float(np.ptp(along, axis=0).min())

    @property
    def reach(self) -> float:
        """Distance of the outermost point from the centre [m]."""
        return max(math.hypot(*vertex) for vertex in self.vertices)


#: Allowed distance of a polygon's centroid from the origin, as a share of its size: round-off of its source.
CENTRED = 1e-9
#: Most vertices of a polygon or a hull.
MOST_VERTICES = 64


def check_points(label: str, points: Any, dimension: int, least: int) -> None:
    """Raise `SceneError` unless the number of points and coordinates is right, and points are finite and different."""
    if not isinstance(points, tuple) or not least <= len(points) <= MOST_VERTICES:
        raise SceneError(f"{label}: {least} to {MOST_VERTICES} points are needed")
    for k, point in enumerate(points):
        if not isinstance(point, tuple):
            raise SceneError(f"{label}.{k}: {point!r} is not a point")
        check_finite(f"{label}.{k}", point)
        check_length(f"{label}.{k}", point, dimension)
    if len(set(points)) < len(points):
        raise SceneError(f"{label}: a point is given twice")


def area_and_centroid(points: tuple[tuple[float, float], ...]) -> tuple[float, tuple[float, float], float]:
    """Area [m^2], centroid [m] and second moment about it [m^4] of a counter-clockwise polygon (Green's theorem).

    Summed about the first vertex, so that no digits are lost far from the origin.
    """
    (ox, oy), *rest = points
    area = first_x = first_y = second = 0.0
    for (px, py), (qx, qy) in pairwise(rest):
        ax, ay, bx, by = px - ox, py - oy, qx - ox, qy - oy
        cross = ax * by - ay * bx
        area += 0.5 * cross
        first_x += cross * (ax + bx) / 6.0
        first_y += cross * (ay + by) / 6.0
        second += cross * (ax * ax + ax * bx + bx * bx + ay * ay + ay * by + by * by) / 12.0
    if not area > 0.0:
        raise SceneError("vertices: must enclose an area, counter-clockwise")
    x, y = first_x / area, first_y / area
    return area, (ox + x, oy + y), second - area * (x * x + y * y)


def reach(shape: Shape) -> float:
    """Distance of a shape's outermost point from its centre [m]; 0 for a half-space."""
    if isinstance(shape, Box):
        return math.hypot(*shape.half_extents)
    if isinstance(shape, HalfSpace):
        return 0.0
    return shape.radius if isinstance(shape, Disc | Sphere) else shape.reach


Shape = Disc | Sphere | Box | HalfSpace | Capsule | Polygon | Cylinder | Hull
#: Shapes that rotate within their outline.
ROUND = (Disc, Sphere)
#: Shapes of each dimension.
SHAPES_OF: dict[int, tuple[type, ...]] = {
    2: (Disc, Box, HalfSpace, Capsule, Polygon),
    3: (Sphere, Box, HalfSpace, Capsule, Cylinder, Hull),
}
SHAPES: dict[str, type] = {
    "disc": Disc,
    "sphere": Sphere,
    "box": Box,
    "half_space": HalfSpace,
    "capsule": Capsule,
    "polygon": Polygon,
    "cylinder": Cylinder,
    "hull": Hull,
}
SHAPE_NAMES = {cls: name for name, cls in SHAPES.items()}
