"""Contacts that last through a force phase, and room for its integration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.model import Array
from reference_solver.settings import ACCURACY
from reference_solver.structures import structure

Indices = NDArray[np.int64]

#: Entries of `Lasting.size`: contacts, bodies, velocities per body, tangents per contact.
CONTACTS, BODIES, VELOCITIES, TANGENTS = 0, 1, 2, 3
#: Modes of a contact. OPEN: it parts. STICK: its tangents are held. SLIP: friction mu times the load against the slip.
OPEN, STICK, SLIP = 0, 1, 2
#: Rows of the dense matrix of a phase, such as five boxes turned against each other that stick in eight points each;
#: islands with more rows are stepped by the impulse-level scheme.
MOST_ROWS = 128
#: Values of `Lasting.parts`: parts at the start of the phase, by noise; its features have ended.
HOPS, GONE = 1, 2
#: Contacts of a phase: each pressed one has a row at least.
MOST_CONTACTS = MOST_ROWS
#: Entries of `Lasting.monitor`: load, friction left, slip onward, and from `FEATURE` on how far the contact is from
#: each end of its features (`operations.feature_limits`): what comes over an edge starts at one, and may pass another.
LOAD, GRIP, ONWARD, FEATURE = 0, 1, 2, 3
#: Ends of the features of a contact by dimension. In the plane: both of an edge, two normals at each of two corners; in
#: space: both ends, or the normal of a face, along each body axis.
LIMITS = {2: 4, 3: 12}
#: Places in `Lasting.monitor`: start of the phase; near and far end of a search; the step made last; its stages.
START, NEAR, FAR, LAST, BETWEEN = 0, 1, 2, 3, 4
PLACES_WATCHED = 5
#: Stages of the Dormand-Prince step.
STAGES = 7
#: Numbers that a dimension may keep of the features of a contact.
KINDS, PLACES = 8, 24


@structure
class Lasting(NamedTuple):
    """Contacts k of an island and its n bodies; V velocities, T tangents, P numbers of a pose, D axes."""

    size: Indices  # (4,)
    body: Indices  # (k, 2): A, B
    row: Indices  # (k,): row of the dimension's table
    mode: Indices  # (k,): OPEN, STICK, SLIP
    kind: Indices  # (k, KINDS): which features, the dimension's own
    place: Array  # (k, PLACES): features in body axes, the dimension's own
    friction: Array  # (k,): mu
    parts: Indices  # (k,): HOPS or GONE, else 0
    slides: Indices  # (k,): 1 where it slips at the start of the phase, 0 where it may begin to
    speeds: Array  # (k,): reference speed [m/s], `noise.NOISE` of which is round-off
    extent: Array  # (k,): smaller half width of its bodies [m]
    scale: Array  # (k,): size of the accelerations that meet in its rows [m/s^2]
    usual: Array  # (k, 1 + T): forces at the start of the phase, from which redundant ones are told [N]
    gap: Array  # (k,) [m]
    frame: Array  # (k, 1 + T, D): normal, tangents, world axes
    normal: Array  # (k, D): at the start of the phase
    jacobian: Array  # (k, 2, 1 + T, V): u = J_A v_A + J_B v_B
    response: Array  # (k, 2, 1 + T, V): rows of J M^-1
    speed: Array  # (k, 1 + T): u = J v [m/s]
    gamma: Array  # (k, 1 + T): (dJ/dt) v [m/s^2]
    force: Array  # (k, 1 + T): lambda [N]
    direction: Array  # (k, T): unit vector of the slip, where it slips
    turned: Indices  # (k,): 1 where it was turned for a slow slip since forces were found, else 0
    begun: Array  # (k, T): the same at the start of the phase
    impulse: Array  # (k, D): integral of the force on B over the phase, world axes [N s]
    moment: Array  # (k, V - D): of it about the world's origin [N m s]
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
    other: Array  # (R,)
    weight: Array  # (R,)
    wanted: Array  # (T,)
    gives: Array  # (1 + T, 1 + T): how a contact yields to forces along its rows while all others hold on [1/kg]
    yields: Array  # (k, 1 + T, 1 + T): the same of each contact of which it has been asked in the step being made
    asked: Indices  # (k,): 1 where it has been, else 0
    order: Indices  # (R,)
    filled: Indices  # (R,): columns of a row that are not zero
    change: Array  # (V,): of the velocities of a body by a unit of force
    label: Indices  # (n,): lowest body of the cluster that contacts hold together
    unknown: Indices  # (R, 2): contact and row (0 normal, 1.. tangents) of each equality
    monitor: Array  # (PLACES_WATCHED, k, FEATURE + LIMITS): what must not fall below zero while modes are held
    length: Array  # (1,): of the step being made [s]
    accuracy: Array  # (1,): `Settings.accuracy`
    error: Array  # (1,): of the step made last over it, see `phase.relative_error`
    early: Array  # (1,): share of a step after which a stage found a monitor below zero, 1 if none did
    lenient: Array  # (1,): 1 where a slip that is all but nothing may be projected away
    spin: Array  # (V,)
    trial: Array  # (k, 2, 1 + T, V): rows at the start of a path


def allocate_lasting(dimension: int, bodies: int, contacts: int) -> Lasting:
    """Return room for phases of ``bodies`` bodies and ``contacts`` contacts."""
    n, k, v, t, p = bodies, min(contacts, MOST_CONTACTS), 3 * (dimension - 1), dimension - 1, 3 if dimension == 2 else 7
    r = min(k * (1 + t), MOST_ROWS)
    return Lasting(
        size=np.array([0, n, v, t], np.int64),
        body=np.zeros((k, 2), np.int64),
        row=np.zeros(k, np.int64),
        mode=np.zeros(k, np.int64),
        kind=np.zeros((k, KINDS), np.int64),
        place=np.zeros((k, PLACES)),
        friction=np.zeros(k),
        parts=np.zeros(k, np.int64),
        slides=np.zeros(k, np.int64),
        speeds=np.zeros(k),
        extent=np.zeros(k),
        scale=np.zeros(k),
        usual=np.zeros((k, 1 + t)),
        gap=np.zeros(k),
        frame=np.zeros((k, 1 + t, dimension)),
        normal=np.zeros((k, dimension)),
        jacobian=np.zeros((k, 2, 1 + t, v)),
        response=np.zeros((k, 2, 1 + t, v)),
        speed=np.zeros((k, 1 + t)),
        gamma=np.zeros((k, 1 + t)),
        force=np.zeros((k, 1 + t)),
        direction=np.zeros((k, t)),
        turned=np.zeros(k, np.int64),
        begun=np.zeros((k, t)),
        impulse=np.zeros((k, dimension)),
        moment=np.zeros((k, v - dimension)),
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
        other=np.zeros(r),
        weight=np.zeros(r),
        wanted=np.zeros(t),
        gives=np.zeros((1 + t, 1 + t)),
        yields=np.zeros((k, 1 + t, 1 + t)),
        asked=np.zeros(k, np.int64),
        order=np.zeros(r, np.int64),
        filled=np.zeros(r, np.int64),
        change=np.zeros(v),
        label=np.zeros(n, np.int64),
        unknown=np.zeros((r, 2), np.int64),
        monitor=np.zeros((PLACES_WATCHED, k, FEATURE + LIMITS[dimension])),
        length=np.zeros(1),
        accuracy=np.full(1, ACCURACY),
        error=np.zeros(1),
        early=np.ones(1),
        lenient=np.zeros(1),
        spin=np.zeros(v),
        trial=np.zeros((k, 2, 1 + t, v)),
    )
