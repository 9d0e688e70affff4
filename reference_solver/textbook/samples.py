"""The samples of a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reference_solver.compilation import spliced_kernel
from reference_solver.model import Array
from reference_solver.pieces import Indices
from reference_solver.records import Contacts
from reference_solver.textbook.vectors import copy_vectors


class Buffer(NamedTuple):
    """Samples of a run; `names` and `real` of length 0 where contacts are not recorded."""

    pose: Array  # (s, n, 3 | 7)
    twist: Array  # (s, n, 3 | 6)
    offset: Indices  # (s + 1,): first contact of each sample
    names: Indices  # (k, 3): body A, body B, feature; sorted within a sample
    real: Array  # (k, 3 d + 1): point, normal, impulse on B (world axes), gap


def allocate_buffer(samples: int, pose: Array, twist: Array, contacts: int) -> Buffer:
    """Return room for a number of samples of such poses and twists, and for so many contacts in all of them."""
    dimension = 2 if pose.shape[1] == 3 else 3
    return Buffer(
        np.zeros((samples, *pose.shape)),
        np.zeros((samples, *twist.shape)),
        np.zeros(samples + 1, np.int64),
        np.zeros((contacts, 3), np.int64),
        np.zeros((contacts, 3 * dimension + 1)),
    )


def contacts_of(buffer: Buffer, count: int) -> Contacts:
    """Return copies of the first contacts of a buffer."""
    names, real = buffer.names[:count], buffer.real[:count]
    d = real.shape[1] // 3
    point, normal, impulse = (real[:, k : k + d].copy() for k in (0, d, 2 * d))
    body_a, body_b, feature = (names[:, k].copy() for k in range(3))
    return Contacts(body_a, body_b, feature, point, normal, impulse, real[:, 3 * d].copy())


@spliced_kernel
def lacks_room(buffer: Buffer, k: int, stride: int, most: int) -> bool:
    """Whether the sample after step k may not take the ``most`` contacts that there can be."""
    if stride == 0 or (k + 1) % stride > 0 or len(buffer.real) == 0:
        return False
    return bool(buffer.offset[k // stride] + most > len(buffer.real))


@spliced_kernel
def end_step(pose: Array, twist: Array, buffer: Buffer, k: int, stride: int) -> int:
    """Write poses and twists if a sample follows step k; its number if contacts are to follow, else -1."""
    if stride == 0 or (k + 1) % stride > 0:
        return -1
    s = (k + 1) // stride - 1
    copy_vectors(pose, buffer.pose[s])
    copy_vectors(twist, buffer.twist[s])
    buffer.offset[s + 1] = buffer.offset[s]
    return s if len(buffer.real) > 0 else -1
