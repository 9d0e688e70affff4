"""Scalar sequential impulses: one row after the other, accumulated impulses clamped (E10, E11)."""

from __future__ import annotations

from reference_solver.compilation import kernel
from reference_solver.planar.kinematics import apply_normal, apply_tangent, normal_velocity, tangent_velocity
from reference_solver.planar.state import CONTACTS, Bodies, Options, Rows


@kernel
def sweep_rows(bodies: Bodies, rows: Rows, options: Options, relaxation: float) -> None:
    """One sweep over all rows in canonical order, at each point the normal row and then the friction row."""
    for c in range(rows.count[CONTACTS]):
        u = normal_velocity(bodies.twist, rows, c)
        old = rows.impulse[c, 0]
        new = max(old - relaxation * (u - rows.target[c]) * rows.normal_mass[c], 0.0)
        rows.impulse[c, 0] = new
        apply_normal(bodies, bodies.twist, rows, c, new - old)
        if options.friction:
            u = tangent_velocity(bodies.twist, rows, c)
            old = rows.impulse[c, 1]
            bound = rows.friction[c] * rows.impulse[c, 0]
            new = min(max(old - relaxation * u * rows.tangent_mass[c], -bound), bound)
            rows.impulse[c, 1] = new
            apply_tangent(bodies, bodies.twist, rows, c, new - old)


@kernel
def sweep_pushes(bodies: Bodies, rows: Rows, relaxation: float) -> None:
    """One sweep over the pseudo-velocity rows of position correction (E16)."""
    for c in range(rows.count[CONTACTS]):
        u = normal_velocity(bodies.pseudo, rows, c)
        old = rows.push[c]
        new = max(old - relaxation * (u - rows.push_target[c]) * rows.normal_mass[c], 0.0)
        rows.push[c] = new
        apply_normal(bodies, bodies.pseudo, rows, c, new - old)
