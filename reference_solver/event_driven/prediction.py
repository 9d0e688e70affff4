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

#: A bound that is only just beyond the limit may be round-off; such a pair is looked at in full.
SURELY = 1.0 + 1e-9


@kernel
def touch_length(i, j, t, x0, v0, reach, offset):
    """Gap [m] of pair (i, j) that is round-off at time t."""
    size = reach[i] + reach[j] + abs(offset[i]) + abs(offset[j])
    for k in range(x0.shape[1]):
        size += abs(x0[i, k]) + abs(x0[j, k]) + t * (abs(v0[i, k]) + abs(v0[j, k]))
    return TOUCH * size


@inner_kernel
def since(i, t, extra, t0, late):
    """Time from body i's anchor to t + extra; 0 where t is the rounded time of the anchor."""
    return 0.0 if t == t0[i] else (t - t0[i]) + (extra - late[i])


@inner_kernel
def plane_gap(ball, plane, t, extra, x0, v0, a0, t0, late, radius, normal, offset):
    """Gap, its rate and its acceleration between a ball and a plane that moves uniformly."""
    gap = -offset[plane] - radius[ball]
    rate = 0.0
    acceleration = 0.0
    flown, moved = since(ball, t, extra, t0, late), since(plane, t, extra, t0, late)
    for k in range(x0.shape[1]):
        n = normal[plane, k]
        place = x0[ball, k] + flown * (v0[ball, k] + 0.5 * flown * a0[ball, k])
        gap += n * (place - (x0[plane, k] + moved * v0[plane, k]))
        rate += n * (v0[ball, k] + flown * a0[ball, k] - v0[plane, k])
        acceleration += n * a0[ball, k]
    return gap, rate, acceleration


@inner_kernel
def meet_plane(ball, plane, x0, v0, a0, t0, late, radius, normal, offset):
    """Time [s] from the later anchor to the next contact of a ball with a plane; inf if never."""
    last = ball if t0[ball] >= t0[plane] else plane
    gap, rate, acceleration = plane_gap(ball, plane, t0[last], late[last], x0, v0, a0, t0, late, radius, normal, offset)
    if gap <= touch_length(ball, plane, t0[last], x0, v0, radius, offset):
        gap = 0.0
    speed = 0.0
    for k in range(x0.shape[1]):
        speed += abs(v0[ball, k]) + abs(v0[plane, k])
    if gap == 0.0 and abs(rate) <= GRAZE * speed:
        rate = 0.0
    return first_fall(gap, rate, acceleration)


@inner_kernel
def relative_flight(i, j, t, extra, x0, v0, a0, t0, late, work):
    """Position, velocity, acceleration of ball j seen from ball i at t + extra, into rows 1 to 3 of ``work``."""
    since_i, since_j = since(i, t, extra, t0, late), since(j, t, extra, t0, late)
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
def meet_ball(i, j, x0, v0, a0, t0, late, radius, offset, work):
    """Time [s] from the later anchor to the next contact of two balls; inf if never (O4, O5)."""
    last, d = i if t0[i] >= t0[j] else j, x0.shape[1]
    relative_flight(i, j, t0[last], late[last], x0, v0, a0, t0, late, work)
    x, v, a = work[1], work[2], work[3]
    reach, distance = radius[i] + radius[j], math.sqrt(dot(x, x, d))
    gap = (distance - reach) * (distance + reach)
    closing, vv, aa = dot(x, v, d), dot(v, v, d), dot(a, a, d)
    speed = math.sqrt(dot(v0[i], v0[i], d)) + math.sqrt(dot(v0[j], v0[j], d))
    if abs(closing) <= GRAZE * speed * distance:
        closing = 0.0
    if distance - reach <= touch_length(i, j, t0[last], x0, v0, radius, offset):
        gap = 0.0
        if closing < 0.0:
            return 0.0
    if aa == 0.0:
        if closing >= 0.0:
            return math.inf
        quarter = reach * reach * vv - crossed(x, v, d)
        return gap / (-closing + math.sqrt(quarter)) if quarter > GRAZE * reach * reach * vv else math.inf
    cubic, square = dot(v, a, d), vv + dot(x, a, d)
    work[0, 0], work[0, 1], work[0, 2], work[0, 3], work[0, 4] = gap, 2.0 * closing, square, cubic, 0.25 * aa
    return first_quartic_fall(work)


@inner_kernel
def meet(i, j, kind, x0, v0, a0, t0, late, radius, normal, offset, work):
    """Time [s] from the later anchor to the next contact of two bodies; inf if never."""
    if kind[i] == BALL and kind[j] == BALL:
        return meet_ball(i, j, x0, v0, a0, t0, late, radius, offset, work)
    if kind[j] == PLANE:
        return meet_plane(i, j, x0, v0, a0, t0, late, radius, normal, offset)
    return meet_plane(j, i, x0, v0, a0, t0, late, radius, normal, offset)


@kernel
def next_meeting(i, kind, skipped, x0, v0, a0, t0, late, radius, normal, offset, work, best):
    """Partner of body i's next contact (-1: none); the lowest index where times tie.

    ``best`` (2,) is its time and what rounding took from it, exact as their sum. Most balls are passed over without
    a square root, or even a call: from |x + v t|^2 = R^2 follows 2 |x.v| t >= x.x - R^2.
    """
    best[0], best[1] = math.inf, 0.0
    partner = -1
    for distance in range(1, x0.shape[0]):
        for side in range(2):  # near indices first: they are often near in space, and then spare the others
            j = i - distance if side == 0 else i + distance
            if j < 0 or j >= x0.shape[0] or skipped[i, j] != 0:
                continue
            last = i if t0[i] >= t0[j] else j
            if kind[i] == BALL and kind[j] == BALL:
                since_i = (t0[last] - t0[i]) + (late[last] - late[i])
                since_j = (t0[last] - t0[j]) + (late[last] - late[j])
                gap, closing, alike = -((radius[i] + radius[j]) ** 2), 0.0, True
                for k in range(x0.shape[1]):
                    alike = alike and a0[i, k] == a0[j, k]
                    x = x0[j, k] + since_j * (v0[j, k] + 0.5 * since_j * a0[j, k])
                    x -= x0[i, k] + since_i * (v0[i, k] + 0.5 * since_i * a0[i, k])
                    gap += x * x
                    closing += x * (v0[j, k] - v0[i, k] + (since_j - since_i) * a0[i, k])
                if alike and (closing >= 0.0 or gap > SURELY * 2.0 * -closing * (best[0] - t0[last])):
                    continue
            tau = late[last] + meet(i, j, kind, x0, v0, a0, t0, late, radius, normal, offset, work)
            t = t0[last] + tau
            if t < best[0] or (t == best[0] and j < partner):
                best[0] = t
                part = t - t0[last]  # what the sum lost (Knuth's two-sum)
                best[1] = (t0[last] - (t - part)) + (tau - part) if t < math.inf else 0.0
                partner = j
    return partner


@inner_kernel
def gap_between(i, j, t, kind, x0, v0, a0, t0, late, radius, normal, offset):
    """Gap [m] of two balls, or of a ball and a plane, at time t."""
    if kind[j] == PLANE or kind[i] == PLANE:
        ball, plane = (i, j) if kind[j] == PLANE else (j, i)
        return plane_gap(ball, plane, t, 0.0, x0, v0, a0, t0, late, radius, normal, offset)[0]
    since_i, since_j = since(i, t, 0.0, t0, late), since(j, t, 0.0, t0, late)
    square = 0.0
    for k in range(x0.shape[1]):
        x = x0[j, k] + since_j * (v0[j, k] + 0.5 * since_j * a0[j, k])
        x -= x0[i, k] + since_i * (v0[i, k] + 0.5 * since_i * a0[i, k])
        square += x * x
    return math.sqrt(square) - radius[i] - radius[j]


@kernel
def touching(i, t, depth, kind, x0, v0, a0, t0, late, radius, normal, offset, found):
    """Number of balls and planes whose gap to body i at time t is below round-off.

    Their indices go into ``found``. With ``depth`` -1 only those are counted that are in overlap by more than that.
    """
    count = 0
    for j in range(x0.shape[0]):
        if j == i or (kind[j] == PLANE and kind[i] == PLANE) or kind[i] > PLANE or kind[j] > PLANE:
            continue
        if kind[i] == BALL and kind[j] == BALL:
            # far by one coordinate alone: no call
            since_i, since_j = t - t0[i], t - t0[j]
            x = x0[j, 0] + since_j * (v0[j, 0] + 0.5 * since_j * a0[j, 0])
            x -= x0[i, 0] + since_i * (v0[i, 0] + 0.5 * since_i * a0[i, 0])
            if abs(x) > 2.0 * (radius[i] + radius[j]):
                continue
        gap = gap_between(i, j, t, kind, x0, v0, a0, t0, late, radius, normal, offset)
        if gap <= depth * touch_length(i, j, t, x0, v0, radius, offset):
            found[count] = j
            count += 1
    return count
