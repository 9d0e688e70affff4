"""Velocities at contact points, and what an impulse does to two bodies."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar.columns import AN, AT, BN, BT, INVERSE_INERTIA, INVERSE_MASS, NX, NY, A, B
from reference_solver.planar.state import Bodies, Rows


@inner_kernel
def normal_velocity(twist: Array, rows: Rows, c: int) -> float:
    """u_n of row c (E2) [m/s]; ``twist`` may hold velocities or pseudo-velocities."""
    a, b = rows.index[c, A], rows.index[c, B]
    along = rows.real[c, NX] * (twist[b, 0] - twist[a, 0]) + rows.real[c, NY] * (twist[b, 1] - twist[a, 1])
    return along + rows.real[c, BN] * twist[b, 2] - rows.real[c, AN] * twist[a, 2]


@inner_kernel
def tangent_velocity(twist: Array, rows: Rows, c: int) -> float:
    """u_t of row c (E2) [m/s]."""
    a, b = rows.index[c, A], rows.index[c, B]
    along = rows.real[c, NX] * (twist[b, 1] - twist[a, 1]) - rows.real[c, NY] * (twist[b, 0] - twist[a, 0])
    return along + rows.real[c, BT] * twist[b, 2] - rows.real[c, AT] * twist[a, 2]


@inner_kernel
def apply_normal(bodies: Bodies, twist: Array, rows: Rows, c: int, p: float) -> None:
    """Add normal impulse p of row c to B and its opposite to A (E4)."""
    a, b = rows.index[c, A], rows.index[c, B]
    px, py = p * rows.real[c, NX], p * rows.real[c, NY]
    twist[a, 0] -= bodies.real[a, INVERSE_MASS] * px
    twist[a, 1] -= bodies.real[a, INVERSE_MASS] * py
    twist[a, 2] -= bodies.real[a, INVERSE_INERTIA] * (rows.real[c, AN] * p)
    twist[b, 0] += bodies.real[b, INVERSE_MASS] * px
    twist[b, 1] += bodies.real[b, INVERSE_MASS] * py
    twist[b, 2] += bodies.real[b, INVERSE_INERTIA] * (rows.real[c, BN] * p)


@inner_kernel
def apply_tangent(bodies: Bodies, twist: Array, rows: Rows, c: int, p: float) -> None:
    """Add tangential impulse p of row c to B and its opposite to A (E4)."""
    a, b = rows.index[c, A], rows.index[c, B]
    px, py = -p * rows.real[c, NY], p * rows.real[c, NX]
    twist[a, 0] -= bodies.real[a, INVERSE_MASS] * px
    twist[a, 1] -= bodies.real[a, INVERSE_MASS] * py
    twist[a, 2] -= bodies.real[a, INVERSE_INERTIA] * (rows.real[c, AT] * p)
    twist[b, 0] += bodies.real[b, INVERSE_MASS] * px
    twist[b, 1] += bodies.real[b, INVERSE_MASS] * py
    twist[b, 2] += bodies.real[b, INVERSE_INERTIA] * (rows.real[c, BT] * p)
