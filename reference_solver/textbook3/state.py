"""Arrays that the spatial kernels work on: one record per body, one per manifold.

Records rather than one array per field: a kernel call hands over one pointer instead of two hundred numbers,
which is what compilation time goes with, and the constants of a manifold lie side by side in memory.

Symbols as in ``docs/solver/model.md``. A manifold ``m`` holds the one to eight contact points ``s`` of one
pair of bodies, which share a normal; manifolds are sorted by (body_a, body_b), their points by feature.
Every manifold has room for eight points.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from reference_solver.direct.problem import Problem
from reference_solver.model import (
    Array,
    Body,
    Box,
    Capsule,
    HalfSpace,
    Model,
    Sphere,
    pair_table,
    smallest_extent,
)
from reference_solver.needs import Needs
from reference_solver.pieces import Indices
from reference_solver.textbook.broadphase import Boxes, allocate_boxes
from reference_solver.textbook.motion import MOTION_CODE
from reference_solver.textbook.options import Options

#: Shape codes, from flat to round; a pair of different shapes is handled in this order.
HALF_SPACE, BOX, SPHERE, CAPSULE = 0, 1, 2, 3

#: Points per manifold: two rectangles share a polygon of up to eight corners, and each of them can carry load.
POINTS = 8

#: Entries of `Detection.found`: candidates, manifolds remembered of the step before, manifolds.
CANDIDATES, REMEMBERED, MANIFOLDS = 0, 1, 2
FOUND = 3


BODY = np.dtype(
    [
        ("pose", "f8", 7),  # position [m], quaternion (w, x, y, z) body to world
        ("twist", "f8", 6),  # velocity [m/s], angular velocity [rad/s], world axes
        ("axes", "f8", (3, 3)),  # rotation matrix of the pose; columns are the body axes in the world
        ("inverse_inertia", "f8", (3, 3)),  # world axes, recomputed after every turn
        ("inverse_mass", "f8"),  # 0 unless free
        ("inverse_moments", "f8", 3),  # of the principal moments; 0 unless free, or where rotation is left out
        ("pseudo", "f8", 6),  # pseudo-velocity of position correction
        ("start", "f8", 6),  # twist before the impulses of a contact solve, for its certificate
        ("pressed", "f8", 2),  # sum of the sizes of those impulses over mass [m/s], and over inertia [rad/s]
        ("acceleration", "f8", 3),  # gravity plus constant force over mass [m/s^2]
        ("torque", "f8", 3),  # constant torque [N m]
        ("moments", "f8", 3),  # principal moments of free bodies [kg m^2]
        ("angular_momentum", "f8", 3),  # world axes [kg m^2/s], kept for gyroscopic bodies only
        ("spin_before", "f8", 3),  # angular velocity at the start of the step
        ("gyroscopic", "i8"),  # 1 for free bodies with unequal moments
        ("turning", "i8"),  # 1 where the quaternion can change
        ("kind", "i8"),  # shape code
        # half-space (normal, offset), box (half extents), sphere (radius), capsule (half length, radius) [m]
        ("geometry", "f8", 4),
        ("extent", "f8"),  # smallest half width [m]
        ("motion", "i8"),  # FIXED, FREE or PRESCRIBED
    ],
    align=True,
)

# Vectors are in world axes, except those marked *frame*: components along (t1, t2, n) of the manifold.
MANIFOLD = np.dtype(
    [
        ("body_a", "i8"),
        ("body_b", "i8"),
        ("points", "i8"),  # number of points, 1..8
        ("friction", "f8"),  # mu
        ("restitution", "f8"),  # e
        ("frame", "f8", (3, 3)),  # rows t1, t2, n; n points from A to B
        ("lever_a", "f8", 3),  # centre of the manifold minus centre of A [m]
        ("lever_b", "f8", 3),
        ("offset", "f8", (POINTS, 3)),  # contact point minus centre of the manifold, frame [m]
        ("response", "f8", (POINTS, 6, 3)),  # relative twist at the centre per impulse at the point, frame
        ("matrix", "f8", (POINTS, 6)),  # collision matrix k11, k12, k13, k22, k23, k33, frame [1/kg]
        ("target", "f8", POINTS),  # b_n [m/s]
        ("impulse", "f8", (POINTS, 3)),  # accumulated impulse on B, frame [N s]
        ("before", "f8", (POINTS, 3)),  # the same before a block was solved
        ("rigid", "i8"),  # 1 where the points fix all six relative velocities: `sticking` applies
        ("spread", "f8", 3),  # second moments of the points xx, xy, yy, frame [m^2]
        ("factor", "f8", (6, 6)),  # Cholesky factor of the relative twist per wrench at the centre, frame
        ("wrench", "f8", 6),  # force and moment at the centre being solved for, frame [N s, N m s]
        ("share", "f8", (POINTS, 3)),  # how the points would share it, frame [N s]
        ("failures", "i8"),  # of Newton's method in this step
        ("trial", "f8", (POINTS, 3)),  # impulses of a Newton step, frame [N s]
        ("system", "f8", (6, 7)),  # matrix and right side of a Newton step
        ("push", "f8", POINTS),  # accumulated pseudo-impulse along n
        ("push_target", "f8", POINTS),  # pseudo-velocity to reach [m/s]
        ("speed", "f8", POINTS),  # reference speed of the residual [m/s]
        ("impact", "i8", POINTS),  # 1 where bodies meet or part faster than loads explain
        ("feature", "i8", POINTS),
        ("gap", "f8", POINTS),  # [m], < 0 overlap
        ("arm_a", "f8", (POINTS, 3)),  # contact point minus centre of A [m]
        ("arm_b", "f8", (POINTS, 3)),
        ("point", "f8", (POINTS, 3)),  # at detection, for records only [m]
    ],
    align=True,
)

#: What is remembered of a manifold until the next step.
MEMORY = np.dtype(
    [
        ("pair", "i8"),  # `pair_of` its bodies, ascending
        ("points", "i8"),
        ("feature", "i8", POINTS),
        ("impulse", "f8", (POINTS, 3)),  # world axes, so that a turning contact frame does not turn the impulse
        ("arm", "f8", (POINTS, 3)),  # contact point minus centre of B [m]
    ],
    align=True,
)

# numpy's record arrays of the types above. Their fields are attributes that a type checker cannot know.
Bodies: TypeAlias = Any
Manifolds: TypeAlias = Any
Memory: TypeAlias = Any


class Detection(NamedTuple):
    """Laws of the pairs, room for candidates of the broadphase, and working space of the polygon clipper."""

    found: Indices  # (FOUND,): see CANDIDATES .. MANIFOLDS
    restitution: Array  # (n, n), strided: one number where all pairs have the same
    friction: Array  # (n, n), likewise
    boxes: Boxes
    polygon: Array  # (2, 16, 5): two polygons, each made from the other by one clip
    polygon_edge: Indices  # (2, 16): number of the edge that leaves each vertex


def allocate_bodies(model: Model, needs: Needs) -> Bodies:
    """Return the start state of ``model``."""
    n = len(model.bodies)
    free = np.array([body.motion == "free" for body in model.bodies])
    mass = np.array([body.mass if body.motion == "free" else np.inf for body in model.bodies])
    moments = np.array([body.inertia if body.motion == "free" else (np.inf,) * 3 for body in model.bodies])
    acceleration = np.array([body.force for body in model.bodies], dtype=np.float64) / mass[:, None]
    acceleration[free] += model.gravity
    bodies: Bodies = np.zeros(n, BODY).view(np.recarray)
    bodies.pose = [body.pose for body in model.bodies]
    bodies.twist = [body.twist for body in model.bodies]
    bodies.acceleration = acceleration
    torques = [body.torque for body in model.bodies if body.motion == "free"]
    bodies.torque[free] = np.reshape(np.array(torques, dtype=np.float64), (-1, 3))  # also without a free body
    bodies.inverse_mass = 1.0 / mass
    bodies.inverse_moments = 1.0 / moments if needs.rotation else 0.0
    bodies.moments = moments
    bodies.gyroscopic = free & (moments != moments[:, :1]).any(axis=1)
    bodies.turning = (free & needs.rotation) | bodies.twist[:, 3:].any(axis=1)
    bodies.kind = [_SHAPE_CODE[type(body.shape)] for body in model.bodies]
    bodies.geometry = [_geometry(body) for body in model.bodies]
    bodies.extent = [smallest_extent(body.shape) for body in model.bodies]
    bodies.motion = [MOTION_CODE[body.motion] for body in model.bodies]
    return bodies


_SHAPE_CODE = {HalfSpace: HALF_SPACE, Box: BOX, Sphere: SPHERE, Capsule: CAPSULE}


def _geometry(body: Body) -> tuple[float, ...]:
    shape = body.shape
    if isinstance(shape, HalfSpace):
        return (*shape.normal, shape.offset)
    if isinstance(shape, Box):
        return (*shape.half_extents, 0.0)
    if isinstance(shape, Capsule):
        return (shape.half_length, shape.radius, 0.0, 0.0)
    assert isinstance(shape, Sphere)
    return (shape.radius, 0.0, 0.0, 0.0)


def allocate_detection(model: Model, capacity: int) -> Detection:
    """Return the pair tables, and room for ``capacity`` candidates."""
    return Detection(
        found=np.zeros(FOUND, np.int64),
        restitution=pair_table(model.restitution),
        friction=pair_table(model.friction),
        boxes=allocate_boxes(model, capacity),
        polygon=np.zeros((2, 16, 5)),
        polygon_edge=np.zeros((2, 16), np.int64),
    )


class Space(NamedTuple):
    """What a step works on."""

    bodies: Bodies
    detection: Detection
    room: Manifolds  # as many as there is room for
    memory: Memory
    problem: Problem
    options: Options
    tally: Array  # (SIZE,)


def allocate_manifolds(capacity: int) -> Manifolds:
    """Return room for ``capacity`` manifolds."""
    return np.zeros(capacity, MANIFOLD).view(np.recarray)


def allocate_memory(capacity: int) -> Memory:
    """Return room to remember ``capacity`` manifolds."""
    return np.zeros(capacity, MEMORY).view(np.recarray)
