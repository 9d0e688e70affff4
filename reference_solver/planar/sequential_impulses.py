"""Scalar sequential impulses: one row after the other, accumulated impulses clamped (E10, E11)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.coulomb import into_interval
from reference_solver.planar.columns import FRICTION, NORMAL_MASS, PN, PT, PUSH, PUSH_TARGET, TANGENT_MASS, TARGET
from reference_solver.planar.kinematics import apply_normal, apply_tangent, normal_velocity, tangent_velocity
from reference_solver.planar.state import CONTACTS, Bodies, Rows
from reference_solver.stepping.options import Options


@inner_kernel
def sweep_rows(bodies: Bodies, rows: Rows, options: Options, relaxation: float) -> None:
    """One sweep over all rows in canonical order, at each point the normal row and then the friction row."""
    for c in range(rows.counts[CONTACTS]):
        u = normal_velocity(bodies.twist, rows, c)
        old = rows.real[c, PN]
        new = max(old - relaxation * (u - rows.real[c, TARGET]) * rows.real[c, NORMAL_MASS], 0.0)
        rows.real[c, PN] = new
        apply_normal(bodies, bodies.twist, rows, c, new - old)
        if options.friction:
            u = tangent_velocity(bodies.twist, rows, c)
            old = rows.real[c, PT]
            bound = rows.real[c, FRICTION] * rows.real[c, PN]
            new = into_interval(old - relaxation * u * rows.real[c, TANGENT_MASS], bound)
            rows.real[c, PT] = new
            apply_tangent(bodies, bodies.twist, rows, c, new - old)


@inner_kernel
def sweep_pushes(bodies: Bodies, rows: Rows, relaxation: float) -> None:
    """One sweep over the pseudo-velocity rows of position correction (E16)."""
    for c in range(rows.counts[CONTACTS]):
        u = normal_velocity(bodies.pseudo, rows, c)
        old = rows.real[c, PUSH]
        new = max(old - relaxation * (u - rows.real[c, PUSH_TARGET]) * rows.real[c, NORMAL_MASS], 0.0)
        rows.real[c, PUSH] = new
        apply_normal(bodies, bodies.pseudo, rows, c, new - old)
