"""A world that is looked at every dt, as `reference_solver.simulation` asks for it."""

from __future__ import annotations

import copy
from typing import Self

import numpy as np

from reference_solver.exact.bodies import start_of, world_of
from reference_solver.exact.loop import Loop
from reference_solver.exact.motion import Piece
from reference_solver.exact.record import Blow, Part, Recorder
from reference_solver.model import Model
from reference_solver.needs import Needs
from reference_solver.pieces import Journal
from reference_solver.records import Contacts, Frames, joined, joined_contacts
from reference_solver.settings import Settings
from reference_solver.step_problem import StepProblem

#: Longest piece, in units of the world's time.
LONGEST = 10.0


class EventWorld:
    """A model that the event loop moves; see the interface in ``simulation.py``.

    A run keeps the piece that it looks into, so that one that is made in parts has the same bits.
    """

    def __init__(self, model: Model, settings: Settings, needs: Needs, certified: bool = True) -> None:
        self._dt, self._steps = settings.dt, 0
        world, state = world_of(model), start_of(model)
        assert settings.tolerance is not None
        self._loop = Loop(world, state, settings.tolerance, LONGEST * world.time)
        self._recorder = Recorder(world)
        self._piece: Piece | None = None
        self._share = 0.0  # of the piece, up to where the world was looked at
        self._parts: list[Part | Blow] = []  # what happened in the last step
        self.pose, self.twist = state.pose, state.velocity.copy()

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Look at the world after every ``stride`` of ``steps`` steps.

        Raises
        ------
        Refused
            Where the loop has no answer, in one sentence; the world is then where it was last looked at.
        """
        return self._run(steps, stride, contacts, kept=False)

    def recorded(self, steps: int, stride: int, contacts: bool) -> tuple[Frames, Journal]:
        """Run, and return what was done as well.

        Raises
        ------
        Refused
            See `run`.
        """
        self._recorder.begin(self.pose, self.twist)
        first = self._steps
        frames = self._run(steps, stride, contacts, kept=True)
        return frames, self._recorder.journal(first, steps)

    def _run(self, steps: int, stride: int, contacts: bool, kept: bool) -> Frames:
        """Make steps piece by piece: of each piece all steps that end in it at once."""
        none = Contacts.empty(0, self._loop.world.dimension)
        frames = [Frames(self.pose[None][:0], self.twist[None][:0], np.zeros(1, np.int64), none)]
        ends, k = np.arange(self._steps + 1, self._steps + steps + 1) * self._dt, 0
        while k < steps:
            piece, before = self._moved_to(float(ends[k]))
            until = int(np.searchsorted(ends, piece.start.t + piece.length, side="right"))
            shares = np.append(self._share, (ends[k:until] - piece.start.t) / piece.length)
            numbers = np.arange(k + 1, until + 1)
            if kept:
                self._recorder.write(self._steps + k, self._dt, before, piece, shares)
            sampled = np.flatnonzero(numbers % stride == 0) if stride else np.zeros(0, np.int64)
            pose, twist = piece.looked_at(shares[1:][np.append(sampled, -1)])
            counts, found = np.zeros(len(sampled) + 1, np.int64), [none]
            if contacts and len(sampled):
                counts[1:] = len(piece.held.contacts)
                along = sampled
                if before and sampled[0] == 0:
                    found.append(self._recorder.contacts([*before, Part(piece, *shares[:2].tolist())]))
                    counts[1], along = len(found[1]), sampled[1:]
                if len(along):
                    found.append(self._recorder.contacts_between(piece, shares[along], shares[along + 1]))
            frames.append(Frames(pose[:-1], twist[:-1], counts.cumsum(), joined_contacts(found)))
            self.pose, self.twist, self._share = pose[-1], twist[-1], float(shares[-1])
            self._parts = [*(before if until - k == 1 else []), Part(piece, *shares[-2:].tolist())]
            k = until
        self._steps += steps
        return joined(frames)

    def _moved_to(self, t: float) -> tuple[Piece, list[Part | Blow]]:
        """Return the piece in which a time lies [s], and what came before it since the world was looked at."""
        before: list[Part | Blow] = []
        while self._piece is None or self._piece.start.t + self._piece.length < t:
            if self._piece is not None and self._share < 1.0:
                before.append(Part(self._piece, self._share, 1.0))
            blows, self._piece = self._loop.next_piece()
            before += blows
            self._share = 0.0
        return self._piece, before

    @property
    def is_closed(self) -> bool:
        """Whether all motion so far is in closed form: any tolerance gives the same bits."""
        return self._loop.steps == 0

    def copy(self) -> Self:
        """Return a world of its own that goes on with the same bits."""
        constant = self._loop.world
        return copy.deepcopy(self, {id(constant): constant})

    def contacts(self) -> Contacts:
        """Return the contacts of the last step, with all that they did in it."""
        return self._recorder.contacts(self._parts)

    def step_problem(self) -> StepProblem:
        """Refuse: the loop has no steps.

        Raises
        ------
        ValueError
        """
        raise ValueError("tolerance: the event loop has no problem of one step; use Settings.fixed_step")
