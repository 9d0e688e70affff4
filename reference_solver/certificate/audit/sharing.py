"""Whether the motion depends on how contacts share a load where the laws do not tell how they share it.

The four corners of a box can carry its weight in more than one way. The motion is the same while all corners stick, or
while all slip in one direction with one mu; otherwise friction, and with it the motion, depends on the shares.

In one piece the modes of the contacts are those of the record: closed or open, sticking or slipping. The forces (in an
impact: impulses) that the laws admit then are a convex set. They keep closed contacts closed, loaded now or not, and
sticking contacts sticking; normal forces push; friction is ``mu p_n`` against a slip, and within its cone where a
contact sticks. The extremes of the velocities over that set tell by how much two motions can differ.

Other modes are for `answers`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.certificate.audit.contact import SLIP_NOISE, reduced_mass, speeds
from reference_solver.certificate.audit.run import Indices, Run, cross, scaled_along
from reference_solver.geometry import rotation
from reference_solver.model import Array

#: Share of the speeds at a contact up to which it stays closed, and of the momentum there up to which it carries
#: nothing: the limit of the check ``normal``.
HELD = 1e-9
#: Singular value, as a share of the largest, up to which contacts are redundant: points are known to that share of a
#: body (the check ``place``).
REDUNDANT = 1e-9
#: Share of unit forces up to which what is left of their sum is round-off: some thousand last places.
ROUND_OFF = 1e-12
#: Share of their size by which numbers may differ from those of the same contacts in an earlier piece, for an answer to
#: be that one: a hundredth of that to which `answers` tells problems apart.
UNCHANGED = 1e-10
#: Sides of the polygon that replaces the circle of sticking friction in space; at its corners friction exceeds mu p_n
#: by 2 %.
SIDES = 16
_ANGLE = np.arange(SIDES) * 2.0 * np.pi / SIDES
#: Directions of friction along the tangents, in the plane and in space.
SIDES_OF = {2: np.array([[1.0], [-1.0]]), 3: np.column_stack([np.cos(_ANGLE), np.sin(_ANGLE)])}


class Spread(NamedTuple):
    """By how much the change of velocity of a body in a piece can differ, for each row of the run."""

    gain: Array  # (m,) largest difference at any point of the body [m/s]
    contacts: dict[int, Indices]  # the contacts that share a load, for each row with a difference


class Known:
    """Answers of clusters of contacts: what rests, or slides straight, has one all along.

    Parameters
    ----------
    run
        Whose contacts are asked for.
    """

    def __init__(self, run: Run) -> None:
        pieces = run.pieces
        self._names = np.column_stack([pieces.body_a, pieces.body_b, pieces.feature])
        self._answers: dict[bytes, tuple[Indices, Any]] = {}

    def answer(self, own: Indices, contents: tuple[Array, Array], ask: Callable[[Indices], Any]) -> Any:
        """Return what ``ask`` says of contacts, or said of the same ones in an earlier piece with the same contents.

        ``contents`` (c, k) of all contacts, and sizes by which their changes are measured (c, k).
        """
        key, (told, size) = self._names[own].tobytes(), contents
        before = self._answers.get(key)
        if before is None or not (np.abs(told[own] - told[before[0]]) <= UNCHANGED * size[before[0]]).all():
            before = self._answers[key] = own, ask(own)
        return before[1]


class _Contacts(NamedTuple):
    """Modes of all contacts (c,), and what unit impulses at them do.

    ``push`` has changes of the twists of both bodies times the root of M: by a unit impulse along the normal, by the
    same with the friction that goes with it, and by unit impulses along the tangents.
    """

    held: NDArray[np.bool_]  # (c,) closed throughout its piece
    rubs: NDArray[np.bool_]  # (c,) held, slips, and has friction
    sticks: NDArray[np.bool_]  # (c,) held, does not slip, and has friction
    mu: Array  # (c,)
    given: Array  # (c, d) impulse: along the normal, along the tangents [N s]
    row: Indices  # (c, 2) rows of body A and body B; -1 where it is not free
    push: Array  # (c, 2, 1 + d, 3 | 6)


def shared_loads(run: Run) -> Spread:
    """Return the spread of every row; low rebounds that are summed up have none."""
    pieces, owner = run.pieces, run.contact_owner
    found = Spread(np.zeros(len(pieces.body)), {})
    if not len(owner):
        return found
    contacts = _contacts(run)
    contents, known = _contents(run, contacts), Known(run)
    for k in np.unique(owner[contacts.rubs]):
        own = np.arange(pieces.first_contact[k], pieces.first_contact[k + 1])
        for cluster in clusters(own[contacts.held[own]], contacts.row):
            if len(cluster) > 1 and contacts.rubs[cluster].any():
                gain, takes = known.answer(cluster, contents, lambda own: _share(run, contacts, own))
                rows = np.unique(contacts.row[cluster])
                rows = rows[rows >= 0]
                found.gain[rows] += gain
                for row, taking in zip(rows[gain > 0.0].tolist(), takes[gain > 0.0], strict=True):
                    found.contacts[row] = np.sort(cluster[taking])
    return found


def distances(run: Run, t: Array) -> tuple[Array, str]:
    """Return how far apart (s,) two motions that both obey the laws can be at times ``t`` (s,) [m], and why.

    A difference of velocities lasts until the body rests. The sentence names the body that moves farthest, and the
    contacts of its piece with the largest spread; it is empty where there is none.
    """
    spread, pieces = shared_loads(run), run.pieces
    found, told, still = np.zeros(len(t)), "", _at_rest(run, pieces.twist_after)
    for i in np.unique(pieces.body[list(spread.contacts)]):
        rows = np.flatnonzero(pieces.body == i)
        speed, way, ways = 0.0, 0.0, []
        for gain, length, rests in zip(spread.gain[rows], run.length[rows], still[rows], strict=True):
            speed = 0.0 if rests else speed + gain
            way += speed * length if length > 0.0 else 0.0
            ways.append(way)
        own = np.interp(t, (pieces.begin[run.owner] + run.length)[rows], ways, left=0.0)
        if own[-1] > found[-1]:
            contacts = spread.contacts[int(rows[spread.gain[rows].argmax()])]
            *others, last = np.unique([pieces.body_a[contacts], pieces.body_b[contacts]])
            far = f"by up to {own[-1]:.2g} m" if np.isfinite(own[-1]) else "by any distance"
            told = (
                f"the motion is not determined: bodies {', '.join(map(str, others))} and {last} can share their load "
                f"among {len(contacts)} contacts with friction in more than one way, which moves body {i} {far}"
            )
        found = np.maximum(found, own)
    return found, told


def _fastest(run: Run, twist: Array) -> Array:
    """Upper bound (m,) of the speed of any point of the body of each row [m/s]."""
    reach = np.where(run.free, run.reach, 0.0)[run.pieces.body]
    speed: Array = np.linalg.norm(twist[:, : run.d], axis=1) + reach * np.linalg.norm(twist[:, run.d :], axis=1)
    return speed


def _at_rest(run: Run, twist: Array) -> NDArray[np.bool_]:
    """Whether the body of each row is at rest (m,) if its velocity is ``twist`` (m, 3 | 6)."""
    return np.asarray(_fastest(run, twist) <= SLIP_NOISE * run.pull * run.dt)


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
    asked = impact | (run.is_forces & ~run.is_rocking & (pieces.length > 0.0))[owner]
    row = np.column_stack([np.where(run.free[i], side, -1) for i, side in zip(sides, run.side, strict=True)])
    carries = pressed > HELD * reduced_mass(run) * speed
    held = asked & (closed | carries) & (row >= 0).any(axis=1)
    # Friction of a force is against the slip at its start, or against the slip that begins; friction of an impact, and
    # of a fixed step, against the slip that is left.
    first, last = (u - (u * n).sum(axis=1)[:, None] * n for u in (before, after))
    begins = run.is_frozen[owner] & (np.linalg.norm(first, axis=1) <= SLIP_NOISE * speed)
    slip = np.where((impact | begins)[:, None], last, first)
    size = np.linalg.norm(slip, axis=1)
    still = size <= SLIP_NOISE * speed
    against = np.where(still, 0.0, mu / np.where(still, 1.0, size))
    tangents = tangents_of(n)
    along = np.concatenate([n[:, None], (n - against[:, None] * slip)[:, None], tangents], axis=1)
    given = np.column_stack([pressed.clip(min=0.0), (pieces.impulse[:, None] * tangents).sum(axis=2)])
    push = np.zeros((*row.shape, along.shape[1], pieces.twist_before.shape[1]))
    for side, sign in ((0, -1.0), (1, 1.0)):
        for j in range(along.shape[1]):
            push[:, side, j] = pushed(run, row[:, side], pieces.point, sign * along[:, j])
    held &= np.isfinite(push).all(axis=(1, 2, 3))
    slips = held & ~still & (mu > 0.0)
    return _Contacts(held, slips, held & still & (mu > 0.0), mu, given, row, push)


def pushed(run: Run, row: Indices, point: Array, impulse: Array) -> Array:
    """Changes of the twists (c, 3 | 6) of the bodies of rows by impulses (c, d) at points, times the root of M."""
    body = run.pieces.body[row]
    moment = cross(point - run.pieces.pose_before[row, : run.d], impulse)
    found = np.column_stack([impulse / np.sqrt(run.mass[body])[:, None], by_root_of_inertia(run, row, moment)])
    return np.where((row >= 0)[:, None], found, 0.0)


def by_root_of_inertia(run: Run, row: Indices, moment: Array) -> Array:
    """Moments (s, 1 | 3) over the root of the inertia tensor of the bodies of rows (s,)."""
    factor = 1.0 / np.sqrt(run.moments[run.pieces.body[row]])
    return moment * factor if run.d == 2 else scaled_along(rotation(run.pieces.pose_before[row]), factor, moment)


def _next_approach(run: Run, approach: Array, leaves: Array) -> Array:
    """Return the normal velocity (c,) of each contact as its next piece starts, else ``leaves`` [m/s]."""
    pieces, owner, found = run.pieces, run.contact_owner, leaves.copy()
    order = np.lexsort((owner, pieces.feature, pieces.body_b, pieces.body_a))
    one, other = order[:-1], order[1:]
    same = np.all([x[one] == x[other] for x in (pieces.body_a, pieces.body_b, pieces.feature)], axis=0)
    end = (pieces.begin + pieces.length)[owner[one]]
    same &= np.abs(pieces.begin[owner[other]] - end) <= 1e-12 * run.dt + 4.0 * np.spacing(np.abs(end))
    found[one[same]] = approach[other[same]]
    return found


def tangents_of(n: Array) -> Array:
    """Unit vectors (c, d - 1, d) that are square to normals (c, d) and to each other."""
    if n.shape[1] == 2:
        return np.stack([-n[:, 1], n[:, 0]], axis=1)[:, None]
    first = np.cross(n, np.eye(3)[np.abs(n).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(n, first)], axis=1)


def clusters(own: Indices, row: Indices) -> list[Indices]:
    """Contacts of one piece in groups that share no free body."""
    groups: list[tuple[set[int], list[int]]] = []
    for c, rows in zip(own.tolist(), row[own].tolist(), strict=True):
        bodies, members = set(rows) - {-1}, [c]
        for group in [group for group in groups if group[0] & bodies]:
            groups.remove(group)
            bodies, members = bodies | group[0], group[1] + members
        groups.append((bodies, members))
    return [np.array(members) for _, members in groups]


def _contents(run: Run, contacts: _Contacts) -> tuple[Array, Array]:
    """What spreads of contacts (c,) are made of, see `Known.answer`."""
    c, owner = len(contacts.mu), run.contact_owner
    modes = np.column_stack([contacts.held, contacts.rubs, contacts.sticks]).astype(float)
    push, largest = contacts.push.reshape(c, -1), np.zeros(len(run.pieces))
    np.maximum.at(largest, owner, np.abs(contacts.given).max(axis=1))
    return joined_contents((modes, np.ones(c)), (contacts.given, largest[owner]), (push, np.abs(push).max(axis=1)))


def joined_contents(*parts: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return parts (c, k) as one table, and their sizes (c,) as another."""
    tables = [part for part, _ in parts], [np.broadcast_to(size[:, None], part.shape) for part, size in parts]
    return np.concatenate(tables[0], axis=1), np.concatenate(tables[1], axis=1)


def _share(run: Run, contacts: _Contacts, own: Indices) -> tuple[Array, NDArray[np.bool_]]:
    """Return the spread of each free body (r,) of a cluster of contacts (c,), and which contacts make it (r, c)."""
    d, many = run.d, len(own)
    rows = np.unique(contacts.row[own])
    rows = rows[rows >= 0]
    where = np.searchsorted(rows, contacts.row[own])
    # Unknown are the normal impulses, and both parts of friction where a contact sticks.
    stuck = np.flatnonzero(contacts.sticks[own])
    of = np.concatenate([np.arange(many), np.repeat(stuck, d - 1)])
    part = np.concatenate([np.ones(many, int), np.tile(np.arange(2, d + 1), len(stuck))])
    pushed = np.zeros((2, len(of), len(rows), contacts.push.shape[3]))
    for side in range(2):
        known = contacts.row[own[of], side] >= 0
        at, body = np.flatnonzero(known), where[of[known], side]
        for which, column in enumerate((np.where(part == 1, 0, part), part)):
            pushed[which, at, body] += contacts.push[own[of[at]], side, column[at]]
    held, moves = pushed.reshape(2, len(of), -1)
    size = np.linalg.norm(moves, axis=1)
    held, moves = held / np.linalg.norm(held, axis=1)[:, None], moves / size[:, None]
    _, strength, ways = np.linalg.svd(held @ moves.T)
    ways = ways[strength <= REDUNDANT * strength[0]]
    directions, strength, turn = np.linalg.svd(moves.T @ ways.T, full_matrices=False)
    moving = np.flatnonzero(strength > ROUND_OFF)
    gained, takes = np.zeros(len(rows)), np.zeros((len(rows), many), bool)
    if not len(moving):
        return gained, takes
    ways = ways / size
    given = contacts.given[own[of], np.where(part == 1, 0, part - 1)]
    limits = _limits(contacts.mu[own], stuck, d)
    room = np.maximum(limits @ given, 0.0)
    for k in moving:
        spread = strength[k] * sum(farthest(sign * turn[k], limits @ ways.T, room) for sign in (1.0, -1.0))
        motion = directions[:, k].reshape(len(rows), -1)
        reach = run.reach[run.pieces.body[rows]]
        gain = np.linalg.norm(motion[:, :d], axis=1) / np.sqrt(run.mass[run.pieces.body[rows]])
        gain += reach * np.linalg.norm(by_root_of_inertia(run, rows, motion[:, d:]), axis=1)
        if spread > 0.0:
            gained += np.where(gain > 0.0, spread * gain, 0.0)
            takes[np.ix_(gain > 0.0, of[np.abs(turn[k] @ ways) * size > REDUNDANT])] = True
    return gained, takes


def _limits(mu: Array, stuck: Indices, d: int) -> Array:
    """Rows (k, ..) whose products with admissible impulses are not negative: contacts push, friction is in its cone."""
    size = len(mu) + len(stuck) * (d - 1)
    sides = SIDES_OF[d]
    cones = np.zeros((len(stuck), len(sides), size))
    for j, i in enumerate(stuck):
        cones[j, :, i] = mu[i]
        cones[j, :, len(mu) + j * (d - 1) : len(mu) + (j + 1) * (d - 1)] = sides
    return np.concatenate([np.eye(len(mu), size), cones.reshape(-1, size)])


def farthest(aim: Array, limits: Array, room: Array) -> float:
    """Return the largest ``aim @ y`` of all y (k,) with ``limits @ y >= -room``, infinite if it is not bounded.

    A linear program, solved by active sets from y = 0, which is admissible as ``room`` (r,) is not negative. Of several
    limits (r, k) to let go of, or to meet, it takes the first, so that it does not go in circles (R. G. Bland, *Math.
    Oper. Res.* 2, 1977).
    """
    y, size = np.zeros(len(aim)), float(np.linalg.norm(aim))
    active: list[int] = []
    for _ in range(50 * len(limits)):
        rows = limits[active]
        weight = np.linalg.lstsq(rows.T, aim, rcond=None)[0] if active else np.zeros(0)
        along = aim - weight @ rows
        if np.linalg.norm(along) <= REDUNDANT * size or len(active) == len(aim):
            back = [i for i, share in zip(active, weight, strict=True) if share > ROUND_OFF]
            if not back:
                return float(aim @ y)
            active.remove(min(back))
            continue
        slope = limits @ along
        falls = slope < -ROUND_OFF * np.linalg.norm(limits, axis=1) * size
        falls[active] = False
        if not falls.any():
            return float("inf")
        way = np.full(len(limits), np.inf)
        way[falls] = np.maximum(limits[falls] @ y + room[falls], 0.0) / -slope[falls]
        y = y + way.min() * along
        active.append(int(way.argmin()))
    return float("inf")
