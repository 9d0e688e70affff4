"""Scenes that solvers get wrong, each with a verdict: a certified answer, or DIVERGED with its reason.

>>> from reference_solver.verification.hard_cases import HARD_CASES
>>> verdict = HARD_CASES["card tent, mu -1 %"].run()
>>> verdict.answer["falls"]
1.0
"""

from __future__ import annotations

from reference_solver.verification.hard_cases.blocks import edge_drop, rocking
from reference_solver.verification.hard_cases.case import HardCase, Run, Verdict
from reference_solver.verification.hard_cases.collisions import PLACES, elastic_pile, simultaneous
from reference_solver.verification.hard_cases.extremes import deep_overlap, far_origin, many_sizes, thin_wall
from reference_solver.verification.hard_cases.masonry import arch
from reference_solver.verification.hard_cases.rods import card_tent, crossed_capsules, kane, painleve
from reference_solver.verification.hard_cases.stacks import heavy_on_light, overhang

__all__ = ["HARD_CASES", "HardCase", "Run", "Verdict"]

_CASES = (
    *(heavy_on_light(ratio, limit) for ratio, limit in ((1e2, 1e-12), (1e4, 1e-10), (1e6, 1e-8))),
    *(overhang(shift) for shift in (-1e-6, 1e-6)),
    *(painleve(share, spin) for share in (0.98, 1.02) for spin in (0.0, 5.0)),
    *(kane(slide) for slide in (0.727, -0.727)),
    rocking(),
    crossed_capsules(),
    edge_drop(),
    *(arch(share) for share in (1.02, 0.98)),
    *(card_tent(share) for share in (1.01, 0.99)),
    *(deep_overlap(share) for share in (0.1, 0.3, 0.5, 0.7, 0.9)),
    *(thin_wall(10.0**k) for k in range(1, 7)),
    *(far_origin(distance) for distance in (1e3, 1e6)),
    many_sizes(),
    *(simultaneous(places, law) for places in PLACES for law in ("N-SIM", "N-SEQ")),
    elastic_pile(),
)

#: All cases by name.
HARD_CASES: dict[str, HardCase] = {case.name: case for case in _CASES}
