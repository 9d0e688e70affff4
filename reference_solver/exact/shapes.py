"""Shapes as cores of points, faces and lines, which a radius grows: told for every shape apart."""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch
from itertools import product

import numpy as np

from reference_solver.model import Array
from reference_solver.pieces import Indices
from reference_solver.shapes import Box, Capsule, Disc, HalfSpace, Polygon, Sphere


@dataclass(frozen=True)
class Core:
    """Polytope that a radius grows on all sides (E50).

    Parameters
    ----------
    points, lines
        (p, d) corners [m]; (l, 2) numbers of the points that edges join.
    normals, offsets
        (f, d) outward unit normals, (f,) distances from the centre [m]; a segment in the plane has two faces.
    sides
        For each face a list of its sides: normal (d,) and distance from the centre [m]. A place is over the face if it
        lies within all of them.
    radius
        By how much the polytope is grown [m].
    """

    points: Array
    lines: Indices
    normals: Array
    offsets: Array
    sides: list[list[tuple[Array, float]]]
    radius: float

    @property
    def reach(self) -> float:
        """Distance of the farthest point from the centre [m]; infinite for a half-space."""
        return float(np.linalg.norm(self.points, axis=1).max()) if len(self.points) else np.inf


@singledispatch
def core(shape: object, dimension: int) -> Core:
    """Return the core of a shape.

    Raises
    ------
    TypeError
        For what is no shape.
    """
    raise TypeError(f"shape: {shape!r}")


@core.register
def _half_space(shape: HalfSpace, dimension: int) -> Core:
    none = np.zeros((0, dimension))
    return Core(none, _lines(), np.array([shape.normal]), np.array([shape.offset]), [[]], 0.0)


@core.register(Disc)
@core.register(Sphere)
def _ball(shape: Disc | Sphere, dimension: int) -> Core:
    return Core(np.zeros((1, dimension)), _lines(), np.zeros((0, dimension)), np.zeros(0), [], shape.radius)


@core.register
def _capsule(shape: Capsule, dimension: int) -> Core:
    points = np.zeros((2, dimension))
    points[:, 0] = -shape.half_length, shape.half_length
    if dimension == 2:
        return _edged(points, [(0, 1), (1, 0)], shape.radius)
    return Core(points, _lines((0, 1)), np.zeros((0, 3)), np.zeros(0), [], shape.radius)


@core.register
def _polygon(shape: Polygon, dimension: int) -> Core:
    count = len(shape.vertices)
    return _edged(np.array(shape.vertices), [(k, (k + 1) % count) for k in range(count)], 0.0)


@core.register
def _box(shape: Box, dimension: int) -> Core:
    half = np.array(shape.half_extents)
    if dimension == 2:
        x, y = half
        return _edged(np.array([(x, y), (-x, y), (-x, -y), (x, -y)]), [(0, 1), (1, 2), (2, 3), (3, 0)], 0.0)
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    pairs = [(i, j) for j in range(8) for i in range(j) if np.abs(signs[i] - signs[j]).sum() == 2.0]
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    offsets = np.concatenate([half, half])
    # The sides of a face are the four faces that are square to it.
    sides = [[(m, o) for m, o in zip(normals, offsets, strict=True) if m @ n == 0.0] for n in normals]
    return Core(signs * half, _lines(*pairs), normals, offsets, sides, 0.0)


def _lines(*pairs: tuple[int, int]) -> Indices:
    return np.array(pairs, np.int64).reshape(-1, 2)


def _edged(points: Array, pairs: list[tuple[int, int]], radius: float) -> Core:
    """Return a planar core of edges (from, to), the solid on their left; each edge is a face between its two ends."""
    normals, offsets, sides = [], [], []
    for i, j in pairs:
        along = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
        normals.append(np.array([along[1], -along[0]]))
        offsets.append(normals[-1] @ points[i])
        sides.append([(-along, -float(along @ points[i])), (along, float(along @ points[j]))])
    lines = _lines(*(pairs if len(points) > 2 else pairs[:1]))
    return Core(points, lines, np.array(normals), np.array(offsets), sides, radius)
