"""The spatial world: arrays of one model, and how they grow (interface: ``simulation.py``)."""

from __future__ import annotations

from reference_solver.direct.problem import allocate_problem
from reference_solver.model import Model
from reference_solver.needs import Needs
from reference_solver.settings import Settings
from reference_solver.step_problem import StepProblem
from reference_solver.textbook.broadphase import doubled
from reference_solver.textbook.samples import Buffer
from reference_solver.textbook.world import SteppedWorld
from reference_solver.textbook3.motion import initialise
from reference_solver.textbook3.problem import assemble, pose_problem
from reference_solver.textbook3.state import (
    CANDIDATES,
    MANIFOLDS,
    POINTS,
    Space,
    allocate_bodies,
    allocate_detection,
    allocate_manifolds,
    allocate_memory,
)
from reference_solver.textbook3.step import copy_contacts, run


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
        self._laws = self._detection.restitution, self._detection.friction
        initialise(self._bodies)

    def step_problem(self) -> StepProblem:
        """Contact problem of the next step; the world stays what it is."""
        trial, found = self.copy(), -1
        while found < 0:
            found = pose_problem(trial._bodies, trial._detection, trial._manifolds, trial._memory, trial._options)
            if found < 0:
                trial._grow()
        return assemble(trial._bodies, trial._manifolds[:found])

    def _run(self, buffer: Buffer, done: int, steps: int, stride: int) -> int:
        arrays = self._bodies, self._detection, self._manifolds, self._memory, self._problem
        return int(run(Space(*arrays, self._options, self.tally), buffer, done, steps, stride))

    def _most_contacts(self) -> int:
        return POINTS * len(self._manifolds)

    def _write_found(self, buffer: Buffer) -> int:
        return int(copy_contacts(self._manifolds[: self._detection.found[MANIFOLDS]], buffer, 0))

    def _grow(self) -> None:
        """Double whatever was found too small; the step that stopped is made anew."""
        if self._detection.found[CANDIDATES] >= len(self._detection.boxes.candidate):
            self._detection = self._detection._replace(boxes=doubled(self._detection.boxes))
            return
        memory = allocate_memory(2 * len(self._memory))
        memory[: len(self._memory)] = self._memory
        self._memory = memory
        self._manifolds = allocate_manifolds(2 * len(self._manifolds))
        self._problem = allocate_problem(3, len(self._bodies), self._most_contacts(), bool(self._options.direct))
