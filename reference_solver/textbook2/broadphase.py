"""Bounding boxes of planar bodies, and which of them overlap (`textbook.broadphase`)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.textbook.broadphase import bound_along, pair_bodies
from reference_solver.textbook.options import Options
from reference_solver.textbook2.columns import COS, EXTENT, REACH, SHAPE, SIN, SIZE
from reference_solver.textbook2.state import BOX, CANDIDATES, CAPSULE, HALF_SPACE, Bodies, Pairs, Rows


@inner_kernel
def find_candidates(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> bool:
    """Fill the candidates of `Pairs.boxes`; False if there is no room.

    Bounds are widened by the detection margin. A half-space is unbounded, but for the side of a face along an axis.
    """
    for i in range(len(bodies.kind)):
        wide = bodies.real[i, SIZE]
        high = wide
        if bodies.kind[i, SHAPE] == HALF_SPACE:
            wide = high = math.inf
        elif bodies.kind[i, SHAPE] == BOX:
            c, s = abs(bodies.real[i, COS]), abs(bodies.real[i, SIN])
            wide = c * bodies.real[i, SIZE] + s * bodies.real[i, SIZE + 1]
            high = s * bodies.real[i, SIZE] + c * bodies.real[i, SIZE + 1]
        elif bodies.kind[i, SHAPE] >= CAPSULE:
            wide = high = bodies.real[i, REACH]
        # A pair's margin is the smaller of both extents, so that one body's own margin always covers it.
        grow = options.margin * bodies.real[i, EXTENT] + 1e-15 * (abs(bodies.pose[i, 0]) + abs(bodies.pose[i, 1]))
        pairs.boxes.low[i, 0], pairs.boxes.high[i, 0] = bodies.pose[i, 0] - wide - grow, bodies.pose[i, 0] + wide + grow
        pairs.boxes.low[i, 1], pairs.boxes.high[i, 1] = bodies.pose[i, 1] - high - grow, bodies.pose[i, 1] + high + grow
        if bodies.kind[i, SHAPE] == HALF_SPACE:
            c, s = bodies.real[i, COS], bodies.real[i, SIN]
            x, y = bodies.real[i, SIZE], bodies.real[i, SIZE + 1]
            normal = (c * x - s * y, s * x + c * y)
            for k in range(2):
                bound_along(pairs.boxes, i, k, normal[k], bodies.pose[i, k] + bodies.real[i, SIZE + 2] * normal[k])
    rows.counts[CANDIDATES] = pair_bodies(pairs.boxes, options.broadphase)
    return bool(rows.counts[CANDIDATES] <= len(pairs.boxes.candidate))
