"""Arrays that the spatial kernels work on, as named tuples of arrays.

Symbols as in ``reference_solver/README.md``. A manifold ``m`` holds the one to four contact points ``s`` of one
pair of bodies, which share a normal; manifolds are sorted by (body_a, body_b), their points by feature.
Every manifold has room for four points, so that its constants are one contiguous block.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.model import Array, Body, Box, HalfSpace, Model, Sphere, smallest_extent
from reference_solver.needs import Needs

Indices = NDArray[np.int64]

#: Shape codes, from flat to round; a pair of different shapes is handled in this order.
HALF_SPACE, BOX, SPHERE = 0, 1, 2
FIXED, FREE, PRESCRIBED = 0, 1, 2

#: Points per manifold: a plane support needs no more than four to carry any load.
POINTS = 4

#: Entries of `Manifolds.count`.
MANIFOLDS, REMEMBERED, CANDIDATES = 0, 1, 2


class Bodies(NamedTuple):
    """Bodies i = 0 .. n-1."""

    pose: Array  # (n, 7): position [m], quaternion (w, x, y, z) body to world
    twist: Array  # (n, 6): velocity [m/s], angular velocity [rad/s], world axes
    axes: Array  # (n, 3, 3): rotation matrix of the pose; columns are the body axes in the world
    pseudo: Array  # (n, 6): pseudo-velocity of position correction
    acceleration: Array  # (n, 3): gravity plus constant force over mass [m/s^2]
    torque: Array  # (n, 3): constant torque [N m]
    inverse_mass: Array  # (n,): 0 unless free
    inverse_moments: Array  # (n, 3): of the principal moments; 0 unless free, or where rotation is left out
    moments: Array  # (n, 3): principal moments of free bodies [kg m^2]
    inverse_inertia: Array  # (n, 3, 3): world axes, recomputed after every turn
    angular_momentum: Array  # (n, 3): world axes [kg m^2/s], kept for gyroscopic bodies only
    spin_before: Array  # (n, 3): angular velocity at the start of the step
    gyroscopic: Indices  # (n,): 1 for free bodies with unequal moments
    turning: Indices  # (n,): 1 where the quaternion can change
    shape: Indices  # (n,)
    size: Array  # (n, 4): half-space (normal, offset), box (half extents, .), sphere (radius, ., ., .)
    extent: Array  # (n,): smallest half width [m]
    motion: Indices  # (n,)


class Pairs(NamedTuple):
    """Laws of the pairs, room for candidates of the broadphase, and working space of the polygon clipper."""

    restitution: Array  # (n, n)
    friction: Array  # (n, n)
    low: Array  # (n, 3): lower corner of the bounding box
    high: Array  # (n, 3): upper corner
    candidate: Indices  # (capacity,): a * n + b, ascending
    polygon: Array  # (2, 16, 3): two polygons, each made from the other by one clip
    polygon_edge: Indices  # (2, 16): number of the edge that leaves each vertex


class Manifolds(NamedTuple):
    """Contacts of the current step, and what is remembered of the step before.

    Vectors are in world axes, except those marked *frame*: components along (t1, t2, n) of the manifold.
    """

    count: Indices  # (3,): see MANIFOLDS .. CANDIDATES
    body_a: Indices  # (m,)
    body_b: Indices
    points: Indices  # (m,): number of points, 1..4
    frame: Array  # (m, 3, 3): rows t1, t2, n; n points from A to B
    friction: Array  # (m,): mu
    lever_a: Array  # (m, 3): centre of the manifold minus centre of A [m]
    lever_b: Array
    feature: Indices  # (m, 4)
    arm_a: Array  # (m, 4, 3): contact point minus centre of A [m]
    arm_b: Array
    point: Array  # (m, 4, 3): at detection, for records only [m]
    gap: Array  # (m, 4) [m], < 0 overlap
    offset: Array  # (m, 4, 3): contact point minus centre of the manifold, frame [m]
    response: Array  # (m, 4, 6, 3): relative twist at the manifold's centre per impulse at the point, frame
    matrix: Array  # (m, 4, 6): collision matrix k11, k12, k13, k22, k23, k33, frame [1/kg]
    approach: Array  # (m, 4): u_n before forces [m/s]
    target: Array  # (m, 4): b_n
    bounce: Indices  # (m, 4): 1 where the target comes from restitution
    speed: Array  # (m, 4): reference speed of the residual [m/s]
    impulse: Array  # (m, 4, 3): accumulated impulse on B, frame [N s]
    before: Array  # (m, 4, 3): impulses before a block was solved, frame
    push: Array  # (m, 4): accumulated pseudo-impulse along n
    push_target: Array  # (m, 4): pseudo-velocity to reach [m/s]
    old_pair: Indices  # (m,): a * n + b of the step before, ascending
    old_points: Indices  # (m,)
    old_feature: Indices  # (m, 4)
    old_impulse: Array  # (m, 4, 3): world axes, so that a turning contact frame does not turn the impulse


def allocate_bodies(model: Model, needs: Needs) -> Bodies:
    """Return the start state of ``model``."""
    n = len(model.bodies)
    free = np.array([body.motion == "free" for body in model.bodies])
    mass = np.array([body.mass if body.motion == "free" else np.inf for body in model.bodies])
    moments = np.array([body.inertia if body.motion == "free" else (np.inf,) * 3 for body in model.bodies])
    acceleration = np.array([body.force for body in model.bodies], dtype=np.float64) / mass[:, None]
    acceleration[free] += model.gravity
    twist = np.array([body.twist for body in model.bodies], dtype=np.float64)
    return Bodies(
        pose=np.array([body.pose for body in model.bodies], dtype=np.float64),
        twist=twist,
        axes=np.zeros((n, 3, 3)),
        pseudo=np.zeros((n, 6)),
        acceleration=acceleration,
        torque=np.array([body.torque for body in model.bodies], dtype=np.float64) * free[:, None],
        inverse_mass=1.0 / mass,
        inverse_moments=1.0 / moments if needs.rotation else np.zeros((n, 3)),
        moments=moments,
        inverse_inertia=np.zeros((n, 3, 3)),
        angular_momentum=np.zeros((n, 3)),
        spin_before=np.zeros((n, 3)),
        gyroscopic=(free & (moments != moments[:, :1]).any(axis=1)).astype(np.int64),
        turning=((free & needs.rotation) | twist[:, 3:].any(axis=1)).astype(np.int64),
        shape=np.array([_SHAPE_CODE[type(body.shape)] for body in model.bodies]),
        size=np.array([_size(body) for body in model.bodies]),
        extent=np.array([smallest_extent(body.shape) for body in model.bodies]),
        motion=np.array([_MOTION_CODE[body.motion] for body in model.bodies]),
    )


_SHAPE_CODE = {HalfSpace: HALF_SPACE, Box: BOX, Sphere: SPHERE}
_MOTION_CODE = {"fixed": FIXED, "free": FREE, "prescribed": PRESCRIBED}


def _size(body: Body) -> tuple[float, ...]:
    shape = body.shape
    if isinstance(shape, HalfSpace):
        return (*shape.normal, shape.offset)
    if isinstance(shape, Box):
        return (*shape.half_extents, 0.0)
    assert isinstance(shape, Sphere)
    return (shape.radius, 0.0, 0.0, 0.0)


def allocate_pairs(model: Model, capacity: int) -> Pairs:
    """Return the pair tables, and room for ``capacity`` candidates."""
    n = len(model.bodies)
    return Pairs(
        restitution=model.restitution.copy(),
        friction=model.friction.copy(),
        low=np.zeros((n, 3)),
        high=np.zeros((n, 3)),
        candidate=np.zeros(capacity, np.int64),
        polygon=np.zeros((2, 16, 3)),
        polygon_edge=np.zeros((2, 16), np.int64),
    )


_PER_POINT = {"arm_a": (3,), "arm_b": (3,), "offset": (3,), "response": (6, 3), "matrix": (6,), "impulse": (3,)}
_PER_POINT |= {"before": (3,), "point": (3,), "old_impulse": (3,), "gap": (), "approach": (), "target": (), "speed": (), "push": ()}
_PER_POINT |= {"push_target": (), "feature": (), "bounce": (), "old_feature": ()}
_PER_MANIFOLD = {"frame": (3, 3), "lever_a": (3,), "lever_b": (3,)}
_INTEGERS = {"body_a", "body_b", "points", "feature", "bounce", "old_pair", "old_points", "old_feature"}


def allocate_manifolds(capacity: int) -> Manifolds:
    """Return room for ``capacity`` manifolds."""
    fields: dict[str, NDArray[np.generic]] = {}
    for name in Manifolds._fields:
        inner = (POINTS, *_PER_POINT[name]) if name in _PER_POINT else _PER_MANIFOLD.get(name, ())
        fields[name] = np.zeros((capacity, *inner), np.int64 if name in _INTEGERS else np.float64)
    fields["count"] = np.zeros(3, np.int64)
    return Manifolds(**fields)  # type: ignore[arg-type]


def grown(manifolds: Manifolds) -> Manifolds:
    """Return twice the room, with what is remembered of the step before; the current step must be redone."""
    capacity = len(manifolds.body_a)
    bigger = allocate_manifolds(2 * capacity)
    bigger.count[:] = manifolds.count
    for name in ("old_pair", "old_points", "old_feature", "old_impulse"):
        getattr(bigger, name)[:capacity] = getattr(manifolds, name)
    return bigger
