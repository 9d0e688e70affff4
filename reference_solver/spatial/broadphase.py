"""Bounding boxes of spatial bodies, and which of them overlap (`stepping.broadphase`)."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.compilation import inner_kernel
from reference_solver.spatial.state import BOX, CANDIDATES, CAPSULE, FREE, HALF_SPACE, Bodies, Detection
from reference_solver.spatial.vector import row, times
from reference_solver.stepping import operations
from reference_solver.stepping.broadphase import Boxes, bound_along, pair_bodies
from reference_solver.stepping.options import Options


@inner_kernel
def bound_bodies(bodies: Bodies, boxes: Boxes, options: Options) -> None:
    """Axis-aligned bounds, widened by the detection margin; a half-space is unbounded."""
    for i in range(len(bodies)):
        # A pair's margin is the smaller of both extents, so that one body's own margin always covers it.
        grow = options.margin * bodies.extent[i]
        for d in range(3):
            wide = bodies.geometry[i, 0]
            if bodies.kind[i] == HALF_SPACE:
                wide = math.inf
            elif bodies.kind[i] == BOX:
                wide = 0.0
                for k in range(3):
                    wide += abs(bodies.axes[i, d, k]) * bodies.geometry[i, k]
            elif bodies.kind[i] == CAPSULE:
                wide = abs(bodies.axes[i, d, 0]) * bodies.geometry[i, 0] + bodies.geometry[i, 1]
            far = wide + (grow + 1e-15 * (wide + abs(bodies.pose[i, d])))  # 1e-15: rounding of these sums
            boxes.low[i, d] = bodies.pose[i, d] - far
            boxes.high[i, d] = bodies.pose[i, d] + far


@inner_kernel
def is_free(bodies: Bodies, i: int) -> bool:
    """Whether forces move body i."""
    return bool(bodies.motion[i] == FREE)


@inner_kernel
def find_candidates(bodies: Bodies, detection: Detection, options: Options) -> bool:
    """Fill the candidates of `Detection.boxes`; False if there is no room."""
    bound_bodies(bodies, detection.boxes, options)
    for i in range(len(bodies)):
        if bodies.kind[i] == HALF_SPACE:
            normal = times(bodies.axes, i, row(bodies.geometry, i, 0))
            for d in range(3):
                bound_along(detection.boxes, i, d, normal[d], bodies.pose[i, d] + bodies.geometry[i, 3] * normal[d])
    return find_overlaps(bodies, detection, options)


@inner_kernel
def find_overlaps(bodies: Bodies, detection: Detection, options: Options) -> bool:
    """The same from the boxes as they are."""
    detection.found[CANDIDATES] = pair_bodies(bodies, detection.boxes, options.broadphase)
    return bool(detection.found[CANDIDATES] <= len(detection.boxes.candidate))


operations.provide(operations.is_free, np.recarray, is_free)
