"""Coulomb's law as complementarity of second-order cones (E60)."""

from __future__ import annotations

import math

from reference_solver.compilation import kernel


@kernel
def into_cone(normal: float, size: float, mu: float) -> tuple[float, float]:
    """Nearest point (normal, size) of the cone size <= mu * normal; ``size`` >= 0 is the length of the tangent part.

    The polar cone, mu * size <= -normal, falls onto the apex.
    """
    if mu * size <= -normal:
        return 0.0, 0.0
    if size <= mu * normal:
        return normal, size
    nearest = (normal + mu * size) / (1.0 + mu * mu)
    return nearest, mu * nearest


@kernel
def cone_defect(
    impulse: tuple[float, float, float], velocity: tuple[float, float, float], target: float, mu: float, step: float
) -> float:
    """|p - proj(p - step (u + mu |u_t| n))| of one point [N s] (E60), with the normal velocity less its target.

    ``impulse`` and ``velocity`` are (t1, t2, n); ``step`` [kg] is any positive mass, it sets the scale only.
    """
    slip = math.sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1])
    t1, t2 = impulse[0] - step * velocity[0], impulse[1] - step * velocity[1]
    size = math.sqrt(t1 * t1 + t2 * t2)
    normal, length = into_cone(impulse[2] - step * (velocity[2] - target + mu * slip), size, mu)
    shrink = length / size if size > 0.0 else 0.0
    d1, d2, dn = impulse[0] - shrink * t1, impulse[1] - shrink * t2, impulse[2] - normal
    return math.sqrt(d1 * d1 + d2 * d2 + dn * dn)
