"""What a run did, step by step, in the form that the audit reads (`reference_solver.pieces`).

A piece of the loop may last longer than a step. It is recorded in parts that end where the world is looked at, so that
the audit's bounds, which grow with the length of a part, stay those of ``dt``. Impulses of a part are integrals of the
forces that contacts have along the piece, which is integrated with them. Bodies that share no contact have records of
their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import roots_legendre

from reference_solver.exact.bodies import State, World
from reference_solver.exact.forces import Held
from reference_solver.exact.motion import Piece, free_acceleration
from reference_solver.exact.rows import Contacts, labels, moments
from reference_solver.model import Array
from reference_solver.pieces import FIFTH_ORDER, FORCES, FROZEN, IMPACT, ROCKING, Indices, Journal
from reference_solver.records import Contacts as Handed

#: Share of the smallest half width by which ways of a part may differ from cubic polynomials: the audit's limit.
CLOSE = 1e-9
#: Share of the world's speed, some hundred last places, below which changes of velocity are round-off and no blow.
NO_BLOW = 1e-13
#: Shares of a part, and their weights, at which moments of its impulses are taken: enough for polynomials of degree 7.
GAUSS = [0.5 + 0.5 * roots_legendre(4)[0], 0.5 * roots_legendre(4)[1]]


class Acting(NamedTuple):
    """What contacts did: features (m, 6), gaps (m,), points, normals and impulses on B (m, d), moments (m, s)."""

    features: Indices
    gap: Array
    point: Array
    normal: Array
    impulse: Array
    moment: Array

    def chosen(self, which: NDArray[np.bool_]) -> Acting:
        """Return some of them."""
        return self._replace(**{name: each[which] for name, each in self._asdict().items()})

    @classmethod
    def of(cls, contacts: Contacts, impulse: Array, moment: Array | None = None) -> Acting:
        """Return what contacts did with impulses in world axes, which act where they are unless moments are told."""
        rows = contacts.rows
        own = moments(rows.place, impulse) if moment is None else moment
        return cls(contacts.features, rows.gap.copy(), rows.place.copy(), rows.frame[:, 0].copy(), impulse, own)

    @classmethod
    def between(cls, part: Part) -> Acting:
        """Return what contacts did in a part of a piece, without moving those that the loop goes on with."""
        piece = part.piece
        contacts = piece.own_contacts.at(*piece.at(part.first))
        if not piece.turns:
            force = contacts.along_axes(piece.held.answer.forces)
            return cls.of(contacts, (part.last - part.first) * piece.length * force)
        whole, own = part.first == 0.0 and part.last == 1.0, Held(contacts, piece.held.answer, piece.held.acceleration)
        first, length = contacts.rows.place.copy(), part.last - part.first
        impulse, moment = np.zeros(first.shape), np.zeros(())
        for node, weight in zip(*GAUSS, strict=True):
            share = part.first + length * node
            place, axes, velocity = piece.at(share)
            if whole:  # what moved the bodies, to the last place
                contacts.at(place, axes, velocity)
                rate = piece.impulse(share, rate=True)
            else:  # between its ends a piece is known less well than its forces
                own.follow(place, axes, velocity, free_acceleration(contacts.world, axes, velocity))
                rate = piece.length * own.pushes
            impulse = impulse + length * weight * rate
            # Far from the origin the way of a place is known to more digits than the place.
            moment = moment + length * weight * moments(contacts.rows.place - first, rate)
        return cls.of(contacts.at(*piece.at(part.first)), impulse, moment + moments(first, impulse))


@dataclass(frozen=True)
class Blow:
    """Impulses at an instant.

    Parameters
    ----------
    after
        State after them.
    acting
        Contacts that took part, those without an impulse too.
    scheme
        See `reference_solver.pieces`.
    """

    after: State
    acting: Acting
    scheme: int = FROZEN

    @classmethod
    def of(cls, after: State, contacts: Contacts, impulses: Array, scheme: int = FROZEN) -> Blow:
        """Return a blow of impulses (m, d) along the frames."""
        return cls(after, Acting.of(contacts, contacts.along_axes(impulses)), scheme)


class Part(NamedTuple):
    """A piece between two shares."""

    piece: Piece
    first: float
    last: float


class Row(NamedTuple):
    """A piece of the record: begin in its step and length [s], labels, bodies, states before and after, contacts."""

    time: tuple[float, float]
    label: tuple[int, ...]
    bodies: Indices
    before: Array
    after: Array
    acting: Acting


class Recorder:
    """Writes what a world does."""

    def __init__(self, world: World) -> None:
        self._world = world

    def begin(self, pose: Array, twist: Array) -> None:
        """Begin a record where bodies are."""
        self._state = np.concatenate([pose, twist], axis=1)
        self._rows: list[Row] = []
        self._bodies = self._contacts = 0

    def contacts(self, parts: Sequence[Part | Blow]) -> Handed:
        """Return contacts as a simulation hands them out: each once, as it was first, with the sum of its impulses."""
        found = [part.acting if isinstance(part, Blow) else Acting.between(part) for part in parts]
        if not any(len(each.gap) for each in found):
            return Handed.empty(0, self._world.dimension)
        every = Acting(*(np.concatenate(each) for each in zip(*found, strict=True)))
        key = np.column_stack([every.features[:, :2], self._numbered(every.features)])
        order = np.lexsort(key.T[::-1])
        begins = np.append(True, (np.diff(key[order], axis=0) != 0).any(axis=1))
        first = order[begins]
        impulse = np.add.reduceat(every.impulse[order], np.flatnonzero(begins))
        a, b, feature = key[first].T
        return Handed(a, b, feature, every.point[first], every.normal[first], impulse, every.gap[first])

    def _numbered(self, features: Indices) -> Indices:
        """Return one number (m,) for the features of each contact (m, 6)."""
        bodies = self._world.bodies
        most = max(bodies.point.shape[1], bodies.normal.shape[1], bodies.line.shape[1])
        return np.asarray(((features[:, 2] * most + features[:, 3]) * 3 + features[:, 4]) * most + features[:, 5])

    def write(self, step: int, dt: float, parts: Sequence[Part | Blow]) -> None:
        """Write what happened in a step."""
        for is_blow, group in groupby(parts, lambda part: isinstance(part, Blow)):
            if is_blow:
                self._write_blows(step, dt, [part for part in group if isinstance(part, Blow)])
                continue
            for part in group:
                if isinstance(part, Part):
                    for share in self._shares(part):
                        self._write_part(step, dt, share)

    def _write_blows(self, step: int, dt: float, blows: list[Blow]) -> None:
        """Write blows of one instant: those of bodies that share contacts follow each other."""
        begin = blows[0].after.t - step * dt
        self._bring(blows[0].after)
        features = np.concatenate([blow.acting.features for blow in blows])
        for bodies, _ in self._groups(features):
            for blow in blows:
                free = bodies[self._world.bodies.free[bodies] == 1]
                own = np.asarray(np.isin(blow.acting.features[:, :2], free).any(axis=1))
                gained = blow.after.velocity[bodies] - self._state[bodies, -self._world.shape[1] :]
                if np.abs(gained / self._world.per_length).max() > NO_BLOW * self._world.speed:
                    rocks = blow.scheme == ROCKING
                    label = (step, FORCES if rocks else IMPACT, blow.scheme)
                    self._enter((begin, 0.0), label, bodies, blow.after, blow.acting.chosen(own))

    def _shares(self, part: Part) -> list[Part]:
        """Return a part in so many that cubic polynomials through their ends, which the audit follows, are close."""
        piece, first, last = part
        if not piece.turns:
            return [part]
        s = np.array([first, 0.5 * (first + last), last])[:, None]
        way, rate = (each @ (s ** np.arange(each.shape[2])).T for each in (piece.way, piece.velocity))
        bend = 0.125 * (last - first) * piece.length * (rate[..., 0] - rate[..., 2])
        off = np.abs(way[..., 1] - 0.5 * (way[..., 0] + way[..., 2]) - bend).max() / (CLOSE * self._world.size)
        ends = np.linspace(first, last, 1 + max(1, int(np.ceil(off**0.25))))  # errors fall with the fourth power
        return [Part(piece, *both) for both in pairwise(ends.tolist())]

    def _write_part(self, step: int, dt: float, part: Part) -> None:
        piece, start, end = part.piece, part.piece.state(part.first), part.piece.state(part.last)
        self._bring(start)
        length = (part.last - part.first) * piece.length  # to more digits than times have
        acting = Acting.between(part)
        for bodies, own in self._groups(acting.features):
            scheme = FIFTH_ORDER if piece.turns and own.any() else FROZEN
            if piece.held.lasts > 0.0 and own.any():
                scheme = ROCKING
            label = (step, FORCES, scheme)
            self._enter((start.t - step * dt, length), label, bodies, end, acting.chosen(own))

    def _bring(self, state: State) -> None:
        """Bring bodies that are not free to a state: they are where they are, whether anything touches them or not."""
        moved = self._world.bodies.free == 0
        self._state[moved] = np.concatenate([state.pose, state.velocity], axis=1)[moved]

    def _groups(self, features: Indices) -> Iterator[tuple[Indices, NDArray[np.bool_]]]:
        """Yield bodies that share contacts, with what is moved and touches them, and which contacts (m,) are theirs."""
        bodies, pairs = self._world.bodies, features[:, :2]
        free = bodies.free == 1
        label = np.array(labels(free.tolist(), pairs.tolist()))
        of = np.where(free[pairs[:, 0]], label[pairs[:, 0]], label[pairs[:, 1]])
        moved = ~free & (self._state[:, -self._world.shape[1] :] != 0.0).any(axis=1)
        for group in dict.fromkeys(label[free].tolist()):
            own = of == group
            touched = np.zeros(len(free), bool)
            touched[features[own, :2].ravel()] = True
            yield np.flatnonzero(free & (label == group) | touched & moved), own

    def _enter(
        self, time: tuple[float, float], label: tuple[int, ...], bodies: Indices, after: State, acting: Acting
    ) -> None:
        state = np.concatenate([after.pose[bodies], after.velocity[bodies]], axis=1)
        numbers = (*label, self._bodies, self._contacts)
        self._rows.append(Row(time, numbers, bodies, self._state[bodies], state, acting))
        self._bodies += len(bodies)
        self._contacts += len(acting.gap)
        free = self._world.bodies.free[bodies] == 1  # several groups may touch what is moved
        self._state[bodies[free]] = state[free]

    def journal(self, first: int, steps: int) -> Journal:
        """Return what was written of ``steps`` steps from the step ``first`` on, as a journal without room for more."""
        d = self._world.dimension
        rows, number = self._rows, self._state.shape[1]
        acting = [row.acting for row in rows]
        feature = np.concatenate([np.zeros((0, 6), np.int64), *(each.features for each in acting)])
        wrench = [np.concatenate([a.point, a.normal, a.impulse, a.moment], axis=1) for a in acting]
        width = 3 * d + (1 if d == 2 else 3)
        return Journal(
            used=np.array([len(rows), self._bodies, self._contacts, steps]),
            time=np.array([row.time for row in rows]).reshape(-1, 2),
            label=np.array([row.label for row in rows], np.int64).reshape(-1, 5) - np.array([first, 0, 0, 0, 0]),
            body=np.concatenate([np.zeros(0, np.int64), *(row.bodies for row in rows)]),
            before=np.concatenate([np.zeros((0, number)), *(row.before for row in rows)]),
            after=np.concatenate([np.zeros((0, number)), *(row.after for row in rows)]),
            name=np.column_stack([feature[:, :2], self._numbered(feature)]),
            wrench=np.concatenate([np.zeros((0, width)), *wrench]),
            pose=np.zeros((0, 0)),
            twist=np.zeros((0, 0)),
        )
