"""What the step asks of space (`stepping.operations`): bodies displaced and turned, loads, held contacts."""

from __future__ import annotations

from typing import Any, NamedTuple

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.spatial.features import distances_to_limits, follow, name_features, name_next
from reference_solver.spatial.motion import momentum_of, put_orientation, set_orientation
from reference_solver.spatial.state import FREE, Manifolds
from reference_solver.spatial.turning import vector_curvature, vector_rate
from reference_solver.spatial.vector import (
    ZERO,
    Quaternion,
    cross,
    quaternion_product,
    rotation_quaternion,
    row,
    sub,
    times,
)
from reference_solver.stepping import operations
from reference_solver.stepping.lasting import CONTACTS, Lasting
from reference_solver.structures import structure


@structure
class Spatial(NamedTuple):
    """The bodies under a type of their own, by which the step knows space."""

    record: Any  # (n,) records `BODY`
    pose: Array  # (n, 7): of those records
    twist: Array  # (n, 6)


@inner_kernel
def is_free(bodies: Spatial, i: int) -> bool:
    """Whether forces move body i."""
    return bool(bodies.record.motion[i] == FREE)


@inner_kernel
def hold(bodies: Spatial, manifolds: Manifolds, lasting: Lasting, c: int, k: int) -> None:
    """Note the features of point c % 8 of manifold c // 8."""
    name_features(bodies.record, manifolds, lasting, c, k)


@inner_kernel
def next_features(bodies: Spatial, lasting: Lasting, k: int) -> bool:
    """Name the next features of contact k."""
    return bool(name_next(bodies.record, lasting, k))


@inner_kernel
def evaluate(bodies: Spatial, lasting: Lasting) -> None:
    """Follow the features of all contacts."""
    for k in range(lasting.size[CONTACTS]):
        follow(bodies.record, lasting, k)


@inner_kernel
def free_accelerations(bodies: Spatial, lasting: Lasting) -> None:
    """Loads, and the gyroscopic term of Euler's equations: I dw/dt = torque - w x I w."""
    record = bodies.record
    for i in range(len(record)):
        spin = (0.0, 0.0, 0.0)
        if record.motion[i] == FREE:
            w = row(record.twist, i, 3)
            turning = row(record.torque, i, 0)
            if record.gyroscopic[i]:
                turning = sub(turning, cross(w, momentum_of(record, i, w)))
            spin = times(record.inverse_inertia, i, turning)
        for d in range(3):
            lasting.free[i, d] = record.acceleration[i, d] if record.motion[i] == FREE else 0.0
            lasting.free[i, 3 + d] = spin[d]


@inner_kernel
def displace(bodies: Spatial, lasting: Lasting, i: int) -> None:
    """Pose, axes and inertia of body i."""
    record = bodies.record
    for d in range(3):
        record.pose[i, d] = lasting.base[i, d] + lasting.displacement[i, d]
    psi = row(lasting.displacement, i, 3)
    q: Quaternion = (lasting.base[i, 3], lasting.base[i, 4], lasting.base[i, 5], lasting.base[i, 6])
    if psi == ZERO:
        put_orientation(record, i, q)
    elif record.turning[i]:
        set_orientation(record, i, quaternion_product(rotation_quaternion(psi), q))


@inner_kernel
def displacement_rate(bodies: Spatial, lasting: Lasting, i: int, stage: int) -> None:
    """Velocity, and the rate of the rotation vector."""
    rate = vector_rate(row(lasting.displacement, i, 3), row(bodies.record.twist, i, 3))
    for d in range(3):
        lasting.rate[stage, i, d] = bodies.record.twist[i, d]
        lasting.rate[stage, i, 3 + d] = rate[d]


@inner_kernel
def displacement_curvature(bodies: Spatial, lasting: Lasting, i: int, end: int) -> None:
    """Acceleration, and the second derivative of the rotation vector."""
    w = row(bodies.record.twist, i, 3)
    bend = vector_curvature(row(lasting.displacement, i, 3), w, row(lasting.acceleration, i, 3))
    for d in range(3):
        lasting.bend[end, i, d] = lasting.acceleration[i, d]
        lasting.bend[end, i, 3 + d] = bend[d]


@inner_kernel
def feature_limits(bodies: Spatial, lasting: Lasting, k: int, place: int) -> None:
    """Distances of contact k from where its features end [m]."""
    distances_to_limits(bodies.record, lasting, k, place)


operations.provide(operations.is_free, Spatial, is_free)
operations.provide(operations.hold, Spatial, hold)
operations.provide(operations.next_features, Spatial, next_features)
operations.provide(operations.evaluate, Spatial, evaluate)
operations.provide(operations.free_accelerations, Spatial, free_accelerations)
operations.provide(operations.displace, Spatial, displace)
operations.provide(operations.displacement_rate, Spatial, displacement_rate)
operations.provide(operations.displacement_curvature, Spatial, displacement_curvature)
operations.provide(operations.feature_limits, Spatial, feature_limits)
