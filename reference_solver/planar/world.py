"""The planar world: arrays of one model and the calls into compiled code (interface: ``simulation.py``)."""

from __future__ import annotations

from copy import deepcopy
from typing import Self

import numpy as np

from reference_solver.direct.problem import allocate_problem
from reference_solver.model import Array, Model
from reference_solver.needs import Needs
from reference_solver.pieces import allocate_journal
from reference_solver.planar.ledger import copy_ledger
from reference_solver.planar.meeting import allocate_meeting
from reference_solver.planar.problem import assemble, pose_problem
from reference_solver.planar.state import (
    CANDIDATES,
    CONTACTS,
    Buffer,
    Island,
    allocate_bodies,
    allocate_ledger,
    allocate_pairs,
    allocate_rows,
    allocate_sub_step,
    allocate_world,
    grown,
)
from reference_solver.planar.step import copy_contacts, run_steps
from reference_solver.records import Contacts, Frames
from reference_solver.settings import Settings
from reference_solver.step_problem import StepProblem
from reference_solver.stepping.broadphase import doubled
from reference_solver.stepping.lasting import allocate_lasting
from reference_solver.stepping.options import FIXED_STEP, options, uses_direct
from reference_solver.stepping.run import run_located
from reference_solver.tally import new_tally


class World:
    """One planar model being stepped; see the interface in ``simulation.py``."""

    def __init__(self, model: Model, settings: Settings, needs: Needs) -> None:
        n = len(model.bodies)
        self._model = model
        self._bodies = allocate_bodies(model, needs)
        # A body of similar size has at most six neighbours, each pair counted once; arrays grow when that fails.
        self._pairs = allocate_pairs(model, 8 * n + 64)
        self._rows = allocate_rows(8 * n + 64)
        self._sub = allocate_sub_step(n, len(self._rows.real), allocate_meeting(self._bodies))
        self._ledger = allocate_ledger(8 * n + 64)
        self._world = allocate_world(self._bodies, len(self._pairs.boxes.candidate))
        self._options, self._accuracy = options(settings, needs), settings.accuracy
        self._problem = allocate_problem(2, n, len(self._rows.real), uses_direct(settings))
        self.tally = new_tally()
        self.journal = allocate_journal(2, n, 0)

    @property
    def pose(self) -> Array:
        """Current poses (n, 3)."""
        return self._bodies.pose

    @property
    def twist(self) -> Array:
        """Current twists (n, 3)."""
        return self._bodies.twist

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Make ``steps`` steps, sampling after every ``stride`` (0: never)."""
        samples = steps // stride if stride else 0
        # Two points per body are typical; at most a million rows (80 MB) before it is known that they are needed.
        room = self._most_contacts() + min(2 * samples * len(self.pose), 1_000_000) if contacts else 0
        buffer = self._buffer(samples, room)
        done = 0
        while True:
            done = self._run(buffer, done, steps, stride)
            if done == steps:
                break
            if contacts and buffer.offset[done // stride] + self._most_contacts() > len(buffer.real):
                buffer = self._doubled(buffer)
            else:
                self._grow()
        used = int(buffer.offset[-1])
        return Frames(buffer.pose, buffer.twist, buffer.offset, _contacts(buffer, used))

    def contacts(self) -> Contacts:
        """Contacts of the last step."""
        located = self._options.scheme != FIXED_STEP
        count = int(self._ledger.used[0] if located else self._rows.counts[CONTACTS])
        buffer = self._buffer(0, count)
        if located:
            copy_ledger(self._ledger, buffer, 0)
        else:
            copy_contacts(self._rows, buffer, 0)
        return _contacts(buffer, count)

    def copy(self) -> Self:
        """Return a world of its own in the same state.

        Tables are shared: nothing writes to them, and a copy of one with strides of zero would be one number per pair,
        and of another type, for which all kernels would be compiled anew.
        """
        return deepcopy(self, {id(table): table for table in (self._pairs.restitution, self._pairs.friction)})

    def step_problem(self) -> StepProblem:
        """Contact problem of the next step, as a fixed step poses it; the world stays what it is."""
        trial = self.copy()
        trial._options = self._options._replace(scheme=FIXED_STEP)
        while not pose_problem(trial._bodies, trial._pairs, trial._rows, trial._options):
            trial._grow()
        return assemble(trial._bodies, trial._rows, trial._options)

    def _run(self, buffer: Buffer, done: int, steps: int, stride: int) -> int:
        state = (self._bodies, self._pairs, self._rows, self._problem)
        if self._options.scheme != FIXED_STEP:
            sub = self._sub._replace(journal=self.journal)
            sub.lasting.accuracy[0] = self._accuracy
            whole = Island(*state, sub, self._ledger, self._options, self.tally)
            return int(run_located(whole, self._world, buffer, done, steps, stride))
        return int(run_steps(*state, self._options, self.tally, buffer, done, steps, stride))

    def _most_contacts(self) -> int:
        return max(len(self._rows.real), len(self._ledger.real))

    def _buffer(self, samples: int, room: int) -> Buffer:
        frames = np.zeros((samples, len(self.pose), 3))
        offset = np.zeros(samples + 1, np.int64)
        names, real = np.zeros((room, 3), np.int64), np.zeros((room, 7))
        return Buffer(frames, frames.copy(), offset, names, real, self.journal)

    def _doubled(self, buffer: Buffer) -> Buffer:
        """Twice the room for contacts, and what has been recorded so far."""
        bigger = self._buffer(len(buffer.pose), 2 * (len(buffer.real) + self._most_contacts()))
        for old, new in zip(buffer[:5], bigger[:5], strict=True):
            new[: len(old)] = old
        return bigger

    def _grow(self) -> None:
        """Double whatever was found too small; the step that stopped goes on from where it was."""
        if self._rows.counts[CANDIDATES] >= len(self._pairs.boxes.candidate):
            self._pairs = self._pairs._replace(boxes=doubled(self._pairs.boxes))
            self._world = allocate_world(self._bodies, len(self._pairs.boxes.candidate))
        elif self._ledger.used[0] + self._rows.counts[CONTACTS] > len(self._ledger.real):
            bigger = allocate_ledger(2 * len(self._ledger.real))
            for old, new in zip(self._ledger, bigger, strict=True):
                new[: len(old)] = old
            self._ledger = bigger
        else:
            self._rows = grown(self._rows)
            self._sub = self._sub._replace(lasting=allocate_lasting(2, len(self.pose), len(self._rows.real)))
            self._problem = allocate_problem(2, len(self.pose), len(self._rows.real), bool(self._options.direct))


def _contacts(buffer: Buffer, count: int) -> Contacts:
    index, real = buffer.integer[:count], buffer.real[:count]
    body_a, body_b, feature = (index[:, k].copy() for k in range(3))
    return Contacts(
        body_a, body_b, feature, real[:, 0:2].copy(), real[:, 2:4].copy(), real[:, 4:6].copy(), real[:, 6].copy()
    )
