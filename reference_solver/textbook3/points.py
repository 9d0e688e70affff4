"""How a contact point is written down."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.textbook3.state import Manifolds
from reference_solver.textbook3.vector import Vector


@inner_kernel
def write_point(
    manifolds: Manifolds, m: int, p: int, f: int, s: int, feature: int, arm_f: Vector, arm_s: Vector, gap: float
) -> None:
    """Store point p of manifold m, given by the arms of the first and the second body."""
    manifolds.feature[m, p] = feature
    manifolds.gap[m, p] = gap
    for d in range(3):
        if f < s:
            manifolds.arm_a[m, p, d] = arm_f[d]
            manifolds.arm_b[m, p, d] = arm_s[d]
        else:
            manifolds.arm_a[m, p, d] = arm_s[d]
            manifolds.arm_b[m, p, d] = arm_f[d]
