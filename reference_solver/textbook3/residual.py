"""How far impulses and velocities are from solving the contact problem: the scaled natural map (E14)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.coulomb import into_disc
from reference_solver.direct.problem import IMPULSE_SHARE
from reference_solver.textbook.options import Options
from reference_solver.textbook3.kinematics import relative_twist, velocity_at
from reference_solver.textbook3.state import Bodies, Manifolds
from reference_solver.textbook3.vector import Vector


@inner_kernel
def natural_map(bodies: Bodies, manifolds: Manifolds, options: Options) -> float:
    """Largest scaled natural-map residual over all points, dimensionless."""
    worst = 0.0
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            worst = max(worst, point_residual(manifolds, m, p, velocity_at(v, w, manifolds, m, p)))
    return worst


@inner_kernel
def point_residual(manifolds: Manifolds, m: int, p: int, u: Vector) -> float:
    """Larger of the normal and the friction defect of one point, each over its scale."""
    k = manifolds.matrix[m, p]
    pressed, speed = manifolds.impulse[m, p, 2], manifolds.speed[m, p]
    defect = abs(pressed - max(pressed - (u[2] - manifolds.target[m, p]) / k[5], 0.0))
    worst = share(defect, max(speed / k[5], IMPULSE_SHARE * pressed))
    if manifolds.friction[m] > 0.0:
        t1, t2 = manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1]
        stiffness = 0.5 * (k[0] + k[3])
        bound = manifolds.friction[m] * max(pressed, 0.0)
        moved1, moved2 = into_disc(t1 - u[0] / stiffness, t2 - u[1] / stiffness, bound)
        slip_defect = math.sqrt((t1 - moved1) ** 2 + (t2 - moved2) ** 2)
        worst = max(worst, share(slip_defect, max(speed / stiffness, IMPULSE_SHARE * pressed)))
    return worst


@inner_kernel
def share(defect: float, scale: float) -> float:
    """Defect over scale; where nothing acts any defect is a whole one."""
    if defect == 0.0:
        return 0.0
    return defect / scale if scale > 0.0 else 1.0
