"""Impulses of contacts of which an engine tells a part: what is unknown is NaN, never zero."""

from __future__ import annotations

import numpy as np

from adapters.engine import Array

#: Share of a unit normal's other components that single precision leaves along an axis.
ALONG = 1e-5


def along_normal(impulse: float, normal: Array, rough: bool) -> Array:
    """Impulse [N s] as far as it is known where an engine tells the part along the ``normal`` (d,) alone.

    Without friction that is all of it. Of a ``rough`` contact the components across the normal are known to be unknown
    (NaN); where the normal is not along an axis, all are.
    """
    told = impulse * normal
    if rough:
        along = np.abs(normal) > 1.0 - ALONG
        told = np.where(along, told, np.nan)
    return told
