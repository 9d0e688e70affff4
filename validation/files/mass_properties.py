"""Area or volume and moments of inertia of uniform bodies, about the centre of mass (any table of mechanics)."""

from __future__ import annotations

import math

import numpy as np

from adapters.scene import Box, Capsule, Cylinder, Disc, HalfSpace, Hull, Polygon, Shape, Sphere
from adapters.scene.shapes import area_and_centroid
from validation.solids import hull_properties

#: Words for moments that were computed here.
HOW: dict[type, str] = {
    Disc: "disc",
    Sphere: "ball",
    Box: "box",
    Capsule: "capsule",
    Polygon: "polygon",
    Cylinder: "cylinder",
    Hull: "solid",
}


def volume(shape: Shape, dimension: int = 3) -> float:
    """Area [m^2] of a planar shape, volume [m^3] of a spatial one; of a capsule, which is both, as ``dimension`` says.

    Raises
    ------
    ValueError
        For a half-space, which has none.
    """
    if isinstance(shape, Disc):
        return math.pi * shape.radius**2
    if isinstance(shape, Sphere):
        return 4.0 / 3.0 * math.pi * shape.radius**3
    if isinstance(shape, HalfSpace):
        raise ValueError("a half-space has no volume")
    if isinstance(shape, Capsule):
        r, length = shape.radius, 2.0 * shape.half_length
        return math.pi * r * r + 2.0 * r * length if dimension == 2 else math.pi * r * r * (4.0 / 3.0 * r + length)
    if isinstance(shape, Cylinder):
        return 2.0 * math.pi * shape.radius**2 * shape.half_length
    if isinstance(shape, Polygon):
        return area_and_centroid(shape.vertices)[0]
    if isinstance(shape, Hull):
        return hull_properties(np.array(shape.vertices))[0]
    return math.prod(2.0 * half for half in shape.half_extents)


def moments(shape: Shape, mass: float, dimension: int) -> float | tuple[float, float, float]:
    """Moment about the axis of the plane, or the three principal moments along the body axes [kg m^2].

    Disc m r^2/2, ball 2 m r^2/5, box m (a^2 + b^2)/3 with the half extents a, b across the axis, cylinder m r^2/2 and
    m (r^2/4 + h^2/3) with the half length h; a capsule is a box or a cylinder between two halves of a disc or a ball,
    polygons and hulls are sums over triangles and tetrahedra. Those of a hull are about its body axes.

    Raises
    ------
    ValueError
        For a half-space.
    """
    if isinstance(shape, HalfSpace):
        raise ValueError("a half-space has no moments of inertia")
    if isinstance(shape, Disc):
        return 0.5 * mass * shape.radius**2
    if isinstance(shape, Sphere):
        return (0.4 * mass * shape.radius**2,) * 3
    if isinstance(shape, Polygon):
        area, _, second = area_and_centroid(shape.vertices)
        return mass * second / area
    if isinstance(shape, Hull):
        whole, _, tensor = hull_properties(np.array(shape.vertices))
        x, y, z = (float(square) / whole for square in np.diag(tensor))
        return mass * (y + z), mass * (z + x), mass * (x + y)
    if isinstance(shape, Capsule):
        return _capsule(shape, mass, dimension)
    if isinstance(shape, Cylinder):
        across = mass * (0.25 * shape.radius**2 + shape.half_length**2 / 3.0)
        return 0.5 * mass * shape.radius**2, across, across
    if dimension == 2:
        return mass * sum(half * half for half in shape.half_extents) / 3.0
    x, y, z = (half * half for half in shape.half_extents)
    return mass * (y + z) / 3.0, mass * (z + x) / 3.0, mass * (x + y) / 3.0


def _capsule(shape: Capsule, mass: float, dimension: int) -> float | tuple[float, float, float]:
    """Middle and two caps: each cap's moment about its own centre is moved by its distance along the axis."""
    r, h = shape.radius, shape.half_length
    density = mass / volume(shape, dimension)
    if dimension == 2:
        middle, cap = density * 4.0 * r * h, density * 0.5 * math.pi * r * r
        off = 4.0 * r / (3.0 * math.pi)  # centroid of half a disc from its flat side
        return middle * (r * r + h * h) / 3.0 + 2.0 * (cap * (0.5 * r * r - off * off) + cap * (h + off) ** 2)
    middle, cap = density * 2.0 * math.pi * r * r * h, density * 2.0 / 3.0 * math.pi * r**3
    off = 0.375 * r  # centroid of half a ball
    across = middle * (0.25 * r * r + h * h / 3.0) + 2.0 * (cap * (0.4 * r * r - off * off) + cap * (h + off) ** 2)
    return 0.5 * middle * r * r + 2.0 * cap * 0.4 * r * r, across, across
