"""How a contact point is written down."""

from __future__ import annotations

from reference_solver.compilation import spliced_kernel
from reference_solver.textbook2.columns import ARM_A, ARM_B, FEATURE, GAP, NX, NY, A, B
from reference_solver.textbook2.state import Rows


@spliced_kernel
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
