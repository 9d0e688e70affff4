"""Whether a motion hangs on how contacts share a load, where the laws do not say how they do.

Four corners of a box carry its weight in more than one way. That is of no consequence while all of them stick, or while
all slip one way with one mu; else the ways differ in friction, and so in motion. Of one piece the ways are the forces
(of an impact: impulses) that leave the held directions as they are: normals of contacts that stay closed, loaded or
not, and tangents of those that stick. They push, have ``mu p_n`` against a slip, and stay within the cone where nothing
slips: a convex set, whose extremes tell by how much velocities may differ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.certification.audit.contact import SLIP_NOISE, speeds
from reference_solver.certification.audit.run import Indices, Run, cross, scaled_along
from reference_solver.certification.geometry import rotation
from reference_solver.model import Array

#: Share of the speeds that meet by which a closed contact may seem to open: what `CHECKS` allows normal impulses.
HELD = 1e-9
#: Share of their levers by which contacts may miss being redundant: points are known to that (`CHECKS`, ``place``).
REDUNDANT = 1e-9
#: Share of what the forces of redundant contacts do that is round-off where they cancel: some thousand last places.
ROUND_OFF = 1e-12
#: Sides of the polygon that stands for the circle of sticking friction in space; it is a fiftieth too wide.
SIDES = 16


class Shared(NamedTuple):
    """Of each row, a body in a piece: what it may gain otherwise than it did, and by which contacts."""

    gain: Array  # (m,) spread of the change of velocity in the piece, of the body's fastest point [m/s]
    contacts: dict[int, Indices]  # of rows with a spread: the contacts that share


class _Contacts(NamedTuple):
    """What an admissible force of each contact (c,) is made of.

    Pushes are what unit impulses do to the bodies on both sides, as changes of their twists times the root of M: along
    the normal, along the normal and against the slip by mu, and along the tangents.
    """

    held: NDArray[np.bool_]  # (c,) closed throughout its piece
    rubs: NDArray[np.bool_]  # (c,) held, and slips with friction
    sticks: NDArray[np.bool_]  # (c,) held, and friction keeps it from slipping
    mu: Array  # (c,)
    given: Array  # (c, d) impulse: along the normal, along the tangents [N s]
    row: Indices  # (c, 2) rows of body A and body B; -1 where it is not free
    push: Array  # (c, 2, 1 + d, 3 | 6)


def shared_loads(run: Run) -> Shared:
    """Return what the laws leave open of each row; impulse-level pieces, which are no truth, are not asked."""
    pieces, owner = run.pieces, run.contact_owner
    found = Shared(np.zeros(len(pieces.body)), {})
    if not len(owner):
        return found
    contacts = _contacts(run)
    for k in np.unique(owner[contacts.rubs]):
        own = np.arange(pieces.first_contact[k], pieces.first_contact[k + 1])
        for cluster in _clusters(own[contacts.held[own]], contacts.row):
            if len(cluster) > 1 and contacts.rubs[cluster].any():
                _share(run, contacts, cluster, found)
    return found


def ways_apart(run: Run, t: Array) -> tuple[Array, str]:
    """Return how far apart (s,) two motions may be at times ``t`` (s,) that both obey the laws [m], and why.

    Velocities that differ go on doing so until their body rests. The sentence names the body that this moves farthest,
    with the contacts of the piece that adds most; it is empty where the laws leave nothing open.
    """
    shared, pieces = shared_loads(run), run.pieces
    found, told = np.zeros(len(t)), ""
    for i in np.unique(pieces.body[list(shared.contacts)]):
        rows = np.flatnonzero(pieces.body == i)
        speed, way, ways = 0.0, 0.0, []
        for gain, length, rests in zip(shared.gain[rows], run.length[rows], _rests(run, rows), strict=True):
            speed = 0.0 if rests else speed + gain
            way += speed * length
            ways.append(way)
        own = np.interp(t, (pieces.begin[run.owner] + run.length)[rows], ways, left=0.0)
        if own[-1] > found[-1]:
            most = rows[shared.gain[rows].argmax()]
            told = _told(run, int(i), shared.contacts[int(most)], float(own[-1]))
        found = np.maximum(found, own)
    return found, told


def _rests(run: Run, rows: Indices) -> NDArray[np.bool_]:
    """Whether (s,) a body stands still in a piece."""
    twist, i = run.pieces.twist_after[rows], run.pieces.body[rows]
    speed = np.linalg.norm(twist[:, : run.d], axis=1) + run.reach[i] * np.linalg.norm(twist[:, run.d :], axis=1)
    return np.asarray(speed <= SLIP_NOISE * run.pull * run.dt)


def _told(run: Run, i: int, contacts: Indices, way: float) -> str:
    a, b = run.pieces.body_a[contacts], run.pieces.body_b[contacts]
    others = [str(j) for j in np.unique([a, b]) if j != i]
    who = f"body {others[0]}" if len(others) == 1 else f"bodies {', '.join(others[:-1])} and {others[-1]}"
    return (
        f"the motion is not determined: how body {i} and {who} share their load among {len(contacts)} contacts with "
        f"friction is open, and moves body {i} by up to {way:.2g} m"
    )


def _contacts(run: Run) -> _Contacts:
    pieces, owner, n = run.pieces, run.contact_owner, run.pieces.normal
    sides = (pieces.body_a, pieces.body_b)
    mu = run.model.friction[sides]
    pressed = (pieces.impulse * n).sum(axis=1)
    before, after = (run.meeting_velocity(late) for late in (False, True))
    approach, leaves = ((u * n).sum(axis=1) for u in (before, after))
    speed, impact = speeds(run), run.is_impact[owner]
    rebound = np.where(impact, run.model.restitution[sides] * np.maximum(-approach, 0.0), 0.0)
    ends = np.where(run.is_frozen[owner], leaves, _next_approach(run, approach, leaves))
    closed = (impact | (np.abs(approach) <= HELD * speed)) & (np.abs(ends - rebound) <= HELD * speed)
    asked = impact | (run.is_forces & ~run.is_impulse_level & (pieces.length > 0.0))[owner]
    row = np.column_stack([np.where(run.free[i], side, -1) for i, side in zip(sides, run.side, strict=True)])
    held = asked & (closed | (pressed > 0.0)) & (row >= 0).any(axis=1)
    # Forces answer to the slip that there is, or that begins; impulses, and those of a fixed step, to that they leave.
    first, last = (u - (u * n).sum(axis=1)[:, None] * n for u in (before, after))
    begins = run.is_frozen[owner] & (np.linalg.norm(first, axis=1) <= SLIP_NOISE * speed)
    slip = np.where((impact | run.is_fixed[owner] | begins)[:, None], last, first)
    size = np.linalg.norm(slip, axis=1)
    still = size <= SLIP_NOISE * speed
    against = np.where(still, 0.0, mu / np.where(still, 1.0, size))
    tangents = _tangents(n)
    along = np.concatenate([n[:, None], (n - against[:, None] * slip)[:, None], tangents], axis=1)
    given = np.column_stack([pressed.clip(min=0.0), (pieces.impulse[:, None] * tangents).sum(axis=2)])
    push = np.zeros((*row.shape, along.shape[1], pieces.twist_before.shape[1]))
    for side, sign in ((0, -1.0), (1, 1.0)):
        for j in range(along.shape[1]):
            push[:, side, j] = _pushed(run, row[:, side], pieces.point, sign * along[:, j])
    return _Contacts(held, held & ~still & (mu > 0.0), held & still & (mu > 0.0), mu, given, row, push)


def _pushed(run: Run, row: Indices, point: Array, impulse: Array) -> Array:
    """What impulses (c, d) at points do to the bodies of rows, as changes of twists (c, 3 | 6) times the root of M."""
    body = run.pieces.body[row]
    moment = cross(point - run.pieces.pose_before[row, : run.d], impulse)
    found = np.column_stack([impulse / np.sqrt(run.mass[body])[:, None], _by_root_of_inertia(run, row, moment)])
    return np.where((row >= 0)[:, None], found, 0.0)


def _by_root_of_inertia(run: Run, row: Indices, moment: Array) -> Array:
    """Moments (s, 1 | 3) over the root of the inertia tensor of the bodies of rows (s,)."""
    factor = 1.0 / np.sqrt(run.moments[run.pieces.body[row]])
    return moment * factor if run.d == 2 else scaled_along(rotation(run.pieces.pose_before[row]), factor, moment)


def _next_approach(run: Run, approach: Array, leaves: Array) -> Array:
    """Normal velocity (c,) with which the next piece finds a contact, where it has it; else that which this one has."""
    pieces, owner, found = run.pieces, run.contact_owner, leaves.copy()
    order = np.lexsort((owner, pieces.feature, pieces.body_b, pieces.body_a))
    one, other = order[:-1], order[1:]
    same = np.all([x[one] == x[other] for x in (pieces.body_a, pieces.body_b, pieces.feature)], axis=0)
    end = (pieces.begin + pieces.length)[owner[one]]
    same &= np.abs(pieces.begin[owner[other]] - end) <= 1e-12 * run.dt + 4.0 * np.spacing(np.abs(end))
    found[one[same]] = approach[other[same]]
    return found


def _tangents(n: Array) -> Array:
    if n.shape[1] == 2:
        return np.stack([-n[:, 1], n[:, 0]], axis=1)[:, None]
    first = np.cross(n, np.eye(3)[np.abs(n).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(n, first)], axis=1)


def _clusters(own: Indices, row: Indices) -> list[Indices]:
    """Contacts of one piece, together those that share a free body."""
    groups: list[tuple[set[int], list[int]]] = []
    for c, rows in zip(own.tolist(), row[own].tolist(), strict=True):
        bodies, members = set(rows) - {-1}, [c]
        for group in [group for group in groups if group[0] & bodies]:
            groups.remove(group)
            bodies, members = bodies | group[0], group[1] + members
        groups.append((bodies, members))
    return [np.array(members) for _, members in groups]


def _share(run: Run, contacts: _Contacts, own: Indices, found: Shared) -> None:
    """Enter what a cluster of contacts leaves open."""
    d, many = run.d, len(own)
    rows = np.unique(contacts.row[own])
    rows = rows[rows >= 0]
    where = np.searchsorted(rows, contacts.row[own])
    # Unknown are the normal impulses, and both parts of friction where a contact sticks.
    stuck = np.flatnonzero(contacts.sticks[own])
    of = np.concatenate([np.arange(many), np.repeat(stuck, d - 1)])
    part = np.concatenate([np.ones(many, int), np.tile(np.arange(2, d + 1), len(stuck))])
    moves = np.zeros((len(of), len(rows), contacts.push.shape[3]))
    held = moves.copy()
    for side in range(2):
        known = contacts.row[own[of], side] >= 0
        at, body = np.flatnonzero(known), where[of[known], side]
        moves[at, body] += contacts.push[own[of[at]], side, part[at]]
        held[at, body] += contacts.push[own[of[at]], side, np.where(part[at] == 1, 0, part[at])]
    moves, held = moves.reshape(len(of), -1), held.reshape(len(of), -1)
    size = np.linalg.norm(moves, axis=1)
    held, moves = held / np.linalg.norm(held, axis=1)[:, None], moves / size[:, None]
    _, strength, ways = np.linalg.svd(held @ moves.T)
    ways = ways[strength <= REDUNDANT * strength[0]]
    directions, strength, turn = np.linalg.svd(moves.T @ ways.T, full_matrices=False)
    moving = np.flatnonzero(strength > ROUND_OFF)
    if not len(moving):
        return
    ways = ways / size
    given = contacts.given[own[of], np.where(part == 1, 0, part - 1)]
    limits = _limits(contacts.mu[own], stuck, d)
    room = np.maximum(limits @ given, 0.0)
    for k in moving:
        spread = strength[k] * sum(farthest(sign * turn[k], limits @ ways.T, room) for sign in (1.0, -1.0))
        motion = directions[:, k].reshape(len(rows), -1)
        reach = run.reach[run.pieces.body[rows]]
        gain = np.linalg.norm(motion[:, :d], axis=1) / np.sqrt(run.mass[run.pieces.body[rows]])
        gain += reach * np.linalg.norm(_by_root_of_inertia(run, rows, motion[:, d:]), axis=1)
        taking = own[np.unique(of[np.abs(turn[k] @ ways) * size > REDUNDANT])]
        for row in rows[spread * gain > 0.0].tolist():
            found.contacts[row] = np.union1d(found.contacts.get(row, taking), taking)
        found.gain[rows] += spread * gain


def _limits(mu: Array, stuck: Indices, d: int) -> Array:
    """Rows (k, ..) that must not fall below zero: normal impulses, and what is left of the cone where a contact sticks."""
    size = len(mu) + len(stuck) * (d - 1)
    angle = np.arange(SIDES) * 2.0 * np.pi / SIDES
    sides = np.array([[1.0], [-1.0]]) if d == 2 else np.column_stack([np.cos(angle), np.sin(angle)])
    cones = np.zeros((len(stuck), len(sides), size))
    for j, i in enumerate(stuck):
        cones[j, :, i] = mu[i]
        cones[j, :, len(mu) + j * (d - 1) : len(mu) + (j + 1) * (d - 1)] = sides
    return np.concatenate([np.eye(len(mu), size), cones.reshape(-1, size)])


def farthest(aim: Array, limits: Array, room: Array) -> float:
    """Return the largest ``aim @ y`` of all y with ``limits @ y >= -room``; infinite where there is none.

    From y = 0, which is one of them (room >= 0), along the edges of what is allowed: a linear program by active sets,
    the first of several that tie (R. G. Bland, Math. Oper. Res. 2, 1977).
    """
    y, active = np.zeros(len(aim)), []
    for _ in range(50 * len(limits)):
        rows = limits[active]
        weight = np.linalg.lstsq(rows.T, aim, rcond=None)[0] if active else np.zeros(0)
        along = aim - weight @ rows
        if np.linalg.norm(along) <= ROUND_OFF * np.linalg.norm(aim) or len(active) == len(aim):
            back = [i for i, share in zip(active, weight, strict=True) if share > ROUND_OFF]
            if not back:
                return float(aim @ y)
            active.remove(min(back))
            continue
        slope = limits @ along
        falls = slope < -ROUND_OFF * np.linalg.norm(limits, axis=1) * np.linalg.norm(along)
        falls[active] = False
        if not falls.any():
            return float("inf")
        way = np.full(len(limits), np.inf)
        way[falls] = np.maximum(limits[falls] @ y + room[falls], 0.0) / -slope[falls]
        y = y + way.min() * along
        active.append(int(way.argmin()))
    return float("inf")
