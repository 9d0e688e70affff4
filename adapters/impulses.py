"""Contact impulses of engines that report only a part: unknown components are NaN, never zero."""

from __future__ import annotations

import math
from collections.abc import Sequence

#: Largest other component of a unit normal along an axis in single precision.
ALONG = 1e-5


def along_normal(impulse: float, normal: Sequence[float], rough: bool) -> list[float]:
    """Known part of an impulse [N s] where an engine reports only the part along the ``normal`` (d,).

    Without friction that is all of it. For a ``rough`` contact the components across the normal are unknown (NaN);
    where the normal is not along an axis, all are.
    """
    return [math.nan if rough and abs(n) <= 1.0 - ALONG else impulse * n for n in normal]
