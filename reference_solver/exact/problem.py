"""The contact problem, which impacts and forces share: u = W p + q, W = G M^-1 G'.

Of each contact, with the friction mu and the direction d of its slip,

    open     p = 0,            u_n >= 0
    sticks   u = 0,            p_n >= 0,  |p_t| <= mu p_n
    slips    u_n = 0, p_n >= 0,  p_t = -mu p_n d,  and d is the direction of u_t, or is given.

In an impact u and p are velocities and impulses, otherwise accelerations and forces, and contacts that slip already
have a given d. First everything that may is held; if that breaks a law, a method for cones finds which contacts hold,
stick and slip (`cones`), and the equations of these modes are solved once more, so that round-off is all that is left.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.exact.cones import add_friction, loads_with_friction, within_cones
from reference_solver.exact.kernels.forces import OPEN, SLIP, STICK, solve_near
from reference_solver.exact.refusals import NoSolution, Undecided, Unlawful
from reference_solver.exact.rows import Contacts
from reference_solver.model import Array
from reference_solver.pieces import Indices

#: Shares of the largest number of their kind below which forces, and velocities or accelerations, are none; what a
#: solution may break the laws by; singular values that are round-off; what equations may leave.
NONE, BROKEN, SINGULAR, ROUND_OFF = 1e-9, 1e-6, 1e-11, 1e-15


class Answer(NamedTuple):
    """Modes (m,), directions of slips (m, d - 1), forces or impulses (m, d) along the frames."""

    modes: Indices
    directions: Array
    forces: Array

    def chosen(self, which: NDArray[Any]) -> Answer:
        """Return the answer for some contacts, by numbers or by a mask."""
        return Answer(self.modes[which], self.directions[which], self.forces[which])


def directed(slips: Array, least: float, otherwise: Array | float = 0.0) -> Array:
    """Return the directions (m, k) of slips (m, k) that are larger than ``least``, and ``otherwise`` for the others."""
    size = np.sqrt((slips * slips).sum(axis=1, keepdims=True))
    moves = size > least
    return np.where(moves, slips / np.where(moves, size, 1.0), otherwise)


def all_open(count: int, d: int) -> Answer:
    """Return the answer of contacts without forces."""
    return Answer(np.zeros(count, np.int64), np.zeros((count, d - 1)), np.zeros((count, d)))


@dataclass
class Problem:
    """One contact problem.

    Parameters
    ----------
    contacts
        With their rows at the instant.
    free
        q (m d,): velocities [m/s] or accelerations [m/s^2] of contacts without impulses or forces.
    slips
        (m, d - 1) directions of contacts that slip already; zeros where friction may do anything within its cone.
    size
        What velocities or accelerations are measured by, in their unit; at least the largest of ``free``.
    """

    contacts: Contacts
    free: Array
    slips: Array
    size: float = 0.0

    def __post_init__(self) -> None:
        # G (m d, N) and M^-1 G' (N, m d).
        self.rows, self.yields = self.contacts.matrices
        self.size = max(self.size, float(np.abs(self.free).max(initial=0.0)), 1e-300)
        self.friction, self.dimension = self.contacts.friction, self.contacts.world.dimension

    @property
    def slipping(self) -> NDArray[np.bool_]:
        """(m,) whether the direction of a slip is given."""
        return np.asarray(np.abs(self.slips).max(axis=1) > 0.0)

    def solved(self, t: float) -> Answer:
        """Return modes and forces; refusals name the time ``t`` [s].

        Raises
        ------
        NoSolution, Unconverged
            If no forces exist, or none are found (`cones`): those of a method without an end grow until what they do
            together is round-off of what each does.
        Undecided, Unlawful
            If the modes that were found have no forces, or those break a law by more than `BROKEN`.
        """
        if self._parts:
            return self._joined([part.solved(t) for _, part in self._parts])
        guess = self.with_modes(np.where((self.friction > 0.0) & ~self.slipping, STICK, SLIP), self.slips)
        if guess is not None and self.broken(guess) < NONE:
            return _pressing(guess)
        found = within_cones(self.contacts, self.free, self.slips)
        answer = self._polished(found.reshape(-1, self.dimension), t)
        broken = self.broken(answer)
        if broken > BROKEN:
            if ROUND_OFF * self._alone(found) > BROKEN * self.size:
                raise NoSolution
            raise Unlawful(t=t, share=broken)
        return answer

    @cached_property
    def _parts(self) -> list[tuple[Indices, Problem]]:
        """Numbers and problem of each group of contacts that share no free body with others. Empty for one group."""
        groups, free = self.contacts.groups, self.free.reshape(len(self.contacts), -1)
        return [
            (each, Problem(self.contacts.chosen(each), free[each].ravel(), self.slips[each], self.size))
            for each in (groups if len(groups) > 1 else [])
        ]

    def _joined(self, answers: list[Answer]) -> Answer:
        """Return answers of all parts as one."""
        whole = all_open(len(self.contacts), self.dimension)
        for (group, _), answer in zip(self._parts, answers, strict=True):
            for each, own in zip(whole, answer, strict=True):
                each[group] = own
        return whole

    def _shown(self, forces: Array) -> tuple[Indices, Array]:
        """Modes and directions that forces (m, d) show."""
        u = (self.rows @ (self.yields @ forces.ravel()) + self.free).reshape(forces.shape)
        still = NONE * self.size
        directions, given = directed(u[:, 1:], still), self.slipping
        slides = np.asarray(directions.any(axis=1))
        # A slip leads against its friction, which is known to more digits than what it leaves of the slip; but for what
        # carries nothing, of all forces or of what would undo the free velocities.
        stiffest = float(np.einsum("ij,ji->i", self.rows, self.yields).max())
        least = NONE * max(float(np.abs(forces).max()), self.size / stiffest)
        directions = np.where(slides[:, None], directed(-forces[:, 1:], least, directions), 0.0)
        directions = np.where(given[:, None], self.slips, directions)
        modes = np.where(given | slides | (self.friction == 0.0), SLIP, STICK)
        return np.where(u[:, 0] > still, OPEN, modes), directions

    def equations(self, modes: Indices, directions: Array) -> tuple[Indices, Array]:
        """Numbers (r,) of the rows that modes keep at zero, and how forces on them move bodies (N, r)."""
        d = self.dimension
        held, sticks = np.flatnonzero(modes != OPEN), np.flatnonzero(modes == STICK)
        tangents = (sticks[:, None] * d + np.arange(1, d)).ravel()
        blocks = self.yields.reshape(len(self.yields), -1, d)
        normals = loads_with_friction(blocks, np.where(modes == SLIP, self.friction, 0.0), directions)
        return np.concatenate([held * d, tangents]), np.concatenate(
            [normals[:, held], self.yields[:, tangents]], axis=1
        )

    def spread(self, modes: Indices, directions: Array, rows: Indices, forces: Array) -> Array:
        """Return all forces (m, d) from those on the rows of `equations` (r,), with the friction of slips."""
        flat = np.zeros(len(modes) * self.dimension)
        flat[rows] = forces
        out = flat.reshape(len(modes), -1)
        add_friction(out, self.friction, directions, modes == SLIP)
        return out

    def with_modes(self, modes: Indices, directions: Array, near: Array | None = None) -> Answer | None:
        """Return the forces of given modes, None if there are none.

        Where loads are redundant: the forces nearest to ``near`` (m, d), each change weighed by what is carried there
        (E37); without, the least.
        """
        if not (modes != OPEN).any():
            return all_open(len(modes), self.dimension)
        if self._parts:
            answers = []
            for group, part in self._parts:
                answer = part.with_modes(modes[group], directions[group], None if near is None else near[group])
                if answer is None:
                    return None
                answers.append(answer)
            return self._joined(answers)
        rows, columns = self.equations(modes, directions)
        matrix, wanted = self.rows[rows] @ columns, -self.free[rows]
        scale, start = np.ones(len(rows)), np.zeros(len(rows))
        if near is not None:
            scale, start = loads_shared(self.contacts, near).ravel()[rows], near.ravel()[rows]
        found = solve_near(matrix, wanted, start, scale)
        forces = self.spread(modes, directions, rows, found)
        if np.abs(matrix @ found - wanted).max() > NONE * self._told_by(forces):
            return None
        return Answer(modes, directions, forces)

    def _told_by(self, forces: Array) -> float:
        """What velocities are measured by: of light bodies between heavy ones, by all that forces do one by one."""
        return max(self.size, 10.0 * ROUND_OFF / NONE * self._alone(forces))

    def _alone(self, forces: Array) -> float:
        """Return the largest of what forces (m, d) or (m d,) do to contacts, their sizes added up."""
        return float((np.abs(self.rows) @ (np.abs(self.yields) @ np.abs(forces.ravel()))).max())

    def broken(self, answer: Answer) -> float:
        """Return the largest share of their size by which velocities or forces of an answer break a law."""
        p = answer.forces
        u = (self.rows @ (self.yields @ p.ravel()) + self.free).reshape(p.shape)
        size_u, stiffest = self._told_by(p), float(np.einsum("ij,ji->i", self.rows, self.yields).max())
        size_p = max(np.abs(p).max(), size_u / stiffest)
        speed, friction = np.linalg.norm(u[:, 1:], axis=1), np.linalg.norm(p[:, 1:], axis=1)
        limit = self.friction * p[:, 0]
        loaded = p[:, 0] > NONE * size_p
        # Friction opposes the slip as much as it can: p_t |u_t| = -mu p_n u_t.
        off = np.linalg.norm(p[:, 1:] * speed[:, None] + limit[:, None] * u[:, 1:], axis=1)
        shares = (
            (-u[:, 0]).max() / size_u,
            (-p[:, 0]).max() / size_p,
            (friction - limit).max() / size_p,
            np.where(loaded, np.abs(u[:, 0]), 0.0).max() / size_u,
            np.where(self.slipping | ~loaded, 0.0, off).max() / size_u / size_p,
        )
        return float(max(shares))

    def _polished(self, start: Array, t: float) -> Answer:
        """Solve the equations of the modes that forces (m, d) show; what would pull is opened."""
        modes, directions = self._shown(start)
        for _ in range(len(modes) + 1):
            for near in (None, start):
                found = self.with_modes(modes, directions, near)
                if found is not None and self.broken(found) < NONE:
                    return _pressing(found)
            nearest = found
            if nearest is None:
                break
            least = nearest.forces[:, 0].argmin()
            if nearest.forces[least, 0] > -BROKEN * np.abs(nearest.forces).max():
                return _pressing(nearest)
            modes = modes.copy()
            modes[least] = OPEN
        raise Undecided(t=t)


def loads_shared(contacts: Contacts, near: Array) -> Array:
    """Return weights (m, d) of changes of redundant forces: the larger, the more a contact carries (E37).

    ``near``: (m, d) forces that the redundant ones are nearest to.
    """
    bears = np.maximum(near[:, :1] / max(1e-300, near[:, 0].max()), 1e-12)
    weight = np.repeat(bears, near.shape[1], axis=1)
    weight[:, 1:] *= contacts.friction[:, None]
    return np.sqrt(weight)


def _pressing(answer: Answer) -> Answer:
    """Return the answer without forces where loads are round-off, or negative by it."""
    loads = answer.forces[:, :1]
    return Answer(answer.modes, answer.directions, np.where(loads > ROUND_OFF * loads.max(), answer.forces, 0.0))
