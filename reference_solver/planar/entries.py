"""Pieces of a planar run as entries of the journal."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.journal import enter_bodies, is_kept, keep_state, next_contact, open_piece
from reference_solver.model import Array
from reference_solver.pieces import (
    CHAIN,
    CONTACTS,
    FIFTH_ORDER,
    FIXED,
    FORCES,
    FROZEN,
    IMPACT,
    IMPULSE_LEVEL,
    ROCKING,
    UNORDERED,
    Journal,
)
from reference_solver.planar.columns import ARM_B, ENDING, FEATURE, IMPACT_N, IMPACT_T, NUMBER, NX, NY, PN, PT, A, B
from reference_solver.planar.midpoint import exchange_levers
from reference_solver.planar.state import CONTACTS as ROW_CONTACTS
from reference_solver.planar.state import Bodies, Rows, SubStep
from reference_solver.stepping.clock import HELD, LEFT
from reference_solver.stepping.clock import ROCKING as COMES_TO_REST
from reference_solver.stepping.clock import UNORDERED as HAS_NO_ORDER
from reference_solver.stepping.impacts import CHAIN_ENDS
from reference_solver.stepping.lasting import CONTACTS as HELD_CONTACTS
from reference_solver.stepping.lasting import Lasting
from reference_solver.stepping.options import Options


@inner_kernel
def enter_contact_rows(journal: Journal, bodies: Bodies, pose: Array, rows: Rows, normal: int, tangent: int) -> None:
    """Enter all rows with the impulses of columns ``normal`` and ``tangent``; ``pose`` as the piece began."""
    for c in range(rows.counts[ROW_CONTACTS]):
        b = rows.integer[c, B]
        first, second = bodies.kind[rows.integer[c, A], NUMBER], bodies.kind[b, NUMBER]
        k = next_contact(journal, first, second, rows.integer[c, FEATURE])
        if k < 0:
            continue
        x, y = pose[b, 0] + rows.real[c, ARM_B], pose[b, 1] + rows.real[c, ARM_B + 1]
        nx, ny, pn, pt = rows.real[c, NX], rows.real[c, NY], rows.real[c, normal], rows.real[c, tangent]
        px, py = pn * nx - pt * ny, pn * ny + pt * nx
        journal.wrench[k, 0], journal.wrench[k, 1] = x, y
        journal.wrench[k, 2], journal.wrench[k, 3] = nx, ny
        journal.wrench[k, 4], journal.wrench[k, 5] = px, py
        journal.wrench[k, 6] = x * py - y * px


@inner_kernel
def enter_moments(journal: Journal, lasting: Lasting, first: int) -> None:
    """Impulses and moments of lasting contacts, whose frames turned within the piece."""
    for j in range(lasting.size[HELD_CONTACTS]):
        k = first + lasting.row[j]
        if k < len(journal.wrench):
            journal.wrench[k, 4], journal.wrench[k, 5] = lasting.impulse[j, 0], lasting.impulse[j, 1]
            journal.wrench[k, 6] = lasting.moment[j, 0]


@inner_kernel
def impulse_scheme(sub: SubStep) -> int:
    """By what rule the impulse-level scheme was taken: for what is left, or until bodies that rock rest (E22)."""
    return ROCKING if sub.clock[COMES_TO_REST] > 0.0 else IMPULSE_LEVEL


@inner_kernel
def enter_settled(bodies: Bodies, rows: Rows, sub: SubStep, options: Options) -> None:
    """Enter what was changed of poses and impulses of the impulse-level scheme at the end of its sub-step (E28)."""
    if is_kept(sub.journal):
        open_piece(sub.journal, options.dt - sub.clock[LEFT], 0.0, FORCES, impulse_scheme(sub))
        enter_bodies(sub.journal, bodies.kind[:, NUMBER], bodies.pose, bodies.twist)
        enter_contact_rows(sub.journal, bodies, sub.journal.pose, rows, IMPACT_N, IMPACT_T)


@inner_kernel
def differ(one: Array, other: Array) -> bool:
    """Whether any velocity is not the same."""
    for i in range(len(one)):
        for k in range(3):
            if one[i, k] != other[i, k]:
                return True
    return False


@inner_kernel
def enter_impact(bodies: Bodies, rows: Rows, sub: SubStep, pose: Array, options: Options) -> None:
    """Enter the impact that a located sub-step begins with, at ``pose``, where it changed a velocity."""
    if not is_kept(sub.journal) or not differ(sub.before, sub.start):
        return
    scheme = UNORDERED if sub.clock[HAS_NO_ORDER] > 0.0 else FROZEN
    for c in range(rows.counts[ROW_CONTACTS]):
        scheme = CHAIN if rows.integer[c, ENDING] == CHAIN_ENDS else scheme
    keep_state(sub.journal, pose, sub.before)
    open_piece(sub.journal, options.dt - sub.clock[LEFT], 0.0, IMPACT, scheme)
    enter_bodies(sub.journal, bodies.kind[:, NUMBER], pose, sub.start)
    enter_contact_rows(sub.journal, bodies, pose, rows, IMPACT_N, IMPACT_T)


@inner_kernel
def enter_sub_step(bodies: Bodies, rows: Rows, sub: SubStep, options: Options, length: float, curved: bool) -> None:
    """Enter a located sub-step of ``length``: its impact, then its force phase."""
    journal = sub.journal
    if not is_kept(journal):
        return
    begin = options.dt - sub.clock[LEFT]
    if sub.clock[HELD] > 0.0:
        exchange_levers(rows)  # those of the start
    enter_impact(bodies, rows, sub, sub.pose, options)
    if sub.clock[HELD] > 0.0:
        exchange_levers(rows)
    keep_state(journal, sub.pose, sub.start)
    scheme = FIFTH_ORDER if curved else FROZEN
    if sub.clock[HELD] > 0.0 or sub.clock[COMES_TO_REST] > 0.0:
        scheme = impulse_scheme(sub)
    open_piece(journal, begin, length, FORCES, scheme)
    enter_bodies(journal, bodies.kind[:, NUMBER], bodies.pose, bodies.twist)
    first = journal.used[CONTACTS]
    enter_contact_rows(journal, bodies, sub.pose, rows, PN, PT)
    if curved:
        enter_moments(journal, sub.lasting, first)
    keep_state(journal, bodies.pose, bodies.twist)


@inner_kernel
def enter_fixed_step(journal: Journal, bodies: Bodies, rows: Rows, options: Options) -> None:
    """Enter a step at fixed dt, from what was kept before it."""
    if is_kept(journal):
        open_piece(journal, 0.0, options.dt, FORCES, FIXED)
        enter_bodies(journal, bodies.kind[:, NUMBER], bodies.pose, bodies.twist)
        enter_contact_rows(journal, bodies, journal.pose, rows, PN, PT)
