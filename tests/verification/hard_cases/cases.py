"""Scenes that solvers get wrong, each with a verdict: a certified answer, or DIVERGED with its reason.

>>> from tests.verification.hard_cases.cases import HARD_CASES
>>> verdict = HARD_CASES["three discs, row, N-SIM"].run()
>>> round(verdict.answer["third [m/s]"], 12)
0.666666666667
"""

from __future__ import annotations

from tests.verification.hard_cases.blocks import edge_drop
from tests.verification.hard_cases.case import HardCase, Run, Verdict
from tests.verification.hard_cases.collisions import PLACES, elastic_pile, simultaneous
from tests.verification.hard_cases.extremes import many_sizes
from tests.verification.hard_cases.rods import crossed_capsules

__all__ = ["HARD_CASES", "HardCase", "Run", "Verdict"]

_CASES = (
    crossed_capsules(),
    edge_drop(),
    many_sizes(),
    *(simultaneous(places, law) for places in PLACES for law in ("N-SIM", "N-SEQ")),
    elastic_pile(),
)

#: All cases by name.
HARD_CASES: dict[str, HardCase] = {case.name: case for case in _CASES}
