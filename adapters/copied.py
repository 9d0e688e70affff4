"""Readings of a run in the engine's own terms, copied step by step and converted many at once.

    advance -> copy_pose, copy_twist, copy_contacts -> advance -> ...     then once:  poses_of, twists_of, contacts_of

A conversion of one state by numpy takes longer than a step of most engines, one of a hundred hardly longer than of one.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array, Contacts, Recorded, Simulation
from adapters.scene import Scene
from adapters.stages import READING, stage

#: Largest other component of a unit normal along an axis in single precision.
ALONG = 1e-5


class Copied(Simulation):
    """A simulation that is read by copies, whose own form only the adapter knows; `pose` is the pose of one copy.

    Here a copy of poses or twists is a list of numbers, body by body, and one of contacts a list of rows
    ``(i, j, *point, *normal, *impulse, gap)`` as of `engine.Row`; adapters with other copies convert them.
    """

    scene: Scene
    #: Whether contacts are read after the next steps; adapters need not observe them otherwise.
    observed = True

    @abstractmethod
    def copy_pose(self) -> Any:
        """Numbers of which `poses_of` makes this instant's poses; not the engine's own arrays, which change."""

    def poses_of(self, copies: Sequence[Any]) -> Array:
        """Poses of s copies, (s, n, 3 | 7)."""
        return np.array(copies, float).reshape(len(copies), len(self.scene.bodies), -1)

    @abstractmethod
    def copy_twist(self) -> Any:
        """Numbers of which `twists_of` makes this instant's twists."""

    def twists_of(self, copies: Sequence[Any]) -> Array:
        """Twists of s copies, (s, n, 3 | 6)."""
        return np.array(copies, float).reshape(len(copies), len(self.scene.bodies), -1)

    @abstractmethod
    def copy_contacts(self) -> Any:
        """What `contacts_of` makes contacts of, with the impulses of the last step."""

    def contacts_of(self, copies: Sequence[Any]) -> tuple[NDArray[np.int64], Contacts]:
        """Number of contacts in each of s copies, (s,), and the contacts of all in that order, here sorted by pair."""
        counts = np.array([len(rows) for rows in copies], np.int64)
        told = np.array(list(chain.from_iterable(copies)), float).reshape(-1, 3 + 3 * self.scene.dimension)
        return counts, by_pair(counts, told)

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        pose: Array = self.poses_of([self.copy_pose()])[0]
        return pose

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        twist: Array = self.twists_of([self.copy_twist()])[0]
        return twist

    def contacts(self) -> Contacts:
        """See `Simulation.contacts`."""
        return self.contacts_of([self.copy_contacts()])[1]

    def record(self, samples: int, stride: int, contacts: bool) -> Recorded:
        """See `Simulation.record`."""
        poses, twists, touched = [], [], []
        self.observed = contacts
        reading = stage(READING)
        for _ in range(samples):
            self.advance(stride)
            with reading:
                poses.append(self.copy_pose())
                twists.append(self.copy_twist())
                if contacts:
                    touched.append(self.copy_contacts())
        self.observed = True
        with reading:
            counts, rows = self.contacts_of(touched) if contacts else (np.zeros(samples, np.int64), None)
            return Recorded(self.poses_of(poses), self.twists_of(twists), counts, rows)


def by_pair(counts: NDArray[np.int64], told: Array) -> Contacts:
    """Contacts sorted by pair within each of s samples; those of a pair stay in their order.

    Parameters
    ----------
    counts
        Number of contacts in each sample, (s,).
    told
        Rows of `Copied`, (k, 3 + 3 d).
    """
    i, j = told[:, :2].astype(np.int64).T
    order = np.lexsort((np.maximum(i, j), np.minimum(i, j), np.repeat(np.arange(len(counts)), counts)))
    point, normal, impulse = np.split(told[order, 2:-1], 3, axis=1)
    return Contacts.turned(i[order], j[order], point, normal, impulse, told[order, -1])


def along_normal(impulse: float, normal: Sequence[float], rough: bool) -> list[float]:
    """Known part of an impulse [N s] where an engine reports only the part along the ``normal`` (d,).

    Without friction that is all of it. For a ``rough`` contact the components across the normal are unknown (NaN);
    where the normal is not along an axis, all are.
    """
    return [math.nan if rough and abs(n) <= 1.0 - ALONG else impulse * n for n in normal]
