"""The spatial world: arrays of one model and the calls into compiled code (interface: ``simulation.py``)."""

from __future__ import annotations

import numpy as np

from reference_solver.model import Array, Model
from reference_solver.needs import Needs
from reference_solver.planar.state import Buffer, options
from reference_solver.records import Contacts, Frames
from reference_solver.settings import Settings
from reference_solver.spatial.motion import initialise
from reference_solver.spatial.state import (
    CANDIDATES,
    MANIFOLDS,
    POINTS,
    allocate_bodies,
    allocate_manifolds,
    allocate_pairs,
    grown,
)
from reference_solver.spatial.step import copy_contacts, run_steps
from reference_solver.tally import new_tally


class World:
    """One spatial model being stepped; see the interface in ``simulation.py``."""

    def __init__(self, model: Model, settings: Settings, needs: Needs) -> None:
        n = len(model.bodies)
        self._bodies = allocate_bodies(model, needs)
        # A body of similar size has at most twelve neighbours, each pair counted once; arrays grow when that fails.
        self._pairs = allocate_pairs(model, 8 * n + 64)
        self._manifolds = allocate_manifolds(4 * n + 16)
        self._options = options(settings, needs)
        self.tally = new_tally()
        initialise(self._bodies)

    @property
    def pose(self) -> Array:
        """Current poses (n, 7)."""
        return self._bodies.pose

    @property
    def twist(self) -> Array:
        """Current twists (n, 6)."""
        return self._bodies.twist

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Make ``steps`` steps, sampling after every ``stride`` (0: never)."""
        samples = steps // stride if stride else 0
        room = self._room_of_a_sample() + POINTS * samples if contacts else 0
        buffer = self._buffer(samples, room)
        done = 0
        while True:
            done = run_steps(
                self._bodies, self._pairs, self._manifolds, self._options, self.tally, buffer, done, steps, stride
            )
            if done == steps:
                break
            buffer = self._grow(buffer)
        used = int(buffer.offset[-1])
        return Frames(buffer.pose, buffer.twist, buffer.offset, _contacts(buffer, used))

    def contacts(self) -> Contacts:
        """Contacts of the last step."""
        buffer = self._buffer(0, POINTS * int(self._manifolds.count[MANIFOLDS]))
        count = copy_contacts(self._manifolds, buffer, 0)
        return _contacts(buffer, count)

    def _room_of_a_sample(self) -> int:
        return POINTS * len(self._manifolds.body_a)

    def _buffer(self, samples: int, room: int) -> Buffer:
        n = len(self._bodies.motion)
        rows = Contacts.empty(room, 3)
        columns = (rows.body_a, rows.body_b, rows.feature, rows.point, rows.normal, rows.impulse, rows.gap)
        return Buffer(np.zeros((samples, n, 7)), np.zeros((samples, n, 6)), np.zeros(samples + 1, np.int64), *columns)

    def _grow(self, buffer: Buffer) -> Buffer:
        """Double whatever may have been too small."""
        if self._manifolds.count[CANDIDATES] >= len(self._pairs.candidate):
            room = np.zeros(2 * len(self._pairs.candidate), np.int64)
            self._pairs = self._pairs._replace(candidate=room)
        self._manifolds = grown(self._manifolds)
        if len(buffer.gap) == 0:
            return buffer
        bigger = self._buffer(len(buffer.pose), 2 * (len(buffer.gap) + self._room_of_a_sample()))
        for old, new in zip(buffer, bigger, strict=True):
            new[: len(old)] = old
        return bigger


def _contacts(buffer: Buffer, count: int) -> Contacts:
    columns = (buffer.body_a, buffer.body_b, buffer.feature, buffer.point, buffer.normal, buffer.impulse, buffer.gap)
    return Contacts(*(np.array(column[:count]) for column in columns))
