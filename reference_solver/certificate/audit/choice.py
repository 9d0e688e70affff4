"""Which normal cornered bodies meet along, where several part them as far as they are apart (E31, E50).

Where an edge comes down on an edge, a corner on a corner, or a box on a seam, many directions part two bodies equally
far. The law knows but a few of them: normals of faces (in the plane, of edges) and what is square to an edge of each;
and of the faces that one along which they close last.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from reference_solver.certificate.audit.run import Indices, Run, turned, twist_of
from reference_solver.geometry import Core, Nearest, core_of, partings
from reference_solver.model import Array, HalfSpace

#: Angle up to which two normals are one [rad], and share of the half width within which two gaps tie.
ONE_NORMAL, TIED = 1e-6, 1e-12
#: Share of a speed of approach by which the law tells no two of them apart: ten of its own (`spatial/closing_axis.py`,
#: which takes whatever is a millionth slower).
SAME_APPROACH = 1e-5

Pair = tuple[Any, Any]


def is_cornered(shapes: Pair) -> bool:
    """Whether two bodies can meet along one of many normals: neither is round, nor a half-space."""
    return not any(isinstance(shape, HalfSpace) or hasattr(shape, "radius") for shape in shapes)


def strayed(normal: Array, shapes: Pair, poses: tuple[Array, Array], found: Nearest) -> Array:
    """Distance (s,) of unit vectors ``normal`` (s, d) from the nearest one that the law knows [rad].

    Bodies that are apart have the line of their nearest points as well.
    """
    known = partings(shapes[0], poses[0], shapes[1], poses[1]).axes
    off = np.linalg.norm(known - normal[:, None], axis=2).min(axis=1)
    return np.asarray(np.minimum(off, np.linalg.norm(found.normal - normal, axis=1)))


def closes_sooner(run: Run, rows: Indices, shapes: Pair, poses: tuple[Array, Array], gap: Array) -> Array:
    """How much faster (s,) bodies close along a normal than along a face's that ties with it, over the speeds there.

    Each body closes with those of its corners that are nearest to the other along a normal: with the one that closes
    fastest.
    """
    pieces = run.pieces
    a, b = int(pieces.body_a[rows[0]]), int(pieces.body_b[rows[0]])
    known = partings(shapes[0], poses[0], shapes[1], poses[1])
    axes = np.concatenate([known.axes, pieces.normal[rows][:, None]], axis=1)
    noise = 16.0 * np.spacing(np.abs(pieces.point[rows]).max()) + TIED * min(run.extent[a], run.extent[b])
    closing, speed = np.zeros(axes.shape[:2]), np.zeros(len(rows))
    for k, i, away in ((0, a, 1.0), (1, b, -1.0)):
        row, body = run.side[k][rows], core_of(shapes[k], poses[k])
        own = twist_of(run.model.bodies[i])
        twist = np.where((row >= 0)[:, None], pieces.twist_before[row], own)
        closing += _fastest(body, twist, away * axes, noise)
        arm = pieces.point[rows] - body.centre
        speed += np.linalg.norm(twist[:, : run.d] + turned(twist[:, run.d :], arm), axis=1)
    other = np.linalg.norm(known.axes - pieces.normal[rows][:, None], axis=2) > ONE_NORMAL
    ties = other & known.faces & (known.apart >= (gap - noise)[:, None])
    least = np.where(ties, closing[:, :-1].clip(min=0.0), np.inf).min(axis=1)
    sooner = closing[:, -1] - (1.0 + SAME_APPROACH) * least
    return np.divide(sooner, speed, out=np.zeros(len(rows)), where=np.isfinite(least) & (speed > 0.0))


def _fastest(body: Core, twist: Array, axes: Array, noise: float) -> Array:
    """Speed (s, m) along ``axes`` (s, m, d) of the fastest of those corners that are farthest along them."""
    d, directions = axes.shape[2], axes.swapaxes(1, 2)
    arms = body.vertex - body.centre[:, None]
    height = arms @ directions
    spin = np.repeat(twist[:, None, d:], arms.shape[1], axis=1).reshape(-1, twist.shape[1] - d)
    speeds = twist[:, None, :d] + turned(spin, arms.reshape(-1, d)).reshape(arms.shape)
    along = speeds @ directions
    far = height >= height.max(axis=1, keepdims=True) - noise
    return np.asarray(np.where(far, along, -np.inf).max(axis=1))
