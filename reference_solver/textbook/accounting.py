"""Shares that the certificate of a solve keeps (E60 to E63); for both dimensions."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.tally import (
    CONTACT_WORK,
    CREATED,
    ENERGY,
    KANE,
    NOT_FINITE,
    OPENED,
    PENETRATION,
    PUMPED,
    SOLVES,
    START_OVERLAP,
    SURFACE_WORK,
)
from reference_solver.textbook.vectors import are_finite

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


@inner_kernel
def begin_certificate(twist: Array, tally: Array) -> bool:
    """Count a contact solve; False if it left a velocity that is no number."""
    tally[SOLVES] += 1.0
    finite = are_finite(twist)
    tally[NOT_FINITE] += 0.0 if finite else 1.0
    return finite


@inner_kernel
def enter_overlap(before: float, tally: Array) -> None:
    """Keep the worst overlap of this solve, by itself if it is the first, and with the worst of those ``before``."""
    if tally[OPENED] <= 1.0:
        tally[START_OVERLAP] = max(tally[START_OVERLAP], tally[PENETRATION])
    tally[PENETRATION] = max(tally[PENETRATION], before)


@inner_kernel
def enter_energy(work: float, surface: float, effort: float, kinetic: tuple[float, float], tally: Array) -> None:
    """Add the work of contacts and of moving surfaces, and compare it with what bodies gained (E62)."""
    tally[CONTACT_WORK] += work
    tally[SURFACE_WORK] += surface
    gained, size = kinetic
    enter_share(tally, ENERGY, abs(gained - work - surface), effort + size)
