"""Forces at the instants between pieces: a mean over a piece whose contacts turn hides a share of them.

Where a contact, or a body, goes on through several pieces, sums of its impulses and moments are known as each begins,
and so are its normal, its point, its slip and its spin. The rate of a polynomial through the sums is the force there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from reference_solver.certificate.audit.contact import fastest_of, reduced_mass, speeds
from reference_solver.certificate.audit.run import Indices, Run, cross
from reference_solver.certificate.audit.turning import alone, follow_on
from reference_solver.certificate.audit.unexplained import Unexplained
from reference_solver.model import Array

#: Pieces through whose ends a polynomial goes, and how many fewer another one has. What both differ by, so many times,
#: is what they leave out: where all is smooth it is a hundred times that.
PIECES, FEWER, SLACK = 6, 2, 3.0
MIDDLE = PIECES // 2
#: Share of a step below which a piece is too short to tell a rate; and of the fastest speed of the run above which a
#: contact slips for certain.
SHORT, SLIPS = 1e-3, 1e-9


def measured(run: Run, left: Unexplained) -> Iterator[tuple[str, float]]:
    """Yield by how much forces miss their laws, and moments the rates of spins, as shares of what acts.

    Friction is mu times the load against a slip, within its cone elsewhere, and a force acts at its point.
    """
    pieces, owner = run.pieces, run.contact_owner
    slip = run.meeting_velocity(after=False)
    slip = slip - (slip * pieces.normal).sum(axis=1)[:, None] * pieces.normal
    size = np.linalg.norm(slip, axis=1)
    slips = size > SLIPS * fastest_of(speeds(run))
    way = np.where(slips[:, None], slip, 0.0) / np.where(slips, size, 1.0)[:, None]
    # Forces jump where a piece has other contacts, or others of them slip.
    modes: Array = np.column_stack(
        [np.bincount(owner, each, len(pieces)) for each in (None, slips, pieces.feature)]
    ).astype(float)
    yield "rates", max(_forces(run, left, modes, way), _spins(run, left, modes))


def _forces(run: Run, left: Unexplained, modes: Array, way: Array) -> float:
    pieces, owner, n, d = run.pieces, run.contact_owner, run.pieces.normal, run.d
    slips, length = np.asarray(way.any(axis=1)), run.pieces.length[run.contact_owner]
    turned = np.sign(cross(n, way))[:, 0] if d == 2 else slips
    # Points of a pair share its load in a way that the record knows less well: they are not asked.
    shares = np.where(alone(owner, pieces.body_a * len(run.free) + pieces.body_b), -1, np.arange(len(owner)))
    identity = shares, pieces.feature, pieces.body_b, pieces.body_a
    state = np.column_stack([slips, turned, modes[owner]])
    at = _in_a_row(run, identity, state, owner, run.side)
    c = at[:, MIDDLE]
    # Moments about the point there, whose round-off is none of the distance from the origin.
    moment = _moved(-pieces.point[c][:, None], pieces.impulse[at], pieces.moment[at]) / run.size
    rate, unsure = _rate(length[at], np.concatenate([pieces.impulse[at], moment], axis=2))
    force, mu = rate[:, :d], run.model.friction[pieces.body_a, pieces.body_b][c]
    load = (force * n[c]).sum(axis=1)
    limit = mu * load.clip(min=0.0)
    along = force - load[:, None] * n[c] + limit[:, None] * way[c]
    missed = np.linalg.norm(along, axis=1) - np.where(slips[c], 0.0, limit)
    missed = np.maximum(missed, np.linalg.norm(rate[:, d:], axis=1))
    missed = np.where(missed > unsure, missed, 0.0)
    left.pushed(_lasting(at, missed, length))
    return _worst(missed, np.linalg.norm(force, axis=1) + reduced_mass(run)[c] * run.pull)


def _spins(run: Run, left: Unexplained, modes: Array) -> float:
    pieces, body, count = run.pieces, run.pieces.body, np.arange(len(run.pieces.body))
    identity = (np.where(run.free[body], -1, count), body)  # others are no motion that goes on
    at = _in_a_row(run, identity, modes[run.owner], run.owner, (count,))
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
    ends = np.concatenate([np.zeros((len(length), 1)), length.cumsum(axis=1)], axis=1)
    ends = (ends - ends[:, MIDDLE, None]) / ends[:, -1:]
    sums = np.concatenate([np.zeros((len(length), 1, acting.shape[2])), acting.cumsum(axis=1)], axis=1)
    found = []
    for cut in (0, FEWER // 2):
        own = slice(cut, PIECES + 1 - cut)
        powers = ends[:, own, None] ** np.arange(PIECES + 1 - 2 * cut)
        found.append(np.linalg.solve(powers, sums[:, own] - sums[:, MIDDLE, None])[:, 1])
    whole = length.sum(axis=1)[:, None]
    return found[0] / whole, SLACK * np.linalg.norm((found[0] - found[1]) / whole, axis=1)


def _worst(missed: Array, scale: Array) -> float:
    return float((missed / np.where(scale > 0.0, scale, np.inf)).max(initial=0.0))
