"""Bounding boxes of spatial bodies, and which of them overlap (`textbook.broadphase`)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.textbook.broadphase import bound_along, pair_bodies
from reference_solver.textbook.options import Options
from reference_solver.textbook3.state import BOX, CANDIDATES, CAPSULE, HALF_SPACE, Bodies, Detection
from reference_solver.textbook3.vector import row, times


@inner_kernel
def find_candidates(bodies: Bodies, detection: Detection, options: Options) -> bool:
    """Fill the candidates of `Detection.boxes`; False if there is no room; see `textbook2.broadphase`."""
    boxes = detection.boxes
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
        if bodies.kind[i] == HALF_SPACE:
            normal = times(bodies.axes, i, row(bodies.geometry, i, 0))
            for d in range(3):
                bound_along(boxes, i, d, normal[d], bodies.pose[i, d] + bodies.geometry[i, 3] * normal[d])
    detection.found[CANDIDATES] = pair_bodies(detection.boxes, options.broadphase)
    return bool(detection.found[CANDIDATES] <= len(detection.boxes.candidate))
