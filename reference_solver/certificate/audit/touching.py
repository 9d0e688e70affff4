"""Whether bodies touch where contacts say, along their normals, and only there, by the certificate's own geometry.

Along a normal bodies are as far apart as they are at all. Where one of them is round, and their cores are apart, one
direction alone is that; of corners that meet there are many: `audit.choice` tells which the law takes.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from reference_solver.certificate.audit.choice import closes_sooner, is_cornered, strayed
from reference_solver.certificate.audit.contact import reduced_mass
from reference_solver.certificate.audit.run import POINT, Indices, Run, placed, turned, twist_of
from reference_solver.certificate.audit.turning import SAME, pose_within, unseen
from reference_solver.certificate.audit.unexplained import Unexplained
from reference_solver.geometry import Nearest, core_of, distinct, rotation
from reference_solver.model import Array, HalfSpace
from reference_solver.shapes import smallest_extent

#: Share of the smaller half width within which a gap is none: a unit in the last place of it a thousand times.
NO_GAP = 1e-13
#: Share of the smallest half width up to which a gap of an impact is none, whatever the loads.
LATE = 1e-12
#: Share of a step up to which a piece is an instant: slips that have all but ended are taken out in 1e-8 of one (E54).
INSTANT = 1e-7
#: Share of the speeds there, ten times what solves leave of them, above which what touches parts.
PARTING = 1e-12


def measured(run: Run, left: Unexplained) -> Iterator[tuple[str, float]]:
    """Yield what is measured of all contacts that carry something, and of all pairs at impacts."""
    yield from zip(("apart", "direction", "place", "choice", "stays"), _touching(run, left), strict=True)
    yield "together", _left_out(run)


def _touching(run: Run, left: Unexplained) -> list[float]:
    """Worst gap, error of a normal [rad], and distance of a contact point from a surface, as shares of the extent.

    Then by how much faster bodies close along a normal than along another that is as good, as a share of the speeds,
    and how far contacts open within their pieces (`_opened`). Only contacts with an impulse are measured. Those of
    low rebounds that are summed up close a gap: they are left out.
    """
    pieces, force = run.pieces, np.linalg.norm(run.pieces.impulse, axis=1)
    worst, doubt, mass = np.zeros(5), unseen(run), reduced_mass(run)
    astray, apart = np.zeros((2, len(force)))
    coarse = run.is_rocking[run.contact_owner]
    carry = (np.abs(pieces.impulse) > 0.0).any(axis=1) & ~coarse & np.isfinite(pieces.normal).all(axis=1)
    pairs = pieces.body_a * len(run.free) + pieces.body_b
    for pair in np.unique(pairs[carry]):
        rows = np.flatnonzero(carry & (pairs == pair))
        a, b = int(pieces.body_a[rows[0]]), int(pieces.body_b[rows[0]])
        pose_a, pose_b = (pose_within(run, i, run.side[k][rows], 0.0) for k, i in enumerate((a, b)))
        shape_a, shape_b = run.model.bodies[a].shape, run.model.bodies[b].shape
        found = distinct(shape_a, pose_a, shape_b, pose_b)
        size = min(run.extent[a], run.extent[b])
        noise = 16.0 * np.spacing(max(np.abs(pieces.point[rows]).max(), np.abs(pose_b[:, : run.d]).max()))
        n = pieces.normal[rows]
        lost = (found.gap - _along(shape_a, pose_a, shape_b, pose_b, n, run.d) - noise) / size
        length = np.abs(np.linalg.norm(n, axis=1) - 1.0)
        off = np.zeros(len(rows))
        radius = _radius(shape_a) + _radius(shape_b)
        if radius > 0.0:  # a normal's error is of second order in the gap along it, its tilt of the impulse is not
            either = (np.linalg.norm(n - m, axis=1) for m in (found.normal, _line(found, radius)))
            off = np.minimum(*either) - noise / radius
        sooner, cornered = 0.0, is_cornered((shape_a, shape_b))
        if cornered:
            off = strayed(n, (shape_a, shape_b), (pose_a, pose_b), found)
        if cornered and (hit := run.is_impact[run.contact_owner[rows]]).any():
            at = pose_a[hit], pose_b[hit]
            sooner = float(closes_sooner(run, rows[hit], (shape_a, shape_b), at, found.gap[hit]).max())
        place = placed(pieces.point[rows], run.d)
        sides = [distinct(shape, pose, POINT, place).gap for shape, pose in ((shape_a, pose_a), (shape_b, pose_b))]
        # Beside its place a point leaves what is round in second order only: inwards, by its radius, in first order.
        sides += [_off_core(*own, pieces.point[rows], n) for own in ((shape_a, pose_a, -1.0), (shape_b, pose_b, 1.0))]
        beside = np.max([np.abs(side) - np.abs(found.gap) for side in sides], axis=0) - noise
        apart[rows] = (np.abs(found.gap) - noise).clip(min=0.0)
        here = ((np.abs(found.gap) - noise).max() / size, max(lost.max(), length.max(), off.max()), beside.max() / size)
        astray[rows] = force[rows] * (off.clip(min=0.0) + beside.clip(min=0.0) / size)
        lasts = np.flatnonzero(pieces.length[run.contact_owner[rows]] > INSTANT * run.dt)
        # What lasts is apart by its largest gap, and once.
        apart[rows[lasts]] = np.diff(np.maximum.accumulate(apart[rows[lasts]]), prepend=0.0)
        point = 0.5 * (found.point_a + found.point_b)[lasts]
        opened = (
            _opened(run, rows[lasts], (pose_a[lasts], pose_b[lasts]), point, noise, doubt, mass) if len(lasts) else 0.0
        )
        worst = np.maximum(worst, [*here, sooner, opened])
    left.pushed(astray)
    left.met(2.0 * apart)  # before and after
    # Loads change speeds for as long as an impact comes too late or too soon.
    approach = -(run.meeting_velocity(after=False) * pieces.normal).sum(axis=1)
    hit = run.is_impact[run.contact_owner] & (approach > 0.0)
    late = (apart - LATE * run.size).clip(min=0.0) / np.where(hit, approach, np.inf)
    left.pushed(2.0 * mass * np.minimum(run.pull * late, np.where(hit, approach, 0.0)))
    return [float(x) for x in worst]


def _line(found: Nearest, radius: float) -> Array:
    """Unit vectors (s, d) along the nearest points of two cores that ``radius`` grows [m].

    A ball whose centre is x beyond the end of a face is nearest to the corner: the normal leans by x/r, and with it by
    dx/r where places are known to dx. The gap grows by x^2/(2 r) only. Where that is round-off of the distance of a
    size s, 1e-14 s, `nearest` has the face's normal, off by up to sqrt(2e-14 s/r): 6e-7 for r = .1 m and s = 2 m. The
    contact of a ball that rolls over a seam has either.
    """
    line = found.point_b - found.point_a + radius * found.normal
    length = np.linalg.norm(line, axis=1, keepdims=True)
    return np.asarray(np.where(length > 0.0, line / np.where(length > 0.0, length, 1.0), found.normal))


def _off_core(shape: Any, pose: Array, sign: float, point: Array, normal: Array) -> Array:
    """How far (s,) places a radius from ``point``, along ``sign`` times the normal, are from the core [m]."""
    if not (radius := _radius(shape)):
        return np.zeros(len(point))
    vertex, inner = core_of(shape, pose).vertex, point + sign * radius * normal
    line = vertex[:, -1] - vertex[:, 0]
    square = (line * line).sum(axis=1)
    share = ((inner - vertex[:, 0]) * line).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    return np.asarray(np.linalg.norm(vertex[:, 0] + share.clip(0.0, 1.0)[:, None] * line - inner, axis=1))


def _opened(
    run: Run, rows: Indices, start: tuple[Array, Array], nearest: Array, noise: float, doubt: Array, mass: Array
) -> float:
    """How far contacts of one pair open by the middle and the end of their pieces, as a share of the extent.

    No feature carries beyond its end. Then the bodies are apart, or a corner is off the face that it stood on within
    its edges; where one of them is round they go apart along the normal of where they are, as a share of the speeds.
    Half-way bodies are where cubic polynomials have them, but for the ``doubt``: as near as an overlap counts.
    """
    pieces, worst = run.pieces, 0.0
    bodies = int(pieces.body_a[rows[0]]), int(pieces.body_b[rows[0]])
    shapes = [run.model.bodies[i].shape for i in bodies]
    size, still = min(run.extent[i] for i in bodies), min(run.still[i] for i in bodies)
    corners = [_corner_on_face(shapes[k], start[k], shapes[1 - k], start[1 - k], pieces.point[rows]) for k in (0, 1)]
    half_way = 1e-6 * size + sum(np.where(row[rows] >= 0, doubt[row[rows]], 0.0) for row in run.side)
    for share, unsure in ((0.5, half_way), (1.0, 0.0)):
        pose = [pose_within(run, i, run.side[k][rows], share) for k, i in enumerate(bodies)]
        found = distinct(shapes[0], pose[0], shapes[1], pose[1])
        off = np.abs(found.gap)
        for k, (at, corner) in enumerate(corners):
            if len(at):
                place = placed(core_of(shapes[k], pose[k][at]).vertex[np.arange(len(at)), corner], run.d)
                off[at] = np.maximum(off[at], np.abs(distinct(shapes[1 - k], pose[1 - k][at], POINT, place).gap))
        worst = max(worst, float(((off - noise - unsure) / size).max()))
    if (radius := _radius(shapes[0]) + _radius(shapes[1])) > 0.0:
        # Of a rod that lies flush the nearest point is the other end, or the middle: it tells nothing of this one.
        told = np.linalg.norm(nearest - pieces.point[rows], axis=1) <= SAME * size
        point = 0.5 * (found.point_a + found.point_b)
        first, last = (_moving(run, i, run.side[k][rows], point, pose[k], after=True) for k, i in enumerate(bodies))
        speed = np.linalg.norm(first, axis=1) + np.linalg.norm(last, axis=1)
        parting = ((last - first) * found.normal).sum(axis=1) - noise / radius * speed - still
        # What opens by no gap in the whole piece has not opened: so it is while a seam passes below a ball.
        told &= parting * pieces.length[run.contact_owner[rows]] > noise + NO_GAP * size
        parting = np.minimum(parting, np.linalg.norm(pieces.impulse[rows], axis=1) / mass[rows]).clip(min=0.0)
        worst = max(worst, float((parting / (speed + run.pull * run.dt + still))[told].max(initial=0.0)))
    return worst


def _corner_on_face(shape: Any, pose: Array, other: Any, pose_other: Array, point: Array) -> tuple[Indices, Indices]:
    """Which points (s, d) are corners of one body within a face of the other, and which corners, both (k,)."""
    if _radius(shape) + _radius(other) > 0.0 or isinstance(shape, HalfSpace):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    far = np.linalg.norm(core_of(shape, pose).vertex - point[:, None], axis=2)
    found = far.min(axis=1) <= SAME * smallest_extent(shape)
    if not isinstance(other, HalfSpace):
        core, near = core_of(other, pose_other), SAME * smallest_extent(other)
        if point.shape[1] == 2:
            found &= (np.linalg.norm(core.vertex - point[:, None], axis=2) > near).all(axis=1)
        else:
            local = np.einsum("sij,si->sj", core.axes, point - core.centre)
            found &= (core.half - np.abs(local) <= near).sum(axis=1) == 1
    return np.flatnonzero(found), far.argmin(axis=1)[found]


def _left_out(run: Run) -> float:
    """Approach after an impact of a pair of its bodies that touches and is no contact of it, over the speeds there.

    All that touches at that instant and does not part is solved together (E21): pair after pair would be another law.
    What parts may come closer, if the same instant has another impact.
    """
    pieces, d = run.pieces, run.d
    worst = 0.0
    impacts = np.flatnonzero(run.is_impact)
    if not len(impacts):
        return worst
    rows = np.flatnonzero(run.is_impact[run.owner])
    of = {(int(k), int(i)): int(row) for k, i, row in zip(run.owner[rows], pieces.body[rows], rows, strict=True)}
    known = set(zip(run.contact_owner.tolist(), pieces.body_a.tolist(), pieces.body_b.tolist(), strict=True))
    wanted: dict[tuple[int, int], list[int]] = {}
    for k in impacts.tolist():
        moved = [i for i in pieces.body[pieces.first_body[k] : pieces.first_body[k + 1]].tolist() if run.free[i]]
        for i in moved:
            for j in range(len(run.free)):
                if (j > i or not run.free[j]) and (run.free[j] <= ((k, j) in of)):
                    pair = (min(i, j), max(i, j))
                    if (k, *pair) not in known:
                        wanted.setdefault(pair, []).append(k)
    for (i, j), pieces_of in wanted.items():
        at = np.array(pieces_of)
        sides = [np.array([of.get((k, body), -1) for k in pieces_of]) for body in (i, j)]
        poses = [_at(run, body, side, at) for body, side in zip((i, j), sides, strict=True)]
        apart = np.linalg.norm(poses[0][:, :d] - poses[1][:, :d], axis=1)
        near = ~(apart > run.reach[i] + run.reach[j])
        if not near.any():
            continue
        found = distinct(run.model.bodies[i].shape, poses[0][near], run.model.bodies[j].shape, poses[1][near])
        size = min(run.extent[i], run.extent[j])
        # At the middle of both points: of a face that lies flush the mean of its corners, as good as any.
        point = 0.5 * (found.point_a + found.point_b)
        shares, noise = [], run.pull * run.dt * 1e-9 + 1e-15 * size / run.dt
        for after in (False, True):
            one, other = (
                _moving(run, body, side[near], point, pose[near], after)
                for body, side, pose in zip((i, j), sides, poses, strict=True)
            )
            closing, speed = (
                -((other - one) * found.normal).sum(axis=1),
                np.linalg.norm([one, other], axis=2).sum(axis=0),
            )
            shares.append(np.where(speed > 0.0, closing / (speed + noise), 0.0))
        touch = np.abs(found.gap) <= NO_GAP * size
        share = np.where(touch & ~(run.is_followed[at[near]] & (shares[0] < -PARTING)), shares[1], 0.0)
        worst = max(worst, float(share.max()))
    return worst


def _at(run: Run, i: int, rows: Indices, pieces: Indices) -> Array:
    """Poses (s, P) of body i in impacts: as the record has it, or as prescribed."""
    if run.free[i]:
        return np.asarray(run.pieces.pose_before[rows])
    return run.prescribed_pose(i, run.pieces.begin[pieces])


def _moving(run: Run, i: int, rows: Indices, point: Array, pose: Array, after: bool) -> Array:
    """Velocities (s, d) of points of body i before or ``after`` their pieces."""
    own = np.tile(twist_of(run.model.bodies[i]), (len(rows), 1))
    told = run.pieces.twist_after if after else run.pieces.twist_before
    twist = np.where((rows >= 0)[:, None], told[rows], own) if run.free[i] else own
    return np.asarray(twist[:, : run.d] + turned(twist[:, run.d :], point - pose[:, : run.d]))


def _radius(shape: Any) -> float:
    """What a shape's core is grown by [m]."""
    return float(getattr(shape, "radius", 0.0))


def _along(shape_a: Any, pose_a: Array, shape_b: Any, pose_b: Array, n: Array, d: int) -> Array:
    """Separation (s,) of two bodies along ``n``; of a half-space, less what another direction than its own loses."""
    heights = []
    for shape, pose, sign in ((shape_a, pose_a, 1.0), (shape_b, pose_b, -1.0)):
        if isinstance(shape, HalfSpace):
            own = np.einsum("sij,j->si", rotation(pose), np.array(shape.normal))
            # Its surface along n is its own, where n is its normal; the miss counts in full.
            heights.append((own * pose[:, :d]).sum(axis=1) + shape.offset + np.linalg.norm(sign * n - own, axis=1))
        else:
            centre = (sign * n * pose[:, :d]).sum(axis=1)
            heights.append(centre + _half_width(shape, pose, sign * n))
    return np.asarray(-heights[0] - heights[1])


def _half_width(shape: Any, pose: Array, n: Array) -> Array:
    """How far a body reaches along n (s, d) from its centre [m]."""
    local = np.einsum("sij,si->sj", rotation(pose), n)
    if hasattr(shape, "half_extents"):
        return np.asarray(np.abs(local) @ np.array(shape.half_extents))
    if hasattr(shape, "vertices"):
        return np.asarray((local @ np.array(shape.vertices).T).max(axis=1))
    if hasattr(shape, "half_length"):
        return np.asarray(np.abs(local[:, 0]) * shape.half_length + shape.radius)
    return np.full(len(n), float(shape.radius))
