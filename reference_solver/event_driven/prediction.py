"""When balls and planes meet next: one compiled scan over the partners of a body (O3 to O5).

Each pair is looked at from the later of its two anchors, so that the answer does not depend on when it is asked.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.event_driven.bodies import BALL, PLANE
from reference_solver.event_driven.roots import GRAZE, first_fall, first_quartic_fall

#: Gaps below this share of the coordinates that make them are contacts: 16 units in the last place, the rounding of
#: two positions, two radii and an event time.
TOUCH = 16.0 * 2.220446049250313e-16


@kernel
def touch_length(i, j, t, x0, v0, reach, offset):
    """Gap [m] of pair (i, j) that is round-off at time t."""
    size = reach[i] + reach[j] + abs(offset[i]) + abs(offset[j])
    for k in range(x0.shape[1]):
        size += abs(x0[i, k]) + abs(x0[j, k]) + t * (abs(v0[i, k]) + abs(v0[j, k]))
    return TOUCH * size


@inner_kernel
def plane_gap(ball, plane, t, x0, v0, a0, t0, radius, normal, offset):
    """Gap, its rate and its acceleration between a ball and a plane that moves uniformly."""
    gap = -offset[plane] - radius[ball]
    rate = 0.0
    acceleration = 0.0
    since, moved = t - t0[ball], t - t0[plane]
    for k in range(x0.shape[1]):
        n = normal[plane, k]
        place = x0[ball, k] + since * (v0[ball, k] + 0.5 * since * a0[ball, k])
        gap += n * (place - (x0[plane, k] + moved * v0[plane, k]))
        rate += n * (v0[ball, k] + since * a0[ball, k] - v0[plane, k])
        acceleration += n * a0[ball, k]
    return gap, rate, acceleration


@inner_kernel
def meet_plane(ball, plane, x0, v0, a0, t0, radius, normal, offset):
    """Time [s] of the next contact of a ball with a plane; inf if never."""
    base = max(t0[ball], t0[plane])
    gap, rate, acceleration = plane_gap(ball, plane, base, x0, v0, a0, t0, radius, normal, offset)
    if gap <= touch_length(ball, plane, base, x0, v0, radius, offset):
        gap = 0.0
    speed = 0.0
    for k in range(x0.shape[1]):
        speed += abs(v0[ball, k]) + abs(v0[plane, k])
    if gap == 0.0 and abs(rate) <= GRAZE * speed:
        rate = 0.0
    return base + first_fall(gap, rate, acceleration)


@inner_kernel
def relative_flight(i, j, t, x0, v0, a0, t0, work):
    """Position, velocity and acceleration of ball j seen from ball i at time t, into rows 1 to 3 of ``work``."""
    since_i, since_j = t - t0[i], t - t0[j]
    for k in range(x0.shape[1]):
        work[1, k] = x0[j, k] + since_j * (v0[j, k] + 0.5 * since_j * a0[j, k])
        work[1, k] -= x0[i, k] + since_i * (v0[i, k] + 0.5 * since_i * a0[i, k])
        work[2, k] = v0[j, k] + since_j * a0[j, k] - (v0[i, k] + since_i * a0[i, k])
        work[3, k] = a0[j, k] - a0[i, k]


@inner_kernel
def dot(a, b, size):
    """Sum of products."""
    total = 0.0
    for k in range(size):
        total += a[k] * b[k]
    return total


@inner_kernel
def crossed(x, v, size):
    """Square of |x cross v|, from the differences themselves: x.x v.v - (x.v)^2 would cancel."""
    total = 0.0
    for k in range(size):
        for m in range(k):
            total += (x[k] * v[m] - x[m] * v[k]) ** 2
    return total


@inner_kernel
def meet_ball(i, j, x0, v0, a0, t0, radius, offset, work):
    """Time [s] of the next contact of two balls; inf if never (O4, O5)."""
    base, d = max(t0[i], t0[j]), x0.shape[1]
    relative_flight(i, j, base, x0, v0, a0, t0, work)
    x, v, a = work[1], work[2], work[3]
    reach, distance = radius[i] + radius[j], math.sqrt(dot(x, x, d))
    gap = (distance - reach) * (distance + reach)
    closing, vv, aa = dot(x, v, d), dot(v, v, d), dot(a, a, d)
    if distance - reach <= touch_length(i, j, base, x0, v0, radius, offset):
        gap = 0.0
        speed = math.sqrt(dot(v0[i], v0[i], d)) + math.sqrt(dot(v0[j], v0[j], d))
        if abs(closing) <= GRAZE * speed * distance:
            closing = 0.0
        if closing < 0.0:
            return base
    if aa == 0.0:
        if closing >= 0.0:
            return math.inf
        quarter = reach * reach * vv - crossed(x, v, d)
        return base + gap / (-closing + math.sqrt(quarter)) if quarter > GRAZE * reach * reach * vv else math.inf
    cubic, square = dot(v, a, d), vv + dot(x, a, d)
    work[0, 0], work[0, 1], work[0, 2], work[0, 3], work[0, 4] = gap, 2.0 * closing, square, cubic, 0.25 * aa
    return base + first_quartic_fall(work)


@kernel
def next_meeting(i, kind, skipped, x0, v0, a0, t0, radius, normal, offset, work, best):
    """Partner of body i's next contact (-1: none), its time in ``best[0]``; the lowest index where times tie."""
    best[0] = math.inf
    partner = -1
    for j in range(x0.shape[0]):
        if j == i or skipped[i, j] != 0:
            continue
        if kind[i] == BALL and kind[j] == BALL:
            t = meet_ball(i, j, x0, v0, a0, t0, radius, offset, work)
        elif kind[j] == PLANE:
            t = meet_plane(i, j, x0, v0, a0, t0, radius, normal, offset)
        else:
            t = meet_plane(j, i, x0, v0, a0, t0, radius, normal, offset)
        if t < best[0]:
            best[0] = t
            partner = j
    return partner


@kernel
def touching(i, t, kind, x0, v0, a0, t0, radius, normal, offset, found):
    """Number of balls and planes that touch body i at time t; their indices in ``found``."""
    count = 0
    for j in range(x0.shape[0]):
        if j == i or (kind[j] == PLANE and kind[i] == PLANE) or kind[i] > PLANE or kind[j] > PLANE:
            continue
        if kind[j] == PLANE:
            gap, _rate, _acceleration = plane_gap(i, j, t, x0, v0, a0, t0, radius, normal, offset)
        elif kind[i] == PLANE:
            gap, _rate, _acceleration = plane_gap(j, i, t, x0, v0, a0, t0, radius, normal, offset)
        else:
            square = 0.0
            for k in range(x0.shape[1]):
                x = x0[j, k] + (t - t0[j]) * (v0[j, k] + 0.5 * (t - t0[j]) * a0[j, k])
                x -= x0[i, k] + (t - t0[i]) * (v0[i, k] + 0.5 * (t - t0[i]) * a0[i, k])
                square += x * x
            gap = math.sqrt(square) - radius[i] - radius[j]
        if gap <= touch_length(i, j, t, x0, v0, radius, offset):
            found[count] = j
            count += 1
    return count
