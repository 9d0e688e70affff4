"""How contacts would accelerate if no body did: points that touch wander over bodies that move, and normals turn.

A contact's velocity u changes by ``G a + gamma``, with accelerations a of bodies. Here is gamma, the rate of u while
all twists stay what they are, from the features that touch. A feature is a corner, an edge or a face of a shape's core,
as lines and planes without end; a ball's centre is a corner, and a capsule's axis an edge (in the plane a face).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.certificate.audit.run import Indices, Run, turned, twist_of
from reference_solver.certificate.audit.turning import pose_within
from reference_solver.geometry import rotation
from reference_solver.model import Array, HalfSpace
from reference_solver.shapes import smallest_extent

#: Share of a half width within which a point is on a corner or an edge.
ON = 1e-7
#: Turn, or way over the half width, between two of the five places that a rate is taken from: of fourth order, it is
#: off by 1e-13 for that, and as much for round-off.
STEP = 1e-3
CORNER, EDGE, FACE = 0, 1, 2


class _Feature(NamedTuple):
    """What touches of one body, in its own axes, for s contacts."""

    kind: Indices  # (s,)
    place: Array  # (s, d) a point of the core's feature
    along: Array  # (s, d) direction of an edge, or zeros


def accelerations(run: Run, wanted: NDArray[np.bool_]) -> Array:
    """Return ``d(n.u)/dt`` and ``du/dt`` (c, 1 + d) in world axes [m/s^2] of ``wanted`` contacts while twists stay."""
    pieces, d = run.pieces, run.d
    found = np.zeros((len(pieces.body_a), 1 + d))
    pairs = pieces.body_a * len(run.free) + pieces.body_b
    for pair in np.unique(pairs[wanted]):
        rows = np.flatnonzero(wanted & (pairs == pair))
        found[rows] = _of_pair(run, rows)
    return found


def _of_pair(run: Run, rows: Indices) -> Array:
    pieces, d = run.pieces, run.d
    bodies = int(pieces.body_a[rows[0]]), int(pieces.body_b[rows[0]])
    shapes = [run.model.bodies[i].shape for i in bodies]
    poses = [pose_within(run, i, run.side[k][rows], 0.0) for k, i in enumerate(bodies)]
    own = [twist_of(run.model.bodies[i]) for i in bodies]
    twists = [
        np.where((row >= 0)[:, None] & run.free[i], pieces.twist_before[row], mine)
        for i, row, mine in zip(bodies, (run.side[0][rows], run.side[1][rows]), own, strict=True)
    ]
    n, origin = pieces.normal[rows], poses[0][:, :d].copy()
    point = pieces.point[rows] - origin
    axes = [rotation(pose) for pose in poses]
    centres = [pose[:, :d] - origin for pose in poses]
    radii = [float(getattr(shape, "radius", 0.0)) for shape in shapes]
    features = [
        _feature(shape, np.einsum("sij,si->sj", axis, point - sign * radius * n - centre))
        for shape, axis, centre, radius, sign in zip(shapes, axes, centres, radii, (1.0, -1.0), strict=True)
    ]
    meets = _meeting(features, axes, centres, n, radii)
    size = min((s for s in map(smallest_extent, shapes) if np.isfinite(s)), default=1.0)
    slip = (twists[1][:, :d] + turned(twists[1][:, d:], point - centres[1])) - (
        twists[0][:, :d] + turned(twists[0][:, d:], point - centres[0])
    )
    rate = sum(np.linalg.norm(twist[:, d:], axis=1) for twist in twists) + np.linalg.norm(slip, axis=1) / size
    h = STEP / np.where(rate > 0.0, rate, 1.0)

    def velocity(share: float) -> Array:
        """``n.u`` and u (s, 1 + d) a time ``share h`` later, or earlier."""
        at, moved = [], []
        for axis, centre, twist in zip(axes, centres, twists, strict=True):
            at.append(_spun(twist[:, d:], share * h) @ axis)
            moved.append(centre + (share * h)[:, None] * twist[:, :d])
        where, normal = meets(at, moved)
        one, other = (t[:, :d] + turned(t[:, d:], where - x) for t, x in zip(twists, moved, strict=True))
        u = other - one
        return np.column_stack([(normal * u).sum(axis=1), u])

    change = 8.0 * (velocity(1.0) - velocity(-1.0)) - (velocity(2.0) - velocity(-2.0))
    return np.where((rate > 0.0)[:, None], change / (12.0 * h)[:, None], 0.0)


def _feature(shape: Any, place: Array) -> _Feature:
    """Return what the points ``place`` (s, d), in body axes, of a shape's core belong to."""
    s, d = place.shape
    kind, along, place = np.full(s, FACE), np.zeros((s, d)), place.copy()
    if isinstance(shape, HalfSpace):
        return _Feature(kind, place, along)
    near = ON * smallest_extent(shape)
    if hasattr(shape, "half_extents"):
        half = np.array(shape.half_extents)
        ends = np.abs(place) >= half - near
        place = np.where(ends, np.sign(place) * half, place)
        kind = np.where(ends.sum(axis=1) == d, CORNER, np.where(ends.sum(axis=1) == d - 1, EDGE, FACE))
        along = np.where((kind == EDGE)[:, None], ~ends, 0.0).astype(float)
        if d == 2:
            kind = np.where(kind == EDGE, FACE, kind)
    elif hasattr(shape, "vertices"):
        corners = np.array(shape.vertices)
        far = np.linalg.norm(place[:, None] - corners, axis=2)
        on = far.min(axis=1) <= near
        kind = np.where(on, CORNER, FACE)
        place = np.where(on[:, None], corners[far.argmin(axis=1)], place)
    elif hasattr(shape, "half_length"):
        on = np.abs(place[:, 0]) >= shape.half_length - near
        kind = np.where(on, CORNER, FACE if d == 2 else EDGE)
        place = np.column_stack(
            [np.where(on, np.sign(place[:, 0]) * shape.half_length, place[:, 0]), 0.0 * place[:, 1:]]
        )
        along[:, 0] = 1.0
    else:
        kind, place = np.full(s, CORNER), np.zeros((s, d))
    return _Feature(kind, place, along)


def _meeting(
    features: list[_Feature], axes: list[Array], centres: list[Array], n: Array, radii: list[float]
) -> Callable[[list[Array], list[Array]], tuple[Array, Array]]:
    """Return what tells point (s, d) and normal (s, d) of contacts from axes and centres of both bodies.

    A face holds the normal; two corners of which one is round have it along their line, a round one and an edge square
    to the edge, and two edges square to both. Corners and edges that lie flush have the normal of a face: that of B,
    unless it is A on whose face a corner of B stands.
    """
    kinds = [feature.kind for feature in features]
    own = [np.einsum("sij,si->sj", axis, n) for axis in axes]  # the normal in either body's axes
    flat = [np.sort(np.abs(x), axis=1)[:, -1] >= 1.0 - 1e-9 for x in own]
    round_one = sum(radii) > 0.0
    line = round_one & (kinds[0] != FACE) & (kinds[1] != FACE) & ~((kinds[0] == EDGE) & (kinds[1] == EDGE))
    lines = [np.einsum("sij,sj->si", axis, f.along) for axis, f in zip(axes, features, strict=True)]
    crossed = _crossed(*lines) if n.shape[1] == 3 else np.zeros_like(n)
    size = np.linalg.norm(crossed, axis=1)
    edges = (kinds[0] == EDGE) & (kinds[1] == EDGE) & (size > ON)
    sign = np.where((crossed * n).sum(axis=1) < 0.0, -1.0, 1.0)
    # Whose face it is: A's where A has one and B none, or where only A's axes hold the normal.
    of_a = (kinds[0] == FACE) & (kinds[1] != FACE)
    of_a |= (kinds[0] != FACE) & (kinds[1] != FACE) & flat[0] & ~flat[1]

    def meet(now: list[Array], at: list[Array]) -> tuple[Array, Array]:
        places = [x + np.einsum("sij,sj->si", axis, f.place) for x, axis, f in zip(at, now, features, strict=True)]
        held = [np.einsum("sij,sj->si", axis, x) for axis, x in zip(now, own, strict=True)]
        normal = np.where(of_a[:, None], *held)
        ways = [np.einsum("sij,sj->si", axis, f.along) for axis, f in zip(now, features, strict=True)]
        apart = places[1] - places[0]
        if line.any():
            for k in (0, 1):  # square to an edge
                on = (kinds[k] == EDGE)[:, None]
                apart = apart - np.where(on, (apart * ways[k]).sum(axis=1)[:, None] * ways[k], 0.0)
            long = np.linalg.norm(apart, axis=1)
            ok = line & (long > 0.0)
            normal = np.where(ok[:, None], apart / np.where(ok, long, 1.0)[:, None], normal)
        if edges.any():
            across = sign[:, None] * _crossed(*ways)
            long = np.linalg.norm(across, axis=1)
            normal = np.where(edges[:, None], across / np.where(edges, long, 1.0)[:, None], normal)
        # A corner is where it is; of two edges the point of A nearest to B; else what does not hold the normal.
        first, second = places[0] + radii[0] * normal, places[1] - radii[1] * normal
        from_b = of_a | ((kinds[1] == CORNER) & (kinds[0] != CORNER))
        point = np.where(from_b[:, None], second, first)
        if edges.any():
            between = places[1] - places[0]
            uv = (ways[0] * ways[1]).sum(axis=1)
            share = (between * ways[0]).sum(axis=1) - uv * (between * ways[1]).sum(axis=1)
            share = share / np.where(edges, 1.0 - uv * uv, 1.0)
            nearest = places[0] + share[:, None] * ways[0] + radii[0] * normal
            point = np.where(edges[:, None], nearest, point)
        return point, normal

    return meet


def _crossed(one: Array, other: Array) -> Array:
    return np.cross(one, other) if one.shape[1] == 3 else np.zeros_like(one)


def _spun(w: Array, t: Array) -> NDArray[np.float64]:
    """Matrices (s, d, d) of the turns by spins (s, 1 | 3) in times (s,)."""
    if w.shape[1] == 1:
        c, s = np.cos(w[:, 0] * t), np.sin(w[:, 0] * t)
        return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    angle = np.linalg.norm(w, axis=1)
    axis = w / np.where(angle > 0.0, angle, 1.0)[:, None]
    k = np.zeros((len(w), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -axis[:, 2], axis[:, 1], -axis[:, 0]
    k -= k.swapaxes(1, 2)
    turn = (angle * t)[:, None, None]
    return np.asarray(np.eye(3) + np.sin(turn) * k + (1.0 - np.cos(turn)) * (k @ k))
