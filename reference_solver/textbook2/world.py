"""The planar world: arrays of one model, and how they grow (interface: ``simulation.py``)."""

from __future__ import annotations

from reference_solver.compilation import config
from reference_solver.direct.problem import allocate_problem
from reference_solver.model import Model
from reference_solver.needs import ALL_PAIRS_LIMIT, Needs
from reference_solver.settings import Settings
from reference_solver.step_problem import StepProblem
from reference_solver.textbook.broadphase import doubled
from reference_solver.textbook.samples import Buffer
from reference_solver.textbook.world import SteppedWorld
from reference_solver.textbook2.problem import assemble, pose_problem
from reference_solver.textbook2.state import (
    CANDIDATES,
    Plane,
    allocate_bodies,
    allocate_pairs,
    allocate_rows,
    allocate_wide,
    grown,
)
from reference_solver.textbook2.step import copy_contacts, run


class World(SteppedWorld):
    """One planar model being stepped; see the interface in ``simulation.py``."""

    typical = 2

    def __init__(self, model: Model, settings: Settings, needs: Needs, certified: bool = True) -> None:
        # A body of similar size has at most six neighbours, each pair counted once; arrays grow when that fails.
        n = len(model.bodies)
        room = 8 * n + 64
        super().__init__(model, settings, needs, certified, room)
        self._bodies = allocate_bodies(model, needs)
        self._pairs = allocate_pairs(model, room)
        wide = settings.is_textbook and n > ALL_PAIRS_LIMIT and not config.DISABLE_JIT
        self._rows = allocate_rows(room)
        self._wide = allocate_wide(n if wide else 0, room if wide else 0)
        self._laws = self._pairs.restitution, self._pairs.friction

    def step_problem(self) -> StepProblem:
        """Contact problem of the next step; the world stays what it is."""
        trial = self.copy()
        while not pose_problem(trial._bodies, trial._pairs, trial._rows, trial._options):
            trial._grow()
        return assemble(trial._bodies, trial._rows, trial._options)

    def _run(self, buffer: Buffer, done: int, steps: int, stride: int) -> int:
        plane = Plane(self._bodies, self._pairs, self._rows, self._wide, self._problem, self._options, self.tally)
        return int(run(plane, buffer, done, steps, stride))

    def _most_contacts(self) -> int:
        return len(self._rows.real)

    def _write_found(self, buffer: Buffer) -> int:
        return int(copy_contacts(self._rows, buffer, 0))

    def _grow(self) -> None:
        """Double whatever was found too small; the step that stopped is made anew."""
        if self._rows.counts[CANDIDATES] >= len(self._pairs.boxes.candidate):
            self._pairs = self._pairs._replace(boxes=doubled(self._pairs.boxes))
        else:
            self._grow_rows()

    def _grow_rows(self) -> None:
        self._rows = grown(self._rows)
        n = len(self._wide.last)
        self._wide = allocate_wide(n, len(self._rows.real) if n else 0)
        self._problem = allocate_problem(2, len(self.pose), len(self._rows.real), bool(self._options.direct))
