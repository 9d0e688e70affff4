"""How far impulses and velocities are from solving the contact problem: the scaled natural map (E14)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.coulomb import into_interval
from reference_solver.direct.problem import IMPULSE_SHARE
from reference_solver.textbook.options import Options
from reference_solver.textbook2.columns import FRICTION, NORMAL_MASS, PN, PT, SPEED, TANGENT_MASS, TARGET
from reference_solver.textbook2.kinematics import normal_velocity, tangent_velocity
from reference_solver.textbook2.state import CONTACTS, Bodies, Rows


@inner_kernel
def natural_map(bodies: Bodies, rows: Rows, options: Options) -> float:
    """Largest scaled natural-map residual over all rows, dimensionless."""
    worst = 0.0
    for c in range(rows.counts[CONTACTS]):
        slip = tangent_velocity(bodies.twist, rows, c) if options.friction else 0.0
        worst = max(worst, row_residual(rows, c, normal_velocity(bodies.twist, rows, c), slip, options))
    return worst


@spliced_kernel
def row_residual(rows: Rows, c: int, normal_speed: float, slip: float, options: Options) -> float:
    """Larger of the normal and the friction defect of row c, each over its scale."""
    worst = 0.0
    normal_impulse = rows.real[c, PN]
    step = (normal_speed - rows.real[c, TARGET]) * rows.real[c, NORMAL_MASS]
    defect = abs(normal_impulse - max(normal_impulse - step, 0.0))
    scale = max(rows.real[c, NORMAL_MASS] * rows.real[c, SPEED], IMPULSE_SHARE * normal_impulse)
    if options.friction:
        bound = rows.real[c, FRICTION] * normal_impulse
        tangent = rows.real[c, PT]
        moved = tangent - slip * rows.real[c, TANGENT_MASS]
        slip_defect = abs(tangent - into_interval(moved, bound))
        slip_scale = max(rows.real[c, TANGENT_MASS] * rows.real[c, SPEED], IMPULSE_SHARE * normal_impulse)
        if slip_defect > 0.0:
            worst = slip_defect / slip_scale if slip_scale > 0.0 else 1.0
    if defect > worst * scale:
        worst = defect / scale if scale > 0.0 else 1.0
    return worst
