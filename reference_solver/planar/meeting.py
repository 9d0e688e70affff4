"""Two planar bodies on their paths, for the time of impact: where their corners are, and how far they are apart."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar import columns
from reference_solver.planar.columns import COS, FIRST_VERTEX, MOTION, ROUNDING, SHAPE, SIN, VERTICES
from reference_solver.planar.separating_axis import CORNERS, best_axis, corner, corner_line, edge_normal
from reference_solver.planar.state import FIXED, HALF_SPACE, Bodies, Indices
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


@structure
class Meeting(NamedTuple):
    """A pair of bodies at a time of the step; the first may be a plane (`time_of_impact`)."""

    bodies: Bodies  # all, read for their shapes only, and for the place of what is fixed
    paths: Paths  # of all
    trial: Bodies  # (2,): the pair where it stands
    kind: Indices  # (KINDS,)
    size: Array  # (2, SIZES)
    offset: Array  # (1,): of the plane from the first body's centre [m]
    vector: Array  # (VECTORS, 3)
    corner: Array  # (2, v, 3): corners of the cores from the centres, where the pair stands [m]
    watched: Indices  # (v,): 1 for the corners of the second body that may not come down unseen
    sunk: Array  # (v,): how deep they are in a plane to begin with, which is no contact until it grows [m]


def allocate_meeting(bodies: Bodies) -> Meeting:
    """Return room for pairs of ``bodies``, and for the paths of all."""
    # The table of all vertices stays one: bodies of the pair keep their places in it.
    pair = Bodies(*(np.zeros((2, *array.shape[1:]), array.dtype) for array in bodies))._replace(vertex=bodies.vertex)
    most = int(bodies.kind[:, VERTICES].max(initial=1))
    return Meeting(
        bodies=bodies,
        paths=allocate_paths(2, len(bodies.pose)),
        trial=pair,
        kind=np.zeros(KINDS, np.int64),
        size=np.zeros((2, SIZES)),
        offset=np.zeros(1),
        vector=np.zeros((VECTORS, 3)),
        corner=np.zeros((2, most, 3)),
        watched=np.zeros(most, np.int64),
        sunk=np.zeros(most),
    )


@inner_kernel
def is_half_space(meeting: Meeting, i: int) -> bool:
    """Whether body i is one."""
    return bool(meeting.bodies.kind[i, SHAPE] == HALF_SPACE)


@inner_kernel
def introduce(meeting: Meeting, first: int, second: int) -> None:
    """Shapes of the pair."""
    meeting.kind[FIRST], meeting.kind[SECOND], meeting.kind[PLANE] = first, second, 0
    for k in range(2):
        i = first if k == 0 else second
        kind, real = meeting.bodies.kind, meeting.bodies.real
        meeting.trial.kind[k, SHAPE], meeting.trial.kind[k, MOTION] = kind[i, SHAPE], kind[i, MOTION]
        meeting.trial.kind[k, FIRST_VERTEX], meeting.trial.kind[k, VERTICES] = kind[i, FIRST_VERTEX], kind[i, VERTICES]
        meeting.trial.real[k, ROUNDING] = real[i, ROUNDING]
        meeting.trial.real[k, COS], meeting.trial.real[k, SIN] = real[i, COS], real[i, SIN]
        meeting.kind[CORNERS_FIRST + k] = kind[i, VERTICES]
        meeting.size[k, RADIUS], meeting.size[k, EXTENT] = real[i, ROUNDING], real[i, columns.EXTENT]
        meeting.size[k, REACH] = 0.0 if kind[i, VERTICES] < 2 else real[i, columns.REACH] - real[i, ROUNDING]
    if meeting.bodies.kind[first, SHAPE] == HALF_SPACE:
        meeting.kind[PLANE] = 1
        meeting.vector[FACE, 0] = meeting.bodies.real[first, columns.SIZE]
        meeting.vector[FACE, 1] = meeting.bodies.real[first, columns.SIZE + 1]
        meeting.offset[0] = meeting.bodies.real[first, columns.SIZE + 2]


@inner_kernel
def stand(meeting: Meeting, t: float) -> None:
    """Poses, velocities and corners of both bodies at time t."""
    trial, paths = meeting.trial, meeting.paths
    for k in range(2):
        i = meeting.kind[FIRST + k]
        turns = trial.kind[k, VERTICES] > 1 or trial.kind[k, SHAPE] == HALF_SPACE
        for d in range(2):
            trial.pose[k, d], meeting.vector[VELOCITY + k, d] = meeting.bodies.pose[i, d], 0.0
        if trial.kind[k, MOTION] != FIXED:
            for d in range(2):
                trial.pose[k, d] = paths.pose[i, d] + derivative(paths, i, d, 0, t)
                meeting.vector[VELOCITY + k, d] = derivative(paths, i, d, 1, t)
            if turns:
                angle = paths.pose[i, 2] + derivative(paths, i, 2, 0, t)
                trial.real[k, COS], trial.real[k, SIN] = math.cos(angle), math.sin(angle)
                meeting.vector[SPIN + k, 2] = derivative(paths, i, 2, 1, t)
        if not turns or trial.kind[k, MOTION] == FIXED:
            meeting.vector[SPIN + k, 2] = 0.0
        for d in range(2):
            meeting.vector[CENTRE + k, d] = trial.pose[k, d]
        for c in range(trial.kind[k, VERTICES]):
            meeting.corner[k, c, 0], meeting.corner[k, c, 1] = corner(trial, k, c)
    if meeting.kind[PLANE]:
        c, s, x, y = trial.real[0, COS], trial.real[0, SIN], meeting.vector[FACE, 0], meeting.vector[FACE, 1]
        set_normal(meeting, c * x - s * y, s * x + c * y, 0.0)


@inner_kernel
def fix_plane(meeting: Meeting) -> None:
    """The present normal, in the axes of the first body."""
    meeting.kind[PLANE] = 1
    c, s = meeting.trial.real[0, COS], meeting.trial.real[0, SIN]
    x, y = meeting.vector[NORMAL, 0], meeting.vector[NORMAL, 1]
    meeting.vector[FACE, 0], meeting.vector[FACE, 1] = c * x + s * y, c * y - s * x


@inner_kernel
def separate(meeting: Meeting) -> float:
    """Distance of two bodies with corners, of overlapping ones minus the least overlap (E50) [m]."""
    trial = meeting.trial
    dx, dy = trial.pose[1, 0] - trial.pose[0, 0], trial.pose[1, 1] - trial.pose[0, 1]
    value, reference, k, l = best_axis(trial, 0, 1, dx, dy, 0.0)
    if reference == CORNERS:
        x, y = corner_line(trial, 0, 1, k, l, dx, dy)
    elif trial.kind[reference, VERTICES] < 2:  # two centres in one place
        x, y = 1.0, 0.0
    else:
        x, y = edge_normal(trial, reference, k)
        if reference == 1:
            x, y = -x, -y
    set_normal(meeting, x, y, 0.0)
    return value - trial.real[0, ROUNDING] - trial.real[1, ROUNDING]


@inner_kernel
def turn_bounds(meeting: Meeting, i: int, now: float, until: float) -> tuple[float, float]:
    """Bounds of the rates of the angle."""
    paths = meeting.paths
    return derivative_bound(paths, i, True, 1, now, until), derivative_bound(paths, i, True, 2, now, until)


provide(time_of_impact.is_half_space, Meeting, is_half_space)
provide(time_of_impact.introduce, Meeting, introduce)
provide(time_of_impact.stand, Meeting, stand)
provide(time_of_impact.fix_plane, Meeting, fix_plane)
provide(time_of_impact.separate, Meeting, separate)
provide(time_of_impact.turn_bounds, Meeting, turn_bounds)
