"""Sequential impulses, row after row, with accumulated impulses clamped (E10, E11).

The rows of one manifold are solved in their own space: their velocities are read from the two bodies once, each impulse
changes the velocities of the other rows by the matrix W of the manifold (E12), and the bodies get the sum at the end.
That is the same row after row, with fewer operations that wait for each other.

The two points of a manifold take turns in being first. In one order throughout, what the last sweep leaves unsolved is
always at the same corner, and a column creeps to one side.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.coulomb import into_interval
from reference_solver.planar.columns import (
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
from reference_solver.planar.state import MANIFOLDS, Bodies, Rows
from reference_solver.stepping.options import Options


@inner_kernel
def sweep_rows(bodies: Bodies, rows: Rows, options: Options, relaxation: float, turn: int, push: int) -> None:
    """One sweep over all manifolds in canonical order, at each point the normal row and then the friction row.

    ``turn``: number of the sweep. ``push``: whether the pseudo-velocity rows (E16) are solved along with them.
    """
    for m in range(rows.counts[MANIFOLDS]):
        first = rows.manifold[m]
        if rows.manifold[m + 1] - first == 1:
            sweep_point(bodies, rows, first, options, relaxation)
            if push:
                push_point(bodies, rows, first, relaxation)
        else:
            c, d = first + turn % 2, first + 1 - turn % 2
            sweep_pair(bodies, rows, c, d, options, relaxation)
            if push:
                push_pair(bodies, rows, c, d, relaxation)


@inner_kernel
def sweep_point(bodies: Bodies, rows: Rows, c: int, options: Options, relaxation: float) -> None:
    """Rows of a manifold of one point."""
    a, b, row = rows.integer[c, A], rows.integer[c, B], rows.real[c]
    va, vb = bodies.twist[a], bodies.twist[b]
    nx, ny = row[NX], row[NY]
    x, y = vb[0] - va[0], vb[1] - va[1]
    un = nx * x + ny * y + (row[BN] * vb[2] - row[AN] * va[2])
    old = row[PN]
    new = max(old - relaxation * (un - row[TARGET]) * row[NORMAL_MASS], 0.0)
    row[PN], pn, pt = new, new - old, 0.0
    if options.friction:
        ut = nx * y - ny * x + (row[BT] * vb[2] - row[AT] * va[2]) + row[COUPLING] * pn
        old = row[PT]
        row[PT] = into_interval(old - relaxation * ut * row[TANGENT_MASS], row[FRICTION] * new)
        pt = row[PT] - old
    px, py = pn * nx - pt * ny, pn * ny + pt * nx
    mass_a, mass_b = bodies.real[a, INVERSE_MASS], bodies.real[b, INVERSE_MASS]
    va[0] -= mass_a * px
    va[1] -= mass_a * py
    va[2] -= bodies.real[a, INVERSE_INERTIA] * (row[AN] * pn + row[AT] * pt)
    vb[0] += mass_b * px
    vb[1] += mass_b * py
    vb[2] += bodies.real[b, INVERSE_INERTIA] * (row[BN] * pn + row[BT] * pt)


@inner_kernel
def sweep_pair(bodies: Bodies, rows: Rows, c: int, d: int, options: Options, relaxation: float) -> None:
    """Rows of a manifold of two points, which share their normal: those of row c, then those of row d."""
    a, b, one, two = rows.integer[c, A], rows.integer[c, B], rows.real[c], rows.real[d]
    va, vb = bodies.twist[a], bodies.twist[b]
    mass_a, mass_b = bodies.real[a, INVERSE_MASS], bodies.real[b, INVERSE_MASS]
    ia, ib = bodies.real[a, INVERSE_INERTIA], bodies.real[b, INVERSE_INERTIA]
    nx, ny = one[NX], one[NY]
    x, y, wa, wb = vb[0] - va[0], vb[1] - va[1], va[2], vb[2]
    along, across = nx * x + ny * y, nx * y - ny * x
    an1, bn1, an2, bn2 = one[AN], one[BN], two[AN], two[BN]
    at1, bt1, at2, bt2 = one[AT], one[BT], two[AT], two[BT]
    old = one[PN]
    new = max(old - relaxation * (along + (bn1 * wb - an1 * wa) - one[TARGET]) * one[NORMAL_MASS], 0.0)
    one[PN], pn1, pt1 = new, new - old, 0.0
    if options.friction:
        ut = across + (bt1 * wb - at1 * wa) + one[COUPLING] * pn1
        old = one[PT]
        one[PT] = into_interval(old - relaxation * ut * one[TANGENT_MASS], one[FRICTION] * new)
        pt1 = one[PT] - old
    un = along + (bn2 * wb - an2 * wa) + (mass_a + mass_b + ia * (an1 * an2) + ib * (bn1 * bn2)) * pn1
    un += (ia * (at1 * an2) + ib * (bt1 * bn2)) * pt1
    old = two[PN]
    new = max(old - relaxation * (un - two[TARGET]) * two[NORMAL_MASS], 0.0)
    two[PN], pn2, pt2 = new, new - old, 0.0
    if options.friction:
        ut = across + (bt2 * wb - at2 * wa) + (ia * (an1 * at2) + ib * (bn1 * bt2)) * pn1
        ut += (mass_a + mass_b + ia * (at1 * at2) + ib * (bt1 * bt2)) * pt1 + two[COUPLING] * pn2
        old = two[PT]
        two[PT] = into_interval(old - relaxation * ut * two[TANGENT_MASS], two[FRICTION] * new)
        pt2 = two[PT] - old
    pn, pt = pn1 + pn2, pt1 + pt2
    px, py = pn * nx - pt * ny, pn * ny + pt * nx
    va[0] -= mass_a * px
    va[1] -= mass_a * py
    va[2] -= ia * ((an1 * pn1 + an2 * pn2) + (at1 * pt1 + at2 * pt2))
    vb[0] += mass_b * px
    vb[1] += mass_b * py
    vb[2] += ib * ((bn1 * pn1 + bn2 * pn2) + (bt1 * pt1 + bt2 * pt2))


@inner_kernel
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


@inner_kernel
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


@inner_kernel
def sweep_pushes(bodies: Bodies, rows: Rows, relaxation: float, turn: int) -> None:
    """One sweep over the pseudo-velocity rows alone."""
    for m in range(rows.counts[MANIFOLDS]):
        first = rows.manifold[m]
        if rows.manifold[m + 1] - first == 1:
            push_point(bodies, rows, first, relaxation)
        else:
            push_pair(bodies, rows, first + turn % 2, first + 1 - turn % 2, relaxation)
