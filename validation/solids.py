"""Cylinders and hulls by libraries: distances by `coal` and mass properties by Qhull."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from adapters.engine import Array
from adapters.scene import Box, Capsule, Cylinder, HalfSpace, Hull, SceneError, Shape, Sphere

#: Tolerance of `coal` as a share of a body's size (its default is 1e-6 m for every size).
TOLERANCE = 1e-9


def separation(a: Shape, pose_a: Array, b: Shape, pose_b: Array) -> Array:
    """Signed distance of two spatial bodies, (s,) [m], by `coal`.

    Raises
    ------
    ModuleNotFoundError
        Where `coal` is not installed.
    """
    import coal

    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_tolerance = request.epa_tolerance = TOLERANCE
    first, second, found = _solid(a), _solid(b), []
    for one, other in zip(pose_a, pose_b, strict=True):
        places = [coal.Transform3s(_turn(shape, pose), pose[:3]) for shape, pose in ((a, one), (b, other))]
        found.append(coal.distance(first, places[0], second, places[1], request, coal.DistanceResult()))
    return np.array(found)


@lru_cache(maxsize=64)
def _solid(shape: Shape) -> Any:
    """The shape in `coal`; cylinders and capsules lie along its z axis."""
    import coal

    if isinstance(shape, Sphere):
        return coal.Sphere(shape.radius)
    if isinstance(shape, Box):
        return coal.Box(*(2.0 * half for half in shape.half_extents))
    if isinstance(shape, Capsule):
        return coal.Capsule(shape.radius, 2.0 * shape.half_length)
    if isinstance(shape, Cylinder):
        return coal.Cylinder(shape.radius, 2.0 * shape.half_length)
    if isinstance(shape, HalfSpace):
        return coal.Halfspace(np.array(shape.normal), shape.offset)
    assert isinstance(shape, Hull)
    points = coal.StdVec_Vec3s()
    for vertex in shape.vertices:
        points.append(np.array(vertex))
    return coal.Convex.convexHull(points, False, "")


def _turn(shape: Shape, pose: Array) -> Array:
    """Rotation of the solid of a shape, (3, 3)."""
    from reference_solver.geometry import rotation

    turn: Array = np.asarray(rotation(pose[None]))[0]
    lying = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # z to x
    return turn @ lying if isinstance(shape, Capsule | Cylinder) else turn


def hull_properties(vertices: Array) -> tuple[float, Array, Array]:
    """Volume [m^3], centroid (3,) [m] and tensor of second moments about it (3, 3) [m^5] of a convex hull.

    Sums over the tetrahedra between the hull's triangles and its middle; the second moment of each about its corner is
    V/20 (sum of x x^T over the corners + (sum of x)(sum of x)^T) [F. Tonon, J. Math. Stat. 1 (2005) 8].

    Raises
    ------
    SceneError
        If the vertices lie in one plane, or one of them inside the hull of the others.
    ModuleNotFoundError
        Where scipy is not installed.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(vertices)
    except QhullError:
        raise SceneError("vertices: lie in one plane, or almost") from None
    inside = sorted(set(range(len(vertices))) - {int(k) for k in hull.vertices})
    if inside:
        raise SceneError(f"vertices: number {inside[0]} lies within the hull of the others")
    middle = vertices.mean(axis=0)
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for triangle in hull.simplices:
        corners = vertices[triangle] - middle
        part = abs(float(np.linalg.det(corners))) / 6.0
        total = corners.sum(axis=0)
        volume += part
        first += part * total / 4.0
        second += part / 20.0 * (corners.T @ corners + np.outer(total, total))
    centre = first / volume
    return volume, middle + centre, second - volume * np.outer(centre, centre)
