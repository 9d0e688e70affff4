"""Two spatial bodies on their paths, for the time of impact: where their corners are, and how far they are apart."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.spatial.flight import copy_body, curvature, place_at, reach_of
from reference_solver.spatial.motion import set_orientation
from reference_solver.spatial.separation import radius_of, separation
from reference_solver.spatial.state import BODY, BOX, CAPSULE, FIXED, HALF_SPACE, Bodies, Indices
from reference_solver.spatial.vector import (
    Vector,
    add_scaled,
    axis,
    cross,
    dot,
    length,
    quaternion_product,
    rotation_quaternion,
    row,
    scale,
    times,
    times_transposed,
)
from reference_solver.stepping import time_of_impact
from reference_solver.stepping.operations import provide
from reference_solver.stepping.paths import Paths, allocate_paths, derivative, derivative_bound
from reference_solver.stepping.time_of_impact import (
    CENTRE,
    CORNERS_FIRST,
    EXTENT,
    FACE,
    FIRST,
    KINDS,
    NORMAL,
    PLANE,
    RADIUS,
    REACH,
    SECOND,
    SIZES,
    SPIN,
    VECTORS,
    VELOCITY,
    set_normal,
)
from reference_solver.structures import structure

#: Corners of a box, the most a core has.
MOST_CORNERS = 8


@structure
class Meeting(NamedTuple):
    """A pair of bodies at a time of the step; the first may be a plane (`time_of_impact`)."""

    bodies: Any  # all, read for their shapes, the place of what is fixed, and how bodies turn by their momentum
    paths: Paths  # of all
    trial: Any  # (2,): the pair where it stands
    kind: Indices  # (KINDS,)
    size: Array  # (2, SIZES)
    offset: Array  # (1,): of the plane from the first body's centre [m]
    vector: Array  # (VECTORS, 3)
    corner: Array  # (2, 8, 3): corners of the cores from the centres, where the pair stands [m]
    watched: Indices  # (8,): 1 for the corners of the second body that may not come down unseen
    sunk: Array  # (v,): how deep they are in a plane to begin with, which is no contact until it grows [m]


def allocate_meeting(bodies: Bodies) -> Meeting:
    """Return room for pairs of ``bodies``, and for the paths of all."""
    return Meeting(
        bodies=bodies,
        paths=allocate_paths(3, len(bodies)),
        trial=np.zeros(2, BODY).view(np.recarray),
        kind=np.zeros(KINDS, np.int64),
        size=np.zeros((2, SIZES)),
        offset=np.zeros(1),
        vector=np.zeros((VECTORS, 3)),
        corner=np.zeros((2, MOST_CORNERS, 3)),
        watched=np.zeros(MOST_CORNERS, np.int64),
        sunk=np.zeros(MOST_CORNERS),
    )


@inner_kernel
def is_half_space(meeting: Meeting, i: int) -> bool:
    """Whether body i is one."""
    return bool(meeting.bodies.kind[i] == HALF_SPACE)


@inner_kernel
def corner_count(bodies: Bodies, i: int) -> int:
    """Number of corners of the core: 8 of a box, 2 of a capsule, the centre of a sphere, none of a half-space."""
    if bodies.kind[i] == BOX:
        return MOST_CORNERS
    if bodies.kind[i] == CAPSULE:
        return 2
    return 0 if bodies.kind[i] == HALF_SPACE else 1


@inner_kernel
def introduce(meeting: Meeting, first: int, second: int) -> None:
    """Shapes of the pair."""
    bodies = meeting.bodies
    meeting.kind[FIRST], meeting.kind[SECOND], meeting.kind[PLANE] = first, second, 0
    for k in range(2):
        i = first if k == 0 else second
        copy_body(bodies, i, meeting.trial, k)
        meeting.kind[CORNERS_FIRST + k] = corner_count(bodies, i)
        meeting.size[k, RADIUS], meeting.size[k, REACH] = radius_of(bodies, i), reach_of(bodies, i)
        meeting.size[k, EXTENT] = bodies.extent[i]
    if bodies.kind[first] == HALF_SPACE:
        meeting.kind[PLANE] = 1
        for d in range(3):
            meeting.vector[FACE, d] = bodies.geometry[first, d]
        meeting.offset[0] = bodies.geometry[first, 3]


@inner_kernel
def spin_on(paths: Paths, i: int, t: float) -> tuple[Vector, Vector]:
    """Turn psi and angular velocity of body i at time t: ``w = integral of exp(u psi) psi' du`` over u from 0 to 1.

    Its sum is ``psi' + (1 - cos a)/a^2 psi x psi' + (a - sin a)/a^3 psi x (psi x psi')``, a = |psi| (the left Jacobian
    of the rotation group; G. Chirikjian, Stochastic Models, Information Theory, and Lie Groups 2, 2012, 10.8).
    """
    psi = (derivative(paths, i, 3, 0, t), derivative(paths, i, 4, 0, t), derivative(paths, i, 5, 0, t))
    rate = (derivative(paths, i, 3, 1, t), derivative(paths, i, 4, 1, t), derivative(paths, i, 5, 1, t))
    square = dot(psi, psi)
    if square < 1e-4:  # by their series: the next terms are below 1e-15 here, and differences of near numbers avoided
        first = 0.5 - square / 24.0 * (1.0 - square / 30.0)
        second = 1.0 / 6.0 - square / 120.0 * (1.0 - square / 42.0)
    else:
        angle = math.sqrt(square)
        half = math.sin(0.5 * angle)
        first, second = 2.0 * half * half / square, (angle - math.sin(angle)) / (angle * square)
    across = cross(psi, rate)
    return psi, add_scaled(add_scaled(rate, first, across), second, cross(psi, across))


@inner_kernel
def flies_by_momentum(bodies: Bodies, i: int) -> bool:
    """Whether body i turns by its angular momentum, not along a polynomial (E30)."""
    return bool(bodies.gyroscopic[i] and not bodies.curved[i])


@inner_kernel
def stand(meeting: Meeting, t: float) -> None:
    """Poses, velocities and corners of both bodies at time t."""
    trial, paths, bodies, vector = meeting.trial, meeting.paths, meeting.bodies, meeting.vector
    for k in range(2):
        i = meeting.kind[FIRST + k]
        for d in range(3):
            vector[VELOCITY + k, d] = vector[SPIN + k, d] = 0.0
        if trial.motion[k] != FIXED:
            for d in range(3):
                trial.pose[k, d] = paths.pose[i, d] + derivative(paths, i, d, 0, t)
                vector[VELOCITY + k, d] = derivative(paths, i, d, 1, t)
            if flies_by_momentum(bodies, i):
                place_at(bodies, i, t, trial, k)
                for d in range(3):
                    vector[SPIN + k, d] = trial.twist[k, 3 + d]
            elif bodies.turning[i] and (meeting.size[k, REACH] > 0.0 or bodies.kind[i] == HALF_SPACE):
                psi, w = spin_on(paths, i, t)
                start = (paths.pose[i, 3], paths.pose[i, 4], paths.pose[i, 5], paths.pose[i, 6])
                set_orientation(trial, k, quaternion_product(rotation_quaternion(psi), start))
                for d in range(3):
                    vector[SPIN + k, d] = w[d]
        for d in range(3):
            vector[CENTRE + k, d] = trial.pose[k, d]
        for c in range(meeting.kind[CORNERS_FIRST + k]):
            arm = corner(trial, k, c)
            for d in range(3):
                meeting.corner[k, c, d] = arm[d]
    if meeting.kind[PLANE]:
        n = times(trial.axes, 0, row(vector, FACE, 0))
        set_normal(meeting, n[0], n[1], n[2])


@inner_kernel
def corner(trial: Bodies, k: int, i: int) -> Vector:
    """Corner i of the core from the centre, numbered as in the narrowphase [m]."""
    x, y, z = trial.geometry[k, 0], trial.geometry[k, 1], trial.geometry[k, 2]
    if trial.kind[k] == BOX:
        return times(trial.axes, k, (x if i & 1 else -x, y if i & 2 else -y, z if i & 4 else -z))
    return scale(-x if i else x, axis(trial.axes, k, 0)) if trial.kind[k] == CAPSULE else (0.0, 0.0, 0.0)


@inner_kernel
def fix_plane(meeting: Meeting) -> None:
    """The present normal, in the axes of the first body."""
    meeting.kind[PLANE] = 1
    n = times_transposed(meeting.trial.axes, 0, row(meeting.vector, NORMAL, 0))
    for d in range(3):
        meeting.vector[FACE, d] = n[d]


@inner_kernel
def separate(meeting: Meeting) -> float:
    """Distance of two bodies with corners (E31) [m]."""
    ordered = meeting.trial.kind[0] <= meeting.trial.kind[1]
    value, n = separation(meeting.trial, 0 if ordered else 1, 1 if ordered else 0)
    sign = 1.0 if ordered else -1.0
    set_normal(meeting, sign * n[0], sign * n[1], sign * n[2])
    return value


@inner_kernel
def turn_bounds(meeting: Meeting, i: int, now: float, until: float) -> tuple[float, float]:
    """|w| is at most |psi'| and |dw/dt| at most |psi''| + |psi'|^2 / 2 (`spin_on`); else what its momentum allows.

    With angular momentum L a body turns at |L| / I_min at most, and w changes by I^-1 (torque - w x L).
    """
    bodies, paths = meeting.bodies, meeting.paths
    if not bodies.turning[i]:
        return 0.0, 0.0
    if flies_by_momentum(bodies, i):
        least = min(bodies.moments[i, 0], bodies.moments[i, 1], bodies.moments[i, 2])
        torque = length(curvature(bodies, i, 3))
        fastest = (length(row(bodies.angular_momentum, i, 0)) + until * torque) / least
        return fastest, fastest * fastest + torque / least
    spin, change = derivative_bound(paths, i, True, 1, now, until), derivative_bound(paths, i, True, 2, now, until)
    return spin, change + 0.5 * spin * spin


provide(time_of_impact.is_half_space, Meeting, is_half_space)
provide(time_of_impact.introduce, Meeting, introduce)
provide(time_of_impact.stand, Meeting, stand)
provide(time_of_impact.fix_plane, Meeting, fix_plane)
provide(time_of_impact.separate, Meeting, separate)
provide(time_of_impact.turn_bounds, Meeting, turn_bounds)
