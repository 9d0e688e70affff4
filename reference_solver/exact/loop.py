"""The loop: find what touches, strike, decide forces, move to the next event."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from reference_solver.exact.bodies import State, World
from reference_solver.exact.checks import check
from reference_solver.exact.cones import NoSolution
from reference_solver.exact.events import Event, Kind, first_event
from reference_solver.exact.features import no_gap
from reference_solver.exact.forces import Held, changed, decide
from reference_solver.exact.impacts import jam, strike
from reference_solver.exact.motion import Piece, constant, free_acceleration, steady
from reference_solver.exact.problem import OPEN, SLIP, STICK
from reference_solver.exact.projection import projected
from reference_solver.exact.record import Blow
from reference_solver.exact.refusals import NoForces, NoProgress, TooManyPieces
from reference_solver.exact.rows import Contacts, touching_contacts
from reference_solver.exact.series import settling
from reference_solver.exact.stiff import step

#: Pieces of a run: some 40 s of CPU. Shorter ones than this share of the world's time are an instant.
MOST_PIECES, PROGRESS = 20_000, 1e-11
#: Events that may follow each other within this share of the longest piece. A series of rebounds with e = .95 takes
#: three hundred to become too low.
MOST_IN_A_ROW, ROW = 1000, 1e-3
#: An instant in which impulses do what no forces can (E54), as a share of the world's time: loads make some hundred
#: times the speed in it that counts as none.
INSTANT = 4e-10
#: First step of a motion that turns, as a share of the world's time.
FIRST_STEP = 0.1
#: Modes that end while others go on: forces do not jump there.
GO_ON = {Kind.LIFT: OPEN, Kind.SLIP: SLIP}
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
        Longest piece [s]: longer ones would be the same.
    blows
        What came before the piece that is returned next.
    """

    world: World
    state: State
    tolerance: float
    longest: float
    step: float = 0.0
    pieces: int = 0
    steps: int = 0  # made to the tolerance
    events: int = 0
    stuck: bool = False  # whether the piece before was an instant, see `PROGRESS`
    blows: list[Blow] = field(default_factory=list)
    row: float = 0.0  # where a count of pieces in a row began [s]
    held: Held | None = None  # what goes on from the piece before
    left: frozenset[tuple[int, ...]] = frozenset()  # contacts at the end of a feature

    def next_piece(self) -> tuple[list[Blow], Piece]:
        """Return what strikes bodies now and the motion up to the next event, and move the world to its end.

        Raises
        ------
        Refused
            Where the loop has no answer.
        """
        while True:
            held = self.held or self._found()
            if held is None:
                continue
            piece = self._piece(held)
            event = first_event(self.world, piece, self.stuck)
            if event.at_start:
                self._count(event.kind.value)
                self.left, self.held = self.left | event.left, self._revised(held, event)
                continue
            piece = self._cut(piece, event)
            check(self.world, piece, self.tolerance)
            blows, self.blows = self.blows, []
            self.held = self._entered(piece, event)
            return blows, piece

    def _found(self) -> Held | None:
        """Find what touches, strike it, and decide forces; None where a jam changed velocities instead."""
        contacts = touching_contacts(self.world, self.state, self.left)
        none = no_gap(self.world, self.state.place)
        blows = strike(self.world, self.state, contacts.chosen(contacts.touch(none)))
        if blows:
            struck = blows[-1].after
            change = np.abs(struck.velocity - self.state.velocity)
            stops = np.abs(struck.velocity) < np.minimum(
                NO_SPEED * self.world.speed * self.world.per_length, NO_SHARE * change
            )
            velocity = np.where(stops, 0.0, struck.velocity)
            self.state = replace(struck, velocity=velocity)
            self.blows += [*blows[:-1], replace(blows[-1], after=self.state)]
            contacts = touching_contacts(self.world, self.state, self.left)
        if blows and (held := settling(self.world, self.state, contacts.chosen(contacts.touch(none)))):
            return held
        speed = contacts.rows.speed[:, 0]  # what approaches and has a gap meets later
        contacts = contacts.chosen((speed < self.world.still) & (contacts.touch(none) | (speed > -self.world.still)))
        free = free_acceleration(self.world, self.state.axes, self.state.velocity)
        try:
            held = decide(self.world, self.state, contacts, free)
        except NoSolution:
            self._jam(contacts)
            return None
        self.step = 0.0
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

    def _piece(self, held: Held) -> Piece:
        """Return the piece from here on: exact where accelerations are constant, else a step."""
        if held.lasts > 0.0:
            return steady(self.state, held, held.acceleration, held.lasts)
        if self.step == 0.0:
            piece = constant(self.world, self.state, held, self.longest)
            if piece is not None:
                return piece
            self.step = FIRST_STEP * self.world.time
        self.steps += 1
        tolerance = self.tolerance * (FREE if self._turns_freely(held) else 1.0)
        piece, self.step = step(self.world, self.state, held, tolerance, min(self.step, self.longest))
        return piece

    def _turns_freely(self, held: Held) -> bool:
        """Whether a body in space turns that nothing touches."""
        d = self.world.dimension
        loose = self.world.bodies.free == 1
        loose[held.contacts.features[:, :2]] = False
        turns = (self.state.velocity[:, d:] != 0.0) | (held.acceleration[:, d:] != 0.0)
        return d == 3 and bool(turns[loose].any())

    def _cut(self, piece: Piece, event: Event) -> Piece:
        """Return the piece up to its event: a step is made anew with that length, so that its end is exact."""
        if event.share >= 1.0:
            return piece
        if piece.turns and event.share > 0.0:
            shorter, _ = step(self.world, piece.start, piece.held, self.tolerance, event.share * piece.length)
            return shorter
        return piece.cut(event.share)

    def _entered(self, piece: Piece, event: Event) -> Held | None:
        """Move the world to the end of a piece; return the contacts that go on, if forces do not jump there."""
        self.pieces += 1
        if self.pieces > MOST_PIECES:
            raise TooManyPieces(count=MOST_PIECES, t=self.state.t)
        self._count(event.kind.value)
        self.stuck = piece.length <= PROGRESS * self.world.time
        if not self.stuck:
            self.left = frozenset()
        self.state = piece.state(1.0)
        if piece.held.lasts > 0.0 and event.kind is Kind.LOOK:  # rebounds that are summed end where contacts are closed
            self._project(piece.held)
        if not piece.turns:
            self.step = 0.0
            return None
        held = self._here(piece.held)
        if event.kind is Kind.LOOK:
            return None if held.slips_end else held
        if event.kind in GO_ON:
            free = free_acceleration(self.world, self.state.axes, self.state.velocity)
            return changed(held, {event.contact: GO_ON[event.kind]}, free)
        return None

    def _here(self, held: Held) -> Held:
        """Return contacts that stay closed, with their forces where the world is now."""
        self._project(held)
        return held.at(self.state, free_acceleration(self.world, self.state.axes, self.state.velocity))

    def _revised(self, held: Held, event: Event) -> Held | None:
        """Return contacts whose modes that end at once have changed; None where all are to be found anew."""
        if event.left:
            return None
        free = free_acceleration(self.world, self.state.axes, self.state.velocity)
        modes = dict(event.modes)
        found = changed(held, modes, free)
        if found is None and STICK in modes.values():  # no forces hold it, and none let it go
            self._jam(held.contacts)
            return None
        return found or changed(held, modes, free, strictly=False)

    def _count(self, what: str) -> None:
        self.events += 1
        if self.events % MOST_IN_A_ROW == 0:
            if self.state.t - self.row < ROW * self.longest:
                raise NoProgress(count=MOST_IN_A_ROW, t=self.state.t, last=what)
            self.row = self.state.t
