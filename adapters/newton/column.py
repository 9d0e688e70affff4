"""A column of upright boxes on a floor, step by step as in Newton's XPBD: the formulas of `motion` along one axis.

Level faces touch in four contacts, one at each corner of the smaller face, with equal depths and corrections; there is
no rotation and no slip. Box i, with n_i contacts (eight, or four for the topmost), gets in an iteration the correction

    r/n_i (4 d_i/K_i - 4 d_(i+1)/K_(i+1))/m_i        d the depths below and above, 1/K the effective mass at a corner

so at rest L_i - L_(i+1) = n_i m g dt holds for the sums L of the corrections at the corners of a face: four weights per
step at the top, eight more for each box. The reported impulse of a face is the mean of both bodies, 2 L/(n_i +
n_(i-1)), and L/n_1 at the floor: 2/3 of the weight under the topmost box, n - i + 1/2 of n - i + 1 boxes below it, if
all faces press in every iteration.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from adapters.newton.shipped import STOPPED
from adapters.newton.telling import told_contacts, told_trajectory
from adapters.scene import Body, Box, HalfSpace, Scene
from adapters.trajectory import Trajectory

#: Corners of a face.
CORNERS = 4.0


def column_of(scene: Scene) -> list[int] | None:
    """Indices of a 3-D scene's floor and of the boxes on it from below; None if it is no column.

    Its boxes are upright about one line, move only along it, and touch only their neighbours.
    """
    fixed = [k for k, body in enumerate(scene.bodies) if body.motion != "free"]
    free = sorted((k for k, body in enumerate(scene.bodies) if body.motion == "free"), key=lambda k: _height(scene, k))
    if len(fixed) != 1 or not free or not _is_floor(scene.bodies[fixed[0]]) or any(scene.gravity[:2]):
        return None
    first = scene.bodies[free[0]]
    if not all(_is_upright(scene.bodies[k], first) for k in free):
        return None
    if any(scene.material(scene.bodies[i].name, scene.bodies[j].name).restitution for i, j in pairwise(fixed + free)):
        return None
    return fixed + free


def _height(scene: Scene, k: int) -> float:
    return float(scene.bodies[k].pose[2])


def _is_floor(body: Body) -> bool:
    still = body.motion == "fixed" and not any(body.surface_velocity)
    return still and isinstance(body.shape, HalfSpace) and tuple(body.shape.normal) == (0.0, 0.0, 1.0)


def _is_upright(body: Body, first: Body) -> bool:
    level = tuple(body.pose[3:]) == (1.0, 0.0, 0.0, 0.0) and tuple(body.pose[:2]) == tuple(first.pose[:2])
    along = not any(body.twist[:2]) and not any(body.twist[3:]) and not any(body.force[:2]) and not any(body.torque)
    return isinstance(body.shape, Box) and level and along


def _corner_feels(below: Body, above: Body) -> float:
    """K: inverse mass at a corner of the face between two bodies [1/kg]; the floor's share is 0."""
    boxes = [body for body in (below, above) if isinstance(body.shape, Box)]
    levers = np.min([body.shape.half_extents[:2] for body in boxes if isinstance(body.shape, Box)], axis=0)
    felt = 0.0
    for body in boxes:
        inertia = np.broadcast_to(np.asarray(body.inertia, float), 3)
        felt += 1.0 / body.mass + levers[1] ** 2 / inertia[0] + levers[0] ** 2 / inertia[1]
    return float(felt)


def column_moved(
    spatial: Scene,
    column: list[int],
    steps: int,
    dt: float,
    longer: float,
    chosen: Mapping[str, Any],
    single: bool,
    blur: tuple[float, float, float],
    flat: bool,
) -> Trajectory | None:
    """Motion of a column; None if boxes are so deep that other contacts matter than those of neighbours' faces.

    ``longer``, ``single`` and ``blur`` as in `motion.moved`; ``flat``: of a 2-D scene, in its own coordinates.
    """
    from adapters.newton.column_recurrence import Boxes, ColumnSettings, ColumnTold, run_column

    kind = np.float32 if single else np.float64
    bodies = [spatial.bodies[k] for k in column]
    floor, boxes, many = bodies[0], bodies[1:], len(bodies)
    assert isinstance(floor.shape, HalfSpace)

    def rows(first: float, *others: float) -> np.ndarray[Any, np.dtype[Any]]:
        return np.array([first, *others], kind)

    halves = [body.shape.half_extents[2] for body in boxes if isinstance(body.shape, Box)]
    world = Boxes(
        rows(float(floor.shape.offset), *(body.pose[2] for body in boxes)),
        rows(0.0, *(body.twist[2] for body in boxes)),
        rows(0.0, *(1.0 / body.mass for body in boxes)),
        rows(0.0, *halves),
        rows(0.0, *(spatial.gravity[2] + body.force[2] / body.mass for body in boxes)),
        rows(1.0, *(_corner_feels(below, above) for below, above in pairwise(bodies))),
        *(np.zeros(many, kind) for _ in range(6)),
    )
    numbers = ColumnSettings(
        rows(dt * (1.0 + longer)), rows(chosen["relaxation"]), rows(2.0 * chosen["gap"]), rows(STOPPED * STOPPED),
        rows(blur[2]), rows(0.0, 0.5, 1.0, CORNERS), chosen["iterations"], int(chosen["weighted"]),
    )  # fmt: skip
    told = ColumnTold(*(np.zeros((steps, many), each) for each in (kind, kind, kind, np.int8)))
    run_column(world, numbers, told)
    if not _is_told(told.place, bodies):
        return None
    # Only heights change: other coordinates and orientations are those of the start.
    pose = np.repeat(np.array([[body.pose for body in boxes]], float), steps, axis=0)
    twist = np.repeat(np.array([[body.twist for body in boxes]], float), steps, axis=0)
    pose[..., 2], twist[..., 2] = told.place[:, 1:], told.speed[:, 1:]
    impulse = np.zeros((steps, many, 3))
    impulse[..., 2] = told.impulse
    faces = np.stack([np.roll(column, 1), column], axis=1)  # there is no body and no contact below the floor
    record = told_contacts(told.pressed, faces, impulse, flat)
    return told_trajectory(spatial, column[1:], pose, twist, record, dt, flat)


def _is_told(place: np.ndarray[Any, np.dtype[Any]], bodies: list[Body]) -> bool:
    """Whether the least overlap is always across the faces, and no box reaches through its neighbour."""
    sizes = [body.shape.half_extents if isinstance(body.shape, Box) else (np.inf, np.inf, 0.0) for body in bodies]
    least = [2.0 * min(*a[:2], *b[:2]) for a, b in pairwise(sizes)]
    low, high = (place + sign * np.array([size[2] for size in sizes]) for sign in (-1.0, 1.0))
    deep = (high[:, :-1] - low[:, 1:] >= np.array(least)).any()
    return bool(np.isfinite(place).all() and not deep and (low[:, 2:] > high[:, :-2]).all())
