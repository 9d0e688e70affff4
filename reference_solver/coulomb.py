"""Coulomb's law: the only place where friction is clamped (E11), and the law as complementarity of cones (E60)."""

from __future__ import annotations

import math

from reference_solver.compilation import kernel, spliced_kernel


@spliced_kernel
def into_interval(impulse: float, bound: float) -> float:
    """Nearest friction impulse of the plane within +-bound."""
    return min(max(impulse, -bound), bound)


@spliced_kernel
def into_disc(p1: float, p2: float, radius: float) -> tuple[float, float]:
    """Nearest point of the disc of that radius."""
    size = math.sqrt(p1 * p1 + p2 * p2)
    if size <= radius:
        return p1, p2
    return radius * p1 / size, radius * p2 / size


@spliced_kernel
def back_into_disc(p1: float, p2: float, radius: float) -> tuple[float, float]:
    """The same for impulses that are remembered, by one factor, as the textbook's bits have it."""
    size = (p1**2 + p2**2) ** 0.5
    if size <= radius:
        return p1, p2
    return p1 * (radius / size), p2 * (radius / size)


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
