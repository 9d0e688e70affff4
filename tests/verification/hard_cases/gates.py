"""Gates of the hard cases: every limit that a certified answer keeps."""

from __future__ import annotations

import math
from collections.abc import Iterator

from tests.verification.gate import Gate
from tests.verification.hard_cases.cases import HARD_CASES, HardCase


def gates() -> Iterator[Gate]:
    """Yield the rows of every case."""
    for case in HARD_CASES.values():
        yield from of_case(case)


def made_by(case: HardCase) -> str:
    """Name of the settings that the case is meant for."""
    return f"{'fixed_step' if case.settings.tolerance is None else 'reference'}, hard case"


def of_case(case: HardCase) -> Iterator[Gate]:
    """Yield the rows of one case; where the run as such is void, one row that says why and does not hold."""
    verdict = case.run()
    for name, limit in verdict.limits.items():
        yield Gate.at_most(name, case.name, verdict.measured[name], limit, made_by(case))
    if not verdict.certified and not verdict.limits:
        yield Gate.at_most(f"DIVERGED: {verdict.reason}", case.name, math.nan, 0.0, made_by(case))
