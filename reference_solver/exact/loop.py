"""The loop: find what touches, strike, decide forces, move to the next event."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from reference_solver.exact.bodies import State, World
from reference_solver.exact.checks import check
from reference_solver.exact.events import Event, Kind, first_event
from reference_solver.exact.features import no_gap
from reference_solver.exact.forces import Held, changed, decide
from reference_solver.exact.impacts import jam, strike
from reference_solver.exact.motion import Piece, constant, free_acceleration, steady
from reference_solver.exact.problem import OPEN, SLIP, STICK
from reference_solver.exact.projection import projected
from reference_solver.exact.record import Blow
from reference_solver.exact.refusals import NoForces, NoProgress, NoSolution, TooManyPieces
from reference_solver.exact.rows import Contacts, touching_contacts
from reference_solver.exact.series import settling
from reference_solver.exact.stiff import step
from reference_solver.model import Array
from reference_solver.settings import TOLERANCE, TOLERANCES

#: Pieces of a run: some 40 s of CPU.
MOST_PIECES = 20_000
#: Length of a piece, as a share of the world's time, up to which it is an instant: what falls from rest moves 1e-22 of
#: a half width in it.
PROGRESS = 1e-11
#: Events that may follow each other within this share of the longest piece. A series of rebounds with e = .95 takes
#: three hundred to become too low.
MOST_IN_A_ROW, ROW = 1000, 1e-3
#: An instant in which impulses do what no forces can (E54), as a share of the world's time: loads make some hundred
#: times the speed in it that counts as none.
INSTANT = 4e-10
#: First step of a motion that turns to the tolerance `TOLERANCE`, as a share of the world's time; it is made shorter or
#: longer to the tolerance. A step of this order that nothing shortens differs between tolerances, too.
FIRST_STEP, ORDER = 0.1, 8.0
#: Modes that end while others go on: forces do not jump there.
GO_ON = {Kind.LIFT: OPEN, Kind.SLIP: SLIP}
#: Angle that a body in space may turn by in a step to the coarsest tolerance, at the spin with which it begins [rad].
#: Turns are rotation vectors, which have no rates at a whole turn. It goes with a power of the tolerance, so that steps
#: differ between tolerances: those to a tenth of one have errors 2.5 times smaller.
TURN, TURN_ORDER = 2.0, 20.0
#: Share of the tolerance that is asked for where a body that turns touches nothing: free rotation is known to nearly
#: round-off.
FREE = 1e-2
#: Share of the world's speed, and of what impacts changed, below which what they leave of speeds is round-off.
NO_SPEED, NO_SHARE = 1e-14, 1e-11


@dataclass
class Loop:
    """A world being moved from event to event.

    Parameters
    ----------
    world
        What moves.
    state
        Where the next piece begins.
    tolerance
        Error of a step of `Turning`.
    longest
        Longest piece [s]. Motion is the same with any.
    pieces, steps
        How many there were; steps are the pieces that were made to the tolerance.
    ends
        Why the piece that was returned last ends.
    held
        Contacts that go on from the piece before, with their forces; None where all is to be found anew.
    left_out
        Contacts that are not found where the next piece begins: their feature ends there, or neither sticking nor
        slipping holds.
    blows
        Blows since the piece that was returned last.
    next_length
        Of the next step to the tolerance [s]; None where a closed form is tried first.
    after_instant
        Whether the piece before was an instant, see `PROGRESS`.
    recent, recent_began
        The last events, up to `MOST_IN_A_ROW`, by what happened, and when they began [s].
    """

    world: World
    state: State
    tolerance: float
    longest: float
    pieces: int = 0
    steps: int = 0
    ends: Kind = Kind.STEP
    held: Held | None = None
    left_out: frozenset[tuple[int, ...]] = frozenset()
    blows: list[Blow] = field(default_factory=list)
    next_length: float | None = None
    after_instant: bool = False
    recent: Counter[str] = field(default_factory=Counter)
    recent_began: float = 0.0

    def next_piece(self) -> tuple[list[Blow], Piece]:
        """Return what strikes bodies now and the motion up to the next event, and move the world to its end.

        Raises
        ------
        Refused
            Where the loop has no answer.
        """
        while True:
            held = self.held or self._found_anew()
            if held is None:  # no forces exist, and a jam has changed velocities
                continue
            piece = self._move(held)
            event = first_event(self.world, piece, self.after_instant)
            if held.lasts is not None and event.kind is Kind.MEET:  # rebounds up to there are followed
                continue
            if event.at_start:
                self.held = self._with_modes_ended(held, event)
                continue
            piece, event = self._cut(piece, event)
            check(self.world, piece, self.tolerance)
            blows, self.blows = self.blows, []
            self._finish(piece, event)
            return blows, piece

    def _found_anew(self) -> Held | None:
        """Strike what touches, and return which contacts hold then; None after a jam."""
        contacts = self._find()
        if self._strike(contacts):
            contacts = self._find()
            held = settling(self.world, self.state, self._closed(contacts))
            if held is not None:  # its speeds are not round-off: the piece takes them off
                return held
        return self._decide(contacts)

    def _find(self) -> Contacts:
        return touching_contacts(self.world, self.state, self.left_out)

    def _closed(self, contacts: Contacts) -> Contacts:
        """Return those whose gaps count as none."""
        return contacts.chosen(contacts.touch(no_gap(self.world, self.state.place)))

    def _free_acceleration(self) -> Array:
        """Return accelerations (n, q) without contacts."""
        return free_acceleration(self.world, self.state.axes, self.state.velocity)

    def _strike(self, contacts: Contacts) -> bool:
        """Strike what touches and approaches; return whether anything does."""
        blows = strike(self.world, self.state, self._closed(contacts))
        if not blows:
            return False
        struck = blows[-1].after
        change = np.abs(struck.velocity - self.state.velocity)
        stops = np.abs(struck.velocity) < np.minimum(
            NO_SPEED * self.world.speed * self.world.per_length, NO_SHARE * change
        )
        self.state = struck.moving(np.where(stops, 0.0, struck.velocity))
        self.blows += [*blows[:-1], replace(blows[-1], after=self.state)]
        return True

    def _decide(self, contacts: Contacts) -> Held | None:
        """Return which contacts hold, stick and slip; None where no forces exist and a jam changes velocities."""
        speed, still = contacts.rows.speed[:, 0], self.world.still
        parts, approaches = speed >= still, speed <= -still
        closed = contacts.touch(no_gap(self.world, self.state.place))
        contacts = contacts.chosen(~parts & (closed | ~approaches))  # what approaches and has a gap meets later
        try:
            held = decide(self.world, self.state, contacts, self._free_acceleration())
        except NoSolution:
            self._jam(contacts)
            return None
        self.next_length = None
        self._project(held)
        return held

    def _project(self, held: Held) -> None:
        self.state, blow = projected(self.world, self.state, held)
        self.blows += [] if blow is None else [blow]

    def _jam(self, contacts: Contacts) -> None:
        try:
            blow = jam(self.world, self.state, contacts, INSTANT * self.world.time)
        except NoSolution:
            raise NoForces(t=self.state.t) from None
        self.blows.append(blow)
        self.state = blow.after
        self._count("a jam")

    def _move(self, held: Held) -> Piece:
        """Return the piece from here on: exact where accelerations are constant, else a step."""
        if held.lasts is not None:
            return steady(self.state, held, held.acceleration, held.lasts)
        if self.next_length is None:
            piece = constant(self.world, self.state, held, self.longest)
            if piece is not None:
                return piece
            self.next_length = FIRST_STEP * self.world.time * (self.tolerance / TOLERANCE) ** (1.0 / ORDER)
        self.steps += 1
        d, length = self.world.dimension, min(self.next_length, self.longest)
        spin = np.linalg.norm(self.state.velocity[:, d:], axis=1).max()
        turn = TURN * (self.tolerance / TOLERANCES[1]) ** (1.0 / TURN_ORDER)
        if d == 3 and spin * length > turn:
            length = turn / float(spin)
        piece, self.next_length = step(self.world, self.state, held, self._tolerance_of(held), length)
        return piece

    def _tolerance_of(self, held: Held) -> float:
        """Return the tolerance of a step from here on: finer where a body in space turns that nothing touches."""
        d = self.world.dimension
        loose = self.world.bodies.free == 1
        loose[held.contacts.features[:, :2]] = False
        turns = (self.state.velocity[:, d:] != 0.0) | (held.acceleration[:, d:] != 0.0)
        return self.tolerance * (FREE if d == 3 and turns[loose].any() else 1.0)

    def _cut(self, piece: Piece, event: Event) -> tuple[Piece, Event]:
        """Return the piece up to its event, and that: a step is made anew with that length, so that its end is exact.

        If the new step is shorter than asked for, it ends before the event.
        """
        if event.share >= 1.0:
            return piece, event
        if not piece.turns or event.share == 0.0:
            return piece.cut(event.share), event
        length = event.share * piece.length
        shorter, _ = step(self.world, piece.start, piece.held, self._tolerance_of(piece.held), length)
        return shorter, event if shorter.length == length else Event(Kind.STEP, 1.0)

    def _finish(self, piece: Piece, event: Event) -> None:
        """Move the world to the end of a piece, and keep its contacts if forces do not jump there."""
        self.ends = event.kind
        self.pieces += 1
        if self.pieces > MOST_PIECES:
            raise TooManyPieces(count=MOST_PIECES, t=self.state.t)
        self._count(event.kind.value)
        self.after_instant = piece.length <= PROGRESS * self.world.time
        if not self.after_instant:
            self.left_out = frozenset()
        self.state, self.held = piece.state(1.0), None
        if piece.turns:
            self.held = self._carried_on(piece.held, event)
            return
        self.next_length = None
        if piece.held.lasts is not None and event.kind is Kind.STEP:  # a series is over: its contacts are closed
            self._project(piece.held)

    def _carried_on(self, held: Held, event: Event) -> Held | None:
        """Return contacts that stay closed at the end of a step, with their forces there; None where forces jump."""
        self._project(held)
        held = held.at(self.state, self._free_acceleration())
        if event.kind in GO_ON:
            return changed(held, {event.contact: GO_ON[event.kind]}, self._free_acceleration())
        return held if event.kind in (Kind.STEP, Kind.SEARCH) and not held.slips_end else None

    def _with_modes_ended(self, held: Held, event: Event) -> Held | None:
        """Return contacts with what ends as their piece begins changed; None where all is to be found anew."""
        self._count(event.kind.value)
        if event.ended:
            self.left_out |= event.ended
            return None
        modes = dict(event.modes)
        neither = held.slipped & {held.contacts.names[k] for k, mode in modes.items() if mode == STICK}
        if neither:  # it stuck, its friction ended, and its slip would turn back at once: neither mode holds
            self.left_out |= neither
            return None
        found = changed(held, modes, self._free_acceleration())
        if found is None and STICK in modes.values():  # no forces hold it, and none let it go
            self._jam(held.contacts)
            return None
        return found or changed(held, modes, self._free_acceleration(), strictly=False)

    def _count(self, what: str) -> None:
        """Count an event, and refuse where time hardly goes on."""
        self.recent[what] += 1
        if self.recent.total() == MOST_IN_A_ROW:
            if self.state.t - self.recent_began < ROW * self.longest:
                most = max(self.recent, key=lambda each: (self.recent[each], each != Kind.STEP.value))
                raise NoProgress(count=MOST_IN_A_ROW, t=self.state.t, most=most)
            self.recent_began = self.state.t
            self.recent.clear()
