"""Clipping one face by another, and keeping at most four vertices where that is asked for.

Polygons live in ``Detection.polygon`` in the frame of a reference face: two coordinates along the face, the third
above it, and the rates of the two along it. ``Detection.polygon_edge`` numbers the line that leaves each vertex: 0..3
the edges of the clipped face, 4..7 the sides of the reference face.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.textbook3.state import Detection

#: Vertices this far outside a side, in half extents, count as on it: boxes of one size stacked flush have all
#: their vertices exactly on the sides, and round-off must not turn vertices into edge crossings.
ON_SIDE = 1e-8


#: Entries of a vertex: coordinates along the face and above it [m], and the rates of the first two [m/s].
ENTRIES = 5


@inner_kernel
def clip_to_rectangle(detection: Detection, half_u: float, half_v: float, ahead: float) -> int:
    """Clip the four-sided polygon 0 to |u| <= half_u, |v| <= half_v; the result is polygon 0 again.

    A vertex on a side that leaves it within ``ahead`` [s] is outside: where a corner slides over an edge, two edges
    cross from then on. With 0 it is where it is.
    """
    count = 4
    source = 0
    for side in range(4):
        half = half_u if side < 2 else half_v
        count = _clip(detection, source, count, side, half, ahead)
        source = 1 - source
    return count


@inner_kernel
def _clip(detection: Detection, source: int, count: int, side: int, half: float, ahead: float) -> int:
    """Keep the part of polygon `source` inside one side (Sutherland and Hodgman, CACM 17, 1974)."""
    target = 1 - source
    coordinate = side // 2
    sign = 1.0 if side % 2 == 0 else -1.0
    tolerance = ON_SIDE * half
    polygon, edge = detection.polygon, detection.polygon_edge
    kept = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        here = sign * polygon[source, i, coordinate] - half
        there = sign * polygon[source, j, coordinate] - half
        here_rate, there_rate = sign * polygon[source, i, 3 + coordinate], sign * polygon[source, j, 3 + coordinate]
        inside = is_inside(here, here_rate, tolerance, ahead)
        if inside:
            for d in range(ENTRIES):
                polygon[target, kept, d] = polygon[source, i, d]
            edge[target, kept] = edge[source, i]
            kept += 1
        if inside == is_inside(there, there_rate, tolerance, ahead):
            continue
        if inside and here >= -tolerance:  # the vertex itself lies on the side
            edge[target, kept - 1] = 4 + side
        elif inside or there < -tolerance:
            part = here / (here - there)
            for d in range(3):
                start = polygon[source, i, d]
                polygon[target, kept, d] = start + part * (polygon[source, j, d] - start)
            part_rate = (here_rate - part * (here_rate - there_rate)) / (here - there)
            for d in range(2):
                start, way = polygon[source, i, 3 + d], polygon[source, j, d] - polygon[source, i, d]
                polygon[target, kept, 3 + d] = start + part * (polygon[source, j, 3 + d] - start) + part_rate * way
            edge[target, kept] = 4 + side if inside else edge[source, i]
            kept += 1
    return kept


@inner_kernel
def is_inside(over: float, rate: float, tolerance: float, ahead: float) -> bool:
    """Whether a vertex that is ``over`` a side [m], and goes on over it with ``rate`` [m/s], counts as inside."""
    return over < -tolerance or (over <= tolerance and rate * ahead <= tolerance)


@inner_kernel
def keep_within_reach(detection: Detection, count: int, reach: float) -> int:
    """Copy the vertices of polygon 0 no higher than reach to polygon 1, with vertex names in place of edges.

    A vertex of a convex polygon is where two of its lines meet: its name is 8 * line arriving + line leaving.
    """
    polygon, edge = detection.polygon, detection.polygon_edge
    kept = 0
    for i in range(count):
        if polygon[0, i, 2] <= reach:
            for d in range(3):  # rates are not asked for again
                polygon[1, kept, d] = polygon[0, i, d]
            edge[1, kept] = 8 * edge[0, i - 1 if i > 0 else count - 1] + edge[0, i]
            kept += 1
    return kept


@inner_kernel
def reduce_to_four(detection: Detection, count: int, tolerance: float) -> int:
    """Keep of polygon 1 the deepest vertex, the one farthest from it, and the widest to either side of that line.

    A later vertex must be better by `tolerance` [m], so that round-off does not choose among equals. The order
    is kept. Returns the number of vertices, 3 or 4.
    """
    p = detection.polygon[1]
    first = 0
    for i in range(1, count):
        if p[i, 2] < p[first, 2] - tolerance:
            first = i
    second, farthest = first, 0.0
    for i in range(count):
        distance = math.hypot(p[i, 0] - p[first, 0], p[i, 1] - p[first, 1])
        if distance > farthest + tolerance:
            second, farthest = i, distance
    eu, ev = (p[second, 0] - p[first, 0]) / farthest, (p[second, 1] - p[first, 1]) / farthest
    left, right = first, first
    widest_left, widest_right = 0.0, 0.0
    for i in range(count):
        width = eu * (p[i, 1] - p[first, 1]) - ev * (p[i, 0] - p[first, 0])
        if width > widest_left + tolerance:
            left, widest_left = i, width
        if -width > widest_right + tolerance:
            right, widest_right = i, -width
    kept = 0
    for i in range(count):
        if i == first or i == second or i == left or i == right:
            for d in range(3):
                p[kept, d] = p[i, d]
            detection.polygon_edge[1, kept] = detection.polygon_edge[1, i]
            kept += 1
    return kept
