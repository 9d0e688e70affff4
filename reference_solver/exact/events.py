"""The first event of a piece: a contact ends, or bodies meet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from operator import itemgetter

import numpy as np
from scipy.optimize import brentq, fminbound

from reference_solver.exact.bodies import World
from reference_solver.exact.features import margins, width_of_margins
from reference_solver.exact.forces import LEAST, NONE
from reference_solver.exact.kernels.features import FACE
from reference_solver.exact.meeting import next_meeting
from reference_solver.exact.motion import Piece, free_acceleration
from reference_solver.exact.problem import OPEN, SLIP, STICK
from reference_solver.model import Array

#: Parts of a step, and of a piece of any length, between which monitors are looked at: so many, and more where a face
#: turns by more than this in one [rad]. Of a piece of any length its beginning counts as well.
OF_STEP, OF_CONSTANT, TURN, BEGINNING = 4, 8, 0.5, 1e-6
#: Where a parabola through three looks leaves less than this share of a monitor, its least is sought, to this share of
#: the piece: a dip that lasts less is as shallow as round-off.
DIPS, CLOSE = 0.5, 1e-7
#: Share of the smallest half width below which margins are round-off.
MARGIN = 1e-12
#: Most rounds of Brent's method: where a monitor steps in its last places at its root it needs more than a hundred.
MOST_ROUNDS = 1000


class Kind(Enum):
    """What happens at the end of a piece."""

    STEP = "a piece ends that is as long as it may be"
    SEARCH = "bodies are so near that the search for their meeting stops and goes on"
    FEATURE = "a contact comes to the end of a feature"
    SLIDE = "a slide ends"
    LIFT = "a load ends"
    SLIP = "friction has no more to give"
    MEET = "bodies meet"


@dataclass(frozen=True)
class Event:
    """The end of a piece.

    Parameters
    ----------
    kind
        What happens.
    share
        At which share of the piece.
    contact
        Number of the contact that it happens to, -1 for none.
    ended
        Contacts whose feature ends where the piece begins.
    modes
        By number of contact: modes that end where the piece begins, and what they become.
    """

    kind: Kind
    share: float
    contact: int = -1
    ended: frozenset[tuple[int, ...]] = frozenset()
    modes: tuple[tuple[int, int], ...] = ()

    @property
    def at_start(self) -> bool:
        """Whether the piece cannot begin like this."""
        return bool(self.ended or self.modes)


class Monitors:
    """What must not fall below zero while a piece lasts.

    For each of m contacts: ``width`` margins of its features [m], how fast it slips in its direction at the start of
    the piece [m/s], its load and the friction that it could still bear [N]; infinite where there is none.

    Parameters
    ----------
    world, piece
        Rows of the piece's contacts are brought to wherever monitors are asked for.
    """

    def __init__(self, world: World, piece: Piece) -> None:
        self._world, self._piece, self._contacts, self._answer = world, piece, piece.held.contacts, piece.held.answer
        self.width = width_of_margins(world)
        modes, directions = self._answer.modes, self._answer.directions
        self._slips = (modes == SLIP) & (np.abs(directions).max(axis=1, initial=0.0) > 0.0)
        # A slip that may turn ends where hardly anything is left of it; one that begins may have less.
        begun = np.linalg.norm(self._contacts.at_state(piece.start).rows.speed[:, 1:], axis=1)
        self._ended = np.minimum(world.slipping, 0.5 * begun)
        self.noise = np.full((len(modes), self.width + 3), MARGIN * world.size)
        self.noise[:, self.width] = world.still
        self.noise[:, self.width + 1 :] = NONE * (
            LEAST * world.least_weight + np.abs(self._answer.forces[:, :1]).max(initial=0.0)
        )

    def __call__(self, share: float) -> Array:
        """Return the monitors (m, k) at a share of the piece."""
        place, axes, velocity = self._piece.at(share)
        held, answer = self._piece.held, self._answer
        if self._piece.turns:
            forces, _ = held.follow(place, axes, velocity, free_acceleration(self._world, axes, velocity))
            load = forces[:, 0]
            left = self._contacts.friction * load - np.linalg.norm(forces[:, 1:], axis=1)
            grip = np.where(answer.modes == STICK, left, np.inf)
        else:  # forces do not change
            self._contacts.at(place, axes, velocity)
            load = grip = np.full(len(answer.modes), np.inf)
        slip = self._contacts.rows.speed[:, 1:]
        if self._piece.turns and slip.shape[1] > 1:
            left = np.linalg.norm(slip, axis=1) - self._ended
            slip = np.minimum(left, (slip * answer.directions).sum(axis=1))
        else:
            slip = (slip * answer.directions).sum(axis=1)
        ends = margins(self._world, place, axes, self._contacts.features)
        return np.column_stack([ends, np.where(self._slips, slip, np.inf), load, grip])

    def shares(self) -> list[float]:
        """Return the shares at which to look."""
        parts, beginning = (OF_STEP, []) if self._piece.turns else (OF_CONSTANT, [BEGINNING])
        features, bodies = self._contacts.features, self._world.bodies
        for turn in range(2):
            owner, kind, face = features[:, turn], features[:, 2 + 2 * turn], features[:, 3 + 2 * turn]
            ends = owner[(kind == FACE) & (bodies.sides[owner, np.where(kind == FACE, face, 0)] > 0)]
            spin = self._piece.velocity[ends, self._world.dimension :]
            fastest = max(np.abs(each).max(initial=0.0) for each in (spin[..., 0], spin.sum(axis=2)))
            parts = max(parts, int(np.ceil(fastest * self._piece.length / TURN)))
        first, *others = np.linspace(0.0, 1.0, parts + 1).tolist()
        return [first, *beginning, *others]

    def kind(self, column: int) -> Kind:
        """Return what happens where a column of the monitors falls below zero."""
        return {self.width: Kind.SLIDE, self.width + 1: Kind.LIFT, self.width + 2: Kind.SLIP}.get(column, Kind.FEATURE)


def first_event(world: World, piece: Piece, after_instant: bool) -> Event:
    """Return the first event of a piece; if contacts or modes end as it begins, only these.

    ``after_instant``: whether the piece before was an instant; then what is as near as round-off is not met again.
    """
    event = Event(Kind.STEP, 1.0)
    if len(piece.held.contacts):
        event = _first_end(piece, Monitors(world, piece))
        piece.held.contacts.at_state(piece.start)
    if event.at_start:
        return event
    share, stopped = next_meeting(world, piece, piece.held.contacts, after_instant)
    return Event(Kind.SEARCH if stopped else Kind.MEET, share) if share < event.share else event


def _first_end(piece: Piece, monitors: Monitors) -> Event:
    event, at_start, ended, modes = Event(Kind.STEP, 1.0), Kind.STEP, set(), {}
    for (last, before), (now, values) in pairwise(_looks(monitors, monitors.shares())):
        for k, column in np.argwhere(values < -monitors.noise).tolist():
            kind = monitors.kind(column)
            if before[k, column] > monitors.noise[k, column]:
                share = brentq(_component(monitors, k, column), last, now, xtol=1e-16, rtol=1e-15, maxiter=MOST_ROUNDS)
            elif last > 0.0:  # it was none but for round-off when it was last looked at
                share = last
            else:  # it is at its end from the beginning
                at_start = kind
                if kind is Kind.FEATURE:
                    ended.add(tuple(piece.held.contacts.features[k].tolist()))
                elif kind is not Kind.SLIDE:
                    modes[k] = OPEN if kind is Kind.LIFT else SLIP
                else:
                    modes.setdefault(k, STICK)
                continue
            if share < event.share:
                event = Event(kind, share, k)
        if ended or modes:
            return Event(at_start, 0.0, ended=frozenset(ended), modes=tuple(modes.items()))
        if event.kind is not Kind.STEP:
            return event
    return event


def _looks(monitors: Monitors, shares: Sequence[float]) -> Iterator[tuple[float, Array]]:
    """Yield shares and monitors there; between two shares also where one is below zero that is so at neither."""
    seen = [(share, monitors(share)) for share in shares[:3]]
    yield seen[0]
    yield from _dips(monitors, seen, 0)
    yield seen[1]
    for share in [*shares[3:], None]:
        yield from _dips(monitors, seen, 1)
        yield seen[2]
        if share is not None:
            seen = [*seen[1:], (share, monitors(share))]


def _dips(monitors: Monitors, seen: list[tuple[float, Array]], k: int) -> list[tuple[float, Array]]:
    """Return looks below zero between the looks k and k + 1 of three, by the parabola through these."""
    (t0, v0), (t1, v1), (t2, v2) = seen
    (begin, before), (end, after) = seen[k : k + 2]
    with np.errstate(invalid="ignore", divide="ignore"):  # infinite is what cannot end
        slope = (v1 - v0) / (t1 - t0)
        bend = ((v2 - v1) / (t2 - t1) - slope) / (t2 - t0)
        vertex = 0.5 * (t0 + t1 - slope / bend)
        left = v0 + (vertex - t0) * (slope + bend * (vertex - t1)) + monitors.noise
        low = np.minimum(before, after) + monitors.noise
        falls = (bend > 0.0) & (begin < vertex) & (vertex < end) & (low >= 0.0) & (left < DIPS * low)
    found = []
    for contact, column in np.argwhere(falls).tolist():
        share = float(fminbound(_component(monitors, contact, column), begin, end, xtol=CLOSE))
        values = monitors(share)
        if values[contact, column] < -monitors.noise[contact, column]:
            found.append((share, values))
    return sorted(found, key=itemgetter(0))


def _component(monitors: Monitors, k: int, column: int) -> Callable[[float], float]:
    return lambda share: float(monitors(share)[k, column])
