"""Sequential impulses, row after row, with accumulated impulses clamped (E10, E11).

The rows of one manifold are solved in their own space: their velocities are read from the two bodies once, each impulse
changes the velocities of the other rows by the matrix W of the manifold (E12), and the bodies get the sum at the end.
That is the same row after row, with fewer operations that wait for each other.

In the second half of the sweeps the second point of two comes first (`iteration.sweep_often`). In one order throughout,
what the last sweep leaves unsolved is always at the same corner, and a column creeps to that side.
"""

from __future__ import annotations

from reference_solver.compilation import spliced_kernel
from reference_solver.coulomb import into_interval
from reference_solver.textbook.options import Options
from reference_solver.textbook2.columns import (
    AN,
    AT,
    BN,
    BT,
    COUPLING,
    FRICTION,
    INVERSE_INERTIA,
    INVERSE_MASS,
    NORMAL_MASS,
    NX,
    NY,
    PN,
    PT,
    PUSH,
    PUSH_TARGET,
    TANGENT_MASS,
    TARGET,
    A,
    B,
)
from reference_solver.textbook2.state import MANIFOLDS, Bodies, Rows


@spliced_kernel
def sweep_rows(bodies: Bodies, rows: Rows, options: Options, relaxation: float, backwards: int, push: int) -> None:
    """One sweep over all manifolds in canonical order, at each point the normal row and then the friction row.

    ``backwards``: whether the second point of two comes first. ``push``: whether the pseudo-velocity rows (E16) are
    solved along with them.
    """
    for m in range(rows.counts[MANIFOLDS]):
        first = rows.manifold[m]
        if rows.manifold[m + 1] - first == 1:
            sweep_point(bodies, rows, first, options, relaxation)
            if push:
                push_point(bodies, rows, first, relaxation)
        else:
            sweep_pair(bodies, rows, m, backwards, options, relaxation)
            if push:
                push_pair(bodies, rows, first + backwards, first + 1 - backwards, relaxation)


@spliced_kernel
def sweep_point(bodies: Bodies, rows: Rows, c: int, options: Options, relaxation: float) -> None:
    """Rows of a manifold of one point."""
    a, b, row = rows.integer[c, A], rows.integer[c, B], rows.real[c]
    va, vb = bodies.twist[a], bodies.twist[b]
    mass_a, mass_b = bodies.real[a, INVERSE_MASS], bodies.real[b, INVERSE_MASS]
    ia, ib = bodies.real[a, INVERSE_INERTIA], bodies.real[b, INVERSE_INERTIA]
    nx, ny, an, bn, at, bt = row[NX], row[NY], row[AN], row[BN], row[AT], row[BT]
    x, y = vb[0] - va[0], vb[1] - va[1]
    old_n, old_t, mass_n = row[PN], row[PT], relaxation * row[NORMAL_MASS]
    n = max(old_n - mass_n * (nx * x + ny * y + (bn * vb[2] - an * va[2]) - row[TARGET]), 0.0)
    row[PN], t = n, old_t
    if options.friction:
        mass_t, k = relaxation * row[TANGENT_MASS], row[COUPLING]
        known = old_t - mass_t * (nx * y - ny * x + (bt * vb[2] - at * va[2]) - k * old_n)
        t = into_interval(known - mass_t * k * n, row[FRICTION] * n)
        row[PT] = t
    pn, pt = n - old_n, t - old_t
    va[0] = va[0] - mass_a * nx * pn + mass_a * ny * pt
    va[1] = va[1] - mass_a * ny * pn - mass_a * nx * pt
    va[2] = va[2] - ia * an * pn - ia * at * pt
    vb[0] = vb[0] + mass_b * nx * pn - mass_b * ny * pt
    vb[1] = vb[1] + mass_b * ny * pn + mass_b * nx * pt
    vb[2] = vb[2] + ib * bn * pn + ib * bt * pt


@spliced_kernel
def sweep_pair(bodies: Bodies, rows: Rows, m: int, backwards: int, options: Options, relaxation: float) -> None:
    """Rows of a manifold of two points, which share their normal; ``backwards``: 1 where the second point comes first.

    In p := max(p - (u - b) / k, 0) the velocity u is that at the start plus W times what impulses have changed since.
    All that is known at the start is taken together first (``known``), so that a row waits for little. For the same
    reason the last friction impulse comes to the bodies after the sum of the others.
    """
    # Rows of W: normal and friction of the point that comes first are i and i + 1, of the other j and j + 1.
    c, d, i, j = rows.manifold[m] + backwards, rows.manifold[m] + 1 - backwards, 2 * backwards, 2 - 2 * backwards
    a, b, one, two, w = rows.integer[c, A], rows.integer[c, B], rows.real[c], rows.real[d], rows.block[m]
    va, vb = bodies.twist[a], bodies.twist[b]
    mass_a, mass_b = bodies.real[a, INVERSE_MASS], bodies.real[b, INVERSE_MASS]
    ia, ib = bodies.real[a, INVERSE_INERTIA], bodies.real[b, INVERSE_INERTIA]
    nx, ny, x, y, wa, wb = one[NX], one[NY], vb[0] - va[0], vb[1] - va[1], va[2], vb[2]
    along, across = nx * x + ny * y, nx * y - ny * x
    an1, bn1, an2, bn2 = one[AN], one[BN], two[AN], two[BN]
    at1, bt1, at2, bt2 = one[AT], one[BT], two[AT], two[BT]
    old_n1, old_t1, old_n2, old_t2 = one[PN], one[PT], two[PN], two[PT]
    t1, t2, friction = old_t1, old_t2, options.friction
    mass_n1, mass_t1 = relaxation * one[NORMAL_MASS], relaxation * one[TANGENT_MASS]
    mass_n2, mass_t2 = relaxation * two[NORMAL_MASS], relaxation * two[TANGENT_MASS]
    n1 = max(old_n1 - mass_n1 * (along + (bn1 * wb - an1 * wa) - one[TARGET]), 0.0)
    if friction:
        known = old_t1 - mass_t1 * (across + (bt1 * wb - at1 * wa) - w[i, i + 1] * old_n1)
        t1 = into_interval(known - mass_t1 * w[i, i + 1] * n1, one[FRICTION] * n1)
    u = along + (bn2 * wb - an2 * wa) - two[TARGET] - w[i, j] * old_n1
    if friction:
        known = old_n2 - mass_n2 * (u - w[i + 1, j] * old_t1)
        n2 = max(known - mass_n2 * w[i, j] * n1 - mass_n2 * w[i + 1, j] * t1, 0.0)
        u = across + (bt2 * wb - at2 * wa) - w[i, j + 1] * old_n1 - w[i + 1, j + 1] * old_t1
        known = old_t2 - mass_t2 * (u - w[j, j + 1] * old_n2)
        known = known - mass_t2 * w[i, j + 1] * n1 - mass_t2 * w[i + 1, j + 1] * t1
        t2 = into_interval(known - mass_t2 * w[j, j + 1] * n2, two[FRICTION] * n2)
    else:
        n2 = max(old_n2 - mass_n2 * u - mass_n2 * w[i, j] * n1, 0.0)
    one[PN], one[PT], two[PN], two[PT] = n1, t1, n2, t2
    pn1, pn2, pt1, pt2 = n1 - old_n1, n2 - old_n2, t1 - old_t1, t2 - old_t2
    px, py = (pn1 + pn2) * nx - pt1 * ny, (pn1 + pn2) * ny + pt1 * nx
    va[0] = va[0] - mass_a * px + mass_a * ny * pt2
    va[1] = va[1] - mass_a * py - mass_a * nx * pt2
    va[2] = wa - ia * (an1 * pn1 + an2 * pn2 + at1 * pt1) - ia * at2 * pt2
    vb[0] = vb[0] + mass_b * px - mass_b * ny * pt2
    vb[1] = vb[1] + mass_b * py + mass_b * nx * pt2
    vb[2] = wb + ib * (bn1 * pn1 + bn2 * pn2 + bt1 * pt1) + ib * bt2 * pt2


@spliced_kernel
def push_point(bodies: Bodies, rows: Rows, c: int, relaxation: float) -> None:
    """Pseudo-velocity row of a manifold of one point (E16)."""
    a, b, row = rows.integer[c, A], rows.integer[c, B], rows.real[c]
    va, vb = bodies.pseudo[a], bodies.pseudo[b]
    un = row[NX] * (vb[0] - va[0]) + row[NY] * (vb[1] - va[1]) + (row[BN] * vb[2] - row[AN] * va[2])
    old = row[PUSH]
    row[PUSH] = max(old - relaxation * (un - row[PUSH_TARGET]) * row[NORMAL_MASS], 0.0)
    p = row[PUSH] - old
    px, py = p * row[NX], p * row[NY]
    va[0] -= bodies.real[a, INVERSE_MASS] * px
    va[1] -= bodies.real[a, INVERSE_MASS] * py
    va[2] -= bodies.real[a, INVERSE_INERTIA] * (row[AN] * p)
    vb[0] += bodies.real[b, INVERSE_MASS] * px
    vb[1] += bodies.real[b, INVERSE_MASS] * py
    vb[2] += bodies.real[b, INVERSE_INERTIA] * (row[BN] * p)


@spliced_kernel
def push_pair(bodies: Bodies, rows: Rows, c: int, d: int, relaxation: float) -> None:
    """Pseudo-velocity rows of a manifold of two points (E16)."""
    a, b, one, two = rows.integer[c, A], rows.integer[c, B], rows.real[c], rows.real[d]
    va, vb = bodies.pseudo[a], bodies.pseudo[b]
    mass_a, mass_b = bodies.real[a, INVERSE_MASS], bodies.real[b, INVERSE_MASS]
    ia, ib = bodies.real[a, INVERSE_INERTIA], bodies.real[b, INVERSE_INERTIA]
    nx, ny = one[NX], one[NY]
    along = nx * (vb[0] - va[0]) + ny * (vb[1] - va[1])
    an1, bn1, an2, bn2 = one[AN], one[BN], two[AN], two[BN]
    old = one[PUSH]
    un = along + (bn1 * vb[2] - an1 * va[2])
    one[PUSH] = max(old - relaxation * (un - one[PUSH_TARGET]) * one[NORMAL_MASS], 0.0)
    p1 = one[PUSH] - old
    old = two[PUSH]
    un = along + (bn2 * vb[2] - an2 * va[2]) + (mass_a + mass_b + ia * (an1 * an2) + ib * (bn1 * bn2)) * p1
    two[PUSH] = max(old - relaxation * (un - two[PUSH_TARGET]) * two[NORMAL_MASS], 0.0)
    p2 = two[PUSH] - old
    px, py = (p1 + p2) * nx, (p1 + p2) * ny
    va[0] -= mass_a * px
    va[1] -= mass_a * py
    va[2] -= ia * (an1 * p1 + an2 * p2)
    vb[0] += mass_b * px
    vb[1] += mass_b * py
    vb[2] += ib * (bn1 * p1 + bn2 * p2)


@spliced_kernel
def sweep_pushes(bodies: Bodies, rows: Rows, relaxation: float) -> None:
    """One sweep over the pseudo-velocity rows alone."""
    for m in range(rows.counts[MANIFOLDS]):
        first = rows.manifold[m]
        if rows.manifold[m + 1] - first == 1:
            push_point(bodies, rows, first, relaxation)
        else:
            push_pair(bodies, rows, first, first + 1, relaxation)
