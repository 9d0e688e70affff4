"""First instants at which a gap closes: quadratics, quartics, and gaps of turning bodies (O3 to O6)."""

from __future__ import annotations

import math
from collections.abc import Callable

from reference_solver.compilation import inner_kernel, kernel

#: A discriminant below this share of its two terms, or a closing speed below this share of the speeds that it is the
#: difference of, is round-off: nobody can tell a graze from a miss there. 16 units in the last place.
GRAZE = 16.0 * 2.220446049250313e-16

#: Doublings of a safe step in which a contact within round-off is looked for: a closing speed of a thousandth of its
#: bound still gets there.
AHEAD = 11


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


@inner_kernel
def polynomial(c, degree, t):
    """Value of c[0] + c[1] t + ... (Horner)."""
    value = c[degree]
    for k in range(degree - 1, -1, -1):
        value = value * t + c[k]
    return value


@inner_kernel
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


@inner_kernel
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
