"""What the worlds of both dimensions share: running, sampling, room that grows (interface: ``simulation.py``)."""

from __future__ import annotations

from copy import copy
from typing import Any, Self

import numpy as np

from reference_solver.direct.problem import allocate_problem
from reference_solver.model import Array, Model
from reference_solver.needs import Needs
from reference_solver.records import Contacts, Frames
from reference_solver.settings import Settings
from reference_solver.tally import new_tally
from reference_solver.textbook.options import options, uses_direct
from reference_solver.textbook.samples import Buffer, allocate_buffer, contacts_of


class SteppedWorld:
    """One model being stepped; a dimension adds its arrays, and how they grow."""

    #: Contacts a body that there is room for in a sample, before it is known how many are needed.
    typical: int

    _bodies: Any
    #: Tables of the laws of pairs: nothing writes to them.
    _laws: tuple[Array, Array]

    def __init__(self, model: Model, settings: Settings, needs: Needs, certified: bool, contacts: int) -> None:
        n, d = len(model.bodies), model.dimension
        self._options = options(settings, needs, certified)
        self._problem = allocate_problem(d, n, contacts, uses_direct(settings))
        self.tally = new_tally()

    @property
    def pose(self) -> Array:
        """Current poses (n, 3 | 7)."""
        return np.asarray(self._bodies.pose)

    @property
    def twist(self) -> Array:
        """Current twists (n, 3 | 6)."""
        return np.asarray(self._bodies.twist)

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Make ``steps`` steps, sampling after every ``stride`` (0: never)."""
        samples = steps // stride if stride else 0
        # At most a million rows (100 MB) before it is known that they are needed.
        room = self._most_contacts() + min(self.typical * samples * len(self.pose), 1_000_000) if contacts else 0
        buffer = allocate_buffer(samples, self.pose, self.twist, room)
        done = 0
        while True:
            done = self._run(buffer, done, steps, stride)
            if done == steps:
                break
            if contacts and buffer.offset[done // stride] + self._most_contacts() > len(buffer.real):
                buffer = self._doubled(buffer)
            else:
                self._grow()
        return Frames(buffer.pose, buffer.twist, buffer.offset, contacts_of(buffer, int(buffer.offset[-1])))

    def contacts(self) -> Contacts:
        """Contacts of the last step."""
        buffer = allocate_buffer(0, self.pose, self.twist, self._most_contacts())
        return contacts_of(buffer, self._write_found(buffer))

    def copy(self) -> Self:
        """Return a world of its own in the same state.

        Tables are shared: nothing writes to them, and a copy of one with strides of zero would be one number per pair,
        and of another type, for which all kernels would be compiled anew. So is the table of pivots, up to 8 MB of
        which nothing outlasts a solve.
        """
        other, known = copy(self), {id(table): table for table in (*self._laws, self._problem.table)}
        for name, value in vars(self).items():
            setattr(other, name, _copied(value, known))
        return other

    def _run(self, buffer: Buffer, done: int, steps: int, stride: int) -> int:
        """Make steps ``done`` .. ``steps`` - 1; return the number made, fewer where an array must grow."""
        raise NotImplementedError

    def _most_contacts(self) -> int:
        """Contacts that there is room for."""
        raise NotImplementedError

    def _write_found(self, buffer: Buffer) -> int:
        """Write the contacts of the last step; return how many."""
        raise NotImplementedError

    def _grow(self) -> None:
        """Double whatever was found too small; the step that stopped is made anew."""
        raise NotImplementedError

    def _doubled(self, buffer: Buffer) -> Buffer:
        """Twice the room for contacts, and what has been recorded so far."""
        room = 2 * (len(buffer.real) + self._most_contacts())
        bigger = allocate_buffer(len(buffer.pose), self.pose, self.twist, room)
        for old, new in zip(buffer, bigger, strict=True):
            new[: len(old)] = old
        return bigger


def _copied(value: Any, known: dict[int, Array]) -> Any:
    """Structures of arrays with arrays of their own, once each; ``known``: what stands for an array, by its identity.

    `copy.deepcopy`, which asks each entry what it is, takes longer.
    """
    if isinstance(value, np.ndarray):
        if id(value) not in known:
            known[id(value)] = value.copy(order="K")
        return known[id(value)]
    if isinstance(value, tuple):
        parts = [_copied(part, known) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value
