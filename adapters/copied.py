"""Readings of a run in the engine's own terms, copied step by step and converted many at once.

    advance -> copy_pose, copy_twist, copy_contacts -> advance -> ...     then once:  poses_of, twists_of, contacts_of

A conversion of one state by numpy takes longer than a step of most engines, one of a hundred hardly longer than of one.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array, Contacts, Recorded, Simulation
from adapters.stages import READING, stage


class Copied(Simulation):
    """A simulation that is read by copies, whose own form only the adapter knows; `pose` is the pose of one copy."""

    @abstractmethod
    def copy_pose(self) -> Any:
        """Numbers of which `poses_of` makes this instant's poses; not the engine's own arrays, which change."""

    @abstractmethod
    def poses_of(self, copies: Sequence[Any]) -> Array:
        """Poses of s copies, (s, n, 3 | 7)."""

    @abstractmethod
    def copy_twist(self) -> Any:
        """Numbers of which `twists_of` makes this instant's twists."""

    @abstractmethod
    def twists_of(self, copies: Sequence[Any]) -> Array:
        """Twists of s copies, (s, n, 3 | 6)."""

    @abstractmethod
    def copy_contacts(self) -> Any:
        """What `contacts_of` makes contacts of, with the impulses of the last step."""

    @abstractmethod
    def contacts_of(self, copies: Sequence[Any]) -> tuple[NDArray[np.int64], Contacts]:
        """Number of contacts in each of s copies, (s,), and the contacts of all in that order."""

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        return self.poses_of([self.copy_pose()])[0]

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        return self.twists_of([self.copy_twist()])[0]

    def contacts(self) -> Contacts:
        """See `Simulation.contacts`."""
        return self.contacts_of([self.copy_contacts()])[1]

    def record(self, samples: int, stride: int, contacts: bool) -> Recorded:
        """See `Simulation.record`."""
        poses, twists, touched = [], [], []
        reading = stage(READING)
        for _ in range(samples):
            self.advance(stride)
            with reading:
                poses.append(self.copy_pose())
                twists.append(self.copy_twist())
                if contacts:
                    touched.append(self.copy_contacts())
        with reading:
            counts, rows = self.contacts_of(touched) if contacts else (np.zeros(samples, np.int64), None)
            return Recorded(self.poses_of(poses), self.twists_of(twists), counts, rows)
