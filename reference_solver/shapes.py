"""What bodies are made of: shapes about the centre of mass, and the size that margins are scaled by."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from reference_solver.checks import require_finite, require_positive, unit, vector

#: Most vertices of a polygon: feature numbers are packed into one key with a pair's body numbers.
MOST_VERTICES = 64

#: The centroid of a polygon may miss the origin by this share of its size: round-off of whoever computed it.
CENTRED = 1e-9


@dataclass(frozen=True)
class Disc:
    """Planar disc of ``radius`` [m]."""

    radius: float

    def __post_init__(self) -> None:
        require_positive("radius", self.radius)


@dataclass(frozen=True)
class Sphere:
    """Sphere of ``radius`` [m]."""

    radius: float

    def __post_init__(self) -> None:
        require_positive("radius", self.radius)


@dataclass(frozen=True)
class Box:
    """Box about its centre with two (planar) or three (spatial) ``half_extents`` [m]."""

    half_extents: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "half_extents", vector("half_extents", self.half_extents, (2, 3)))
        for value in self.half_extents:
            require_positive("half_extents", value)


@dataclass(frozen=True)
class Capsule:
    """All points within ``radius`` of the segment from -half_length to +half_length on the body's x axis [m]."""

    half_length: float
    radius: float

    def __post_init__(self) -> None:
        require_positive("half_length", self.half_length)
        require_positive("radius", self.radius)


@dataclass(frozen=True)
class Polygon:
    """Planar convex polygon of 3 to 64 ``vertices`` in body axes [m], counter-clockwise, its centroid the origin.

    `Polygon.about_centroid` makes one from vertices in any place.
    """

    vertices: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        try:
            count = len(self.vertices)
        except TypeError as error:
            raise ValueError(f"vertices: {self.vertices!r} is not a sequence of points") from error
        if not 3 <= count <= MOST_VERTICES:
            raise ValueError(f"vertices: {count} where 3 to {MOST_VERTICES} are needed")
        points = [vector("vertices", point, (2,)) for point in self.vertices]
        object.__setattr__(self, "vertices", tuple((x, y) for x, y in points))
        _require_convex(self.vertices)
        _, centre, _ = area_centroid_moment(self.vertices)
        size = max(math.hypot(x, y) for x, y in self.vertices)
        if math.hypot(*centre) > CENTRED * size:
            raise ValueError(f"vertices: the centroid is at {centre!r}, not at the origin")

    @classmethod
    def about_centroid(cls, points: tuple[tuple[float, float], ...]) -> Polygon:
        """Return the polygon of ``points``, counter-clockwise [m], moved so that its centroid is the origin."""
        _, (x, y), _ = area_centroid_moment(points)
        return cls(tuple((px - x, py - y) for px, py in points))


@dataclass(frozen=True)
class HalfSpace:
    """Solid region ``normal . x <= offset`` in body axes; ``normal`` leaves the solid, ``offset`` in m."""

    normal: tuple[float, ...]
    offset: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", unit("normal", vector("normal", self.normal, (2, 3))))
        require_finite("offset", self.offset)


Shape = Disc | Sphere | Box | HalfSpace | Capsule | Polygon


def area_centroid_moment(points: tuple[tuple[float, float], ...]) -> tuple[float, tuple[float, float], float]:
    """Area [m^2], centroid [m] and second moment about the centroid [m^4] of a counter-clockwise polygon.

    Sums over the triangles that the first vertex makes with each edge (Green's theorem). Mass times moment over
    area is the inertia of a uniform body.
    """
    (ox, oy), *rest = points
    area = first_x = first_y = second = 0.0
    for (px, py), (qx, qy) in pairwise(rest):
        ax, ay, bx, by = px - ox, py - oy, qx - ox, qy - oy
        double = ax * by - ay * bx
        area += 0.5 * double
        first_x += double * (ax + bx) / 6.0
        first_y += double * (ay + by) / 6.0
        second += double * (ax * ax + ax * bx + bx * bx + ay * ay + ay * by + by * by) / 12.0
    if area <= 0.0:
        raise ValueError("vertices: must enclose an area, counter-clockwise")
    x, y = first_x / area, first_y / area
    return area, (ox + x, oy + y), second - area * (x * x + y * y)


def _require_convex(points: tuple[tuple[float, float], ...]) -> None:
    """Every turn is to the left, and they add up to one round."""
    round_ = 0.0
    for k in range(len(points)):
        (px, py), (qx, qy), (rx, ry) = points[k - 2], points[k - 1], points[k]
        ax, ay, bx, by = qx - px, qy - py, rx - qx, ry - qy
        turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        if not 0.0 < turn < math.pi:
            raise ValueError(f"vertices: not strictly convex and counter-clockwise at {points[k - 1]!r}")
        round_ += turn
    if round_ > 3.0 * math.pi:
        raise ValueError("vertices: go round more than once")


def smallest_extent(shape: Shape) -> float:
    """Smallest half width of a shape [m]; infinite for a half-space. Scales margins, so that units cancel.

    Of a polygon: the smallest distance of an edge from the centroid.
    """
    if isinstance(shape, HalfSpace):
        return math.inf
    if isinstance(shape, Polygon):
        points = shape.vertices
        edges = zip(points, points[1:] + points[:1], strict=True)
        return min((px * qy - py * qx) / math.hypot(qx - px, qy - py) for (px, py), (qx, qy) in edges)
    return min(shape.half_extents) if isinstance(shape, Box) else shape.radius
