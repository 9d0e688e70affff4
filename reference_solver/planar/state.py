"""Arrays that the planar kernels work on, as named tuples of arrays and numbers.

Symbols as in ``reference_solver/README.md``. Rows ``c`` are contact points, sorted by (body_a, body_b, feature);
points of one pair of bodies are neighbours and form a manifold ``m``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.model import Array, Body, Box, Disc, HalfSpace, Model, smallest_extent
from reference_solver.needs import Needs
from reference_solver.settings import Settings

Indices = NDArray[np.int64]

#: Shape codes; a pair of different shapes is handled in this order.
HALF_SPACE, DISC, BOX = 0, 1, 2
FIXED, FREE, PRESCRIBED = 0, 1, 2
SCALAR, BLOCK = 0, 1
NO_CORRECTION, SPLIT, BAUMGARTE = 0, 1, 2

#: Features per pair: bound of the feature numbers in narrowphase.py, to pack (a, b, feature) into one key.
FEATURES = 64

#: Entries of `Rows.count`.
CONTACTS, MANIFOLDS, REMEMBERED, CANDIDATES = 0, 1, 2, 3


class Bodies(NamedTuple):
    """Bodies i = 0 .. n-1."""

    pose: Array  # (n, 3): x, y [m], angle [rad]
    twist: Array  # (n, 3): vx, vy [m/s], omega [rad/s]
    turn: Array  # (n, 2): cos and sin of the angle
    pseudo: Array  # (n, 3): pseudo-velocity of position correction
    acceleration: Array  # (n, 3): M^-1 f of gravity and constant loads
    inverse_mass: Array  # (n,): 0 unless free
    inverse_inertia: Array  # (n,): 0 unless free, and 0 throughout where rotation is left out
    shape: Indices  # (n,)
    size: Array  # (n, 3): disc (radius, ., .), box (half extents, .), half-space (normal, offset)
    extent: Array  # (n,): smallest half width [m]
    motion: Indices  # (n,)


class Pairs(NamedTuple):
    """Laws of the pairs and room for candidates of the broadphase."""

    restitution: Array  # (n, n)
    friction: Array  # (n, n)
    low: Array  # (n, 2): lower corner of the bounding box
    high: Array  # (n, 2): upper corner
    candidate: Indices  # (capacity,): a * n + b, ascending


class Rows(NamedTuple):
    """Contact points of the current step, and what is remembered of the step before."""

    count: Indices  # (4,): see CONTACTS .. CANDIDATES
    body_a: Indices  # (c,)
    body_b: Indices
    feature: Indices
    normal: Array  # (c, 2), from A to B; the tangent is the normal turned by +90 degrees
    arm_a: Array  # (c, 2): contact point minus centre of A [m]
    arm_b: Array
    point: Array  # (c, 2): in world axes at detection, for records only [m]
    gap: Array  # (c,) [m], < 0 overlap
    lever: Array  # (c, 4): r_A x n, r_B x n, r_A x t, r_B x t (E2)
    normal_mass: Array  # (c,): 1 / k_n (E3)
    tangent_mass: Array  # (c,): 1 / k_t
    coupling: Array  # (c,): k_nt
    friction: Array  # (c,): mu
    approach: Array  # (c,): u_n before forces (E6)
    target: Array  # (c,): b_n (E7)
    bounce: Indices  # (c,): 1 where bodies meet or part faster than the loads of one step explain
    speed: Array  # (c,): reference speed of the residual (E14) [m/s]
    impulse: Array  # (c, 2): accumulated normal and tangential impulse [N s]
    push: Array  # (c,): accumulated pseudo-impulse
    push_target: Array  # (c,): pseudo-velocity to reach [m/s]
    manifold: Indices  # (m + 1,): first row of each manifold
    block: Array  # (m, 4, 4): W of a two-point manifold, rows n1, t1, n2, t2 (E12)
    local: Array  # (3, 4): impulses, velocities and trial of the block being solved
    old_key: Indices  # (c,): (a, b, feature) of the step before, ascending
    old_impulse: Array  # (c, 2)


class Options(NamedTuple):
    """Numbers and flags of `Settings` and `Needs`."""

    dt: float
    iterations: int
    residual: float  # < 0: exactly `iterations` sweeps
    max_sweeps: int
    relaxation: float  # <= 0: estimated
    correction: int
    beta: float
    slop: float
    margin: float
    warm_starting: int
    solver: int
    rotation: int
    friction: int
    restitution: int
    broadphase: int


class Buffer(NamedTuple):
    """Samples of a run; contact arrays of length 0 where contacts are not recorded."""

    pose: Array
    twist: Array
    offset: Indices
    body_a: Indices
    body_b: Indices
    feature: Indices
    point: Array
    normal: Array
    impulse: Array
    gap: Array


def allocate_bodies(model: Model, needs: Needs) -> Bodies:
    """Return the start state of ``model``."""
    n = len(model.bodies)
    free = np.array([body.motion == "free" for body in model.bodies])
    pose = np.array([body.pose for body in model.bodies], dtype=np.float64)
    load = np.array([[*body.force, body.torque] for body in model.bodies], dtype=np.float64)  # type: ignore[misc]
    mass = np.array([body.mass if body.motion == "free" else np.inf for body in model.bodies])
    inertia = np.array([body.inertia if body.motion == "free" else np.inf for body in model.bodies])
    acceleration = load / np.column_stack([mass, mass, inertia])
    acceleration[free, :2] += model.gravity
    return Bodies(
        pose=pose,
        twist=np.array([body.twist for body in model.bodies], dtype=np.float64),
        turn=np.column_stack([np.cos(pose[:, 2]), np.sin(pose[:, 2])]),
        pseudo=np.zeros((n, 3)),
        acceleration=acceleration,
        inverse_mass=1.0 / mass,
        inverse_inertia=1.0 / inertia if needs.rotation else np.zeros(n),
        shape=np.array([_SHAPE_CODE[type(body.shape)] for body in model.bodies]),
        size=np.array([_size(body) for body in model.bodies]),
        extent=np.array([smallest_extent(body.shape) for body in model.bodies]),
        motion=np.array([_MOTION_CODE[body.motion] for body in model.bodies]),
    )


_SHAPE_CODE = {HalfSpace: HALF_SPACE, Disc: DISC, Box: BOX}
_MOTION_CODE = {"fixed": FIXED, "free": FREE, "prescribed": PRESCRIBED}


def _size(body: Body) -> tuple[float, float, float]:
    shape = body.shape
    if isinstance(shape, HalfSpace):
        return (shape.normal[0], shape.normal[1], shape.offset)
    if isinstance(shape, Box):
        return (shape.half_extents[0], shape.half_extents[1], 0.0)
    assert isinstance(shape, Disc)
    return (shape.radius, 0.0, 0.0)


def allocate_pairs(model: Model, capacity: int) -> Pairs:
    """Return the pair tables, and room for ``capacity`` candidates."""
    n = len(model.bodies)
    room = np.zeros(capacity, np.int64)
    return Pairs(model.restitution.copy(), model.friction.copy(), np.zeros((n, 2)), np.zeros((n, 2)), room)


def allocate_rows(capacity: int) -> Rows:
    """Return room for ``capacity`` contact points."""
    shapes: dict[str, tuple[int, ...]] = {"point": (2,), "normal": (2,), "arm_a": (2,), "arm_b": (2,), "lever": (4,)}
    shapes |= {"impulse": (2,), "old_impulse": (2,), "block": (4, 4)}
    integers = {"body_a", "body_b", "feature", "bounce", "old_key"}
    fields: dict[str, NDArray[np.generic]] = {
        name: np.zeros((capacity, *shapes.get(name, ())), np.int64 if name in integers else np.float64)
        for name in Rows._fields
    }
    fields |= {"count": np.zeros(4, np.int64), "manifold": np.zeros(capacity + 1, np.int64)}
    fields["local"] = np.zeros((3, 4))
    return Rows(**fields)  # type: ignore[arg-type]


def grown(rows: Rows) -> Rows:
    """Return twice the room, with what is remembered of the step before; the current step must be redone."""
    bigger = allocate_rows(2 * len(rows.gap))
    bigger.count[:] = rows.count
    bigger.old_key[: len(rows.old_key)] = rows.old_key
    bigger.old_impulse[: len(rows.old_impulse)] = rows.old_impulse
    return bigger


def options(settings: Settings, needs: Needs) -> Options:
    """Return settings and needs as plain numbers."""
    return Options(
        dt=float(settings.dt),
        iterations=settings.iterations,
        residual=-1.0 if settings.residual is None else float(settings.residual),
        max_sweeps=settings.max_sweeps,
        relaxation=0.0 if settings.relaxation is None else float(settings.relaxation),
        correction={"none": NO_CORRECTION, "split": SPLIT, "baumgarte": BAUMGARTE}[settings.position_correction],
        beta=float(settings.beta),
        slop=float(settings.slop),
        margin=float(settings.margin),
        warm_starting=int(settings.warm_starting),
        solver={"scalar": SCALAR, "block": BLOCK}[settings.solver],
        rotation=int(needs.rotation),
        friction=int(needs.friction),
        restitution=int(needs.restitution),
        broadphase=int(needs.broadphase),
    )
