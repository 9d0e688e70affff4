"""Contact points of capsules and polygons, with each other, with discs and boxes, and with a half-space.

All are cores grown by a radius (separating_axis.py). Two edges meet in up to two points: the incident edge, clipped
to the reference edge; two corners, or a disc and anything, in one.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.shapes import MOST_VERTICES
from reference_solver.textbook.motion import share_of_gap
from reference_solver.textbook2.closing_axis import lasting_axis
from reference_solver.textbook2.columns import COS, MOTION, ROUNDING, SIN, SIZE, VERTICES
from reference_solver.textbook2.points import write_point
from reference_solver.textbook2.separating_axis import (
    AXIS_ADVANTAGE,
    CORNERS,
    EXACT_ADVANTAGE,
    corner,
    corner_line,
    edge_normal,
    separating_axis,
)
from reference_solver.textbook2.state import Bodies, Rows

#: Cosines closer than this are equal up to round-off; it must not choose between two edges.
SAME_SLOPE = 1e-9


@spliced_kernel
def facing_edge(bodies: Bodies, i: int, nx: float, ny: float) -> int:
    """Edge of core i that looks most against (nx, ny); the vertex that lies deepest is one of its ends."""
    best, edge = 2.0, 0
    count = bodies.kind[i, VERTICES]
    for k in range(count if count > 1 else 0):
        ex, ey = edge_normal(bodies, i, k)
        along = ex * nx + ey * ny
        if along < best - SAME_SLOPE:
            best, edge = along, k
    return edge


@spliced_kernel
def over_half_space(bodies: Bodies, f: int, s: int) -> tuple[float, float, float, float, float]:
    """Normal of half-space f, way from its centre to that of s, and height of the latter over its face [m]."""
    co, si = bodies.real[f, COS], bodies.real[f, SIN]
    nx = co * bodies.real[f, SIZE] - si * bodies.real[f, SIZE + 1]
    ny = si * bodies.real[f, SIZE] + co * bodies.real[f, SIZE + 1]
    dx = bodies.pose[s, 0] - bodies.pose[f, 0]
    dy = bodies.pose[s, 1] - bodies.pose[f, 1]
    return nx, ny, dx, dy, nx * dx + ny * dy - bodies.real[f, SIZE + 2]


@inner_kernel
def half_space_core(bodies: Bodies, f: int, s: int, reach: float, rows: Rows, c: int) -> int:
    """Half-space f and core s: the ends of the edge that looks most against the normal, in the order of vertices."""
    nx, ny, dx, dy, height = over_half_space(bodies, f, s)
    radius = bodies.real[s, ROUNDING]
    height -= radius
    first = facing_edge(bodies, s, nx, ny)
    last = first + 1
    if last == bodies.kind[s, VERTICES]:
        first, last = 0, first
    found = 0
    for end in range(2):
        k = first if end == 0 else last
        x, y = corner(bodies, s, k)
        gap = height + nx * x + ny * y
        if gap <= reach:
            ax, ay = x - radius * nx, y - radius * ny
            write_point(rows, c + found, f, s, k, (nx, ny), (dx + ax, dy + ay), (ax, ay), gap)
            found += 1
    return found


@inner_kernel
def core_core(bodies: Bodies, a: int, b: int, reach: float, ahead: float, rows: Rows, c: int) -> int:
    """Up to two points of bodies a < b, neither of them a half-space."""
    dx = bodies.pose[b, 0] - bodies.pose[a, 0]
    dy = bodies.pose[b, 1] - bodies.pose[a, 1]
    share = EXACT_ADVANTAGE if ahead > 0.0 else AXIS_ADVANTAGE
    separation, reference, k, l = separating_axis(bodies, a, b, dx, dy, share)
    grown = bodies.real[a, ROUNDING] + bodies.real[b, ROUNDING]
    if separation - grown > reach:
        return 0
    if ahead > 0.0:
        separation, reference, k, l = lasting_axis(bodies, a, b, (dx, dy), reference, k, l, grown, ahead)
    gap = separation - grown
    if reference == CORNERS:
        nx, ny = corner_line(bodies, a, b, k, l, dx, dy)
        x, y = corner(bodies, a, k)
        from_a = bodies.real[a, ROUNDING] + share_of_gap(bodies.kind[a, MOTION], bodies.kind[b, MOTION]) * gap
        ax, ay = x + from_a * nx, y + from_a * ny
        feature = 4 * MOST_VERTICES * MOST_VERTICES + k * MOST_VERTICES + l
        write_point(rows, c, a, b, feature, (nx, ny), (ax, ay), (ax - dx, ay - dy), gap)
        return 1
    if reference == a:
        return clip_facing_edge(bodies, a, b, dx, dy, k, reach, rows, c)
    return clip_facing_edge(bodies, b, a, -dx, -dy, k, reach, rows, c)


@spliced_kernel
def clip_facing_edge(
    bodies: Bodies, r: int, i: int, dx: float, dy: float, k: int, reach: float, rows: Rows, c: int
) -> int:
    """Clip the edge of incident core i that faces edge k of reference core r to that edge's ends.

    (dx, dy) leads from r's centre to i's. Coordinates (p, q) below: along the reference normal and along the edge.
    """
    nx, ny = edge_normal(bodies, r, k)
    x, y = corner(bodies, r, k)
    face, low = nx * x + ny * y, nx * y - ny * x
    x, y = corner(bodies, r, k + 1)
    high = nx * y - ny * x
    incident = facing_edge(bodies, i, nx, ny)
    x, y = corner(bodies, i, incident)
    p0, q0 = nx * (dx + x) + ny * (dy + y), nx * (dy + y) - ny * (dx + x)
    x, y = corner(bodies, i, incident + 1)
    p1, q1 = nx * (dx + x) + ny * (dy + y), nx * (dy + y) - ny * (dx + x)
    feature = (((0 if r < i else 1) * MOST_VERTICES + k) * MOST_VERTICES + incident) * 2
    single = bodies.kind[i, VERTICES] == 1
    if max(q0, q1) < low or min(q0, q1) > high:
        if bodies.real[r, ROUNDING] + bodies.real[i, ROUNDING] == 0.0:
            return 0
        single = True  # nearly at a corner, which was not better by the axes' advantage
        if p1 < p0:
            p0, q0 = p1, q1
    found = 0
    for end in range(1 if single else 2):
        p, q, to_p, to_q = (p0, q0, p1, q1) if end == 0 else (p1, q1, p0, q0)
        if not single and (q < low or q > high):
            bound = low if q < low else high
            p += (bound - q) / (to_q - q) * (to_p - p)
            q = bound
        gap = p - bodies.real[i, ROUNDING] - face - bodies.real[r, ROUNDING]
        if gap > reach:
            continue
        p = face + bodies.real[r, ROUNDING] + share_of_gap(bodies.kind[r, MOTION], bodies.kind[i, MOTION]) * gap
        ax, ay = p * nx - q * ny, p * ny + q * nx
        write_point(rows, c + found, r, i, feature + end, (nx, ny), (ax, ay), (ax - dx, ay - dy), gap)
        found += 1
    return found
