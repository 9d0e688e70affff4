"""When balls and planes meet next: one compiled scan over the partners of a body (O3 to O5).

Each pair is looked at from the later of its two anchors, so that the answer does not depend on when it is asked.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.model import Array
from reference_solver.pieces import Indices
from reference_solver.structures import structure
from reference_solver.verification.event_driven.bodies import BALL, PLANE
from reference_solver.verification.event_driven.roots import GRAZE, first_fall, first_quartic_fall

#: Gaps below this share of the coordinates that make them are contacts: 16 units in the last place, the rounding of
#: two positions, two radii and an event time.
TOUCH = 16.0 * 2.220446049250313e-16

#: A bound that is only just beyond the limit may be round-off; such a pair is looked at in full.
SURELY = 1.0 + 1e-9


@structure
class Flown(NamedTuple):
    """What kernels read of the flight (`flight.Flight`) and the shapes (`bodies.Bodies`) of n bodies in d axes."""

    kind: Indices  # (n,)
    x0: Array  # (n, d): anchors [m]
    v0: Array  # (n, d) [m/s]
    a0: Array  # (n, d) [m/s^2]
    t0: Array  # (n,): their times [s]
    late: Array  # (n,): what rounding took from those
    radius: Array  # (n,) [m]
    normal: Array  # (n, d): of planes
    offset: Array  # (n,) [m]


@kernel
def touch_length(i, j, t, x0, v0, reach, offset):
    """Gap [m] of pair (i, j) that is round-off at time t."""
    size = reach[i] + reach[j] + abs(offset[i]) + abs(offset[j])
    for k in range(x0.shape[1]):
        size += abs(x0[i, k]) + abs(x0[j, k]) + t * (abs(v0[i, k]) + abs(v0[j, k]))
    return TOUCH * size


@inner_kernel
def since(i, t, extra, f):
    """Time from body i's anchor to t + extra; 0 where t is the rounded time of the anchor."""
    return 0.0 if t == f.t0[i] else (t - f.t0[i]) + (extra - f.late[i])


@inner_kernel
def plane_gap(ball, plane, t, extra, f):
    """Gap, its rate and its acceleration between a ball and a plane that moves uniformly."""
    gap = -f.offset[plane] - f.radius[ball]
    rate = 0.0
    acceleration = 0.0
    flown, moved = since(ball, t, extra, f), since(plane, t, extra, f)
    for k in range(f.x0.shape[1]):
        n = f.normal[plane, k]
        place = f.x0[ball, k] + flown * (f.v0[ball, k] + 0.5 * flown * f.a0[ball, k])
        gap += n * (place - (f.x0[plane, k] + moved * f.v0[plane, k]))
        rate += n * (f.v0[ball, k] + flown * f.a0[ball, k] - f.v0[plane, k])
        acceleration += n * f.a0[ball, k]
    return gap, rate, acceleration


@inner_kernel
def meet_plane(ball, plane, f):
    """Time [s] from the later anchor to the next contact of a ball with a plane; inf if never."""
    last = ball if f.t0[ball] >= f.t0[plane] else plane
    gap, rate, acceleration = plane_gap(ball, plane, f.t0[last], f.late[last], f)
    if gap <= touch_length(ball, plane, f.t0[last], f.x0, f.v0, f.radius, f.offset):
        gap = 0.0
    speed = 0.0
    for k in range(f.x0.shape[1]):
        speed += abs(f.v0[ball, k]) + abs(f.v0[plane, k])
    if gap == 0.0 and abs(rate) <= GRAZE * speed:
        rate = 0.0
    return first_fall(gap, rate, acceleration)


@inner_kernel
def relative_flight(i, j, t, extra, f, work):
    """Position, velocity, acceleration of ball j seen from ball i at t + extra, into rows 1 to 3 of ``work``."""
    since_i, since_j = since(i, t, extra, f), since(j, t, extra, f)
    for k in range(f.x0.shape[1]):
        work[1, k] = f.x0[j, k] + since_j * (f.v0[j, k] + 0.5 * since_j * f.a0[j, k])
        work[1, k] -= f.x0[i, k] + since_i * (f.v0[i, k] + 0.5 * since_i * f.a0[i, k])
        work[2, k] = f.v0[j, k] + since_j * f.a0[j, k] - (f.v0[i, k] + since_i * f.a0[i, k])
        work[3, k] = f.a0[j, k] - f.a0[i, k]


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
def meet_ball(i, j, f, work):
    """Time [s] from the later anchor to the next contact of two balls; inf if never (O4, O5)."""
    last, d = i if f.t0[i] >= f.t0[j] else j, f.x0.shape[1]
    relative_flight(i, j, f.t0[last], f.late[last], f, work)
    x, v, a = work[1], work[2], work[3]
    reach, distance = f.radius[i] + f.radius[j], math.sqrt(dot(x, x, d))
    gap = (distance - reach) * (distance + reach)
    closing, vv, aa = dot(x, v, d), dot(v, v, d), dot(a, a, d)
    speed = math.sqrt(dot(f.v0[i], f.v0[i], d)) + math.sqrt(dot(f.v0[j], f.v0[j], d))
    if abs(closing) <= GRAZE * speed * distance:
        closing = 0.0
    if distance - reach <= touch_length(i, j, f.t0[last], f.x0, f.v0, f.radius, f.offset):
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
def meet(i, j, f, work):
    """Time [s] from the later anchor to the next contact of two bodies; inf if never."""
    if f.kind[i] == BALL and f.kind[j] == BALL:
        return meet_ball(i, j, f, work)
    if f.kind[j] == PLANE:
        return meet_plane(i, j, f)
    return meet_plane(j, i, f)


@kernel
def next_meeting(i, skipped, f, work, best):
    """Partner of body i's next contact (-1: none); the lowest index where times tie.

    ``best`` (2,) is its time and what rounding took from it, exact as their sum. Most balls are passed over without
    a square root, or even a call: from |x + v t|^2 = R^2 follows 2 |x.v| t >= x.x - R^2.
    """
    best[0], best[1] = math.inf, 0.0
    partner = -1
    for distance in range(1, f.x0.shape[0]):
        for side in range(2):  # near indices first: they are often near in space, and then spare the others
            j = i - distance if side == 0 else i + distance
            if j < 0 or j >= f.x0.shape[0] or skipped[i, j] != 0:
                continue
            last = i if f.t0[i] >= f.t0[j] else j
            if f.kind[i] == BALL and f.kind[j] == BALL:
                since_i = (f.t0[last] - f.t0[i]) + (f.late[last] - f.late[i])
                since_j = (f.t0[last] - f.t0[j]) + (f.late[last] - f.late[j])
                gap, closing, alike = -((f.radius[i] + f.radius[j]) ** 2), 0.0, True
                for k in range(f.x0.shape[1]):
                    alike = alike and f.a0[i, k] == f.a0[j, k]
                    x = f.x0[j, k] + since_j * (f.v0[j, k] + 0.5 * since_j * f.a0[j, k])
                    x -= f.x0[i, k] + since_i * (f.v0[i, k] + 0.5 * since_i * f.a0[i, k])
                    gap += x * x
                    closing += x * (f.v0[j, k] - f.v0[i, k] + (since_j - since_i) * f.a0[i, k])
                if alike and (closing >= 0.0 or gap > SURELY * 2.0 * -closing * (best[0] - f.t0[last])):
                    continue
            tau = f.late[last] + meet(i, j, f, work)
            t = f.t0[last] + tau
            if t < best[0] or (t == best[0] and j < partner):
                best[0] = t
                part = t - f.t0[last]  # what the sum lost (Knuth's two-sum)
                best[1] = (f.t0[last] - (t - part)) + (tau - part) if t < math.inf else 0.0
                partner = j
    return partner


@inner_kernel
def gap_between(i, j, t, f):
    """Gap [m] of two balls, or of a ball and a plane, at time t."""
    if f.kind[j] == PLANE or f.kind[i] == PLANE:
        ball, plane = (i, j) if f.kind[j] == PLANE else (j, i)
        return plane_gap(ball, plane, t, 0.0, f)[0]
    since_i, since_j = since(i, t, 0.0, f), since(j, t, 0.0, f)
    square = 0.0
    for k in range(f.x0.shape[1]):
        x = f.x0[j, k] + since_j * (f.v0[j, k] + 0.5 * since_j * f.a0[j, k])
        x -= f.x0[i, k] + since_i * (f.v0[i, k] + 0.5 * since_i * f.a0[i, k])
        square += x * x
    return math.sqrt(square) - f.radius[i] - f.radius[j]


@kernel
def touching(i, t, depth, f, found):
    """Number of balls and planes whose gap to body i at time t is below round-off.

    Their indices go into ``found``. With ``depth`` -1 only those are counted that are in overlap by more than that.
    """
    count = 0
    for j in range(f.x0.shape[0]):
        if j == i or (f.kind[j] == PLANE and f.kind[i] == PLANE) or f.kind[i] > PLANE or f.kind[j] > PLANE:
            continue
        if f.kind[i] == BALL and f.kind[j] == BALL:
            # far by one coordinate alone: no call
            since_i, since_j = t - f.t0[i], t - f.t0[j]
            x = f.x0[j, 0] + since_j * (f.v0[j, 0] + 0.5 * since_j * f.a0[j, 0])
            x -= f.x0[i, 0] + since_i * (f.v0[i, 0] + 0.5 * since_i * f.a0[i, 0])
            if abs(x) > 2.0 * (f.radius[i] + f.radius[j]):
                continue
        gap = gap_between(i, j, t, f)
        if gap <= depth * touch_length(i, j, t, f.x0, f.v0, f.radius, f.offset):
            found[count] = j
            count += 1
    return count
