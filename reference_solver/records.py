"""What a simulation hands out: contacts of one step, and a recorded run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_solver.model import Array
from reference_solver.pieces import Indices, Pieces


@dataclass(frozen=True)
class Contacts:
    """k contacts as arrays, sorted by (body_a, body_b, feature).

    Parameters
    ----------
    body_a, body_b
        (k,) body indices, body_a < body_b.
    feature
        (k,) which features of the two shapes touch; the same number in the next step is the same contact.
    point
        (k, d) contact point at detection, world axes [m].
    normal
        (k, d) unit normal from A to B.
    impulse
        (k, d) impulse of the step on B, world axes [N s].
    gap
        (k,) separation at detection [m], < 0 is overlap.
    """

    body_a: Indices
    body_b: Indices
    feature: Indices
    point: Array
    normal: Array
    impulse: Array
    gap: Array

    def __len__(self) -> int:
        return len(self.gap)

    @classmethod
    def empty(cls, capacity: int, dimension: int) -> Contacts:
        """Return ``capacity`` contacts of zeros."""
        a, b, feature = (np.zeros(capacity, np.int64) for _ in range(3))
        point, normal, impulse = (np.zeros((capacity, dimension)) for _ in range(3))
        return cls(a, b, feature, point, normal, impulse, np.zeros(capacity))


@dataclass(frozen=True)
class Frames:
    """Samples of one run, the start state excluded.

    Parameters
    ----------
    pose, twist
        (s, n, 3 | 7) and (s, n, 3 | 6).
    offset
        (s + 1,): the contacts of sample s are rows ``offset[s]:offset[s + 1]`` of `contacts`.
    contacts
        Contacts of the last step before each sample; none if they were not asked for.
    """

    pose: Array
    twist: Array
    offset: Indices
    contacts: Contacts


def joined(parts: Sequence[Frames]) -> Frames:
    """Return the samples of consecutive runs as those of one."""
    ends = np.cumsum([0] + [part.offset[-1] for part in parts])
    offsets = [part.offset[1:] + end for part, end in zip(parts, ends, strict=False)]
    return Frames(
        np.concatenate([part.pose for part in parts]),
        np.concatenate([part.twist for part in parts]),
        np.concatenate([np.zeros(1, np.int64), *offsets]),
        joined_contacts([part.contacts for part in parts]),
    )


def joined_contacts(parts: Sequence[Contacts]) -> Contacts:
    """Return contacts one after the other."""
    return Contacts(*(np.concatenate([getattr(c, f.name) for c in parts]) for f in fields(Contacts)))


@dataclass(frozen=True)
class Record:
    """A recorded run, the start state included: ``t`` (s,) [s], then as in `Frames` with s samples.

    The start state carries no contacts (``offset[1] == 0``). ``certificates``, where asked for, holds for each name of
    ``Simulation.certificate`` the values (s,) of the steps since the sample before; zeros, and True, at the start.
    ``pieces``, where asked for, is what happened between the samples.
    """

    t: Array
    pose: Array
    twist: Array
    offset: Indices
    contacts: Contacts
    certificates: dict[str, NDArray[Any]] = field(default_factory=dict)
    pieces: Pieces | None = None
