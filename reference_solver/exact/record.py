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
from reference_solver.pieces import FORCES, FROZEN, IMPACT, ROCKING, TURNING, Indices, Journal, empty_journal
from reference_solver.records import Contacts as Handed

#: Share of the smallest half width by which ways of a part may differ from cubic polynomials: the audit's limit.
CLOSE = 1e-9
#: Share of the world's speed, some hundred last places, below which changes of velocity are round-off and no blow.
NO_BLOW = 1e-13
#: Shares of a part, and their weights, at which moments of its impulses are taken: enough for polynomials of degree 7.
GAUSS = [0.5 + 0.5 * roots_legendre(4)[0], 0.5 * roots_legendre(4)[1]]


class Acting(NamedTuple):
    """What contacts did: features (m, 6), gaps (m,) and points (m, d) [m], normals (m, d), impulses on B (m, d) [N s].

    Moments (m, s) [N m s] are those of the impulses about the world's origin.
    """

    features: Indices
    gap: Array
    point: Array
    normal: Array
    impulse: Array
    moment: Array

    def chosen(self, which: NDArray[np.bool_]) -> Acting:
        """Return those that a mask (m,) tells."""
        features, *numbers = self
        return Acting(features[which], *(each[which] for each in numbers))

    @property
    def wrench(self) -> Array:
        """(m, 3 d + s): points, normals, impulses, moments."""
        return np.concatenate(self[2:], axis=-1)

    @classmethod
    def of(cls, contacts: Contacts, impulse: Array) -> Acting:
        """Return what contacts did by impulses (m, d) in world axes, at the places where the contacts are now."""
        gap, place, normal = (
            each.copy() for each in (contacts.rows.gap, contacts.rows.place, contacts.rows.frame[:, 0])
        )
        return cls(contacts.features, gap, place, normal, impulse, moments(place, impulse))

    @classmethod
    def between(cls, piece: Piece, begin: Array, end: Array) -> list[Acting]:
        """Return what contacts did in each of k parts of a piece, between shares (k,)."""
        if not len(piece.held.contacts):
            return [cls.of(piece.held.contacts, np.zeros((0, piece.start.place.shape[1])))] * len(begin)
        if piece.turns:
            return [cls._turning(piece, *both) for both in zip(begin.tolist(), end.tolist(), strict=True)]
        contacts = piece.own_contacts
        gap, place, frame = contacts.along_way(*piece.way_at(begin), piece.start)
        impulse = np.einsum("mk,smkp->smp", piece.held.answer.forces, frame)
        impulse *= ((end - begin) * piece.length)[:, None, None]
        features = np.broadcast_to(contacts.features, (len(gap), *contacts.features.shape))
        return [
            cls(*each)
            for each in zip(features, gap, place, frame[:, :, 0], impulse, moments(place, impulse), strict=True)
        ]

    @classmethod
    def _turning(cls, piece: Piece, begin: float, end: float) -> Acting:
        """Return what contacts did between shares of a piece in which they turn."""
        contacts = piece.own_contacts.at(*piece.at(begin))
        own = Held(contacts, piece.held.answer, piece.held.acceleration)
        exact = (begin == 0.0 and end == 1.0) or not own.shares_loads
        length, nothing = end - begin, np.zeros(contacts.rows.place.shape)
        acting = cls.of(contacts, nothing)
        first, impulse, moment = acting.point, nothing, np.zeros(())
        for node, weight in zip(*GAUSS, strict=True):
            share = begin + length * node
            place, axes, velocity = piece.at(share)
            if exact:  # what moved the bodies, to the last place
                contacts.at(place, axes, velocity)
                rate = piece.impulse(share, rate=True)
            else:  # how loads are shared is known less well between the ends of a piece than forces are
                forces, _ = own.follow(place, axes, velocity, free_acceleration(contacts.world, axes, velocity))
                rate = piece.length * contacts.along_axes(forces)
            impulse = impulse + length * weight * rate
            # Far from the origin the way of a place is known to more digits than the place.
            moment = moment + length * weight * moments(contacts.rows.place - first, rate)
        return acting._replace(impulse=impulse, moment=moment + moments(first, impulse))


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
    """A piece between two shares of it, 0 <= first < last <= 1."""

    piece: Piece
    first: float
    last: float


class Recorder:
    """Writes what a world does."""

    def __init__(self, world: World) -> None:
        self._world = world

    def begin(self, pose: Array, twist: Array) -> None:
        """Begin a record where bodies have poses (n, 3 | 7) and twists (n, q)."""
        self._state = np.concatenate([pose, twist], axis=1)
        self._rows: list[tuple[Array | Indices, ...]] = [empty_journal(self._world.dimension)[1:]]
        self._bodies = self._contacts = 0

    def contacts(self, parts: Sequence[Part | Blow]) -> Handed:
        """Return the contacts of a step as a simulation hands them out.

        Each is listed once, with the sum of its impulses of all parts, and gap, point and normal of its first part.
        """
        found = [
            part.acting if isinstance(part, Blow) else Acting.between(part.piece, *np.array(part[1:])[:, None])[0]
            for part in parts
        ]
        every = Acting(*(np.concatenate(each) for each in zip(*found, strict=True)))
        if not len(every.gap):
            return Handed.empty(0, self._world.dimension)
        key = self._keys(every.features)
        order = np.lexsort(key.T[::-1])
        begins = np.append(True, (np.diff(key[order], axis=0) != 0).any(axis=1))
        first = order[begins]
        impulse = np.add.reduceat(every.impulse[order], np.flatnonzero(begins))
        a, b, feature = key[first].T
        return Handed(a, b, feature, every.point[first], every.normal[first], impulse, every.gap[first])

    def contacts_between(self, piece: Piece, begin: Array, end: Array) -> Handed:
        """Return the contacts of k steps, which one piece makes between shares (k,), step by step."""
        key = self._keys(piece.held.contacts.features)
        order = np.lexsort(key.T[::-1])
        _, *fields = zip(*Acting.between(piece, begin, end), strict=True)
        gap, point, normal, impulse, _ = (np.concatenate(np.array(each)[:, order]) for each in fields)
        a, b, feature = np.tile(key[order].T, len(begin))
        return Handed(a, b, feature, point, normal, impulse, gap)

    def _keys(self, features: Indices) -> Indices:
        """Return bodies A and B and one number for the features of each contact (m, 6)."""
        bodies = self._world.bodies
        most = max(bodies.point.shape[1], bodies.normal.shape[1], bodies.line.shape[1])
        number = ((features[:, 2] * most + features[:, 3]) * 3 + features[:, 4]) * most + features[:, 5]
        return np.column_stack([features[:, :2], number])

    def write(self, step: int, dt: float, before: Sequence[Part | Blow], piece: Piece, shares: Array) -> None:
        """Write what came in a step before a piece, and the piece in k parts between shares (k + 1,), one in each step.

        ``step``: number of the first; ``dt``: length of all [s].
        """
        for is_blow, group in groupby(before, lambda part: isinstance(part, Blow)):
            if is_blow:
                self._write_blows(step, dt, [part for part in group if isinstance(part, Blow)])
                continue
            for part in group:
                if isinstance(part, Part):
                    self._write_parts(np.array([step]), dt, part.piece, np.array(part[1:]))
        self._write_parts(step + np.arange(len(shares) - 1), dt, piece, shares)

    def _write_blows(self, step: int, dt: float, blows: list[Blow]) -> None:
        """Write blows of one instant: those of bodies that share contacts follow each other."""
        time = np.array([[blows[0].after.t - step * dt, 0.0]])
        self._bring(blows[0].after.numbers)
        features = np.concatenate([blow.acting.features for blow in blows])
        for bodies, _ in self._groups(features):
            free = bodies[self._world.bodies.free[bodies] == 1]
            for blow in blows:
                acting = blow.acting.chosen(np.asarray(np.isin(blow.acting.features[:, :2], free).any(axis=1)))
                before, after = self._state[bodies], blow.after.numbers[bodies]
                gained = (after - before)[:, -self._world.shape[1] :]
                if np.abs(gained / self._world.per_length).max() > NO_BLOW * self._world.speed:
                    label = np.array([[step, FORCES if blow.scheme == ROCKING else IMPACT, blow.scheme, 0, 0]])
                    self._enter(time, label, bodies, before, after, acting.features, acting.wrench)
                    self._state[free] = blow.after.numbers[free]

    def _write_parts(self, steps: Indices, dt: float, piece: Piece, shares: Array) -> None:
        """Write a piece between shares (k + 1,), a part in each of the steps (k,)."""
        if piece.turns:
            ends = [self._shares(piece, *both) for both in pairwise(shares.tolist())]
            steps = np.repeat(steps, list(map(len, ends)))
            shares = np.array([shares[0], *(end for each in ends for end in each)])
        opened = piece.held.opened if shares[0] == 0.0 else ()
        if opened and len(steps) > 1:  # what opens touches as the piece begins
            self._write_parts(steps[:1], dt, piece, shares[:2])
            self._write_parts(steps[1:], dt, piece, shares[1:])
            return
        states = np.concatenate(piece.looked_at(shares), axis=2)
        acting, held = Acting.between(piece, shares[:-1], shares[1:]), len(piece.held.contacts)
        if opened:
            idle = [Acting.of(each, np.zeros(each.rows.place.shape)) for each in opened]
            acting[0] = Acting(*map(np.concatenate, zip(acting[0], *idle, strict=True)))
        features = acting[0].features
        self._bring(states[0])
        groups = list(self._groups(features))
        if not groups:
            return
        bodies, own, k = np.concatenate([each for each, _ in groups]), [each for _, each in groups], len(steps)
        contacts = np.concatenate([np.flatnonzero(each) for each in own])
        scheme = TURNING if piece.turns else FROZEN if piece.held.lasts is None else ROCKING
        label = np.zeros((k, len(groups), 5), np.int64)
        label[:, :, 0], label[:, :, 1] = steps[:, None], FORCES
        label[:, :, 2] = [scheme if each[:held].any() else FROZEN for each in own]
        # Where bodies and contacts of a group begin: behind those of the groups before it, and of the parts before.
        part, first_body = np.arange(k)[:, None], np.cumsum([0, *(len(each) for each, _ in groups[:-1])])
        label[:, :, 3] = first_body + len(bodies) * part
        label[:, :, 4] = np.cumsum([0, *map(np.sum, own[:-1])]) + len(contacts) * part
        # Times are counted from their steps, and lengths known to more digits than times have.
        begin = piece.start.t + shares[:-1] * piece.length - steps * dt
        time = np.repeat(np.column_stack([begin, np.diff(shares) * piece.length]), len(groups), axis=0)
        before = np.concatenate([self._state[None], states[1:-1]])
        wrench = np.array([each.wrench for each in acting])[:, contacts]
        names = np.tile(features[contacts], (k, 1))
        self._enter(
            time, label.reshape(-1, 5), np.tile(bodies, k), before[:, bodies], states[1:, bodies], names, wrench
        )
        self._state = states[-1]

    def _shares(self, piece: Piece, first: float, last: float) -> list[float]:
        """Return shares where a part ends in so many that cubic polynomials through their ends are close to it.

        The audit follows these. Half-way a cubic polynomial is the mean of its ends and an eighth of how much its rate
        changes.
        """
        s = np.array([first, 0.5 * (first + last), last])[:, None]
        way, rate = (each @ (s ** np.arange(each.shape[2])).T for each in (piece.way, piece.velocity))
        bend = 0.125 * (last - first) * piece.length * (rate[..., 0] - rate[..., 2])
        bent = np.abs(way[..., 1] - 0.5 * (way[..., 0] + way[..., 2]) - bend) / self._world.per_length
        off = bent.max() / (CLOSE * self._world.size)
        ends = np.linspace(first, last, 1 + max(1, int(np.ceil(off**0.25))))  # errors fall with the fourth power
        return ends[1:].tolist()

    def _bring(self, state: Array) -> None:
        """Bring bodies that are not free to a state: they are where they are, whether anything touches them or not."""
        moved = self._world.bodies.free == 0
        self._state[moved] = state[moved]

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
        self, time: Array, label: Indices, body: Indices, before: Array, after: Array, features: Indices, wrench: Array
    ) -> None:
        """Enter pieces, whose labels count bodies and contacts from the first of them."""
        label += np.array([0, 0, 0, self._bodies, self._contacts])
        name = self._keys(features)
        before, after, wrench = (each.reshape(-1, each.shape[-1]) for each in (before, after, wrench))
        self._rows.append((time, label, body, before, after, name, wrench))
        self._bodies += len(body)
        self._contacts += len(name)

    def journal(self, first: int, steps: int) -> Journal:
        """Return what was written of ``steps`` steps from the step ``first`` on, as a journal."""
        time, label, *others = (np.concatenate(each) for each in zip(*self._rows, strict=True))
        return Journal(steps, time, label - np.array([first, 0, 0, 0, 0]), *others)
