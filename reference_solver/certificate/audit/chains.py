"""Whether impacts that a piece sums up have no end: proven by the eigenvalues of the cycle in which they repeat (E22).

Where bodies touch and one pair meets at a time, Newton's law of that pair without friction changes the normal
velocities u of all contacts by a matrix, and the gaps g, as multiples of what they are, by another one. The product of
those of a cycle tells of all that follow: with the largest eigenvalue l of the first below 1, and all of the second
below l, velocities fall by l and times by less than 1 from cycle to cycle, so that all is over in a finite time.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from reference_solver.certificate.audit.contact import LEFT, reduced_mass, speeds
from reference_solver.certificate.audit.run import Indices, Run, cross
from reference_solver.geometry import rotation
from reference_solver.model import Array

#: Impacts that are followed to find the cycle, and the longest cycle that is looked for.
FOLLOWED, LONGEST = 5000, 64
#: Share to which velocities of a cycle are a multiple of those of the one before, and share of the largest that each
#: velocity must have for its sign to be certain.
SAME, CLEAR = 1e-9, 1e-7
#: Share of the fastest approach of an impact below which contacts with e = 0 that separate count as closed (E21); and
#: share of a step within which two times are the same.
DRIFTS, SOON = 1e-6, 1e-9
#: Share of what stops the speeds at a contact below which an impulse of a phase is round-off.
NO_LOAD = 1e-9

Groups = list[Indices]


def measured(run: Run) -> Iterator[tuple[str, float]]:
    """Yield how many chains of impacts are not proven to be without end."""
    yield "endless", float(sum(not _has_no_end(run, k) for k in np.flatnonzero(run.is_chain).tolist()))


def without_order(run: Run) -> Indices:
    """Impacts of which round-off decides whether bodies are struck at once or in turn.

    Several pairs meet, and which comes first is not known. Or bodies that touch have no speed but round-off, which
    impacts of one instant have left (but for a cycle that is proven, and for what has carried load since): they may
    part, or lie. Or, with e = 0, they go apart so slowly that they count as lying, though no load has held them.
    """
    pieces, owner = run.pieces, run.contact_owner
    u = (run.meeting_velocity(after=False) * pieces.normal).sum(axis=1)
    fastest = np.zeros(len(pieces))
    np.maximum.at(fastest, owner, -u)
    pairs = pieces.body_a * len(run.free) + pieces.body_b
    # What a phase presses by round-off it does not press.
    least = np.where(run.is_impact[owner], 0.0, NO_LOAD * reduced_mass(run) * speeds(run))
    pressed = np.flatnonzero((pieces.impulse * pieces.normal).sum(axis=1) > least)
    order = pressed[np.lexsort((owner[pressed], pairs[pressed]))]
    last = np.full(len(owner), -1)
    later = (pairs[order[1:]] == pairs[order[:-1]]) & (owner[order[1:]] != owner[order[:-1]])
    last[order[1:][later]] = owner[order[:-1][later]]
    at_once = run.is_followed | np.append(False, run.is_followed[:-1])
    known, slow = last >= 0, np.abs(u) <= LEFT * fastest[owner]
    since = pieces.begin[owner] - pieces.begin[last]
    left = known & slow & (at_once & ~run.is_chain)[last] & (since > 0.0)
    loaded = known & run.is_forces[last] & (since <= pieces.length[last] + SOON * run.dt)
    _, pair = np.unique(owner * len(run.free) ** 2 + pairs, return_inverse=True)
    met = np.bincount(pair, u < -LEFT * fastest[owner]) > 0.0  # its points answer together
    drifts = ~slow & (u > 0.0) & (u <= DRIFTS * fastest[owner]) & ~loaded & ~met[pair]
    bounces = run.model.restitution[pieces.body_a, pieces.body_b] > 0.0
    parts = met[pair] & ~run.is_chain[owner] & (u > DRIFTS * fastest[owner])
    struck = np.isin(np.arange(len(owner)), pressed) & run.is_impact[owner] & np.where(bounces, left | parts, drifts)
    return np.flatnonzero(np.bincount(owner[struck], minlength=len(pieces)) > 0)


def _has_no_end(run: Run, piece: int) -> bool:
    """Whether the contacts that a piece presses go on being struck, all of them, for ever in a finite time."""
    pieces = run.pieces
    rows = np.arange(pieces.first_contact[piece], pieces.first_contact[piece + 1])
    pressed = (pieces.impulse[rows] * pieces.normal[rows]).sum(axis=1) > 0.0
    rows = rows[_joined(run, rows, pressed)]
    pairs = np.column_stack([pieces.body_a, pieces.body_b])[rows]
    if not len(rows) or (run.model.friction[pairs[:, 0], pairs[:, 1]] > 0.0).any():
        return False
    u = (run.meeting_velocity(after=False) * pieces.normal).sum(axis=1)[rows]
    yields, e = _yields(run, rows), run.model.restitution[pairs[:, 0], pairs[:, 1]]
    # What lies across the row, and feels no impulse of it, has no part in it.
    lies = np.abs(u) <= CLEAR * np.abs(u).max()
    feels = (np.abs(yields[:, ~lies]) > SAME * np.diag(yields)[:, None]).any(axis=1)
    own = np.flatnonzero(~lies | feels)
    rows, pairs, u, yields, e = rows[own], pairs[own], u[own], yields[np.ix_(own, own)], e[own]
    cycle, u = _cycle(u, yields, e, pairs)
    if not cycle:
        return False
    struck = np.unique(np.concatenate(cycle))
    held = rows[struck]
    if not np.array_equal((pieces.impulse[held] * pieces.normal[held]).sum(axis=1) > 0.0, np.ones(len(held), bool)):
        return False
    return _contracts(cycle, u, yields, e, struck)


def _joined(run: Run, rows: Indices, pressed: Array) -> Array:
    """Whether (c,) contacts share free bodies with pressed ones, directly or through others."""
    a, b = run.pieces.body_a[rows], run.pieces.body_b[rows]
    known, grown = np.zeros(len(run.free), bool), True
    found = pressed.astype(bool)
    while grown:
        known[a[found]] = known[b[found]] = True
        known &= run.free
        more = found | known[a] | known[b]
        grown, found = bool((more != found).any()), more
    return found


def _yields(run: Run, rows: Indices) -> Array:
    """Change (c, c) of the normal velocity of each contact by a unit of the normal impulse of each other one [1/kg]."""
    pieces, d = run.pieces, run.d
    found = np.zeros((len(rows), len(rows)))
    for i in np.flatnonzero(run.free):
        lever = np.zeros((len(rows), d + pieces.moment.shape[1]))
        for bodies, side, sign in ((pieces.body_a, run.side[0], -1.0), (pieces.body_b, run.side[1], 1.0)):
            own = np.flatnonzero(bodies[rows] == i)
            n, at = pieces.normal[rows[own]], side[rows[own]]
            turning = cross(pieces.point[rows[own]] - pieces.pose_before[at, :d], n)
            if d == 3 and len(own):  # along the body's axes, where its inertia is diagonal
                turning = np.einsum("sij,si->sj", rotation(pieces.pose_before[at]), turning)
            lever[own] += sign * np.concatenate([n, turning], axis=1)
        found += lever / np.concatenate([np.full(d, run.mass[i]), run.moments[i]]) @ lever.T
    return found


def _next(u: Array, pairs: Indices) -> Indices:
    """Contacts that meet next; none where the order is not certain, or all part."""
    size = np.abs(u).max()
    meets = np.flatnonzero(u < 0.0)
    certain = (np.abs(u) > CLEAR * size).all() and (pairs[meets] == pairs[meets[:1]]).all()
    # Points of a pair answer together: where one of them parts, the answer is not linear.
    certain &= len(meets) == (pairs == pairs[meets[:1]]).all(axis=1).sum() if len(meets) else False
    return meets if certain else meets[:0]


def _impulses(group: Indices, yields: Array, e: Array) -> Array:
    """Matrix (g, g) from the velocities of a group of contacts to the impulses of their impact [kg]."""
    return -np.linalg.pinv(yields[np.ix_(group, group)]) * (1.0 + e[group])


def _answer(group: Indices, yields: Array, e: Array) -> Array:
    """Matrix (c, c) that an impact of a group of contacts multiplies velocities by."""
    found = np.eye(len(e))
    found[:, group] += yields[:, group] @ _impulses(group, yields, e)
    return found


def _cycle(u: Array, yields: Array, e: Array, pairs: Indices) -> tuple[Groups, Array]:
    """Follow impacts until they repeat; the groups that are struck in a cycle, and the velocities it begins with."""
    groups: Groups = []
    past: list[Array] = []
    for _ in range(FOLLOWED):
        group = _next(u, pairs)
        if not len(group) or (_impulses(group, yields, e) @ u[group] < 0.0).any():  # contacts do not pull
            break
        for p in range(1, min(LONGEST, len(groups)) + 1):
            struck = np.unique(np.concatenate(groups[-p:]))
            now, then = u[struck], past[-p][struck]
            if np.abs(now / np.abs(now).max() - then / np.abs(then).max()).max() < SAME:
                return groups[-p:], u
        groups.append(group)
        past.append(u)
        u = _answer(group, yields, e) @ u
    return [], u


def _contracts(cycle: Groups, u: Array, yields: Array, e: Array, struck: Indices) -> bool:
    """Whether a cycle that begins with velocities u goes on for ever, and its times add up to a finite one."""
    size, place = len(struck), {int(k): i for i, k in enumerate(struck)}
    speeds, gaps, now = np.eye(len(u)), np.eye(size), u
    for group in cycle:
        v, own = now[struck], [place[int(k)] for k in group]
        gaps = gaps - np.outer(v, gaps[own[0]]) / v[own[0]]
        gaps[own] = 0.0
        answer = _answer(group, yields, e)
        speeds, now = answer @ speeds, answer @ now
    inner = yields[np.ix_(struck, struck)]
    basis, weight, _ = np.linalg.svd(inner)  # velocities that bodies can have: contacts may be redundant
    basis = basis[:, weight > 1e-12 * weight.max()]
    sizes = np.sort(np.abs(np.linalg.eigvals(basis.T @ speeds[np.ix_(struck, struck)] @ basis)))[::-1]
    factor = np.abs(now[struck]).max() / np.abs(u[struck]).max()
    stays = sizes[0] <= (1.0 + np.sqrt(SAME)) * factor  # no disturbance outgrows the velocities of the cycle
    return bool(stays and factor < 1.0 - SAME and np.abs(np.linalg.eigvals(gaps)).max() < factor)
