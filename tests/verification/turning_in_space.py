"""Gates of spatial contacts that turn (`turning`): a part of their own, measured beside those of the plane."""

from __future__ import annotations

from collections.abc import Iterator

from tests.verification.gate import Gate
from tests.verification.turning import rows
from tests.verification.turning_scenes import SPATIAL


def gates() -> Iterator[Gate]:
    """Yield all rows of space."""
    return rows(SPATIAL)
