"""Gates of spatial contacts that turn (`turning`): a part of their own, measured beside those of the plane."""

from __future__ import annotations

from collections.abc import Iterator

from reference_solver.verification import Gate
from reference_solver.verification.turning import rows
from reference_solver.verification.turning_scenes import SPATIAL


def gates() -> Iterator[Gate]:
    """Yield all rows of space."""
    return rows(SPATIAL)
