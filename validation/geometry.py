"""Overlap of two bodies from their poses: the same exact routine for every engine.

Engines report depths by their own rules (margins, speculative gaps, one point or four). Overlaps are therefore measured
from poses by the certificate's geometry, which shares no code with any solver; cylinders and hulls by a library
(`validation.solids`). It runs only where bodies can overlap: projections on any axis are not farther apart than the
bodies.
"""

from __future__ import annotations

import math

import numpy as np

from adapters.engine import Array
from adapters.scene import Box, Cylinder, HalfSpace, Hull, Shape
from adapters.scene.shapes import reach
from reference_solver.geometry import gap, rotation
from validation import solids

#: Samples of one exact computation in the search for the deepest of a run.
BATCH = 32


def separation(a: Shape, pose_a: Array, b: Shape, pose_b: Array) -> Array:
    """Signed distance of two bodies, (s,) [m]; < 0 is the distance that separates them.

    Raises
    ------
    ModuleNotFoundError
        For a cylinder or a hull where the library `coal` is not installed.
    """
    kinds = {type(a), type(b)}
    if Cylinder in kinds or (Hull in kinds and HalfSpace not in kinds):  # by its lowest corner
        return solids.separation(a, pose_a, b, pose_b)
    return np.atleast_1d(gap(a, pose_a, b, pose_b))


def overlap(a: Shape, pose_a: Array, b: Shape, pose_b: Array) -> Array:
    """Depth of the overlap, (s,) [m]; 0 where the bodies are apart, NaN where their poses give no distance."""
    depth = np.zeros(len(pose_a))
    near = np.flatnonzero(~(least_gap(a, pose_a, b, pose_b) >= 0.0))  # a bound that is NaN excludes nothing
    if len(near):
        depth[near] = np.maximum(0.0, -separation(a, pose_a[near], b, pose_b[near]))
    return depth


def deepest(a: Shape, pose_a: Array, b: Shape, pose_b: Array) -> float:
    """Deepest overlap over all samples, >= 0 [m].

    Samples are computed in the order of their lower bounds, until no bound is below the result. NaN if the poses of a
    sample give no distance: it may be the deepest.
    """
    bound, depth = least_gap(a, pose_a, b, pose_b), 0.0
    if np.isnan(bound).any():
        return math.nan
    order = np.argsort(bound)
    for k in range(0, len(order), BATCH):
        chosen = order[k : k + BATCH]
        if bound[chosen[0]] >= -depth:
            break
        depth = float(np.maximum(depth, -separation(a, pose_a[chosen], b, pose_b[chosen]).min()))
        if math.isnan(depth):
            break
    return depth


def least_gap(a: Shape, pose_a: Array, b: Shape, pose_b: Array) -> Array:
    """Lower bound of the signed distance, (s,) [m]: the largest gap of projections on face normals and centre line."""
    if isinstance(a, HalfSpace) or isinstance(b, HalfSpace):
        return separation(a, pose_a, b, pose_b)
    d = 2 if pose_a.shape[1] == 3 else 3
    turn_a, turn_b = rotation(pose_a), rotation(pose_b)
    centres = pose_b[:, :d] - pose_a[:, :d]
    axes = [turn[:, :, k] for turn, s in ((turn_a, a), (turn_b, b)) if isinstance(s, Box) for k in range(d)]
    length = np.linalg.norm(centres, axis=1, keepdims=True)
    axes.append(np.where(length > 0.0, centres / np.where(length > 0.0, length, 1.0), np.eye(d)[d - 1]))
    gaps = [
        np.abs(np.einsum("si,si->s", centres, axis)) - _extent(a, turn_a, axis) - _extent(b, turn_b, axis)
        for axis in axes
    ]
    return np.asarray(np.max(gaps, axis=0))


def _extent(shape: Shape, turn: Array, axis: Array) -> Array:
    """Half width (s,) of the projection of ``shape`` on ``axis`` (s, d), from its centre."""
    if not isinstance(shape, Box):  # an upper bound of its projection
        return np.full(len(axis), reach(shape))
    along = np.einsum("sij,si->sj", turn, axis)
    half: Array = np.abs(along) @ np.array(shape.half_extents)
    return half
