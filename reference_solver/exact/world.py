"""A world that is looked at every dt, as `reference_solver.simulation` asks for it."""

from __future__ import annotations

import copy
from typing import Self

import numpy as np

from reference_solver.exact.bodies import start_of, world_of
from reference_solver.exact.loop import Loop
from reference_solver.exact.motion import Piece
from reference_solver.model import Model
from reference_solver.needs import Needs
from reference_solver.pieces import allocate_journal
from reference_solver.records import Contacts, Frames
from reference_solver.settings import Settings
from reference_solver.step_problem import StepProblem
from reference_solver.tally import new_tally

#: Longest piece, in the time that the smallest half width falls through.
LONGEST = 10.0


class World:
    """A model that the event loop moves; see the interface in ``simulation.py``.

    A run keeps the piece that it looks into, so that one that is made in parts has the same bits.
    """

    def __init__(self, model: Model, settings: Settings, needs: Needs, certified: bool = True) -> None:
        self._dimension, self._dt, self._steps = model.dimension, settings.dt, 0
        world, state = world_of(model), start_of(model)
        self._loop = Loop(world, state, settings.accuracy, LONGEST * float(np.sqrt(world.size / world.weight)))
        self._piece: Piece | None = None
        self.pose, self.twist = state.pose, state.velocity.copy()
        # The record of the audit is not written yet: nothing is counted and no pieces are kept.
        self.tally, self.journal = new_tally(), allocate_journal(model.dimension, len(model.bodies), 0)

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Look at the world after every ``stride`` of ``steps`` steps.

        Raises
        ------
        Refused
            Where the loop has no answer, in one sentence; the world is then where it was last looked at.
        """
        poses, twists = [], []
        for k in range(1, steps + 1):
            if k == steps or (stride and k % stride == 0):
                self._look(self._steps + k)
                if stride and k % stride == 0:
                    poses.append(self.pose)
                    twists.append(self.twist)
        self._steps += steps
        n = len(self.pose)
        return Frames(
            np.array(poses).reshape(-1, n, self.pose.shape[1]),
            np.array(twists).reshape(-1, n, self.twist.shape[1]),
            np.zeros(len(poses) + 1, np.int64),
            self.contacts(),
        )

    def _look(self, step: int) -> None:
        t = step * self._dt
        while self._piece is None or self._piece.start.t + self._piece.length < t:
            self._piece = self._loop.next_piece()
        state = self._piece.state((t - self._piece.start.t) / self._piece.length)
        self.pose, self.twist = state.pose, state.velocity

    def copy(self) -> Self:
        """Return a world of its own that goes on with the same bits."""
        constant = self._loop.world
        return copy.deepcopy(self, {id(constant): constant})

    def contacts(self) -> Contacts:
        """Return no contacts: their impulses are not recorded yet."""
        return Contacts.empty(0, self._dimension)

    def step_problem(self) -> StepProblem:
        """Refuse: the loop has no steps.

        Raises
        ------
        ValueError
        """
        raise ValueError("scheme: the event loop has no problem of one step; use Settings.fixed_step")
