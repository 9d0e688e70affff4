"""Where a contact point lies between two bodies, and how it is written down."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.planar.columns import ARM_A, ARM_B, FEATURE, GAP, MOTION, NX, NY, A, B
from reference_solver.planar.state import FREE, Bodies, Rows


@inner_kernel
def share_of_gap(bodies: Bodies, f: int, s: int) -> float:
    """Where the contact point lies across the gap: 0 on the first body's surface, 1 on the second's."""
    if bodies.kind[s, MOTION] != FREE:
        return 0.0
    if bodies.kind[f, MOTION] != FREE:
        return 1.0
    return 0.5


@inner_kernel
def write_point(
    rows: Rows,
    c: int,
    f: int,
    s: int,
    feature: int,
    n: tuple[float, float],
    at_f: tuple[float, float],
    at_s: tuple[float, float],
    gap: float,
) -> None:
    """Store one point given from first to second: normal ``n``, arms ``at_f`` of first, ``at_s`` of second."""
    rows.integer[c, FEATURE] = feature
    rows.real[c, GAP] = gap
    if f < s:
        rows.integer[c, A], rows.integer[c, B] = f, s
        rows.real[c, NX], rows.real[c, NY] = n
        rows.real[c, ARM_A], rows.real[c, ARM_A + 1] = at_f
        rows.real[c, ARM_B], rows.real[c, ARM_B + 1] = at_s
    else:
        rows.integer[c, A], rows.integer[c, B] = s, f
        rows.real[c, NX], rows.real[c, NY] = -n[0], -n[1]
        rows.real[c, ARM_A], rows.real[c, ARM_A + 1] = at_s
        rows.real[c, ARM_B], rows.real[c, ARM_B + 1] = at_f
