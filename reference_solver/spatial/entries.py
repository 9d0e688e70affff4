"""Pieces of a spatial run as entries of the journal."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.journal import enter_bodies, is_kept, keep_state, next_contact, open_piece
from reference_solver.pieces import (
    CHAIN,
    CONTACTS,
    FIFTH_ORDER,
    FIXED,
    FORCES,
    FROZEN,
    IMPACT,
    IMPULSE_LEVEL,
    UNORDERED,
    Journal,
)
from reference_solver.spatial.midpoint import exchange_levers
from reference_solver.spatial.state import POINTS, Bodies, Manifolds, SubStep
from reference_solver.spatial.vector import add, cross, row, times_transposed
from reference_solver.stepping.clock import HELD, LEFT
from reference_solver.stepping.clock import UNORDERED as HAS_NO_ORDER
from reference_solver.stepping.impacts import CHAIN_ENDS
from reference_solver.stepping.lasting import CONTACTS as LASTING
from reference_solver.stepping.lasting import Lasting
from reference_solver.stepping.options import Options


@inner_kernel
def enter_points(journal: Journal, bodies: Bodies, manifolds: Manifolds, hit: bool) -> None:
    """Enter all points with the impulses of impacts, or else of the force phase; poses as the piece began."""
    for m in range(len(manifolds)):
        a, b = manifolds.body_a[m], manifolds.body_b[m]
        for p in range(manifolds.points[m]):
            k = next_contact(journal, bodies.number[a], bodies.number[b], manifolds.feature[m, p])
            if k < 0:
                continue
            local = row(manifolds.hit[m], p, 0) if hit else row(manifolds.impulse[m], p, 0)
            impulse = times_transposed(manifolds.frame, m, local)
            point = add(row(journal.pose, b, 0), row(manifolds.arm_b[m], p, 0))
            moment = cross(point, impulse)
            for d in range(3):
                journal.wrench[k, d] = point[d]
                journal.wrench[k, 3 + d] = manifolds.frame[m, 2, d]
                journal.wrench[k, 6 + d] = impulse[d]
                journal.wrench[k, 9 + d] = moment[d]


@inner_kernel
def enter_moments(journal: Journal, manifolds: Manifolds, lasting: Lasting, first: int) -> None:
    """Moments of lasting contacts, whose levers turned within the piece; ``first``: row of the first point."""
    before = 0
    for m in range(len(manifolds)):
        for k in range(lasting.size[LASTING]):
            entry = first + before + lasting.row[k] % POINTS
            if lasting.row[k] // POINTS == m and entry < len(journal.name):
                for d in range(3):
                    journal.wrench[entry, 6 + d] = lasting.impulse[k, d]
                    journal.wrench[entry, 9 + d] = lasting.moment[k, d]
        before += manifolds.points[m]


@inner_kernel
def struck(bodies: Bodies) -> bool:
    """Whether impacts changed a velocity."""
    for i in range(len(bodies)):
        for k in range(6):
            if bodies.before[i, k] != bodies.first[i, k]:
                return True
    return False


@inner_kernel
def enter_impact(bodies: Bodies, manifolds: Manifolds, sub: SubStep, options: Options) -> None:
    """Enter the impact that a located sub-step begins with, at the poses kept, where it changed a velocity."""
    if not is_kept(sub.journal) or not struck(bodies):
        return
    scheme = UNORDERED if sub.clock[HAS_NO_ORDER] > 0.0 else FROZEN
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            scheme = CHAIN if manifolds.ending[m, p] == CHAIN_ENDS else scheme
    open_piece(sub.journal, options.dt - sub.clock[LEFT], 0.0, IMPACT, scheme)
    enter_bodies(sub.journal, bodies.number, sub.journal.pose, bodies.first)
    enter_points(sub.journal, bodies, manifolds, True)


@inner_kernel
def enter_sub_step(bodies: Bodies, manifolds: Manifolds, sub: SubStep, options: Options, length: float) -> None:
    """Enter a located sub-step of ``length`` from the poses kept: its impact, if any, then its force phase."""
    journal = sub.journal
    if not is_kept(journal):
        return
    begin = options.dt - sub.clock[LEFT]
    if sub.clock[HELD] > 0.0:
        exchange_levers(manifolds, sub)  # those of the start
    enter_impact(bodies, manifolds, sub, options)
    if sub.clock[HELD] > 0.0:
        exchange_levers(manifolds, sub)
    curved = False
    for i in range(len(bodies)):
        curved = curved or bodies.curved[i] != 0
    keep_state(journal, journal.pose, bodies.first)
    scheme = IMPULSE_LEVEL if sub.clock[HELD] > 0.0 else FIFTH_ORDER if curved else FROZEN
    open_piece(journal, begin, length, FORCES, scheme)
    enter_bodies(journal, bodies.number, bodies.pose, bodies.twist)
    first = journal.used[CONTACTS]
    enter_points(journal, bodies, manifolds, False)
    if curved:
        enter_moments(journal, manifolds, sub.lasting, first)
    keep_state(journal, bodies.pose, bodies.twist)


@inner_kernel
def enter_settled(bodies: Bodies, manifolds: Manifolds, sub: SubStep, options: Options) -> None:
    """Enter what was changed of poses and impulses of the impulse-level scheme at the end of its sub-step (E28)."""
    if is_kept(sub.journal):
        open_piece(sub.journal, options.dt - sub.clock[LEFT], 0.0, FORCES, IMPULSE_LEVEL)
        enter_bodies(sub.journal, bodies.number, bodies.pose, bodies.twist)
        enter_points(sub.journal, bodies, manifolds, True)


@inner_kernel
def enter_fixed_step(journal: Journal, bodies: Bodies, manifolds: Manifolds, options: Options) -> None:
    """Enter a step at fixed dt, from what was kept before it."""
    if is_kept(journal):
        open_piece(journal, 0.0, options.dt, FORCES, FIXED)
        enter_bodies(journal, bodies.number, bodies.pose, bodies.twist)
        enter_points(journal, bodies, manifolds, False)
