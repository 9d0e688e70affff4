"""Arrays that the planar kernels work on, as named tuples of arrays and numbers.

Symbols as in ``docs/solver/model.md``. Rows ``c`` are contact points, sorted by (body_a, body_b, feature);
points of one pair of bodies are neighbours and form a manifold ``m``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reference_solver.direct.problem import Problem
from reference_solver.lanes import LANES, room
from reference_solver.model import (
    Array,
    Body,
    Box,
    Capsule,
    Disc,
    HalfSpace,
    Model,
    Polygon,
    pair_table,
    smallest_extent,
)
from reference_solver.needs import Needs
from reference_solver.pieces import Indices
from reference_solver.shapes import MOST_VERTICES
from reference_solver.textbook.broadphase import Boxes, allocate_boxes
from reference_solver.textbook.motion import MOTION_CODE
from reference_solver.textbook.options import Options
from reference_solver.textbook2.columns import (
    BODY_INTEGERS,
    BODY_REALS,
    COS,
    EXTENT,
    FIRST_VERTEX,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    MOTION,
    REACH,
    ROUNDING,
    ROW_INTEGERS,
    ROW_REALS,
    SHAPE,
    SIN,
    SIZE,
    VERTICES,
    WIDE_REALS,
    B,
)
from reference_solver.textbook2.pair_modes import LOCAL_COLUMNS, LOCAL_ROWS

#: Shape codes; a pair of different shapes is handled in this order.
HALF_SPACE, DISC, BOX, CAPSULE, POLYGON = 0, 1, 2, 3, 4

#: Features per pair: bound of the feature numbers in core_core.py (edge on edge, then vertex on vertex), to pack
#: (a, b, feature) into one key.
FEATURES = 5 * MOST_VERTICES**2

#: Entries of `Rows.counts`.
CONTACTS, MANIFOLDS, REMEMBERED, CANDIDATES = 0, 1, 2, 3
COUNTS = 4
#: More than any number of bodies, so that (a, b, feature) is one key of 63 bits.
MOST_BODIES = 1 << 24


class Bodies(NamedTuple):
    """Bodies i = 0 .. n-1."""

    pose: Array  # (n, 3): x, y [m], angle [rad]
    twist: Array  # (n, 3): vx, vy [m/s], omega [rad/s]
    pseudo: Array  # (n, 3): pseudo-velocity of position correction
    real: Array  # (n, BODY_REALS)
    kind: Indices  # (n, BODY_INTEGERS)
    vertex: Array  # (k, 2): vertices of all cores in body axes [m], counter-clockwise
    start: Array  # (n, 3): twist before the impulses of a contact solve, for its certificate
    pressed: Array  # (n, 2): sum of the sizes of those impulses over mass [m/s], and over inertia [rad/s]


class Pairs(NamedTuple):
    """Laws of the pairs and room for candidates of the broadphase."""

    restitution: Array  # (n, n), strided: one number where all pairs have the same
    friction: Array  # (n, n), likewise
    boxes: Boxes


class Wide(NamedTuple):
    """Room for manifolds in blocks of `LANES` (`wide.py`), or none. A block has one slot for each lane."""

    last: Indices  # (n,): level of a body's last manifold, plus 1
    level: Indices  # (m,): group of each manifold: 2 level, plus 1 if it has two points
    begin: Indices  # (2 m + 3,): number of the first slot of each group
    order: Indices  # (blocks, LANES): manifold of each slot, -1 where there is none
    body: Indices  # (blocks, 2, LANES): rows of `velocity` of A and B
    row: Indices  # (blocks, 2, LANES): rows of `Rows.real`
    velocity: Array  # (n + 1, 8): velocities of each body as `wide` has them; the last stands for none
    point: Array  # (2 blocks, WIDE_REALS, LANES): what of `Rows.real` a sweep needs
    block: Array  # (blocks, 4, 4, LANES): `Rows.block`
    points: Indices  # (blocks,): of each manifold of a block
    pair: Array  # (2, 8, LANES): rows of `velocity` of the bodies of a block
    kind: Indices  # (2, BODY_INTEGERS): nothing of those bodies
    integer: Indices  # (2 blocks, ROW_INTEGERS): that each row is between them
    manifold: Indices  # (blocks + 1,): first row of each block


class Rows(NamedTuple):
    """Contact points c of the current step, and what is remembered of the step before."""

    counts: Indices  # (COUNTS,): see CONTACTS .. CANDIDATES
    integer: Indices  # (c, ROW_INTEGERS)
    real: Array  # (c, ROW_REALS)
    manifold: Indices  # (m + 1,): first row of each manifold
    block: Array  # (m, 4, 4): W of a two-point manifold, rows n1, t1, n2, t2 (E12)
    local: Array  # (LOCAL_ROWS, LOCAL_COLUMNS): scratch of the block being solved, see pair_modes.py
    old_key: Indices  # (c,): (a, b, feature) of the step before, ascending
    old_impulse: Array  # (c, 2)


class Plane(NamedTuple):
    """What a step works on."""

    bodies: Bodies
    pairs: Pairs
    rows: Rows
    wide: Wide
    problem: Problem
    options: Options
    tally: Array  # (SIZE,)


def allocate_bodies(model: Model, needs: Needs) -> Bodies:
    """Return the start state of ``model``."""
    n = len(model.bodies)
    free = np.array([body.motion == "free" for body in model.bodies])
    load = np.array([[*body.force, body.torque] for body in model.bodies], dtype=np.float64)  # type: ignore[misc]
    mass = np.array([body.mass if body.motion == "free" else np.inf for body in model.bodies])
    inertia = np.array([body.inertia if body.motion == "free" else np.inf for body in model.bodies])
    load /= np.column_stack([mass, mass, inertia])
    load[free, :2] += model.gravity
    pose = np.array([body.pose for body in model.bodies], dtype=np.float64)
    real = np.zeros((n, BODY_REALS))
    real[:, COS], real[:, SIN] = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    real[:, LOAD : LOAD + 3] = load
    real[:, INVERSE_MASS] = 1.0 / mass
    real[:, INVERSE_INERTIA] = 1.0 / inertia if needs.rotation else 0.0
    real[:, SIZE : SIZE + 3] = [_size(body) for body in model.bodies]
    real[:, EXTENT] = [smallest_extent(body.shape) for body in model.bodies]
    cores = [_core(body) for body in model.bodies]
    count = np.array([len(core) for core in cores])
    vertex = np.array([point for core in cores for point in core] or np.zeros((1, 2)), dtype=np.float64)
    real[:, ROUNDING] = [getattr(body.shape, "radius", 0.0) for body in model.bodies]
    far = [max((np.hypot(x, y) for x, y in core), default=np.inf) for core in cores]
    real[:, REACH] = np.array(far) + real[:, ROUNDING]
    kind = np.zeros((n, BODY_INTEGERS), np.int64)
    kind[:, FIRST_VERTEX], kind[:, VERTICES] = np.cumsum(count) - count, count
    kind[:, SHAPE] = [_SHAPE_CODE[type(body.shape)] for body in model.bodies]
    kind[:, MOTION] = [MOTION_CODE[body.motion] for body in model.bodies]
    twist = np.array([body.twist for body in model.bodies], dtype=np.float64)
    return Bodies(pose, twist, np.zeros((n, 3)), real, kind, vertex, np.zeros((n, 3)), np.zeros((n, 2)))


_SHAPE_CODE = {HalfSpace: HALF_SPACE, Disc: DISC, Box: BOX, Capsule: CAPSULE, Polygon: POLYGON}


def _size(body: Body) -> tuple[float, float, float]:
    shape = body.shape
    if isinstance(shape, HalfSpace):
        return (shape.normal[0], shape.normal[1], shape.offset)
    if isinstance(shape, Box):
        return (shape.half_extents[0], shape.half_extents[1], 0.0)
    return (shape.radius, 0.0, 0.0) if isinstance(shape, Disc) else (0.0, 0.0, 0.0)


def _core(body: Body) -> tuple[tuple[float, float], ...]:
    """Vertices of the polygon that, grown by the rounding radius, is the body; none of a half-space."""
    shape = body.shape
    if isinstance(shape, HalfSpace):
        return ()
    if isinstance(shape, Box):
        x, y = shape.half_extents
        return ((x, y), (-x, y), (-x, -y), (x, -y))
    if isinstance(shape, Polygon):
        return shape.vertices
    return ((shape.half_length, 0.0), (-shape.half_length, 0.0)) if isinstance(shape, Capsule) else ((0.0, 0.0),)


def allocate_pairs(model: Model, capacity: int) -> Pairs:
    """Return the pair tables, and room for ``capacity`` candidates."""
    return Pairs(pair_table(model.restitution), pair_table(model.friction), allocate_boxes(model, capacity))


def allocate_wide(n: int, capacity: int) -> Wide:
    """Return room for ``capacity`` manifolds of ``n`` bodies in blocks at least half of whose lanes are in use."""
    blocks = 2 * -(-capacity // LANES)
    count = np.int64
    return Wide(
        last=np.zeros(n, count),
        level=np.zeros(capacity, count),
        begin=np.zeros(2 * capacity + 3, count),
        order=np.zeros((blocks, LANES), count),
        body=np.zeros((blocks, 2, LANES), count),
        row=np.zeros((blocks, 2, LANES), count),
        velocity=room(n + 1, LANES),
        point=room(2 * blocks, WIDE_REALS, LANES),
        block=room(blocks, 4, 4, LANES),
        points=np.zeros(blocks, count),
        pair=room(2, LANES, LANES),
        kind=np.zeros((2, BODY_INTEGERS), count),
        integer=np.tile(np.eye(1, ROW_INTEGERS, B, dtype=count), (2 * blocks, 1)),
        manifold=np.arange(0, 2 * blocks + 1, 2),
    )


def allocate_rows(capacity: int) -> Rows:
    """Return room for ``capacity`` contact points."""
    return Rows(
        counts=np.zeros(COUNTS, np.int64),
        integer=np.zeros((capacity, ROW_INTEGERS), np.int64),
        real=np.zeros((capacity, ROW_REALS)),
        manifold=np.zeros(capacity + 1, np.int64),
        block=np.zeros((capacity, 4, 4)),
        local=np.zeros((LOCAL_ROWS, LOCAL_COLUMNS)),
        old_key=np.zeros(capacity, np.int64),
        old_impulse=np.zeros((capacity, 2)),
    )


def grown(rows: Rows) -> Rows:
    """Return twice the room, with what is remembered of the step before; the current step must be redone."""
    bigger = allocate_rows(2 * len(rows.real))
    bigger.counts[:] = rows.counts
    bigger.old_key[: len(rows.old_key)] = rows.old_key
    bigger.old_impulse[: len(rows.old_impulse)] = rows.old_impulse
    return bigger
