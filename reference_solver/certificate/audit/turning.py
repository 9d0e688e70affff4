"""Contacts whose rows turn within a piece: their normals and points on the way, by the certificate's own geometry.

The impulse of such a piece is the mean of a force that turns with its normal, and acts at a point that moves. With
Simpson's rule over start, middle and end, the mean normal is known to the fourth order of the turn. What a force that
changes its size adds is the product of both changes: a twelfth of the turn times the share by which the force changes,
were both linear.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.certificate.audit.run import POINT, Indices, Run, placed
from reference_solver.geometry import Nearest, nearest, rotation
from reference_solver.model import Array

#: Thrice a twelfth: forces and normals bend, too.
SLACK = 0.25
#: Largest error of a normal that the geometry tells anew with which it counts as the one that was used.
SAME = 1e-6
#: Share of an impulse by which a piece that turns, whose stages obey the laws, may miss them.
SOLVED = 1e-8
#: Change of a force as a share of it where no neighbour in time tells: it may end, or begin.
UNKNOWN_CHANGE = 2.0


class Turned(NamedTuple):
    """Of each contact (c,), for its piece: where rows stand still, the normal and the point that the piece has."""

    normal: Array  # (c, d) mean
    last_normal: Array  # (c, d) at the end
    point: Array  # (c, d) mean, world axes [m]
    last_point: Array  # (c, d) at the end [m]
    lean: Array  # (c,) angle by which the impulse may be off the mean normal for its turning [rad]
    stray: Array  # (c,) length by which it may be off the mean point [m]; infinite where that is unknown
    change: Array  # (c,) share by which its force changes within the piece


def turned_contacts(run: Run) -> Turned:
    """Return normals and points over each piece; pairs that touch in many points at once keep those of the start."""
    pieces = run.pieces
    c = len(pieces.body_a)
    normal, last_normal = pieces.normal.copy(), pieces.normal.copy()
    point, last_point = pieces.point.copy(), pieces.point.copy()
    lean, stray, change = np.zeros(c), np.zeros(c), np.zeros(c)
    owner = run.contact_owner
    turning = ~run.is_frozen[owner] & (np.abs(pieces.impulse) > 0.0).any(axis=1)
    pairs = pieces.body_a * len(run.free) + pieces.body_b
    single, off = alone(owner, pairs), unseen(run)
    if turning.any():
        change = np.where(turning, changes_of_force(run), 0.0)
    for pair in np.unique(pairs[turning]):
        rows = np.flatnonzero(turning & (pairs == pair))
        a, b = int(pieces.body_a[rows[0]]), int(pieces.body_b[rows[0]])
        shapes = run.model.bodies[a].shape, run.model.bodies[b].shape
        seen = [
            nearest(
                shapes[0],
                pose_within(run, a, run.side[0][rows], at),
                shapes[1],
                pose_within(run, b, run.side[1][rows], at),
            )
            for at in (0.0, 0.5, 1.0)
        ]
        most = _largest_turn(run, rows)
        chord = np.linalg.norm(seen[2].normal - pieces.normal[rows], axis=1)
        # Where the geometry tells of another feature (faces that lie flush), only the bodies' spins bound the turn.
        told = np.linalg.norm(seen[0].normal - pieces.normal[rows], axis=1) <= SAME
        told &= (chord <= 2.0 * most) & (np.linalg.norm(seen[1].normal - pieces.normal[rows], axis=1) <= 2.0 * most)
        # How it turns, from what it was: faces that lie nearly flush have nearly the same.
        later = [np.where(told[:, None], x.normal - seen[0].normal, 0.0) for x in seen[1:]]
        normal[rows] += (4.0 * later[0] + later[1]) / 6.0
        normal[rows] /= np.linalg.norm(normal[rows], axis=1)[:, None]
        last_normal[rows] += later[1]
        # Of points that share a load, each may take it over from the others.
        change[rows] = np.where(single[rows], change[rows], UNKNOWN_CHANGE)
        lean[rows] = np.where(told, SLACK * chord * (chord + change[rows]) + chord.clip(max=SAME), 2.0 * most) + SOLVED
        place, sure = _places(run, rows, seen)
        moved = np.linalg.norm(place[2] - place[0], axis=1)
        sure = sure & told & single[rows]
        point[rows] = np.where(sure[:, None], (place[0] + 4.0 * place[1] + place[2]) / 6.0, point[rows])
        last_point[rows] = np.where(sure[:, None], place[2], last_point[rows])
        far = SLACK * moved * (most + change[rows]) + 1e-12 * run.size
        far += sum(np.where(row[rows] >= 0, off[row[rows]], 0.0) for row in run.side)
        stray[rows] = np.where(sure, far, np.inf)
    return Turned(normal, last_normal, point, last_point, lean, stray, change)


def alone(owner: Indices, pairs: Indices) -> NDArray[np.bool_]:
    """Whether (c,) a contact is the only one of its pair in its piece."""
    keys = owner * (int(pairs.max(initial=0)) + 1) + pairs
    _, which, count = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray(count[which] == 1)


def changes_of_force(run: Run) -> Array:
    """Share (c,) by which the force between two bodies changes in a piece, as its neighbours in time tell.

    Of its direction as well: friction turns with the slip.
    """
    pieces, owner = run.pieces, run.contact_owner
    pairs = pieces.body_a * len(run.free) + pieces.body_b
    length = pieces.length[owner]
    lasting = length > 0.0
    found = np.full(len(pairs), UNKNOWN_CHANGE)
    for pair in np.unique(pairs[lasting]):
        rows = np.flatnonzero(lasting & (pairs == pair))
        at, first = np.unique(owner[rows], return_inverse=True)
        total = np.zeros((len(at), run.d))
        np.add.at(total, first, pieces.impulse[rows])
        mean = total / pieces.length[at][:, None]
        force = np.linalg.norm(mean, axis=1)
        follows = follow_on(run, at)
        step = np.linalg.norm(np.diff(mean, axis=0), axis=1) * 2.0 / (pieces.length[at][1:] + pieces.length[at][:-1])
        step = np.where(follows, step, 0.0)
        known = np.concatenate([[False], follows]) & np.concatenate([follows, [False]])
        rate = np.maximum(np.concatenate([[0.0], step]), np.concatenate([step, [0.0]]))
        share = rate * pieces.length[at] / np.where(force > 0.0, force, 1.0)
        found[rows] = np.where(known, np.minimum(2.0 * share, UNKNOWN_CHANGE), UNKNOWN_CHANGE)[first]
    return found


def turns_beside(run: Run, turned: Array) -> Array:
    """Angles (c,) by which a direction turns in a piece, or would at the lower rate of its neighbours in time [rad].

    ``turned`` (c,) are angles between both ends. Where a direction turns back within a piece they say nothing of the
    way between; the pieces before and after do, which follow it, and in which it turns by less than one. Of pairs that
    touch in one point.
    """
    pieces, owner = run.pieces, run.contact_owner
    length, found = pieces.length[owner], turned.copy()
    pairs = pieces.body_a * len(run.free) + pieces.body_b
    usable = alone(owner, pairs) & (length > 0.0)
    for pair in np.unique(pairs[usable]):
        rows = np.flatnonzero(usable & (pairs == pair))
        follows = follow_on(run, owner[rows])
        rate = np.where(turned[rows] < 1.0, turned[rows], 0.0) / length[rows]
        before = np.concatenate([[0.0], np.where(follows, rate[:-1], 0.0)])
        after = np.concatenate([np.where(follows, rate[1:], 0.0), [0.0]])
        found[rows] = np.maximum(found[rows], length[rows] * np.minimum(before, after))
    return found


def follow_on(run: Run, at: Indices) -> NDArray[np.bool_]:
    """Whether (s - 1,) each of some pieces (s,), in the order of time, begins where the one before it ends."""
    begin, end = run.pieces.begin[at], run.pieces.begin[at] + run.pieces.length[at]
    return np.asarray(np.abs(begin[1:] - end[:-1]) <= 1e-12 * run.dt + 4.0 * np.spacing(np.abs(end[:-1])))


def _largest_turn(run: Run, rows: Indices) -> Array:
    """How far (s,) a normal can turn in its piece [rad]: by spins, and by bodies that pass each other."""
    pieces = run.pieces
    spins, passing = np.zeros(len(rows)), np.zeros((len(rows), run.d))
    places = []
    for k, sign in ((0, 1.0), (1, -1.0)):
        row = run.side[k][rows]
        known = (row >= 0)[:, None]
        first, last = (np.where(known, x[row], 0.0) for x in (pieces.twist_before, pieces.twist_after))
        spins += np.maximum(np.linalg.norm(first[:, run.d :], axis=1), np.linalg.norm(last[:, run.d :], axis=1))
        passing += sign * 0.5 * (first + last)[:, : run.d]
        places.append(pose_within(run, int((pieces.body_a, pieces.body_b)[k][rows[0]]), row, 0.0)[:, : run.d])
    apart = np.linalg.norm(places[0] - places[1], axis=1)
    apart = np.where(apart > 0.0, apart, run.size)
    shapes = [run.model.bodies[int(i[rows[0]])].shape for i in (pieces.body_a, pieces.body_b)]
    radii = [shape.radius for shape in shapes if hasattr(shape, "radius")]
    if len(radii) == 1:  # about a corner or an edge, what is round turns by its own radius
        apart = np.minimum(apart, radii[0])
    length = pieces.length[run.contact_owner[rows]]
    return np.asarray(length * (spins + np.linalg.norm(passing, axis=1) / apart) + 1e-12)


def _places(run: Run, rows: Indices, seen: list[Nearest]) -> tuple[list[Array], Array]:
    """Where (s, d) a contact is at the start, the middle and the end of its piece, and whether (s,) that is sure.

    The geometry tells where bodies touch that are round, or on a plane; else it is a corner of one of the two, which is
    on both at all three times.
    """
    pieces = run.pieces
    bodies = [int(body[rows[0]]) for body in (pieces.body_a, pieces.body_b)]
    shapes = [run.model.bodies[i].shape for i in bodies]
    start = pieces.point[rows]
    if any(hasattr(shape, "radius") or hasattr(shape, "normal") for shape in shapes):
        place = [0.5 * (x.point_a + x.point_b) for x in seen]
        moved = np.linalg.norm(place[2] - place[0], axis=1)
        sure = np.linalg.norm(place[0] - start, axis=1) <= SAME * run.size
        # No point goes faster than twice the bodies; where one does, a face has come to lie flush.
        sure &= moved <= 2.0 * _fastest(run, rows) + SAME * run.size
        sure &= np.linalg.norm(2.0 * place[1] - place[0] - place[2], axis=1) <= 0.5 * moved + SAME * run.size
        return place, sure
    place, sure = [start, start, start], np.zeros(len(rows), bool)
    for k in range(2):
        poses = [[pose_within(run, i, run.side[j][rows], at) for j, i in enumerate(bodies)] for at in (0.0, 0.5, 1.0)]
        own = np.einsum("sji,sj->si", rotation(poses[0][k]), start - poses[0][k][:, : run.d])
        later = [np.einsum("sij,sj->si", rotation(x[k]), own) + x[k][:, : run.d] for x in poses]
        other = [
            nearest(shapes[1 - k], x[1 - k], POINT, placed(at, run.d)).gap for x, at in zip(poses, later, strict=True)
        ]
        fits = np.asarray((np.abs(np.array(other)) <= SAME * run.size).all(axis=0))
        # Of faces that lie flush a corner of either fits, and both go ways of their own.
        differ = np.linalg.norm(later[2] - place[2], axis=1) > 1e-12 * run.size
        place = [np.where(fits[:, None], new, old) for new, old in zip(later, place, strict=True)]
        sure = np.where(sure & fits, ~differ, sure | fits)
    return place, sure


def unseen(run: Run) -> Array:
    """How far (m,) the middle of a path may be from where a cubic polynomial has it: (w h)^4/384 of a body, thrice."""
    first, last = (x[:, run.d :] for x in (run.pieces.twist_before, run.pieces.twist_after))
    reach = np.where(np.isfinite(run.reach), run.reach, 0.0)[run.pieces.body]
    return missed_by_cubic(reach, run.length, first, last)


def missed_by_cubic(reach: Array | float, length: Array, first: Array, last: Array) -> Array:
    """Return that of points a reach from the centre, for lengths (s,) with spins (s, 1 | 3) at both ends."""
    spin = np.maximum(np.linalg.norm(first, axis=1), np.linalg.norm(last, axis=1))
    turn = (length * spin) ** 2 + length * np.linalg.norm(last - first, axis=1)
    return np.asarray(reach * turn * turn / 128.0)


def _fastest(run: Run, rows: Indices) -> Array:
    """How far (s,) a point of either body goes in its piece, at most [m]."""
    pieces = run.pieces
    found = np.zeros(len(rows))
    for k, body in enumerate((pieces.body_a, pieces.body_b)):
        row = run.side[k][rows]
        arm = np.where(np.isfinite(run.reach), run.reach, 0.0)[body[rows]]
        for twist in (pieces.twist_before, pieces.twist_after):
            speed = np.linalg.norm(twist[row, : run.d], axis=1) + arm * np.linalg.norm(twist[row, run.d :], axis=1)
            found = np.maximum(found, np.where(row >= 0, speed, 0.0))
    return np.asarray(pieces.length[run.contact_owner[rows]] * found)


def pose_within(run: Run, i: int, rows: Indices, at: float) -> Array:
    """Poses (s, P) of body i in the pieces of ``rows`` after the share ``at`` of them, by a cubic polynomial."""
    pieces, length = run.pieces, run.length[rows]
    first, last = pieces.pose_before[rows], pieces.pose_after[rows]
    if 0.0 < at < 1.0:
        way, twists = way_between(first, last), (pieces.twist_before[rows], pieces.twist_after[rows])
        last = moved_by(first, cubic(way, *twists, length, at * length[:, None])[0])
    return np.where((rows >= 0)[:, None], last if at else first, np.array(run.model.bodies[i].pose, dtype=float))


def way_between(before: Array, after: Array) -> Array:
    """Displacements and turns (s, 3 | 6) from poses to poses."""
    if before.shape[1] == 3:
        return np.asarray(after - before)
    return np.concatenate([after[:, :3] - before[:, :3], rotation_vector(before[:, 3:], after[:, 3:])], axis=1)


def rotation_vector(q: Array, p: Array) -> Array:
    """Rotation vectors (s, 3) in world axes that turn orientation q into p, by less than a half turn."""
    # p times the conjugate of q
    scalar = (p * q).sum(axis=1)
    vector = -p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] - np.cross(p[:, 1:], q[:, 1:])
    vector *= np.where(scalar < 0.0, -1.0, 1.0)[:, None]
    sine = np.linalg.norm(vector, axis=1)
    angle = 2.0 * np.arctan2(sine, np.abs(scalar))
    return np.asarray(vector * np.where(sine > 1e-12, angle / np.where(sine > 0.0, sine, 1.0), 2.0)[:, None])


def vector_rate(psi: Array, w: Array) -> Array:
    """Rates (s, 3) of rotation vectors psi at angular velocities w, world axes (J. Stuelpnagel, SIAM Rev. 6, 1964).

    ``psi' = w - psi x w / 2 + c psi x (psi x w)``, ``c = (1 - (a/2) cot(a/2))/a^2`` of the angle a.
    """
    half = 0.5 * np.linalg.norm(psi, axis=1)
    large = half > 1e-3  # below it the next term of the series is 1e-9 of this one
    safe = np.where(large, half, 1.0)
    share = np.where(large, (1.0 - safe / np.tan(safe)) / (4.0 * safe * safe), 1.0 / 12.0)
    across = np.cross(psi, w)
    return np.asarray(w - 0.5 * across + share[:, None] * np.cross(psi, across))


def cubic(way: Array, first: Array, last: Array, length: Array, t: Array) -> tuple[Array, Array]:
    """Displacements (s, 3 | 6) and their rates after t (s, 1), by the cubic polynomial of a way and both its twists."""
    if way.shape[1] == 6:
        last = np.concatenate([last[:, :3], vector_rate(way[:, 3:], last[:, 3:])], axis=1)
    h = np.where(length > 0.0, length, 1.0)[:, None]
    s = t / h
    moved = s * s * (3.0 - 2.0 * s) * way + t * (1.0 - s) ** 2 * first + t * s * (s - 1.0) * last
    rate = 6.0 * s * (1.0 - s) / h * way + (1.0 - s) * (1.0 - 3.0 * s) * first + s * (3.0 * s - 2.0) * last
    return moved, rate


def moved_by(pose: Array, moved: Array) -> Array:
    """Poses (s, 3 | 7) after displacements and turns (s, 3 | 6)."""
    if pose.shape[1] == 3:
        return np.asarray(pose + moved)
    angle = np.linalg.norm(moved[:, 3:], axis=1, keepdims=True)
    half = 0.5 * np.sinc(0.5 * angle / np.pi) * moved[:, 3:]
    scalar, (w, v) = np.cos(0.5 * angle), (pose[:, 3:4], pose[:, 4:])
    q = [scalar * w - (half * v).sum(axis=1, keepdims=True), scalar * v + w * half + np.cross(half, v)]
    return np.concatenate([pose[:, :3] + moved[:, :3], *q], axis=1)
