"""Contacts of discs, boxes and half-spaces in several worlds at once: `narrowphase` and `box_box` without branches.

Each lane holds, to the bit, what those find for its world: the same operations in the same order, with `where` for what
they decide by a branch. Other pairs, a disc and a box too, are looked at world by world.
"""

from __future__ import annotations

import math
from typing import Any

from reference_solver.compilation import inner_kernel
from reference_solver.lanes import any_of, where
from reference_solver.model import Array
from reference_solver.planar.box_box import axis_separation
from reference_solver.planar.columns import ARM_A, ARM_B, COS, EXTENT, GAP, NX, NY, SHAPE, SIN, SIZE
from reference_solver.planar.points import share_of_gap
from reference_solver.planar.separating_axis import AXIS_ADVANTAGE
from reference_solver.planar.state import BOX, DISC, HALF_SPACE, Bodies, Rows

#: What is found of a point.
GEOMETRY = (NX, NY, ARM_A, ARM_A + 1, ARM_B, ARM_B + 1, GAP)
#: Feature of a point that is not there: it matches nothing that is remembered.
NONE = -2.0


@inner_kernel
def collide_at_once(bodies: Bodies, a: int, b: int, reach: Any, near: Any, rows: Rows, feature: Array, c: int) -> Any:
    """Write the points of a < b at rows c, c + 1; how many there are in each world, of those that are ``near``."""
    f, s = (b, a) if bodies.kind[a, SHAPE] > bodies.kind[b, SHAPE] else (a, b)
    if bodies.kind[s, SHAPE] == DISC:
        if bodies.kind[f, SHAPE] == DISC:
            return two_discs(bodies, f, s, reach, near, rows, feature, c)
        return half_space_and_disc(bodies, f, s, reach, near, rows, feature, c)
    if bodies.kind[f, SHAPE] == BOX:
        return two_boxes(bodies, f, s, reach, near, rows, feature, c)
    return half_space_and_box(bodies, f, s, reach, near, rows, feature, c)


@inner_kernel
def are_found_at_once(bodies: Bodies, a: int, b: int) -> bool:
    """Whether `collide_at_once` knows the shapes of two bodies."""
    f, s = bodies.kind[a, SHAPE], bodies.kind[b, SHAPE]
    first, second = min(f, s), max(f, s)
    return bool((second == DISC or second == BOX) and (first == second or first == HALF_SPACE))


@inner_kernel
def half_space_and_disc(
    bodies: Bodies, f: int, s: int, reach: Any, near: Any, rows: Rows, feature: Array, c: int
) -> Any:
    """See `narrowphase.half_space_disc`."""
    nx, ny = normal_of(bodies, f)
    dx, dy = bodies.pose[s, 0] - bodies.pose[f, 0], bodies.pose[s, 1] - bodies.pose[f, 1]
    radius = bodies.real[s, SIZE]
    gap = nx * dx + ny * dy - bodies.real[f, SIZE + 2] - radius
    at_f, at_s = (dx - radius * nx, dy - radius * ny), (-radius * nx, -radius * ny)
    write(rows, c, f < s, (nx, ny), at_f, at_s, gap)
    return settle_one(rows, feature, c, near & ~(gap > reach))


@inner_kernel
def normal_of(bodies: Bodies, f: int) -> tuple[Any, Any]:
    """Normal of half-space f."""
    co, si, x, y = bodies.real[f, COS], bodies.real[f, SIN], bodies.real[f, SIZE], bodies.real[f, SIZE + 1]
    return co * x - si * y, si * x + co * y


@inner_kernel
def two_discs(bodies: Bodies, f: int, s: int, reach: Any, near: Any, rows: Rows, feature: Array, c: int) -> Any:
    """See `narrowphase.disc_disc`."""
    dx, dy = bodies.pose[s, 0] - bodies.pose[f, 0], bodies.pose[s, 1] - bodies.pose[f, 1]
    distance = math.sqrt(dx * dx + dy * dy)
    gap = distance - bodies.real[f, SIZE] - bodies.real[s, SIZE]
    nx, ny = where(distance > 0.0, dx / distance, 1.0), where(distance > 0.0, dy / distance, 0.0)
    share = share_of_gap(bodies, f, s)
    here, far = bodies.real[f, SIZE] + share * gap, bodies.real[s, SIZE] + (1.0 - share) * gap
    write(rows, c, f < s, (nx, ny), (here * nx, here * ny), (-far * nx, -far * ny), gap)
    return settle_one(rows, feature, c, near & ~(gap > reach))


@inner_kernel
def two_boxes(bodies: Bodies, a: int, b: int, reach: Any, near: Any, rows: Rows, feature: Array, c: int) -> Any:
    """See `box_box.box_box`."""
    dx = bodies.pose[b, 0] - bodies.pose[a, 0]
    dy = bodies.pose[b, 1] - bodies.pose[a, 1]
    advantage = AXIS_ADVANTAGE * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT])
    best, side = where(near, -math.inf, -math.inf), where(near, 1.0, 1.0)
    of_a, across = near | ~near, near & ~near  # whose face it is, and whether it is one along the second axis
    for candidate in range(4):
        k = candidate % 2
        if candidate < 2:
            separation, sign = axis_separation(bodies, a, b, dx, dy, k)
        else:
            separation, sign = axis_separation(bodies, b, a, -dx, -dy, k)
        near = near & ~(separation > reach)
        wins = separation > best + advantage
        best, side = where(wins, separation, best), where(wins, sign, side)
        across = across | wins if k == 1 else across & ~wins
        of_a = of_a | wins if candidate < 2 else of_a & ~wins
    if any_of(near):
        return clip(bodies, (a, b), (dx, dy), (of_a, across, side), reach, near, rows, feature, c)
    return settle(rows, feature, c, near, near)


@inner_kernel
def clip(
    bodies: Bodies,
    pair: tuple[int, int],
    way: Any,
    face: Any,
    reach: Any,
    near: Any,
    rows: Rows,
    feature: Array,
    c: int,
) -> Any:
    """See `box_box.clip_edge`; ``face``: whether the reference face is of a, along the second axis, and its side."""
    a, b = pair
    of_a, across, side = face
    dx, dy = where(of_a, way[0], -way[0]), where(of_a, way[1], -way[1])
    cr, sr = either(bodies, of_a, a, b, COS), either(bodies, of_a, a, b, SIN)
    nx, ny = where(across, -side * sr, side * cr), where(across, side * cr, side * sr)
    ci, si = either(bodies, of_a, b, a, COS), either(bodies, of_a, b, a, SIN)
    along_x, along_y = nx * ci + ny * si, ny * ci - nx * si
    first = abs(along_x) > abs(along_y)
    toward = -math.copysign(1.0, where(first, along_x, along_y))
    x, y = either(bodies, of_a, b, a, SIZE), either(bodies, of_a, b, a, SIZE + 1)
    depth_p, depth_q = face_vector(ci, si, first, toward * where(first, x, y), nx, ny)
    reach_p, reach_q = face_vector(ci, si, ~first, where(first, y, x), nx, ny)
    mid_p = nx * dx + ny * dy + depth_p
    mid_q = nx * dy - ny * dx + depth_q
    x, y = either(bodies, of_a, a, b, SIZE), either(bodies, of_a, a, b, SIZE + 1)
    half_width, half_height = where(across, x, y), where(across, y, x)
    share = where(of_a, share_of_gap(bodies, a, b), share_of_gap(bodies, b, a))
    one, other = (-half_width - mid_q) / reach_q, (half_width - mid_q) / reach_q
    low, high = where(one > other, other, one), where(one > other, one, other)
    near = near & ~((low > 1.0) | (high < -1.0))
    faces = 4.0 * (where(across, 2.0, 0.0) + where(side > 0.0, 1.0, 0.0))
    faces = faces + where(first, 0.0, 2.0) + where(toward > 0.0, 1.0, 0.0)
    found = near, near
    for end in range(2):
        s = min(1.0, high) if end == 1 else max(-1.0, low)
        p, q = mid_p + s * reach_p, mid_q + s * reach_q
        gap = p - half_height
        found = found[1], near & ~(gap > reach)
        p -= (1.0 - share) * gap
        ax, ay = p * nx - q * ny, p * ny + q * nx
        write(rows, c + end, of_a, (nx, ny), (ax, ay), (ax - dx, ay - dy), gap)
        feature[c + end] = 2.0 * (where(of_a, 0.0, 16.0) + faces) + float(end)
    return settle(rows, feature, c, found[0], found[1])


@inner_kernel
def either(bodies: Bodies, of_a: Any, a: int, b: int, column: int) -> Any:
    """A number of body a in worlds where ``of_a`` holds, else that of b."""
    return where(of_a, bodies.real[a, column], bodies.real[b, column])


@inner_kernel
def face_vector(co: Any, si: Any, first: Any, length: Any, nx: Any, ny: Any) -> tuple[Any, Any]:
    """See `box_box.face_vector`; ``first``: whether the axis is the first one."""
    x, y = where(first, length * co, -length * si), where(first, length * si, length * co)
    return nx * x + ny * y, nx * y - ny * x


@inner_kernel
def half_space_and_box(
    bodies: Bodies, f: int, s: int, reach: Any, near: Any, rows: Rows, feature: Array, c: int
) -> Any:
    """See `narrowphase.half_space_box`."""
    nx, ny = normal_of(bodies, f)
    dx, dy = bodies.pose[s, 0] - bodies.pose[f, 0], bodies.pose[s, 1] - bodies.pose[f, 1]
    height = nx * dx + ny * dy - bodies.real[f, SIZE + 2]
    cs, ss = bodies.real[s, COS], bodies.real[s, SIN]
    along_x, along_y = nx * cs + ny * ss, ny * cs - nx * ss
    first = abs(along_x) > abs(along_y)
    found = near, near
    for end in range(2):
        free_side = 1.0 if end == 1 else -1.0
        x, y = bodies.real[s, SIZE], bodies.real[s, SIZE + 1]
        qx = where(first, -math.copysign(x, along_x), free_side * x)
        qy = where(first, free_side * y, -math.copysign(y, along_y))
        gap = height + along_x * qx + along_y * qy
        found = found[1], near & (gap <= reach)
        ax, ay = cs * qx - ss * qy, ss * qx + cs * qy
        write(rows, c + end, f < s, (nx, ny), (dx + ax, dy + ay), (ax, ay), gap)
        feature[c + end] = where(qx > 0.0, 2.0, 0.0) + where(qy > 0.0, 1.0, 0.0)
    return settle(rows, feature, c, found[0], found[1])


@inner_kernel
def write(rows: Rows, c: int, ordered: Any, n: Any, at_f: Any, at_s: Any, gap: Any) -> None:
    """See `points.write_point`; ``ordered``: whether the first body is A."""
    rows.real[c, GAP] = gap
    for k in range(2):
        rows.real[c, NX + k] = where(ordered, n[k], -n[k])
        rows.real[c, ARM_A + k] = where(ordered, at_f[k], at_s[k])
        rows.real[c, ARM_B + k] = where(ordered, at_s[k], at_f[k])


@inner_kernel
def settle_one(rows: Rows, feature: Array, c: int, there: Any) -> Any:
    """Clear the point of row c where it is not ``there``; return how many there are."""
    for k in GEOMETRY:
        rows.real[c, k] = where(there, rows.real[c, k], 0.0)
    feature[c] = where(there, 0.0, NONE)
    return where(there, 1.0, 0.0)


@inner_kernel
def settle(rows: Rows, feature: Array, c: int, one: Any, other: Any) -> Any:
    """Let the points of rows c, c + 1 follow each other, where there is ``one`` and the ``other``; return how many."""
    for k in GEOMETRY:
        moved = where(one, rows.real[c, k], rows.real[c + 1, k])
        rows.real[c, k] = where(one | other, moved, 0.0)
        rows.real[c + 1, k] = where(one & other, rows.real[c + 1, k], 0.0)
    moved = where(one, feature[c], feature[c + 1])
    feature[c] = where(one | other, moved, NONE)
    feature[c + 1] = where(one & other, feature[c + 1], NONE)
    return where(one, 1.0, 0.0) + where(other, 1.0, 0.0)
