"""Contacts that last through a force phase, and room for its integration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.model import Array

Indices = NDArray[np.int64]

#: Entries of `Lasting.size`: contacts, bodies, velocities per body, tangents per contact.
CONTACTS, BODIES, VELOCITIES, TANGENTS = 0, 1, 2, 3
SIZES = 4
#: Modes of a contact. OPEN: it parts. STICK: its tangents are held. SLIP: friction mu times the load against the slip.

OPEN, STICK, SLIP = 0, 1, 2
#: Rows of the dense matrix of a phase; islands with more rows are stepped by the impulse-level scheme.
MOST_ROWS = 96
#: Stages of the Dormand-Prince step.
STAGES = 7
#: Numbers that a dimension may keep of the features of a contact.
KINDS, PLACES = 8, 24


class Lasting(NamedTuple):
    """Contacts k of an island and its n bodies; V velocities, T tangents, P numbers of a pose, D axes."""

    size: Indices  # (SIZES,)
    body: Indices  # (k, 2): A, B
    row: Indices  # (k,): row of the dimension's table
    mode: Indices  # (k,): OPEN, STICK, SLIP
    kind: Indices  # (k, KINDS): which features, the dimension's own
    place: Array  # (k, PLACES): features in body axes, the dimension's own
    friction: Array  # (k,): mu
    noise: Array  # (k, 2): gap [m] and velocity [m/s] that are round-off
    gap: Array  # (k,) [m]
    frame: Array  # (k, 1 + T, D): normal, tangents, world axes
    jacobian: Array  # (k, 2, 1 + T, V): u = J_A v_A + J_B v_B
    response: Array  # (k, 2, 1 + T, V): rows of J M^-1
    speed: Array  # (k, 1 + T): u = J v [m/s]
    gamma: Array  # (k, 1 + T): (dJ/dt) v [m/s^2]
    force: Array  # (k, 1 + T): lambda [N]
    direction: Array  # (k, T): unit vector of the slip, where it slips
    impulse: Array  # (k, D): integral of the force on B over the phase, world axes [N s]
    work: Array  # (k, 2): work on the relative motion and of moving surfaces [J]
    base: Array  # (n, P): poses at the start of the phase
    before: Array  # (n, V): twists there
    displacement: Array  # (n, V): from there
    free: Array  # (n, V): accelerations without contacts
    acceleration: Array  # (n, V): with them
    rate: Array  # (STAGES, n, V): of the displacement
    slope: Array  # (STAGES, n, V): of the twist
    bend: Array  # (2, n, V): second derivative of the displacement at start and end
    matrix: Array  # (R, R): rows of the equalities, R at most MOST_ROWS
    factor: Array  # (R, R)
    right: Array  # (R,)
    answer: Array  # (R,)
    spare: Array  # (R,)
    order: Indices  # (R,)
    unknown: Indices  # (R, 2): contact and row (0 normal, 1.. tangents) of each equality
    monitor: Array  # (3, k, 4): what must not fall below zero, at the start, the near and the far end of the search


def allocate_lasting(dimension: int, bodies: int, contacts: int) -> Lasting:
    """Return room for phases of ``bodies`` bodies and ``contacts`` contacts."""
    n, k, v, t, p = bodies, contacts, 3 * (dimension - 1), dimension - 1, 3 if dimension == 2 else 7
    r = min(k * (1 + t), MOST_ROWS)
    return Lasting(
        size=np.array([0, n, v, t], np.int64),
        body=np.zeros((k, 2), np.int64),
        row=np.zeros(k, np.int64),
        mode=np.zeros(k, np.int64),
        kind=np.zeros((k, KINDS), np.int64),
        place=np.zeros((k, PLACES)),
        friction=np.zeros(k),
        noise=np.zeros((k, 2)),
        gap=np.zeros(k),
        frame=np.zeros((k, 1 + t, dimension)),
        jacobian=np.zeros((k, 2, 1 + t, v)),
        response=np.zeros((k, 2, 1 + t, v)),
        speed=np.zeros((k, 1 + t)),
        gamma=np.zeros((k, 1 + t)),
        force=np.zeros((k, 1 + t)),
        direction=np.zeros((k, t)),
        impulse=np.zeros((k, dimension)),
        work=np.zeros((k, 2)),
        base=np.zeros((n, p)),
        before=np.zeros((n, v)),
        displacement=np.zeros((n, v)),
        free=np.zeros((n, v)),
        acceleration=np.zeros((n, v)),
        rate=np.zeros((STAGES, n, v)),
        slope=np.zeros((STAGES, n, v)),
        bend=np.zeros((2, n, v)),
        matrix=np.zeros((r, r)),
        factor=np.zeros((r, r)),
        right=np.zeros(r),
        answer=np.zeros(r),
        spare=np.zeros(r),
        order=np.zeros(r, np.int64),
        unknown=np.zeros((r, 2), np.int64),
        monitor=np.zeros((3, k, 4)),
    )
