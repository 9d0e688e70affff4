"""How far two bodies are apart: the polygon of each body's vertices, its core, grown by its rounding radius.

Of two disjoint convex polygons the nearest points are a corner and a point of an edge, or two corners. The normals
of all edges and the line through the nearest two corners are therefore the only axes that matter, and the largest
separation over them is the distance of disjoint cores, the least overlap of others (separating axis theorem; C.
Ericson, Real-Time Collision Detection, 2005, 5.2).
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.textbook2.columns import COS, EXTENT, FIRST_VERTEX, SIN, VERTICES
from reference_solver.textbook2.state import Bodies

#: Another axis must be better by this fraction of the smaller half width, so that ties of aligned boxes are
#: always decided the same way and round-off cannot swap the reference face (and with it the warm start).
AXIS_ADVANTAGE = 1e-6
#: The same where a step is solved to round-off: what is less is no tilt but round-off, and a normal is exact to it.
EXACT_ADVANTAGE = 1e-9
#: In place of a reference body: the axis is the line through two corners.
CORNERS = -1


@spliced_kernel
def corner(bodies: Bodies, i: int, k: int) -> tuple[float, float]:
    """Vertex k of body i (k up to the count, which is vertex 0 again) minus its centre, world axes [m]."""
    v = bodies.kind[i, FIRST_VERTEX] + (k if k < bodies.kind[i, VERTICES] else 0)
    x, y = bodies.vertex[v, 0], bodies.vertex[v, 1]
    c, s = bodies.real[i, COS], bodies.real[i, SIN]
    return c * x - s * y, s * x + c * y


@spliced_kernel
def edge_normal(bodies: Bodies, i: int, k: int) -> tuple[float, float]:
    """Outward unit normal of edge k of body i, from vertex k to the next; a capsule's core has two edges."""
    px, py = corner(bodies, i, k)
    qx, qy = corner(bodies, i, k + 1)
    ex, ey = qx - px, qy - py
    length = math.sqrt(ex * ex + ey * ey)
    return ey / length, -ex / length


@spliced_kernel
def support(bodies: Bodies, i: int, nx: float, ny: float) -> float:
    """Largest n . v over the vertices v of body i, from its centre [m]."""
    farthest = -math.inf
    for k in range(bodies.kind[i, VERTICES]):
        x, y = corner(bodies, i, k)
        farthest = max(farthest, nx * x + ny * y)
    return farthest


@spliced_kernel
def best_edge(bodies: Bodies, r: int, i: int, dx: float, dy: float, advantage: float) -> tuple[float, int]:
    """Separation of core i from the edge of core r that separates best, and that edge; (dx, dy) leads from r to i.

    -inf for a single vertex. A later edge must be better by `advantage`, so that round-off does not choose.
    """
    best, edge = -math.inf, 0
    count = bodies.kind[r, VERTICES]
    for k in range(count if count > 1 else 0):
        nx, ny = edge_normal(bodies, r, k)
        x, y = corner(bodies, r, k)
        separation = nx * (dx - x) + ny * (dy - y) - support(bodies, i, -nx, -ny)
        if separation > best + advantage:
            best, edge = separation, k
    return best, edge


@spliced_kernel
def nearest_corners(bodies: Bodies, a: int, b: int, dx: float, dy: float, advantage: float) -> tuple[float, int, int]:
    """Separation of the cores along the line through their nearest two corners, and these corners."""
    nearest, k, l = math.inf, 0, 0
    for i in range(bodies.kind[a, VERTICES]):
        ax, ay = corner(bodies, a, i)
        for j in range(bodies.kind[b, VERTICES]):
            bx, by = corner(bodies, b, j)
            distance = math.hypot(dx + bx - ax, dy + by - ay)
            if distance < nearest - advantage:
                nearest, k, l = distance, i, j
    if nearest == 0.0:
        return -math.inf, k, l
    nx, ny = corner_line(bodies, a, b, k, l, dx, dy)
    return nx * dx + ny * dy - support(bodies, a, nx, ny) - support(bodies, b, -nx, -ny), k, l


@spliced_kernel
def corner_line(bodies: Bodies, a: int, b: int, k: int, l: int, dx: float, dy: float) -> tuple[float, float]:
    """Unit vector from corner k of a to corner l of b."""
    ax, ay = corner(bodies, a, k)
    bx, by = corner(bodies, b, l)
    x, y = dx + bx - ax, dy + by - ay
    distance = math.hypot(x, y)
    return x / distance, y / distance


@inner_kernel
def separating_axis(bodies: Bodies, a: int, b: int, dx: float, dy: float, share: float) -> tuple[float, int, int, int]:
    """Largest separation of the cores of a and b, and its axis; (dx, dy) leads from a to b.

    Returns the separation [m], the body whose edge is the axis and its number, 0; or `CORNERS` and a corner of a and
    of b. ``share``: of the smaller half width, by which a later axis has to be better.
    """
    advantage = share * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT])
    best, k = best_edge(bodies, a, b, dx, dy, advantage)
    reference = a
    other, edge = best_edge(bodies, b, a, -dx, -dy, advantage)
    if other > best + advantage:
        best, reference, k = other, b, edge
    apart, i, j = nearest_corners(bodies, a, b, dx, dy, advantage)
    if apart > best + advantage and apart > 0.0:
        return apart, CORNERS, i, j
    return best, reference, k, 0
