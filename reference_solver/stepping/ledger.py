"""Contacts of a step with their impulses summed over its sub-steps, and the samples of a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.model import Array
from reference_solver.pieces import Indices
from reference_solver.records import Contacts
from reference_solver.structures import structure


@structure
class Ledger(NamedTuple):
    """Contacts of one step in d axes, sorted by (body_a, body_b, feature)."""

    used: Indices  # (1,): number of entries
    names: Indices  # (k, 3): body A, body B, feature
    real: Array  # (k, 3 d + 1): point, normal, impulse on B (world axes), gap


@structure
class Buffer(NamedTuple):
    """Samples of a run; `names` and `real`, as in `Ledger`, of length 0 where contacts are not recorded."""

    pose: Array  # (s, n, 3 | 7)
    twist: Array  # (s, n, 3 | 6)
    offset: Indices  # (s + 1,): first contact of each sample
    names: Indices
    real: Array


def allocate_ledger(dimension: int, capacity: int) -> Ledger:
    """Return room for ``capacity`` contacts."""
    return Ledger(np.zeros(1, np.int64), np.zeros((capacity, 3), np.int64), np.zeros((capacity, 3 * dimension + 1)))


def contacts_of(buffer: Buffer, count: int) -> Contacts:
    """Return copies of the first contacts of a buffer."""
    names, real = buffer.names[:count], buffer.real[:count]
    d = real.shape[1] // 3
    point, normal, impulse = (real[:, k : k + d].copy() for k in (0, d, 2 * d))
    body_a, body_b, feature = (names[:, k].copy() for k in range(3))
    return Contacts(body_a, body_b, feature, point, normal, impulse, real[:, 3 * d].copy())


@inner_kernel
def entry_of(ledger: Ledger, name: tuple[int, int, int]) -> tuple[int, bool]:
    """Entry of the contact of that name, and whether it is new: with neither geometry nor impulse yet.

    There must be room for one.
    """
    k = place_of(ledger, name)
    if k < ledger.used[0] and order(ledger, k, name) == 0:
        return k, False
    for j in range(ledger.used[0], k, -1):
        for d in range(3):
            ledger.names[j, d] = ledger.names[j - 1, d]
        for d in range(ledger.real.shape[1]):
            ledger.real[j, d] = ledger.real[j - 1, d]
    ledger.names[k, 0], ledger.names[k, 1], ledger.names[k, 2] = name
    for d in range(ledger.real.shape[1]):
        ledger.real[k, d] = 0.0
    ledger.used[0] += 1
    return k, True


@inner_kernel
def place_of(ledger: Ledger, name: tuple[int, int, int]) -> int:
    """First entry that does not come before the contact of that name: halving."""
    low, high = 0, ledger.used[0]
    while low < high:
        middle = (low + high) // 2
        if order(ledger, middle, name) < 0:
            low = middle + 1
        else:
            high = middle
    return low


@inner_kernel
def order(ledger: Ledger, k: int, name: tuple[int, int, int]) -> int:
    """Whether entry k comes before the contact of that name (-1), is the same (0), or comes after it (1)."""
    for d in range(3):
        if ledger.names[k, d] != name[d]:
            return -1 if ledger.names[k, d] < name[d] else 1
    return 0


@kernel
def copy_ledger(ledger: Ledger, buffer: Buffer, start: int) -> int:
    """Write the contacts of the last step from index ``start`` on; return how many."""
    for c in range(ledger.used[0]):
        for d in range(3):
            buffer.names[start + c, d] = ledger.names[c, d]
        for d in range(ledger.real.shape[1]):
            buffer.real[start + c, d] = ledger.real[c, d]
    return int(ledger.used[0])
