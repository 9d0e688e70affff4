"""Contact points of one pair of shapes: normal, gap, arms and the number of the touching features.

A pair function gets the bodies in the order of their shape codes (first, second), finds points with the normal
from first to second, and `write_point` turns them so that A has the lower index. Arms are measured from the
bodies' centres, so that nothing depends on where the origin is. With an immovable partner the contact point lies
on the free body's own surface (a rolling disc keeps its radius, whatever the overlap); between two free bodies it
lies midway, one point for both, which conserves angular momentum.
"""

from __future__ import annotations

import math

from reference_solver.compilation import spliced_kernel
from reference_solver.textbook.motion import share_of_gap
from reference_solver.textbook2.box_box import box_box
from reference_solver.textbook2.columns import COS, EXTENT, MOTION, SHAPE, SIN, SIZE
from reference_solver.textbook2.core_core import core_core, half_space_core, over_half_space
from reference_solver.textbook2.points import write_point
from reference_solver.textbook2.state import CAPSULE, DISC, HALF_SPACE, Bodies, Rows


@spliced_kernel
def collide(bodies: Bodies, a: int, b: int, margin: float, ahead: float, rows: Rows, c: int) -> int:
    """Write the contact points of bodies a < b at rows c, c + 1 and return how many.

    ``ahead``: time [s] within which axes that separate them are told apart by when they close; 0: by their gaps alone.
    """
    first, second = a, b
    if bodies.kind[a, SHAPE] > bodies.kind[b, SHAPE]:
        first, second = b, a
    reach = margin * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT])
    if bodies.kind[second, SHAPE] >= CAPSULE:
        if bodies.kind[first, SHAPE] == HALF_SPACE:
            return half_space_core(bodies, first, second, reach, rows, c)
        return core_core(bodies, a, b, reach, ahead, rows, c)
    if bodies.kind[first, SHAPE] == HALF_SPACE:
        if bodies.kind[second, SHAPE] == DISC:
            return half_space_disc(bodies, first, second, reach, rows, c)
        return half_space_box(bodies, first, second, reach, rows, c)
    if bodies.kind[first, SHAPE] == DISC:
        if bodies.kind[second, SHAPE] == DISC:
            return disc_disc(bodies, first, second, reach, rows, c)
        return disc_box(bodies, first, second, reach, rows, c)
    return box_box(bodies, first, second, reach, ahead, rows, c)


@spliced_kernel
def half_space_disc(bodies: Bodies, f: int, s: int, reach: float, rows: Rows, c: int) -> int:
    """Half-space f and disc s: one point under the centre."""
    nx, ny, dx, dy, height = over_half_space(bodies, f, s)
    radius = bodies.real[s, SIZE]
    gap = height - radius
    if gap > reach:
        return 0
    at_f, at_s = (dx - radius * nx, dy - radius * ny), (-radius * nx, -radius * ny)
    write_point(rows, c, f, s, 0, (nx, ny), at_f, at_s, gap)
    return 1


@spliced_kernel
def half_space_box(bodies: Bodies, f: int, s: int, reach: float, rows: Rows, c: int) -> int:
    """Half-space f and box s: the two corners of the face that looks most against the normal."""
    nx, ny, dx, dy, height = over_half_space(bodies, f, s)
    cs, ss = bodies.real[s, COS], bodies.real[s, SIN]
    along_x, along_y = nx * cs + ny * ss, ny * cs - nx * ss  # the normal in the box's axes
    found = 0
    for end in range(2):
        free_side = 1.0 if end == 1 else -1.0
        if abs(along_x) > abs(along_y):
            qx, qy = -math.copysign(bodies.real[s, SIZE], along_x), free_side * bodies.real[s, SIZE + 1]
        else:
            qx, qy = free_side * bodies.real[s, SIZE], -math.copysign(bodies.real[s, SIZE + 1], along_y)
        gap = height + along_x * qx + along_y * qy
        if gap <= reach:
            feature = (2 if qx > 0.0 else 0) + (1 if qy > 0.0 else 0)
            ax, ay = cs * qx - ss * qy, ss * qx + cs * qy
            write_point(rows, c + found, f, s, feature, (nx, ny), (dx + ax, dy + ay), (ax, ay), gap)
            found += 1
    return found


@spliced_kernel
def disc_disc(bodies: Bodies, f: int, s: int, reach: float, rows: Rows, c: int) -> int:
    """Discs f and s: one point on the line of centres; concentric discs separate along x."""
    dx = bodies.pose[s, 0] - bodies.pose[f, 0]
    dy = bodies.pose[s, 1] - bodies.pose[f, 1]
    distance = math.sqrt(dx * dx + dy * dy)
    gap = distance - bodies.real[f, SIZE] - bodies.real[s, SIZE]
    if gap > reach:
        return 0
    nx, ny = 1.0, 0.0
    if distance > 0.0:
        nx, ny = dx / distance, dy / distance
    share = share_of_gap(bodies.kind[f, MOTION], bodies.kind[s, MOTION])
    near, far = bodies.real[f, SIZE] + share * gap, bodies.real[s, SIZE] + (1.0 - share) * gap
    write_point(rows, c, f, s, 0, (nx, ny), (near * nx, near * ny), (-far * nx, -far * ny), gap)
    return 1


@spliced_kernel
def disc_box(bodies: Bodies, f: int, s: int, reach: float, rows: Rows, c: int) -> int:
    """Disc f and box s: nearest point of the box, or its nearest face if the centre is inside."""
    dx = bodies.pose[f, 0] - bodies.pose[s, 0]
    dy = bodies.pose[f, 1] - bodies.pose[s, 1]
    cs, ss = bodies.real[s, COS], bodies.real[s, SIN]
    px, py = cs * dx + ss * dy, cs * dy - ss * dx  # disc's centre in the box's axes
    hx, hy = bodies.real[s, SIZE], bodies.real[s, SIZE + 1]
    qx, qy = min(max(px, -hx), hx), min(max(py, -hy), hy)
    ex, ey = px - qx, py - qy  # outward, from the box to the disc
    distance = math.sqrt(ex * ex + ey * ey)
    if distance > 0.0:
        ex, ey = ex / distance, ey / distance
    elif hx - abs(px) < hy - abs(py):
        distance, ex, ey = abs(px) - hx, math.copysign(1.0, px), 0.0
    else:
        distance, ex, ey = abs(py) - hy, 0.0, math.copysign(1.0, py)
    gap = distance - bodies.real[f, SIZE]
    if gap > reach:
        return 0
    nx, ny = -(cs * ex - ss * ey), -(ss * ex + cs * ey)
    near = bodies.real[f, SIZE] + share_of_gap(bodies.kind[f, MOTION], bodies.kind[s, MOTION]) * gap
    ax, ay = near * nx, near * ny
    write_point(rows, c, f, s, 0, (nx, ny), (ax, ay), (ax + dx, ay + dy), gap)
    return 1
