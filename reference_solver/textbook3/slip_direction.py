"""Direction in which one contact slips under Coulomb friction in space (E65).

Components are in the contact frame (t1, t2, n), ``k`` and ``q`` as in one_contact.py. A direction d is right where
the slip velocity that friction -mu pn d leaves is along d.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel

# Newton steps on a smooth scalar function; each at least doubles the digits once near, so 30 always suffice.
NEWTON_STEPS = 30
# Halvings of an interval of length two until neighbouring doubles near its ends.
HALVINGS = 60
# A slip backwards by this share of the terms it is the sum of is round-off: the contact stands on the edge of its cone.
EDGE = 1e-13


@inner_kernel
def slip_condition(k, q, mu, d1, d2):
    """Slip velocity along d and across d, times D, for friction -mu pn d; its turn rate; and D.

    pn = -qn / D with D = knn - mu ktn.d. Times D the slip velocity is the polynomial
    w = qt D - qn ktn + mu qn Ktt d, so that d is right where w is along d: across = 0, along >= 0, D > 0.
    """
    k11, k12, k13, k22, k23, k33 = k
    divisor = k33 - mu * (k13 * d1 + k23 * d2)
    w1 = q[0] * divisor - q[2] * k13 + mu * q[2] * (k11 * d1 + k12 * d2)
    w2 = q[1] * divisor - q[2] * k23 + mu * q[2] * (k12 * d1 + k22 * d2)
    turn = -mu * (k23 * d1 - k13 * d2)
    t1 = q[0] * turn + mu * q[2] * (k12 * d1 - k11 * d2)
    t2 = q[1] * turn + mu * q[2] * (k22 * d1 - k12 * d2)
    along = w1 * d1 + w2 * d2
    across = w2 * d1 - w1 * d2
    rate = t2 * d1 - t1 * d2 - along
    return along, across, rate, divisor


@inner_kernel
def slip_direction(k, q, mu):
    """Unit slip direction: Newton from the slip a frictionless impact would leave; failing that, among all roots."""
    d1 = q[0] - q[2] / k[5] * k[2]
    d2 = q[1] - q[2] / k[5] * k[4]
    size = math.sqrt(d1 * d1 + d2 * d2)
    if size > 0.0:
        d1, d2 = d1 / size, d2 / size
        for _ in range(NEWTON_STEPS):
            along, across, rate, divisor = slip_condition(k, q, mu, d1, d2)
            if abs(across) <= 4e-16 * abs(along):
                break
            if rate == 0.0:
                break
            step = max(-0.5, min(0.5, -across / rate))
            d1, d2 = _turned(d1, d2, step)
        along, across, rate, divisor = slip_condition(k, q, mu, d1, d2)
        # 1e-13: a root reached to round-off of w, whose terms may be larger than their sum
        if along > 0.0 and divisor > 0.0 and abs(across) <= 1e-13 * along:
            return True, d1, d2
    return search_directions(k, q, mu)


@inner_kernel
def _turned(d1, d2, angle):
    c, s = math.cos(angle), math.sin(angle)
    return c * d1 - s * d2, s * d1 + c * d2


@inner_kernel
def search_directions(k, q, mu):
    """Admissible direction with the fastest slip, from all roots of the slip condition; whether there is one.

    With t = tan(theta/2) the condition is a quartic; two charts, t in [-1, 1] about opposite directions, cover the
    circle. Between neighbouring roots of its derivative a polynomial is monotone, so that from the third derivative
    upwards every root is bracketed, however close to its neighbour.
    """
    best, best1, best2 = -EDGE, 1.0, 0.0
    found = False
    for side in (1.0, -1.0):
        p, size = slip_quartic(k, q, mu, side)
        first = (p[1], 2.0 * p[2], 3.0 * p[3], 4.0 * p[4], 0.0)
        second = (first[1], 2.0 * first[2], 3.0 * first[3], 0.0, 0.0)
        m = crossing((second[1], 2.0 * second[2], 0.0, 0.0, 0.0), -1.0, 1.0)
        a, b = crossing(second, -1.0, m), crossing(second, m, 1.0)
        r1, r2, r3 = crossing(first, -1.0, a), crossing(first, a, b), crossing(first, b, 1.0)
        for t in (crossing(p, -1.0, r1), crossing(p, r1, r2), crossing(p, r2, r3), crossing(p, r3, 1.0), r1, r2, r3):
            d1, d2 = side * (1.0 - t * t) / (1.0 + t * t), side * 2.0 * t / (1.0 + t * t)
            d1, d2 = polished(k, q, mu, d1, d2)
            along, across, _, divisor = slip_condition(k, q, mu, d1, d2)
            if divisor > 0.0 and along > best * size and abs(across) <= EDGE * size:
                found, best, best1, best2 = True, along / size, d1, d2
    return found, best1, best2


@inner_kernel
def slip_quartic(k, q, mu, side):
    """Coefficients, ascending in t, of the slip condition times (1 + t^2)^2 about the direction (side, 0); their size.

    w2 d1 - w1 d2 with w = a + A d, d = side (1 - t^2, 2 t)/(1 + t^2).
    """
    k11, k12, k13, k22, k23, k33 = k
    a1, a2 = side * (q[0] * k33 - q[2] * k13), side * (q[1] * k33 - q[2] * k23)
    a11, a12 = mu * (q[2] * k11 - q[0] * k13), mu * (q[2] * k12 - q[0] * k23)
    a21, a22 = mu * (q[2] * k12 - q[1] * k13), mu * (q[2] * k22 - q[1] * k23)
    turn = 2.0 * (a22 - a11)
    size = abs(q[0]) * k33 + abs(q[1]) * k33 - q[2] * (abs(k13) + abs(k23)) + abs(a11) + abs(a12) + abs(a21) + abs(a22)
    return (a2 + a21, turn - 2.0 * a1, -2.0 * a21 - 4.0 * a12, -turn - 2.0 * a1, a21 - a2), size


@inner_kernel
def polynomial(p, t):
    """Value at t of the polynomial with coefficients p, ascending."""
    return p[0] + t * (p[1] + t * (p[2] + t * (p[3] + t * p[4])))


@inner_kernel
def crossing(p, low, high):
    """Where a polynomial that is monotone between two points changes its sign; the upper point if it does not."""
    positive = polynomial(p, low) > 0.0
    if (polynomial(p, high) > 0.0) == positive:
        return high
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if (polynomial(p, middle) > 0.0) == positive:
            low = middle
        else:
            high = middle
    return high


@inner_kernel
def polished(k, q, mu, d1, d2):
    """Newton steps on the condition itself, as long as they bring it down: the quartic's coefficients are rounded."""
    _, across, rate, _ = slip_condition(k, q, mu, d1, d2)
    for _ in range(3):
        if rate == 0.0 or abs(across) > abs(rate):
            break
        t1, t2 = _turned(d1, d2, -across / rate)
        _, better, slope, _ = slip_condition(k, q, mu, t1, t2)
        if abs(better) >= abs(across):
            break
        d1, d2, across, rate = t1, t2, better, slope
    return d1, d2
