"""Coulomb's law at one contact: exact solutions for one point with all other impulses held.

Components are in the contact frame (t1, t2, n). ``k = (k11, k12, k13, k22, k23, k33)`` is the symmetric collision
matrix [1/kg], ``q`` the contact velocity without this contact's impulse, its target taken off [m/s].
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel

# Newton steps on a smooth scalar function; each at least doubles the digits once near, so 30 always suffice.
NEWTON_STEPS = 30
# A disc this small beside the sticking impulse does not change the slip, and the secular equation would underflow.
NO_FRICTION = 1e-50
# Directions tried when Newton fails. The slip condition is a trigonometric polynomial of degree two, with at
# most four roots; a sixteenth of a turn separates all but nearly double ones.
SCAN = 32


@kernel
def disc_friction(k11, k12, k22, g1, g2, radius):
    """Friction impulse minimising 1/2 p.K p + g.p over the disc |p| <= radius.

    Inside the disc the contact sticks. On its edge K p + g = -s p with s > 0: the slip velocity is opposite to
    the impulse also where K is not isotropic, which scaling back the sticking impulse would miss.
    s solves the secular equation 1/|p(s)| = 1/radius by Newton from s = 0 (More and Sorensen, SIAM J. Sci. Stat.
    Comput. 4, 1983).
    """
    if radius <= 0.0:
        return 0.0, 0.0
    s = 0.0
    p1, p2 = 0.0, 0.0
    for step in range(NEWTON_STEPS):
        a, c = k11 + s, k22 + s
        determinant = a * c - k12 * k12
        p1 = (k12 * g2 - c * g1) / determinant
        p2 = (k12 * g1 - a * g2) / determinant
        size = math.sqrt(p1 * p1 + p2 * p2)
        if step == 0 and size <= radius:
            return p1, p2
        if step == 0 and radius < NO_FRICTION * size:
            slip = math.sqrt(g1 * g1 + g2 * g2)
            return -radius * g1 / slip, -radius * g2 / slip
        if size <= radius * (1.0 + 1e-15):
            break
        w1 = (c * p1 - k12 * p2) / determinant
        w2 = (a * p2 - k12 * p1) / determinant
        s += size * size * (size - radius) / (radius * (p1 * w1 + p2 * w2))
    size = math.sqrt(p1 * p1 + p2 * p2)
    return radius * p1 / size, radius * p2 / size


@kernel
def coulomb_impulse(k, q, mu):
    """Impulse (p1, p2, pn) with 0 <= K p + q, complementary to pn, and friction of largest dissipation.

    Separation is tried first, then sticking, then slipping. Depends on k, q and mu only, not on a first guess.
    """
    k11, k12, k13, k22, k23, k33 = k
    if q[2] >= 0.0:
        return (0.0, 0.0, 0.0)
    if mu == 0.0:
        return (0.0, 0.0, -q[2] / k33)
    stick = _solve_symmetric(k, q)
    if stick[2] >= 0.0 and stick[0] * stick[0] + stick[1] * stick[1] <= mu * mu * stick[2] * stick[2]:
        return stick
    found, d1, d2 = _slip_direction(k, q, mu)
    if found:
        pn = -q[2] / (k33 - mu * (k13 * d1 + k23 * d2))
        return (-mu * pn * d1, -mu * pn * d2, pn)
    # No consistent slip direction (large mu and a slender body): normal impulse first, friction limited by it
    pn = -q[2] / k33
    p1, p2 = disc_friction(k11, k12, k22, q[0] + k13 * pn, q[1] + k23 * pn, mu * pn)
    return (p1, p2, pn)


@inner_kernel
def _solve_symmetric(k, q):
    """-K^-1 q of a symmetric positive definite 3 x 3 matrix, by Cramer's rule on cofactors."""
    k11, k12, k13, k22, k23, k33 = k
    c11 = k22 * k33 - k23 * k23
    c12 = k13 * k23 - k12 * k33
    c13 = k12 * k23 - k13 * k22
    c22 = k11 * k33 - k13 * k13
    c23 = k12 * k13 - k11 * k23
    c33 = k11 * k22 - k12 * k12
    s = -1.0 / (k11 * c11 + k12 * c12 + k13 * c13)
    return (
        s * (c11 * q[0] + c12 * q[1] + c13 * q[2]),
        s * (c12 * q[0] + c22 * q[1] + c23 * q[2]),
        s * (c13 * q[0] + c23 * q[1] + c33 * q[2]),
    )


@inner_kernel
def _slip_condition(k, q, mu, d1, d2):
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
def _slip_direction(k, q, mu):
    """Unit slip direction: Newton from the slip a frictionless impact would leave; failing that, a scan."""
    d1 = q[0] - q[2] / k[5] * k[2]
    d2 = q[1] - q[2] / k[5] * k[4]
    size = math.sqrt(d1 * d1 + d2 * d2)
    if size > 0.0:
        d1, d2 = d1 / size, d2 / size
        for _ in range(NEWTON_STEPS):
            along, across, rate, divisor = _slip_condition(k, q, mu, d1, d2)
            if abs(across) <= 4e-16 * abs(along):
                break
            if rate == 0.0:
                break
            step = max(-0.5, min(0.5, -across / rate))
            d1, d2 = _turned(d1, d2, step)
        along, across, rate, divisor = _slip_condition(k, q, mu, d1, d2)
        # 1e-13: a root reached to round-off of w, whose terms may be larger than their sum
        if along > 0.0 and divisor > 0.0 and abs(across) <= 1e-13 * along:
            return True, d1, d2
    return _scan_directions(k, q, mu)


@inner_kernel
def _turned(d1, d2, angle):
    c, s = math.cos(angle), math.sin(angle)
    return c * d1 - s * d2, s * d1 + c * d2


@inner_kernel
def _scan_directions(k, q, mu):
    """First admissible root of the slip condition on the circle, by sign changes and bisection."""
    width = 2.0 * math.pi / SCAN
    for i in range(SCAN):
        low, high = i * width, (i + 1) * width
        at_low = _slip_condition(k, q, mu, math.cos(low), math.sin(low))
        at_high = _slip_condition(k, q, mu, math.cos(high), math.sin(high))
        if (at_low[1] > 0.0) == (at_high[1] > 0.0):
            continue
        for _ in range(60):  # halvings until neighbouring doubles
            middle = 0.5 * (low + high)
            at_middle = _slip_condition(k, q, mu, math.cos(middle), math.sin(middle))
            if (at_middle[1] > 0.0) == (at_low[1] > 0.0):
                low = middle
            else:
                high = middle
        d1, d2 = math.cos(low), math.sin(low)
        along, _, _, divisor = _slip_condition(k, q, mu, d1, d2)
        if along >= 0.0 and divisor > 0.0:
            return True, d1, d2
    return False, 1.0, 0.0


@inner_kernel
def into_disc(p1: float, p2: float, radius: float) -> tuple[float, float]:
    """Nearest point of the disc of that radius."""
    size = math.sqrt(p1 * p1 + p2 * p2)
    if size <= radius:
        return p1, p2
    return radius * p1 / size, radius * p2 / size
