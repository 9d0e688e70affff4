"""How bodies move, and where the contact point of two of them lies."""

from __future__ import annotations

from reference_solver.compilation import spliced_kernel

FIXED, FREE, PRESCRIBED = 0, 1, 2
MOTION_CODE = {"fixed": FIXED, "free": FREE, "prescribed": PRESCRIBED}


@spliced_kernel
def share_of_gap(first: int, second: int) -> float:
    """Where a contact point lies across the gap of two bodies that move like this: 0 on the first, 1 on the second.

    On the surface of the free body where one is not free, midway between two free ones.
    """
    if second != FREE:
        return 0.0
    if first != FREE:
        return 1.0
    return 0.5
