"""Velocities at contact points, and what an impulse does to two bodies."""

from __future__ import annotations

from reference_solver.compilation import kernel
from reference_solver.model import Array
from reference_solver.planar.state import Bodies, Rows


@kernel
def normal_velocity(twist: Array, rows: Rows, c: int) -> float:
    """u_n of row c (E2) [m/s]; ``twist`` may hold velocities or pseudo-velocities."""
    a, b = rows.body_a[c], rows.body_b[c]
    along = rows.normal[c, 0] * (twist[b, 0] - twist[a, 0]) + rows.normal[c, 1] * (twist[b, 1] - twist[a, 1])
    return along + rows.lever[c, 1] * twist[b, 2] - rows.lever[c, 0] * twist[a, 2]


@kernel
def tangent_velocity(twist: Array, rows: Rows, c: int) -> float:
    """u_t of row c (E2) [m/s]."""
    a, b = rows.body_a[c], rows.body_b[c]
    along = rows.normal[c, 0] * (twist[b, 1] - twist[a, 1]) - rows.normal[c, 1] * (twist[b, 0] - twist[a, 0])
    return along + rows.lever[c, 3] * twist[b, 2] - rows.lever[c, 2] * twist[a, 2]


@kernel
def apply_normal(bodies: Bodies, twist: Array, rows: Rows, c: int, p: float) -> None:
    """Add normal impulse p of row c to B and its opposite to A (E4)."""
    a, b = rows.body_a[c], rows.body_b[c]
    px, py = p * rows.normal[c, 0], p * rows.normal[c, 1]
    twist[a, 0] -= bodies.inverse_mass[a] * px
    twist[a, 1] -= bodies.inverse_mass[a] * py
    twist[a, 2] -= bodies.inverse_inertia[a] * (rows.lever[c, 0] * p)
    twist[b, 0] += bodies.inverse_mass[b] * px
    twist[b, 1] += bodies.inverse_mass[b] * py
    twist[b, 2] += bodies.inverse_inertia[b] * (rows.lever[c, 1] * p)


@kernel
def apply_tangent(bodies: Bodies, twist: Array, rows: Rows, c: int, p: float) -> None:
    """Add tangential impulse p of row c to B and its opposite to A (E4)."""
    a, b = rows.body_a[c], rows.body_b[c]
    px, py = -p * rows.normal[c, 1], p * rows.normal[c, 0]
    twist[a, 0] -= bodies.inverse_mass[a] * px
    twist[a, 1] -= bodies.inverse_mass[a] * py
    twist[a, 2] -= bodies.inverse_inertia[a] * (rows.lever[c, 2] * p)
    twist[b, 0] += bodies.inverse_mass[b] * px
    twist[b, 1] += bodies.inverse_mass[b] * py
    twist[b, 2] += bodies.inverse_inertia[b] * (rows.lever[c, 3] * p)
