"""How far impulses and velocities are from solving the contact problem: the scaled natural map (E14)."""

from __future__ import annotations

from reference_solver.compilation import kernel
from reference_solver.planar.kinematics import normal_velocity, tangent_velocity
from reference_solver.planar.state import CONTACTS, Bodies, Options, Rows

#: Share of a contact's own impulse that its scale never falls below. With a residual of 1e-13 it allows 1e-14 of
#: the impulse, 45 units in the last place: what the sum over a tall column cannot be better than.
IMPULSE_SHARE = 0.1


@kernel
def natural_map(bodies: Bodies, rows: Rows, options: Options) -> float:
    """Largest scaled natural-map residual over all rows, dimensionless."""
    worst = 0.0
    for c in range(rows.count[CONTACTS]):
        normal_impulse = rows.impulse[c, 0]
        step = (normal_velocity(bodies.twist, rows, c) - rows.target[c]) * rows.normal_mass[c]
        defect = abs(normal_impulse - max(normal_impulse - step, 0.0))
        scale = max(rows.normal_mass[c] * rows.speed[c], IMPULSE_SHARE * normal_impulse)
        if options.friction:
            bound = rows.friction[c] * normal_impulse
            tangent = rows.impulse[c, 1]
            moved = tangent - tangent_velocity(bodies.twist, rows, c) * rows.tangent_mass[c]
            slip_defect = abs(tangent - min(max(moved, -bound), bound))
            slip_scale = max(rows.tangent_mass[c] * rows.speed[c], IMPULSE_SHARE * normal_impulse)
            if slip_defect > worst * slip_scale:
                worst = slip_defect / slip_scale if slip_scale > 0.0 else 1.0
        if defect > worst * scale:
            worst = defect / scale if scale > 0.0 else 1.0
    return worst
