"""Area or volume and moments of inertia of uniform bodies, about the centre of mass (any table of mechanics)."""

from __future__ import annotations

import math

from adapters.scene import Box, Disc, HalfSpace, Shape, Sphere

#: What is said of moments that were computed here.
HOW: dict[type, str] = {Disc: "disc", Sphere: "ball", Box: "box"}


def volume(shape: Shape) -> float:
    """Area [m^2] of a planar shape, volume [m^3] of a spatial one.

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
    return math.prod(2.0 * half for half in shape.half_extents)


def moments(shape: Shape, mass: float, dimension: int) -> float | tuple[float, float, float]:
    """Moment about the axis of the plane, or the three principal moments along the body axes [kg m^2].

    Disc m r^2/2, ball 2 m r^2/5, box m (a^2 + b^2)/3 with the half extents a, b across the axis.

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
    if dimension == 2:
        return mass * sum(half * half for half in shape.half_extents) / 3.0
    x, y, z = (half * half for half in shape.half_extents)
    return mass * (y + z) / 3.0, mass * (z + x) / 3.0, mass * (x + y) / 3.0
