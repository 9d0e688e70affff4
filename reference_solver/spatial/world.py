"""The spatial world: arrays of one model and the calls into compiled code (interface: ``simulation.py``)."""

from __future__ import annotations

from copy import deepcopy
from typing import Self

import numpy as np

from reference_solver.direct.problem import allocate_problem
from reference_solver.model import Array, Model
from reference_solver.needs import Needs
from reference_solver.pieces import allocate_journal
from reference_solver.records import Contacts, Frames
from reference_solver.settings import Settings
from reference_solver.spatial.ledger import copy_ledger
from reference_solver.spatial.meeting import allocate_meeting
from reference_solver.spatial.motion import initialise
from reference_solver.spatial.problem import assemble, pose_problem
from reference_solver.spatial.state import (
    CANDIDATES,
    MANIFOLDS,
    PAST,
    POINTS,
    REMEMBERED,
    Buffer,
    Island,
    allocate_bodies,
    allocate_detection,
    allocate_ledger,
    allocate_manifolds,
    allocate_memory,
    allocate_sub_step,
    allocate_world,
)
from reference_solver.spatial.step import copy_contacts, run_steps
from reference_solver.step_problem import StepProblem
from reference_solver.stepping.broadphase import doubled
from reference_solver.stepping.options import FIXED_STEP, options, uses_direct
from reference_solver.stepping.run import run_located
from reference_solver.tally import new_tally


class World:
    """One spatial model being stepped; see the interface in ``simulation.py``."""

    def __init__(self, model: Model, settings: Settings, needs: Needs) -> None:
        n = len(model.bodies)
        self._bodies = allocate_bodies(model, needs)
        # A body of similar size has at most twelve neighbours, each pair counted once; arrays grow when that fails.
        self._detection = allocate_detection(model, 8 * n + 64)
        self._manifolds = allocate_manifolds(4 * n + 16)
        self._memory = allocate_memory(4 * n + 16)
        self._sub_step = allocate_sub_step(n, 4 * n + 16, allocate_meeting(self._bodies))
        self._ledger = allocate_ledger(POINTS * (4 * n + 16))
        self._world = allocate_world(self._bodies, len(self._memory), len(self._detection.boxes.candidate))
        self._options, self._accuracy = options(settings, needs), settings.accuracy
        self._problem = allocate_problem(3, n, self._most_points, uses_direct(settings))
        self.tally = new_tally()
        self.journal = allocate_journal(3, n, 0)
        initialise(self._bodies)

    @property
    def pose(self) -> Array:
        """Current poses (n, 7)."""
        return np.asarray(self._bodies.pose)

    @property
    def twist(self) -> Array:
        """Current twists (n, 6)."""
        return np.asarray(self._bodies.twist)

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Make ``steps`` steps, sampling after every ``stride`` (0: never)."""
        samples = steps // stride if stride else 0
        # Four points per body are typical; at most a million rows (100 MB) before it is known that they are needed.
        room = self._most_points + min(POINTS * samples * len(self._bodies), 1_000_000) if contacts else 0
        buffer = self._buffer(samples, room)
        done = 0
        while True:
            done = self._run(buffer, done, steps, stride)
            if done == steps:
                break
            if contacts and buffer.offset[done // stride] + self._most_points > len(buffer.real):
                buffer = self._doubled(buffer)
            else:
                self._grow()
        return Frames(buffer.pose, buffer.twist, buffer.offset, _contacts(buffer, int(buffer.offset[-1])))

    def _run(self, buffer: Buffer, done: int, steps: int, stride: int) -> int:
        state = (self._bodies, self._detection, self._manifolds, self._memory, self._problem)
        if self._options.scheme != FIXED_STEP:
            sub = self._sub_step._replace(journal=self.journal)
            sub.lasting.accuracy[0] = self._accuracy
            whole = Island(*state, sub, self._ledger, self._options, self.tally)
            return int(run_located(whole, self._world, buffer, done, steps, stride))
        return int(run_steps(*state, self._options, self.tally, buffer, done, steps, stride))

    def contacts(self) -> Contacts:
        """Contacts of the last step."""
        buffer = self._buffer(0, self._most_points)
        if self._options.scheme != FIXED_STEP:
            return _contacts(buffer, copy_ledger(self._ledger, buffer, 0))
        return _contacts(buffer, copy_contacts(self._manifolds[: self._detection.found[MANIFOLDS]], buffer, 0))

    def copy(self) -> Self:
        """Return a world of its own in the same state.

        Tables are shared: nothing writes to them, and a copy of one with strides of zero would be one number per pair,
        and of another type, for which all kernels would be compiled anew.
        """
        return deepcopy(self, {id(table): table for table in (self._detection.restitution, self._detection.friction)})

    def step_problem(self) -> StepProblem:
        """Contact problem of the next step; the world stays what it is."""
        trial, found = self.copy(), -1
        if self._options.scheme != FIXED_STEP:
            trial._memory = trial._sub_step.past
            trial._detection.found[REMEMBERED] = trial._detection.found[PAST]
        while found < 0:
            found = pose_problem(trial._bodies, trial._detection, trial._manifolds, trial._memory, trial._options)
            if found < 0:
                trial._grow()
        return assemble(trial._bodies, trial._manifolds[:found])

    @property
    def _most_points(self) -> int:
        return max(POINTS * len(self._manifolds), len(self._ledger.real))

    def _buffer(self, samples: int, room: int) -> Buffer:
        n = len(self._bodies)
        return Buffer(
            pose=np.zeros((samples, n, 7)),
            twist=np.zeros((samples, n, 6)),
            offset=np.zeros(samples + 1, np.int64),
            names=np.zeros((room, 3), np.int64),
            real=np.zeros((room, 10)),
            journal=self.journal,
        )

    def _doubled(self, buffer: Buffer) -> Buffer:
        """Twice the room for contacts, and what has been recorded so far."""
        bigger = self._buffer(len(buffer.pose), 2 * (len(buffer.real) + self._most_points))
        for old, new in zip(buffer[:5], bigger[:5], strict=True):
            new[: len(old)] = old
        return bigger

    def _grow(self) -> None:
        """Double whatever was found too small; the step that stopped is made anew."""
        if self._detection.found[CANDIDATES] >= len(self._detection.boxes.candidate):
            self._detection = self._detection._replace(boxes=doubled(self._detection.boxes))
            self._world = allocate_world(self._bodies, len(self._memory), len(self._detection.boxes.candidate))
            return
        if self._ledger.filled[0] + POINTS * self._detection.found[MANIFOLDS] > len(self._ledger.real):
            ledger = allocate_ledger(2 * len(self._ledger.real))
            for old, new in zip(self._ledger, ledger, strict=True):
                new[: len(old)] = old
            self._ledger = ledger
            return
        memory = allocate_memory(2 * len(self._memory))
        memory[: len(self._memory)] = self._memory
        self._memory = memory
        past = allocate_memory(max(len(memory), len(self._sub_step.past)))
        past[: len(self._sub_step.past)] = self._sub_step.past
        self._manifolds = allocate_manifolds(2 * len(self._manifolds))
        self._sub_step = self._sub_step._replace(kept=allocate_manifolds(len(self._manifolds)), past=past)
        self._world = allocate_world(self._bodies, len(memory), len(self._detection.boxes.candidate))
        self._problem = allocate_problem(3, len(self._bodies), self._most_points, bool(self._options.direct))


def _contacts(buffer: Buffer, count: int) -> Contacts:
    names, real = buffer.names[:count], buffer.real[:count]
    body_a, body_b, feature = (names[:, k].copy() for k in range(3))
    point, normal, impulse = (real[:, k : k + 3].copy() for k in (0, 3, 6))
    return Contacts(body_a, body_b, feature, point, normal, impulse, real[:, 9].copy())
