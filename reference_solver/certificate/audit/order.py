"""Impacts whose outcome hangs on gaps within round-off: whether bodies are struck together or one after the other.

Several pairs of bodies that meet at once would have met in turn, had one of them been nearer by a last place. Bodies
that lie side by side without a load may touch, or have a gap that counts as none. Where one after the other leaves
other velocities than all together, no run at this precision knows which.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reference_solver.certificate.audit.answers import Problem, all_answers, modes_of
from reference_solver.certificate.audit.contact import reduced_mass, speeds
from reference_solver.certificate.audit.run import Indices, Run
from reference_solver.certificate.audit.sharing import HELD, clusters, pushed, tangents_of
from reference_solver.certificate.audit.turning import pose_within
from reference_solver.geometry import distinct
from reference_solver.model import Array

#: Units in the last place of a coordinate up to which a gap is none: bodies are set down side by side with one or two.
GAP_UNITS = 4.0
#: Speed, as a share of the fastest, from which bodies approach, and difference that an order of impacts makes.
APPROACH, DIFFERS = 1e-9, 1e-6
#: Impacts of one instant that are followed: of bodies that fall into a wedge each is a share of the one before.
FOLLOWED = 60
#: Share of a step within which two times are the same.
SOON = 1e-9
#: Share of the smaller half width up to which a gap is none in some place: the event loop closes what lies so near, and
#: strikes what meets across it with what touches, 3000 half widths from the origin.
NO_GAP = 1e-11


def first_without_order(run: Run, known: Indices) -> int | None:
    """Return the first impact whose outcome hangs on an order within round-off, ``known`` (k,) ones among them.

    Pairs that meet in turn across gaps which are none in some place are asked as well.
    """
    pieces, owner = run.pieces, run.contact_owner
    if not len(owner):
        return None
    speed, velocity = speeds(run), run.meeting_velocity(after=False)
    u = (velocity * pieces.normal).sum(axis=1)
    meets = run.is_impact[owner] & ~run.is_chain[owner] & (u < -HELD * speed)
    lies = run.is_impact[owner] & ~run.is_chain[owner] & (np.abs(u) <= HELD * speed)
    pairs = pieces.body_a * len(run.free) + pieces.body_b
    struck = np.unique(owner[meets])
    of_pairs = np.unique(np.column_stack([owner, pairs])[meets], axis=0)[:, 0]
    several = struck[np.bincount(np.searchsorted(struck, of_pairs), minlength=len(struck)) > 1]
    apart = _apart(run, lies & np.isin(owner, struck), meets, pairs)
    asked = np.union1d(several, owner[apart])
    row = np.column_stack(
        [np.where(run.free[i], side, -1) for i, side in zip((pieces.body_a, pieces.body_b), run.side, strict=True)]
    )
    next_ones = _soon(run, meets, u, pairs)
    either = np.union1d(np.union1d(asked, known), np.array([*next_ones], np.int64))
    for k in either[np.argsort(pieces.begin[either], kind="stable")].tolist():
        own = np.arange(pieces.first_contact[k], pieces.first_contact[k + 1])
        if k in known or _hangs(run, own, velocity, row, pairs, apart):
            return int(k)
        if k in next_ones:
            added = np.array(next_ones[k])
            then = _as_it_came(run, k, added, velocity, row)
            gone = apart | np.isin(np.arange(len(owner)), added)
            if _hangs(run, np.concatenate([own, added]), *then, pairs, gone):
                return int(k)
    return None


def _as_it_came(run: Run, piece: int, added: Indices, velocity: Array, row: Indices) -> tuple[Array, Indices]:
    """Velocities (c, d) and rows (c, 2) of contacts, of ``added`` ones those that bodies had as a piece began."""
    bodies, rows = (run.pieces.body_a[added], run.pieces.body_b[added]), _rows(run, piece)
    own = dict(zip(run.pieces.body[rows].tolist(), rows.tolist(), strict=True))
    sides = [np.array([own.get(i, j) for i, j in zip(b.tolist(), r[added].tolist(), strict=True)])
             for b, r in zip(bodies, run.side, strict=True)]  # fmt: skip
    one, other = (run.velocity_at(r, b, run.pieces.point[added], False) for r, b in zip(sides, bodies, strict=True))
    velocity, row = velocity.copy(), row.copy()
    velocity[added], row[added] = other - one, np.where(run.free[np.stack(bodies)], sides, -1).T
    return velocity, row


def _rows(run: Run, piece: int) -> Indices:
    """Rows of the bodies of a piece."""
    return np.arange(run.pieces.first_body[piece], run.pieces.first_body[piece + 1])


def _soon(run: Run, meets: NDArray[np.bool_], u: Array, pairs: Indices) -> dict[int, list[int]]:
    """Contacts that bodies of an impact meet at next, across gaps that were none in some place as it came.

    Those of pairs that have pushed each other in the step before are rebounds, which become lower and lower.
    """
    pieces, owner = run.pieces, run.contact_owner
    rows = np.flatnonzero(meets)
    size = np.minimum(run.extent[pieces.body_a], run.extent[pieces.body_b])[rows]
    when, late = pieces.begin[owner[rows]], NO_GAP * size / -u[rows]
    impacts = np.flatnonzero(run.is_impact)
    impacts = impacts[np.argsort(pieces.begin[impacts], kind="stable")]
    first, last = (np.searchsorted(pieces.begin[impacts], t) for t in (when - np.minimum(late, run.dt), when))
    pressed = np.abs(pieces.impulse).max(axis=1) > 0.0
    found: dict[int, list[int]] = {}
    for j in np.flatnonzero(last > first).tolist():
        c = int(rows[j])
        before = pressed & (pairs == pairs[c]) & (pieces.begin[owner] < when[j])
        if ((pieces.begin + pieces.length)[owner[before]] >= when[j] - run.dt).any():
            continue
        both = [i for i in (int(pieces.body_a[c]), int(pieces.body_b[c])) if run.free[i]]
        for k in impacts[first[j] : last[j]].tolist():
            if np.isin(pieces.body[_rows(run, k)], both).any():
                found.setdefault(k, []).append(c)
    return found


def _apart(run: Run, lies: NDArray[np.bool_], meets: NDArray[np.bool_], pairs: Indices) -> NDArray[np.bool_]:
    """Whether (c,) bodies that lie side by side had a gap since they last pushed each other, or have rebounded.

    The event loop closes it as soon as it finds them; a load that presses them together until then does so, too.
    """
    pieces, owner, found = run.pieces, run.contact_owner, np.zeros(len(lies), bool)
    pressed = (pieces.impulse * pieces.normal).sum(axis=1) > HELD * reduced_mass(run) * speeds(run)
    carries = run.is_forces[owner] & pressed
    ends = (pieces.begin + pieces.length)[owner]
    for pair in np.unique(pairs[lies]):
        rows, loads = np.flatnonzero(lies & (pairs == pair)), np.flatnonzero(carries & (pairs == pair))
        when, whole = pieces.begin[owner[rows]], np.flatnonzero(pairs == pair)
        free = ~(np.abs(when[:, None] - ends[loads]) <= SOON * run.dt).any(axis=1)
        bodies = int(pieces.body_a[rows[0]]), int(pieces.body_b[rows[0]])
        poses = [pose_within(run, i, run.side[k][whole], 0.0) for k, i in enumerate(bodies)]
        gap = distinct(run.model.bodies[bodies[0]].shape, poses[0], run.model.bodies[bodies[1]].shape, poses[1]).gap
        place = max(float(np.abs(pose[:, : run.d]).max()) for pose in poses)
        begin = pieces.begin[owner[whole]]
        for j in np.flatnonzero(free).tolist():
            since = begin[pressed[whole] & (begin < when[j])].max(initial=-np.inf)
            found[rows[j]] = gap[(begin > since) & (begin <= when[j])].max() > GAP_UNITS * np.spacing(place)
            found[rows[j]] |= bool((begin[meets[whole]] < when[j]).any() and run.model.restitution[bodies] > 0.0)
    return found


def _hangs(run: Run, own: Indices, velocity: Array, row: Indices, pairs: Indices, apart: NDArray[np.bool_]) -> bool:
    return any(_differs(run, np.sort(each), velocity, row, pairs, apart) for each in clusters(own, row))


def _differs(run: Run, own: Indices, velocity: Array, row: Indices, pairs: Indices, apart: NDArray[np.bool_]) -> bool:
    """Whether a cluster of contacts comes out otherwise if its pairs are struck in turn."""
    impact = _Impact(run, own, velocity[own], row[own])
    pair, gone, u = pairs[own], apart[own], impact.free
    speed = np.abs(u).max()
    meets = np.unique(pair[u[:, 0] < -APPROACH * speed])
    lies = ~np.isin(pair, meets) & (np.abs(u[:, 0]) <= APPROACH * speed)
    if not len(meets) or (len(meets) == 1 and not gone.any()):
        return False
    together = impact.followed(u, np.isin(pair, meets) | lies, pair)
    for first in meets:
        in_turn = impact.followed(u, (pair == first) | (lies & ~gone), pair)
        if together is None or in_turn is None or np.abs(together - in_turn).max() > DIFFERS * speed:
            return True
    return False


class _Impact:
    """A cluster of contacts that are struck: velocities (c, d) along normals and tangents."""

    def __init__(self, run: Run, own: Indices, velocity: Array, row: Indices) -> None:
        pieces, d, c = run.pieces, run.d, len(own)
        a, b = pieces.body_a[own], pieces.body_b[own]
        self.mu, self.e = run.model.friction[a, b], run.model.restitution[a, b]
        axes = np.concatenate([pieces.normal[own][:, None], tangents_of(pieces.normal[own])], axis=1)
        self.free = np.einsum("cj,ckj->ck", velocity, axes)
        rows = np.unique(row[row >= 0])
        moves = np.zeros((c, d, len(rows), pieces.twist_before.shape[1]))
        for side, sign in ((0, -1.0), (1, 1.0)):
            known = np.flatnonzero(row[:, side] >= 0)
            at = np.searchsorted(rows, row[known, side])
            for j in range(d):
                moves[known, j, at] += pushed(run, row[known, side], pieces.point[own[known]], sign * axes[known, j])
        flat = moves.reshape(c * d, -1)
        self.matrix = (flat @ flat.T).reshape(c, d, c, d)

    def followed(self, u: Array, struck: NDArray[np.bool_], pair: Indices) -> Array | None:
        """Velocities after an impact of some contacts, and all impacts that follow; None if they have no end."""
        size = float(np.abs(u).max())
        for _ in range(FOLLOWED):
            after = self._struck(u, np.flatnonzero(struck))
            if after is None:
                return None
            u = after
            struck = np.isin(pair, pair[u[:, 0] < -APPROACH * size])
            if not struck.any():
                return u
        return u if u[:, 0].min() > -DIFFERS * size else None

    def _struck(self, u: Array, own: Indices) -> Array | None:
        """Velocities (c, d) after one impact of contacts ``own``; None where it has too many modes, or no answer."""
        wanted, matrix = self.e[own] * np.maximum(-u[own, 0], 0.0), self.matrix[own][:, :, own]
        scale = 1.0 / np.sqrt(np.diagonal(matrix[:, 0, :, 0]))
        free = u[own].copy()
        free[:, 0] -= wanted
        size = max(float(np.abs(scale[:, None] * free).max()), np.finfo(float).tiny)
        modes = modes_of(self.mu[own] > 0.0, np.arange(len(own)), u.shape[1])
        if not len(modes):
            return None
        matrix = scale[:, None, None, None] * matrix * scale[None, None, :, None]
        still = np.zeros((len(own), u.shape[1] - 1))
        found = all_answers(Problem(matrix, scale[:, None] * free / size, self.mu[own], still, 0.0 * free, modes))
        if not found:
            return None
        change = (size * found[0] - scale[:, None] * free).ravel()
        impulse = np.linalg.lstsq(matrix.reshape(len(change), -1), change, rcond=HELD)[0].reshape(free.shape)
        after = u + np.einsum("cidj,dj->ci", self.matrix[:, :, own], scale[:, None] * impulse)
        return np.asarray(after)
