"""What a run did, piece by piece: the record that an audit reads.

A *piece* is an impact, at one instant, or a force phase, over a time; pieces of bodies that do not touch each other
may overlap in time. Of each piece stand here: when it began and how long it was, what it was and by which scheme, of
each of its bodies pose and twist before and after, and of each of its contacts place, normal, and the impulse with its
moment about the world's origin (levers may turn within a piece, so that point times impulse need not be the moment).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.model import POSE_SIZE, TWIST_SIZE, Array

Indices = NDArray[np.int64]

#: What a piece is: a force phase; an impact.
FORCES, IMPACT = 0, 1
#: By which scheme: constant acceleration (E19), in steps where rows turn (E35), until two bodies that rock rest on
#: each other (E22). CHAIN: an impact that is the sum of all those to come, which have no end (E22).
FROZEN, TURNING, ROCKING, CHAIN = 0, 1, 2, 3


class Journal(NamedTuple):
    """The pieces of some steps as rows of arrays."""

    steps: int
    time: Array  # (p, 2): begin, counted from the start of its step, and length [s]
    label: Indices  # (p, 5): step, kind, scheme, first body row, first contact row
    body: Indices  # (k,): number of the body
    before: Array  # (k, P + V): pose and twist
    after: Array  # (k, P + V)
    name: Indices  # (c, 3): body A, body B, feature
    wrench: Array  # (c, 3 d + M): point [m], normal, impulse on B [N s], its moment about the origin [N m s]; M = 1 | 3


def empty_journal(dimension: int) -> Journal:
    """Return what no steps leave."""
    p, v, d = POSE_SIZE[dimension], TWIST_SIZE[dimension], dimension
    return Journal(
        steps=0,
        time=np.zeros((0, 2)),
        label=np.zeros((0, 5), np.int64),
        body=np.zeros(0, np.int64),
        before=np.zeros((0, p + v)),
        after=np.zeros((0, p + v)),
        name=np.zeros((0, 3), np.int64),
        wrench=np.zeros((0, 3 * d + v - d)),
    )


@dataclass(frozen=True)
class Pieces:
    """p pieces of a run, in the order in which they were made.

    Parameters
    ----------
    step
        (p,) number of the step, counted from the start of the simulation.
    begin, length
        (p,) when the piece began, and how long it was [s]; 0 for an impact.
    kind, scheme
        (p,) see ``FORCES`` .. and ``FROZEN`` .. in this file.
    first_body, first_contact
        (p + 1,): bodies of piece k are rows ``first_body[k]:first_body[k + 1]`` of the arrays of bodies, likewise
        its contacts.
    body
        (m,) number of the body.
    pose_before, pose_after
        (m, 3 | 7).
    twist_before, twist_after
        (m, 3 | 6).
    body_a, body_b, feature
        (c,) as in `Contacts`.
    point, normal
        (c, d) world axes, at the start of the piece [m].
    impulse
        (c, d) of the piece, on B, world axes [N s].
    moment
        (c, 1 | 3) of that impulse about the world's origin [N m s].
    """

    step: Indices
    begin: Array
    length: Array
    kind: Indices
    scheme: Indices
    first_body: Indices
    first_contact: Indices
    body: Indices
    pose_before: Array
    twist_before: Array
    pose_after: Array
    twist_after: Array
    body_a: Indices
    body_b: Indices
    feature: Indices
    point: Array
    normal: Array
    impulse: Array
    moment: Array

    def __len__(self) -> int:
        return len(self.begin)


def pieces_of(journals: list[Journal], dimension: int, dt: float, first_step: int) -> Pieces:
    """Return what consecutive journals hold as one record; steps of ``dt`` [s] are counted from ``first_step``."""
    d, p = dimension, POSE_SIZE[dimension]
    time, label, body, before, after, name, wrench = map(np.concatenate, list(zip(*journals, strict=True))[1:])
    starts = np.cumsum([[0, 0, 0], *((j.steps, len(j.body), len(j.name)) for j in journals)], axis=0)
    label[:, [0, 3, 4]] += np.repeat(starts[:-1], [len(j.time) for j in journals], axis=0)
    step = label[:, 0] + first_step
    return Pieces(
        step=step,
        begin=step * dt + time[:, 0],
        length=time[:, 1].copy(),
        kind=label[:, 1].copy(),
        scheme=label[:, 2].copy(),
        first_body=np.append(label[:, 3], starts[-1, 1]),
        first_contact=np.append(label[:, 4], starts[-1, 2]),
        body=body,
        pose_before=before[:, :p].copy(),
        twist_before=before[:, p:].copy(),
        pose_after=after[:, :p].copy(),
        twist_after=after[:, p:].copy(),
        body_a=name[:, 0].copy(),
        body_b=name[:, 1].copy(),
        feature=name[:, 2].copy(),
        point=wrench[:, :d].copy(),
        normal=wrench[:, d : 2 * d].copy(),
        impulse=wrench[:, 2 * d : 3 * d].copy(),
        moment=wrench[:, 3 * d :].copy(),
    )
