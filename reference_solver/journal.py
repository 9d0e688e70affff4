"""Kernels that write the pieces of a run; for both dimensions (see `pieces.py`)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.pieces import BODIES, CONTACTS, PIECES, STEPS, Indices, Journal


@inner_kernel
def is_kept(journal: Journal) -> bool:
    """Whether anything is recorded."""
    return len(journal.time) > 0


@inner_kernel
def keep_state(journal: Journal, pose: Array, twist: Array) -> None:
    """Keep poses (n, P) and twists (n, V) as those before the piece that follows."""
    if len(journal.time) == 0:
        return
    for i in range(len(journal.pose)):
        for k in range(journal.pose.shape[1]):
            journal.pose[i, k] = pose[i, k]
        for k in range(journal.twist.shape[1]):
            journal.twist[i, k] = twist[i, k]


@inner_kernel
def open_piece(journal: Journal, begin: float, length: float, kind: int, scheme: int) -> None:
    """Begin a piece; its bodies and contacts follow."""
    k = journal.used[PIECES]
    journal.used[PIECES] += 1
    if k < len(journal.time):
        journal.time[k, 0], journal.time[k, 1] = begin, length
        journal.label[k, 0], journal.label[k, 1], journal.label[k, 2] = journal.used[STEPS], kind, scheme
        journal.label[k, 3], journal.label[k, 4] = journal.used[BODIES], journal.used[CONTACTS]


@inner_kernel
def enter_body(journal: Journal, i: int, number: int, pose: Array, twist: Array) -> None:
    """Enter body i, of that number in the world, from what `keep_state` kept to ``pose[i]`` and ``twist[i]``."""
    k = journal.used[BODIES]
    journal.used[BODIES] += 1
    if k < len(journal.body):
        p = journal.pose.shape[1]
        journal.body[k] = number
        for d in range(p):
            journal.before[k, d], journal.after[k, d] = journal.pose[i, d], pose[i, d]
        for d in range(journal.twist.shape[1]):
            journal.before[k, p + d], journal.after[k, p + d] = journal.twist[i, d], twist[i, d]


@inner_kernel
def enter_bodies(journal: Journal, numbers: Indices, pose: Array, twist: Array) -> None:
    """Enter all bodies by their ``numbers`` in the world."""
    for i in range(len(journal.pose)):
        enter_body(journal, i, numbers[i], pose, twist)


@inner_kernel
def next_contact(journal: Journal, a: int, b: int, feature: int) -> int:
    """Row of `wrench` to fill for a contact of the piece; -1 where there is no room."""
    k = journal.used[CONTACTS]
    journal.used[CONTACTS] += 1
    if k >= len(journal.name):
        return -1
    journal.name[k, 0], journal.name[k, 1], journal.name[k, 2] = a, b, feature
    return int(k)


@inner_kernel
def close_step(journal: Journal) -> None:
    """Count a step made."""
    journal.used[STEPS] += 1


@inner_kernel
def journal_part(journal: Journal, count: int) -> Journal:
    """The journal, with room for the states of the first ``count`` bodies."""
    return Journal(
        journal.used,
        journal.time,
        journal.label,
        journal.body,
        journal.before,
        journal.after,
        journal.name,
        journal.wrench,
        journal.pose[:count],
        journal.twist[:count],
    )
