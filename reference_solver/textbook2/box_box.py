"""Contact of two boxes: axis of least overlap, then clipping of the incident edge (separating axis test).

Facts from E. Catto, "Modeling and solving constraints" (GDC 2009) and any textbook on the separating axis theorem.
"""

from __future__ import annotations

import math

from reference_solver.compilation import spliced_kernel
from reference_solver.textbook.motion import share_of_gap
from reference_solver.textbook2.closing_axis import lasting_axis
from reference_solver.textbook2.columns import COS, EXTENT, MOTION, SIN, SIZE
from reference_solver.textbook2.points import write_point
from reference_solver.textbook2.separating_axis import AXIS_ADVANTAGE, EXACT_ADVANTAGE
from reference_solver.textbook2.state import Bodies, Rows


@spliced_kernel
def axis_separation(bodies: Bodies, a: int, b: int, dx: float, dy: float, axis: int) -> tuple[float, float]:
    """Separation of b from the face of a along a's own ``axis``, and the side (+-1) on which b lies."""
    ca, sa = bodies.real[a, COS], bodies.real[a, SIN]
    cb, sb = bodies.real[b, COS], bodies.real[b, SIN]
    ux, uy = ca, sa
    if axis == 1:
        ux, uy = -sa, ca
    offset = dx * ux + dy * uy
    spread = bodies.real[b, SIZE] * abs(cb * ux + sb * uy) + bodies.real[b, SIZE + 1] * abs(cb * uy - sb * ux)
    return abs(offset) - bodies.real[a, SIZE + axis] - spread, math.copysign(1.0, offset)


@spliced_kernel
def box_box(bodies: Bodies, a: int, b: int, reach: float, ahead: float, rows: Rows, c: int) -> int:
    """Up to two points of boxes a < b; ``ahead`` as in `collide`."""
    dx = bodies.pose[b, 0] - bodies.pose[a, 0]
    dy = bodies.pose[b, 1] - bodies.pose[a, 1]
    share = EXACT_ADVANTAGE if ahead > 0.0 else AXIS_ADVANTAGE
    advantage = share * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT])
    best, reference, axis, side = -math.inf, a, 0, 1.0
    for candidate in range(4):
        k = candidate % 2
        if candidate < 2:
            separation, sign = axis_separation(bodies, a, b, dx, dy, k)
        else:
            separation, sign = axis_separation(bodies, b, a, -dx, -dy, k)
        if separation > reach:
            return 0
        if separation > best + advantage:
            best, axis, side = separation, k, sign
            reference = a if candidate < 2 else b
    if ahead > 0.0:
        edge = (0 if side > 0.0 else 2) if axis == 1 else (3 if side > 0.0 else 1)  # in the order of vertices
        _, reference, edge, _ = lasting_axis(bodies, a, b, (dx, dy), reference, edge, 0, 0.0, ahead)
        axis, side = 1 - edge % 2, 1.0 if edge == 0 or edge == 3 else -1.0
    if reference == a:
        return clip_edge(bodies, a, b, (dx, dy), axis, side, reach, rows, c)
    return clip_edge(bodies, b, a, (-dx, -dy), axis, side, reach, rows, c)


@spliced_kernel
def clip_edge(
    bodies: Bodies, r: int, i: int, way: tuple[float, float], axis: int, side: float, reach: float, rows: Rows, c: int
) -> int:
    """Clip the edge of incident box i that faces r's reference face (``axis``, ``side``) to that face's width.

    ``way`` leads from r's centre to i's. Coordinates (p, q) below: along the reference normal and its tangent.
    """
    dx, dy = way
    cr, sr = bodies.real[r, COS], bodies.real[r, SIN]
    nx, ny = side * cr, side * sr
    if axis == 1:
        nx, ny = -side * sr, side * cr
    ci, si = bodies.real[i, COS], bodies.real[i, SIN]
    along_x, along_y = nx * ci + ny * si, ny * ci - nx * si  # reference normal in i's axes
    edge = 0 if abs(along_x) > abs(along_y) else 1  # axis of i whose face looks at r
    toward = -math.copysign(1.0, along_x if edge == 0 else along_y)
    depth_p, depth_q = face_vector(ci, si, edge, toward * bodies.real[i, SIZE + edge], nx, ny)
    reach_p, reach_q = face_vector(ci, si, 1 - edge, bodies.real[i, SIZE + (1 - edge)], nx, ny)
    mid_p = nx * dx + ny * dy + depth_p
    mid_q = nx * dy - ny * dx + depth_q
    half_width = bodies.real[r, SIZE + (1 - axis)]
    share = share_of_gap(bodies.kind[r, MOTION], bodies.kind[i, MOTION])
    found = 0
    for end in range(2):
        # Position along the edge in [-1, 1], clipped to where the edge is above the reference face.
        low, high = (-half_width - mid_q) / reach_q, (half_width - mid_q) / reach_q
        if low > high:
            low, high = high, low
        if low > 1.0 or high < -1.0:
            return 0
        s = min(1.0, high) if end == 1 else max(-1.0, low)
        p, q = mid_p + s * reach_p, mid_q + s * reach_q
        gap = p - bodies.real[r, SIZE + axis]
        if gap > reach:
            continue
        p -= (1.0 - share) * gap
        ax, ay = p * nx - q * ny, p * ny + q * nx
        faces = (axis * 2 + (1 if side > 0.0 else 0)) * 4 + edge * 2 + (1 if toward > 0.0 else 0)
        feature = ((0 if r < i else 1) * 16 + faces) * 2 + end
        write_point(rows, c + found, r, i, feature, (nx, ny), (ax, ay), (ax - dx, ay - dy), gap)
        found += 1
    return found


@spliced_kernel
def face_vector(co: float, si: float, axis: int, length: float, nx: float, ny: float) -> tuple[float, float]:
    """Vector of ``length`` along an own ``axis`` of a body turned by (co, si): parts along n and its tangent."""
    x, y = length * co, length * si
    if axis == 1:
        x, y = -length * si, length * co
    return nx * x + ny * y, nx * y - ny * x
