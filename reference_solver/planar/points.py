"""Where a contact point lies between two bodies, and how it is written down."""

from __future__ import annotations

from reference_solver.compilation import kernel
from reference_solver.planar.state import FREE, Bodies, Rows


@kernel
def share_of_gap(bodies: Bodies, f: int, s: int) -> float:
    """Where the contact point lies across the gap: 0 on the first body's surface, 1 on the second's."""
    if bodies.motion[s] != FREE:
        return 0.0
    if bodies.motion[f] != FREE:
        return 1.0
    return 0.5


@kernel
def write_point(
    rows: Rows,
    c: int,
    f: int,
    s: int,
    feature: int,
    nx: float,
    ny: float,
    fx: float,
    fy: float,
    sx: float,
    sy: float,
    gap: float,
) -> None:
    """Store one point given from first to second: normal (nx, ny), arms (fx, fy) of first, (sx, sy) of second."""
    rows.feature[c] = feature
    rows.gap[c] = gap
    if f < s:
        rows.body_a[c], rows.body_b[c] = f, s
        rows.normal[c, 0], rows.normal[c, 1] = nx, ny
        rows.arm_a[c, 0], rows.arm_a[c, 1] = fx, fy
        rows.arm_b[c, 0], rows.arm_b[c, 1] = sx, sy
    else:
        rows.body_a[c], rows.body_b[c] = s, f
        rows.normal[c, 0], rows.normal[c, 1] = -nx, -ny
        rows.arm_a[c, 0], rows.arm_a[c, 1] = sx, sy
        rows.arm_b[c, 0], rows.arm_b[c, 1] = fx, fy
