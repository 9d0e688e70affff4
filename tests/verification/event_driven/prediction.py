"""First instants at which a gap closes (O3 to O6): balls and planes by one compiled scan over the partners of a body.

Each pair is looked at from the later of its two anchors, so that the answer does not depend on when it is asked.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numba

from reference_solver.model import Array
from reference_solver.pieces import Indices
from tests.verification.event_driven.bodies import BALL, PLANE

#: numba keeps machine code by the file a kernel stands in: all of them stand here.
kernel = numba.njit(error_model="numpy", cache=True)

#: Gaps below this share of the coordinates that make them are contacts: 16 units in the last place, the rounding of
#: two positions, two radii and an event time.
TOUCH = 16.0 * 2.220446049250313e-16

#: A bound that is only just beyond the limit may be round-off; such a pair is looked at in full.
SURELY = 1.0 + 1e-9

#: A discriminant below this share of its two terms, or a closing speed below this share of the speeds that it is the
#: difference of, is round-off: nobody can tell a graze from a miss there. 16 units in the last place.
GRAZE = 16.0 * 2.220446049250313e-16

#: Doublings of a safe step in which a contact within round-off is looked for: a closing speed of a thousandth of its
#: bound still gets there.
AHEAD = 11


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


@kernel
def since(i, t, extra, f):
    """Time from body i's anchor to t + extra; 0 where t is the rounded time of the anchor."""
    return 0.0 if t == f.t0[i] else (t - f.t0[i]) + (extra - f.late[i])


@kernel
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


@kernel
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


@kernel
def relative_flight(i, j, t, extra, f, work):
    """Position, velocity, acceleration of ball j seen from ball i at t + extra, into rows 1 to 3 of ``work``."""
    since_i, since_j = since(i, t, extra, f), since(j, t, extra, f)
    for k in range(f.x0.shape[1]):
        work[1, k] = f.x0[j, k] + since_j * (f.v0[j, k] + 0.5 * since_j * f.a0[j, k])
        work[1, k] -= f.x0[i, k] + since_i * (f.v0[i, k] + 0.5 * since_i * f.a0[i, k])
        work[2, k] = f.v0[j, k] + since_j * f.a0[j, k] - (f.v0[i, k] + since_i * f.a0[i, k])
        work[3, k] = f.a0[j, k] - f.a0[i, k]


@kernel
def dot(a, b, size):
    """Sum of products."""
    total = 0.0
    for k in range(size):
        total += a[k] * b[k]
    return total


@kernel
def crossed(x, v, size):
    """Square of |x cross v|, from the differences themselves: x.x v.v - (x.v)^2 would cancel."""
    total = 0.0
    for k in range(size):
        for m in range(k):
            total += (x[k] * v[m] - x[m] * v[k]) ** 2
    return total


@kernel
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


@kernel
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


@kernel
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


@kernel
def first_fall(gap, rate, acceleration):
    """First t >= 0 at which gap + rate t + acceleration t^2 / 2 falls through zero; inf if never (O3).

    ``gap`` must not be negative; the root that would subtract nearly equal numbers is never formed. A gap of
    exactly zero is a contact just left: the next one is at -2 rate / acceleration.
    """
    if gap <= 0.0 and rate < 0.0:
        return 0.0
    square = rate * rate
    product = 2.0 * acceleration * gap
    if rate >= 0.0:
        return (rate + math.sqrt(square - product)) / -acceleration if acceleration < 0.0 else math.inf
    if square - product <= GRAZE * square and acceleration > 0.0:
        return math.inf
    return 2.0 * gap / (-rate + math.sqrt(square - product))


@kernel
def polynomial(c, degree, t):
    """Value of c[0] + c[1] t + ... (Horner)."""
    value = c[degree]
    for k in range(degree - 1, -1, -1):
        value = value * t + c[k]
    return value


@kernel
def between(c, degree, low, high):
    """Root of a polynomial with a sign change on [low, high]: halved down to neighbouring doubles."""
    rising = polynomial(c, degree, low) < 0.0
    while True:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            return high
        if (polynomial(c, degree, middle) < 0.0) == rising:
            low = middle
        else:
            high = middle


@kernel
def first_quartic_fall(work):
    """First t > 0 at which the quartic work[0, :5] falls through zero; inf if never (O5).

    Between two neighbouring roots of its derivative a polynomial is monotone, so that signs tell its roots: from
    the linear third derivative up to the quartic itself. ``work`` (5, 7) is overwritten: row k holds derivative k,
    row 4 the roots found last.
    """
    bound = 0.0
    for k in range(4):
        for m in range(4 - k):
            work[k + 1, m] = (m + 1) * work[k, m + 1]
        bound = max(bound, abs(work[0, k]))
    bound = 1.0 + bound / abs(work[0, 4])  # Cauchy's bound of all roots
    roots = work[4]
    found = 0
    for k in range(3, -1, -1):
        degree = 4 - k
        c = work[k]
        low = 0.0
        at_low = polynomial(c, degree, 0.0)
        kept = 0
        for m in range(found + 1):
            high = roots[m] if m < found else bound
            at_high = polynomial(c, degree, high)
            if at_low * at_high < 0.0 or (at_high == 0.0 and at_low != 0.0):
                root = between(c, degree, low, high)
                if k == 0 and at_low > 0.0:
                    return root
                roots[kept] = root  # never beyond the entry being read: one root per interval
                kept += 1
            low = high
            at_low = at_high
        found = kept
    return math.inf


def first_touch(
    gap: Callable[[float], float],
    step: Callable[[float], float],
    touch: float,
    start: float,
    horizon: float,
) -> float:
    """First t in [start, horizon] at which a gap closes; inf if there is none (O6).

    Steps that cannot overrun the contact come within ``touch`` of it; from there the sign change is bracketed and
    halved down to neighbouring doubles. A gap that comes so close and opens again counts as contact.

    Parameters
    ----------
    gap
        Gap [m] at a time [s].
    step
        Time [s] from t on in which the gap cannot close.
    touch
        What counts as contact [m]: some units in the last place of the coordinates.
    """
    t = before = start
    while t <= horizon:
        value = gap(t)
        if value <= 0.0:
            return _sign_change(gap, before, t)
        if value <= touch:
            ahead = (t + 2.0**k * max(step(t), math.ulp(t)) for k in range(AHEAD))
            return next((_sign_change(gap, t, high) for high in ahead if gap(high) <= 0.0), t)
        before = t
        t += max(step(t), math.ulp(t))
    return math.inf


def _sign_change(gap: Callable[[float], float], low: float, high: float) -> float:
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return high
        if gap(middle) > 0.0:
            low = middle
        else:
            high = middle
