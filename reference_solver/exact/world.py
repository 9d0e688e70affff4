"""A world that is looked at every dt, as `reference_solver.simulation` asks for it."""

from __future__ import annotations

import copy
from typing import Self

import numpy as np

from reference_solver.exact.bodies import start_of, world_of
from reference_solver.exact.loop import Loop
from reference_solver.exact.record import Blow, Part, Recorder
from reference_solver.model import Model
from reference_solver.needs import Needs
from reference_solver.pieces import allocate_journal
from reference_solver.records import Contacts, Frames, joined
from reference_solver.settings import Settings
from reference_solver.step_problem import StepProblem
from reference_solver.tally import new_tally

#: Longest piece, in units of the world's time.
LONGEST = 10.0


class World:
    """A model that the event loop moves; see the interface in ``simulation.py``.

    A run keeps the piece that it looks into, so that one that is made in parts has the same bits.
    """

    def __init__(self, model: Model, settings: Settings, needs: Needs, certified: bool = True) -> None:
        self._dt, self._steps = settings.dt, 0
        world, state = world_of(model), start_of(model)
        assert settings.tolerance is not None
        self._loop = Loop(world, state, settings.tolerance, LONGEST * world.time)
        self._recorder = Recorder(world)
        self._part: Part | None = None  # up to where the world was looked at
        self._parts: list[Part | Blow] = []  # what happened in the last step
        self.pose, self.twist = state.pose, state.velocity.copy()
        self.tally, self.journal = new_tally(), allocate_journal(model.dimension, len(model.bodies), 0)

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Look at the world after every ``stride`` of ``steps`` steps.

        Raises
        ------
        Refused
            Where the loop has no answer, in one sentence; the world is then where it was last looked at.
        """
        kept, d = bool(len(self.journal.time)), self._loop.world.dimension
        if kept:
            self._recorder.begin(self.pose, self.twist)
        none = Contacts.empty(0, d)
        frames = [Frames(self.pose[None][:0], self.twist[None][:0], np.zeros(1, np.int64), none)]
        for k in range(1, steps + 1):
            part = self._move_to(self._steps + k)
            if kept:
                self._recorder.write(self._steps + k - 1, self._dt, self._parts)
            sampled = bool(stride) and k % stride == 0
            if sampled or k == steps:
                state = part.piece.state(part.last)
                self.pose, self.twist = state.pose, state.velocity
            if sampled:
                found = self.contacts() if contacts else none
                frames.append(Frames(self.pose[None], self.twist[None], np.array([0, len(found)]), found))
        if kept:
            self.journal = self._recorder.journal(self._steps, steps)
        self._steps += steps
        return joined(frames) if len(frames) > 1 else frames[0]

    def _move_to(self, step: int) -> Part:
        """Move the world to the end of a step; return the part of a piece that ends there."""
        t, self._parts = step * self._dt, []
        part = self._part
        while part is None or part.piece.start.t + part.piece.length < t:
            if part is not None and part.last < 1.0:
                self._parts.append(Part(part.piece, part.last, 1.0))
            blows, piece = self._loop.next_piece()
            self._parts += blows
            part = Part(piece, 0.0, 0.0)
        self._part = Part(part.piece, part.last, (t - part.piece.start.t) / part.piece.length)
        self._parts.append(self._part)
        return self._part

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
