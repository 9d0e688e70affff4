"""The spatial world: arrays of one model, and how they grow (interface: ``simulation.py``)."""

from __future__ import annotations

from typing import Any

from reference_solver.direct.problem import allocate_problem
from reference_solver.model import Model
from reference_solver.needs import Needs
from reference_solver.settings import Settings
from reference_solver.spatial.meeting import allocate_meeting
from reference_solver.spatial.motion import initialise
from reference_solver.spatial.problem import assemble, pose_problem
from reference_solver.spatial.state import (
    CANDIDATES,
    MANIFOLDS,
    PAST,
    POINTS,
    REMEMBERED,
    Island,
    allocate_bodies,
    allocate_detection,
    allocate_manifolds,
    allocate_memory,
    allocate_sub_step,
    allocate_world,
)
from reference_solver.spatial.step import copy_contacts
from reference_solver.step_problem import StepProblem
from reference_solver.stepping.broadphase import doubled
from reference_solver.stepping.ledger import Buffer
from reference_solver.stepping.options import FIXED_STEP
from reference_solver.stepping.world import SteppedWorld


class World(SteppedWorld):
    """One spatial model being stepped; see the interface in ``simulation.py``."""

    typical = POINTS

    def __init__(self, model: Model, settings: Settings, needs: Needs, certified: bool = True) -> None:
        # A body of similar size has at most twelve neighbours, each pair counted once; arrays grow when that fails.
        n = len(model.bodies)
        room, candidates = 4 * n + 16, 8 * n + 64
        super().__init__(model, settings, needs, certified, POINTS * room)
        self._bodies = allocate_bodies(model, needs)
        self._detection = allocate_detection(model, candidates)
        self._manifolds = allocate_manifolds(room)
        self._memory = allocate_memory(room)
        self._sub = allocate_sub_step(n, room, allocate_meeting(self._bodies))
        self._world = allocate_world(self._bodies, room, candidates)
        self._laws = self._detection.restitution, self._detection.friction
        initialise(self._bodies)

    def step_problem(self) -> StepProblem:
        """Contact problem of the next step; the world stays what it is."""
        trial, found = self.copy(), -1
        if self._options.scheme != FIXED_STEP:
            trial._memory = trial._sub.past
            trial._detection.found[REMEMBERED] = trial._detection.found[PAST]
        while found < 0:
            found = pose_problem(trial._bodies, trial._detection, trial._manifolds, trial._memory, trial._options)
            if found < 0:
                trial._grow()
        return assemble(trial._bodies, trial._manifolds[:found])

    def _whole(self, sub: Any) -> Island:
        state = self._bodies, self._detection, self._manifolds, self._memory, self._problem
        return Island(*state, sub, self._ledger, self._options, self.tally)

    def _most_contacts(self) -> int:
        return max(POINTS * len(self._manifolds), len(self._ledger.real))

    def _write_found(self, buffer: Buffer) -> int:
        return int(copy_contacts(self._manifolds[: self._detection.found[MANIFOLDS]], buffer, 0))

    def _grow(self) -> None:
        """Double whatever was found too small; the step that stopped is made anew."""
        if self._detection.found[CANDIDATES] >= len(self._detection.boxes.candidate):
            self._detection = self._detection._replace(boxes=doubled(self._detection.boxes))
            self._world = allocate_world(self._bodies, len(self._memory), len(self._detection.boxes.candidate))
            return
        if self._ledger.used[0] + POINTS * self._detection.found[MANIFOLDS] > len(self._ledger.real):
            self._grow_ledger()
            return
        memory = allocate_memory(2 * len(self._memory))
        memory[: len(self._memory)] = self._memory
        self._memory = memory
        past = allocate_memory(max(len(memory), len(self._sub.past)))
        past[: len(self._sub.past)] = self._sub.past
        self._manifolds = allocate_manifolds(2 * len(self._manifolds))
        self._sub = self._sub._replace(kept=allocate_manifolds(len(self._manifolds)), past=past)
        self._world = allocate_world(self._bodies, len(memory), len(self._detection.boxes.candidate))
        self._problem = allocate_problem(3, len(self._bodies), self._most_contacts(), bool(self._options.direct))
