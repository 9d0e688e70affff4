"""Coulomb's law at one contact: exact solutions for one point with all other impulses held.

Components are in the contact frame (t1, t2, n). ``k = (k11, k12, k13, k22, k23, k33)`` is the symmetric collision
matrix [1/kg], ``q`` the contact velocity without this contact's impulse, its target taken off [m/s].
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.textbook3.slip_direction import NEWTON_STEPS, slip_direction

# A disc this small beside the sticking impulse does not change the slip, and the secular equation would underflow.
NO_FRICTION = 1e-50


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
    found, d1, d2 = slip_direction(k, q, mu)
    if found:
        pn = -q[2] / (k33 - mu * (k13 * d1 + k23 * d2))
        return (-mu * pn * d1, -mu * pn * d2, pn)
    # None, which only a singular K allows: normal impulse first, friction limited by it
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
