"""Contact impulses of engines that report only a part: unknown components are NaN, never zero."""

from __future__ import annotations

import numpy as np

from adapters.engine import Array

#: Largest other component of a unit normal along an axis in single precision.
ALONG = 1e-5


def along_normal(impulse: float, normal: Array, rough: bool) -> Array:
    """Known part of an impulse [N s] where an engine reports only the part along the ``normal`` (d,).

    Without friction that is all of it. For a ``rough`` contact the components across the normal are unknown (NaN);
    where the normal is not along an axis, all are.
    """
    told = impulse * normal
    if rough:
        along = np.abs(normal) > 1.0 - ALONG
        told = np.where(along, told, np.nan)
    return told
