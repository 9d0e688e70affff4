"""Forces at the instants between pieces: a mean over a piece whose contacts turn hides a share of them.

Where a contact, or a body, goes on through several pieces, sums of its impulses and moments are known as each begins,
and so are its normal, its point, its slip and its spin. The rate of a polynomial through the sums is the force there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from reference_solver.certificate.audit.contact import fastest_of, reduced_mass, speeds
from reference_solver.certificate.audit.run import Indices, Run, cross
from reference_solver.certificate.audit.turning import follow_on, vector_rate, way_between
from reference_solver.certificate.audit.unexplained import Unexplained
from reference_solver.model import Array

#: Pieces through whose ends a polynomial goes. Two others leave out the first end, or the last. Its error is taken as
#: `SLACK` times the largest difference from these, ten times what it is in smooth motion. If two ends were left out,
#: forces that are wrong by 1e-8 would be within that.
PIECES, SLACK = 6, 3.0
MIDDLE = PIECES // 2
#: Largest turn of a body in space in `PIECES` of which turns are compared: rates of rotation vectors grow without bound
#: towards a whole turn [rad].
FAR = 1.0
#: Share of a step below which a piece is too short to tell a rate; and of the fastest speed of the run above which a
#: contact slips for certain.
SHORT, SLIPS = 1e-3, 1e-9


def measured(run: Run, left: Unexplained) -> Iterator[tuple[str, float]]:
    """Yield by how much forces miss their laws, and moments the rates of spins, as shares of what acts.

    Friction is mu times the load against a slip, within its cone elsewhere, and a force acts at its point.
    """
    way, modes = _slips(run)
    left.went(_beside(run, modes))
    yield "rates", max(_forces(run, left, modes, way), _spins(run, left, modes))


def _beside(run: Run, modes: Array) -> Array:
    """Bound (m,) of how far points are from where the integrals of twists over several pieces lead [m].

    A polynomial goes through the twists between pieces; in space, through the rates of rotation vectors. This distance
    has no limit: steps to a coarse tolerance make it large in runs that are right.
    """
    pieces, d, count = run.pieces, run.d, np.arange(len(run.pieces.body))
    found = np.zeros((len(count), 2))
    at = _in_a_row(run, _goes_on(run), modes[run.owner], run.owner, (count,))
    if d == 3:  # rotation vectors are those of less than half a turn
        spin = np.linalg.norm(pieces.twist_after[at][..., d:], axis=2).max(axis=1, initial=0.0)
        at = at[spin * run.length[at].sum(axis=1) < FAR]
    first, rate = pieces.pose_before[at[:, :1]].repeat(PIECES, axis=1), pieces.twist_after[at]
    form, rate = rate.shape, _flat(rate)
    way = way_between(_flat(first), _flat(pieces.pose_after[at]))
    if d == 3:
        rate[:, d:] = vector_rate(way[:, d:], rate[:, d:])
    rates = np.concatenate([pieces.twist_before[at[:, :1]], rate.reshape(form)], axis=1)
    (ends, whole), told = _ends(run.length[at]), []
    for own in (*_knots(), slice(1, PIECES)):
        power = np.arange(len(range(PIECES + 1)[own]))
        terms = np.linalg.solve(ends[:, own, None] ** power, rates[:, own])
        told.append(whole[:, :, None] * np.diff(ends[:, :, None] ** (power + 1) / (power + 1) @ terms, axis=1))
    off = np.array([np.diff(way.reshape(form), axis=1, prepend=0.0), *told[1:]]) - told[0]
    for out, own in enumerate((slice(0, d), slice(d, None))):
        missed, *unsure = np.linalg.norm(off[..., own], axis=3)
        missed = np.where(missed > SLACK * np.max(unsure, axis=0), missed, 0.0)
        for j in np.argsort(-np.abs(np.arange(PIECES) + 0.5 - MIDDLE)):  # the middle last: errors are least there
            found[at[:, j], out] = missed[:, j]
    arm = np.where(run.free, run.reach, 0.0)[pieces.body]
    return np.asarray(found[:, 0] + arm * found[:, 1])


def _flat(rows: Array) -> Array:
    return rows.reshape(-1, rows.shape[-1])


def _slips(run: Run) -> tuple[Array, Array]:
    """Directions of slips (c, d), zeros where nothing slips, and numbers (p, 3) that tell where forces jump.

    They do where a piece has other contacts than the one before it, or others of them slip.
    """
    pieces, owner = run.pieces, run.contact_owner
    slip = run.meeting_velocity(after=False)
    slip = slip - (slip * pieces.normal).sum(axis=1)[:, None] * pieces.normal
    size = np.linalg.norm(slip, axis=1)
    slips = size > SLIPS * fastest_of(speeds(run))
    way = np.where(slips[:, None], slip, 0.0) / np.where(slips, size, 1.0)[:, None]
    modes = [np.bincount(owner, each, len(pieces)) for each in (None, slips, pieces.feature)]
    return way, np.column_stack(modes).astype(float)


def _goes_on(run: Run) -> Sequence[Indices]:
    """What rows of one free body share, and no others: those are no motion that goes on."""
    body = run.pieces.body
    return np.where(run.free[body], -1, np.arange(len(body))), body


def _forces(run: Run, left: Unexplained, modes: Array, way: Array) -> float:
    pieces, d = run.pieces, run.d
    # Points of a pair share its load in a way that the record knows less well: their sum is asked, and no moment. The
    # law holds for it as far as their normals and slips are those of the first.
    keys = (pieces.body_a * len(run.free) + pieces.body_b) * len(pieces) + run.contact_owner
    _, first, pair, points = np.unique(keys, return_index=True, return_inverse=True, return_counts=True)
    a, b, owner = pieces.body_a[first], pieces.body_b[first], run.contact_owner[first]
    impulse, unlike = np.zeros((len(first), d)), np.zeros(len(first))
    np.add.at(impulse, pair, pieces.impulse)
    both = np.column_stack([pieces.normal, way])
    np.maximum.at(unlike, pair, np.abs(both - both[first][pair]).sum(axis=1))
    n, way, length = pieces.normal[first], way[first], pieces.length[owner]
    slips = np.asarray(way.any(axis=1))
    state = np.column_stack([slips, np.sign(cross(n, way))[:, 0] if d == 2 else slips, modes[owner]])
    at = _in_a_row(run, (pieces.feature[first], b, a), state, owner, [each[first] for each in run.side])
    c = at[:, MIDDLE]
    # Moments about the point there, whose round-off is none of the distance from the origin.
    moment = _moved(-pieces.point[first][c][:, None], impulse[at], pieces.moment[first][at]) / run.size
    moment *= (points == 1)[c][:, None, None]
    rate, unsure = _rate(length[at], np.concatenate([impulse[at], moment], axis=2))
    force, mu = rate[:, :d], run.model.friction[a, b][c]
    load = (force * n[c]).sum(axis=1)
    limit = mu * load.clip(min=0.0)
    along = force - load[:, None] * n[c] + limit[:, None] * way[c]
    missed = np.linalg.norm(along, axis=1) - np.where(slips[c], 0.0, limit)
    missed = np.maximum(missed, np.linalg.norm(rate[:, d:], axis=1))
    acting = np.linalg.norm(force, axis=1)
    missed = np.where(missed > unsure + unlike[c] * acting, missed, 0.0)
    left.pushed(np.bincount(first, _lasting(at, missed, length), len(pair)).astype(float))
    return _worst(missed, acting + reduced_mass(run)[first][c] * run.pull)


def _spins(run: Run, left: Unexplained, modes: Array) -> float:
    pieces, body, count = run.pieces, run.pieces.body, np.arange(len(run.pieces.body))
    at = _in_a_row(run, _goes_on(run), modes[run.owner], run.owner, (count,))
    c, place = at[:, MIDDLE], pieces.pose_before[:, : run.d]
    linear, turning, *_ = run.pushed
    gained = run.spin[1][at] - run.spin[0][at] - run.length[at][:, :, None] * run.torque[body[at]]
    moment = _moved(place[at] - place[c][:, None], linear[at], turning[at])
    rate, unsure = _rate(run.length[at], moment - gained)
    missed = np.linalg.norm(rate, axis=1)
    missed = np.where(missed > unsure, missed, 0.0)
    reach, least = np.where(run.free, run.reach, 0.0)[body], run.moments[body].min(axis=1)
    left.gained(_lasting(at, missed, run.length) * reach / least)
    return _worst(missed, (reach * run.mass[body])[c] * run.pull + np.linalg.norm(run.torque[body[c]], axis=1))


def _in_a_row(run: Run, identity: Sequence[Indices], state: Array, owner: Indices, sides: Sequence[Indices]) -> Indices:
    """Rows (k, PIECES) of one ``identity`` and ``state`` in pieces of ``owner``, bodies of ``sides`` not struck."""
    pieces = run.pieces
    turns = ~run.is_frozen & ~run.is_rocking & (pieces.length > SHORT * run.dt)
    order = np.flatnonzero(turns[owner])
    order = order[np.lexsort((owner[order], *(each[order] for each in identity)))]
    one, other = order[:-1], order[1:]
    same = follow_on(run, owner[order]) & (state[one] == state[other]).all(axis=1)
    for each in identity:
        same &= each[one] == each[other]
    for row in sides:
        same &= (row[one] < 0) | (pieces.twist_after[row[one]] == pieces.twist_before[row[other]]).all(axis=1)
    chain = np.append(0, np.cumsum(~same))[: len(order)]
    first = np.flatnonzero(chain[: 1 - PIECES] == chain[PIECES - 1 :]) if len(order) >= PIECES else order[:0]
    return np.asarray(order[first[:, None] + np.arange(PIECES)])


def _lasting(at: Indices, missed: Array, length: Array) -> Array:
    """Forces (k,) that miss, times lengths (c,) of pieces: each of a row misses what its middle does."""
    found = np.zeros(len(length))
    np.maximum.at(found, at, missed[:, None])
    return found * length


def _moved(arm: Array, impulse: Array, moment: Array) -> Array:
    """Moments (k, PIECES, s) about places from which their own are ``arm`` away."""
    arm = np.broadcast_to(arm, impulse.shape).reshape(-1, impulse.shape[2])
    return np.asarray(moment + cross(arm, impulse.reshape(arm.shape)).reshape(moment.shape))


def _rate(length: Array, acting: Array) -> tuple[Array, Array]:
    """Rates (k, q) of sums as the middle one of k rows of pieces begins, and how far they may be off (k,)."""
    ends, whole = _ends(length)
    sums = np.concatenate([np.zeros((len(length), 1, acting.shape[2])), acting.cumsum(axis=1)], axis=1)
    found = []
    for own in _knots():
        powers = ends[:, own, None] ** np.arange(len(range(PIECES + 1)[own]))
        found.append(np.linalg.solve(powers, sums[:, own] - sums[:, MIDDLE, None])[:, 1] / whole)
    unsure = np.maximum(*(np.linalg.norm(each - found[0], axis=1) for each in found[1:]))
    return found[0], SLACK * unsure


def _ends(length: Array) -> tuple[Array, Array]:
    """Ends (k, PIECES + 1) of k rows of pieces, from the middle on, as shares of their whole length (k, 1) [s]."""
    ends = np.concatenate([np.zeros((len(length), 1)), length.cumsum(axis=1)], axis=1)
    return (ends - ends[:, MIDDLE, None]) / ends[:, -1:], ends[:, -1:]


def _knots() -> list[slice]:
    """Ends of pieces through which the polynomial goes, and the others."""
    return [slice(PIECES + 1), slice(PIECES), slice(1, PIECES + 1)]


def _worst(missed: Array, scale: Array) -> float:
    return float((missed / np.where(scale > 0.0, scale, np.inf)).max(initial=0.0))
