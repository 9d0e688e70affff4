"""The planar world: arrays of one model, and how they grow (interface: ``simulation.py``)."""

from __future__ import annotations

from typing import Any

from reference_solver.compilation import config
from reference_solver.direct.problem import allocate_problem
from reference_solver.model import Model
from reference_solver.needs import ALL_PAIRS_LIMIT, Needs
from reference_solver.planar.meeting import allocate_meeting
from reference_solver.planar.problem import assemble, pose_problem
from reference_solver.planar.state import (
    CANDIDATES,
    CONTACTS,
    Bodies,
    Island,
    Rows,
    allocate_bodies,
    allocate_pairs,
    allocate_rows,
    allocate_sub_step,
    allocate_world,
    grown,
)
from reference_solver.planar.step import copy_contacts
from reference_solver.settings import Settings
from reference_solver.step_problem import StepProblem
from reference_solver.stepping.broadphase import doubled
from reference_solver.stepping.lasting import allocate_lasting
from reference_solver.stepping.ledger import Buffer
from reference_solver.stepping.options import FIXED_STEP
from reference_solver.stepping.world import SteppedWorld


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
        self._rows = allocate_rows(room, n if wide else 0)
        self._sub = allocate_sub_step(n, room, allocate_meeting(self._bodies))
        self._world = allocate_world(self._bodies, room)
        self._laws = self._pairs.restitution, self._pairs.friction

    def opened(self, contacts: int) -> tuple[Bodies, Rows]:
        """Arrays to write a state into, with room for ``contacts`` to remember."""
        while contacts > len(self._rows.old_key):
            self._grow_rows()
        return self._bodies, self._rows

    def step_problem(self) -> StepProblem:
        """Contact problem of the next step, as a fixed step poses it; the world stays what it is."""
        trial = self.copy()
        trial._options = self._options._replace(scheme=FIXED_STEP)
        while not pose_problem(trial._bodies, trial._pairs, trial._rows, trial._options):
            trial._grow()
        return assemble(trial._bodies, trial._rows, trial._options)

    def _whole(self, sub: Any) -> Island:
        state = self._bodies, self._pairs, self._rows, self._problem
        return Island(*state, sub, self._ledger, self._options, self.tally)

    def _most_contacts(self) -> int:
        return max(len(self._rows.real), len(self._ledger.real))

    def _write_found(self, buffer: Buffer) -> int:
        return int(copy_contacts(self._rows, buffer, 0))

    def _grow(self) -> None:
        """Double whatever was found too small; the step that stopped goes on from where it was."""
        if self._rows.counts[CANDIDATES] >= len(self._pairs.boxes.candidate):
            self._pairs = self._pairs._replace(boxes=doubled(self._pairs.boxes))
            self._world = allocate_world(self._bodies, len(self._pairs.boxes.candidate))
        elif self._ledger.used[0] + self._rows.counts[CONTACTS] > len(self._ledger.real):
            self._grow_ledger()
        else:
            self._grow_rows()

    def _grow_rows(self) -> None:
        self._rows = grown(self._rows)
        self._sub = self._sub._replace(lasting=allocate_lasting(2, len(self.pose), len(self._rows.real)))
        self._problem = allocate_problem(2, len(self.pose), len(self._rows.real), bool(self._options.direct))
