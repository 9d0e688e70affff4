"""Shares that the certificate of a solve keeps (E60 to E63); for both dimensions."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.tally import CREATED, KANE, PUMPED

#: Created energy up to this share of a solve's work is round-off of its impulses: 1e4 units in the last place, what
#: cancels where thousands of contacts each do their work.
CREATED_NOISE = 1e-12
#: Unit in the last place of a number, as a share of it.
LAST_PLACE = 2.0**-52


@inner_kernel
def enter_share(tally: Array, entry: int, defect: float, scale: float) -> None:
    """Keep the larger share; where nothing acts any defect is a whole one."""
    if defect > tally[entry] * scale:
        tally[entry] = defect / scale if scale > 0.0 else max(tally[entry], 1.0)


@inner_kernel
def enter_creation(work: float, effort: float, restored: bool, tally: Array) -> None:
    """Energy that contacts create (E63): a property of the law under a positive target, an error without one."""
    if work <= CREATED_NOISE * effort:
        return
    enter_share(tally, CREATED if restored else PUMPED, work, effort)
    if restored:
        tally[KANE] += 1.0
