"""Pieces of a planar run as entries of the journal."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.journal import enter_bodies, is_kept, keep_state, next_contact, open_piece
from reference_solver.model import Array
from reference_solver.pieces import FIXED, FORCES, FROZEN, IMPACT, RELEASE, Journal
from reference_solver.planar.columns import ARM_B, FEATURE, IMPACT_N, IMPACT_T, NX, NY, PN, PT, A, B
from reference_solver.planar.state import CONTACTS, HELD, LEFT, Bodies, Options, Rows, SubStep


@inner_kernel
def enter_contact_rows(journal: Journal, pose: Array, rows: Rows, normal: int, tangent: int) -> None:
    """Enter all rows with the impulses of columns ``normal`` and ``tangent``; ``pose`` as the piece began."""
    for c in range(rows.counts[CONTACTS]):
        b = rows.integer[c, B]
        k = next_contact(journal, rows.integer[c, A], b, rows.integer[c, FEATURE])
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
def differ(one: Array, other: Array) -> bool:
    """Whether any velocity is not the same."""
    for i in range(len(one)):
        for k in range(3):
            if one[i, k] != other[i, k]:
                return True
    return False


@inner_kernel
def enter_sub_step(bodies: Bodies, rows: Rows, sub: SubStep, options: Options, length: float) -> None:
    """Enter a located sub-step of ``length``: its impacts where they changed a velocity, then its force phase."""
    journal = sub.journal
    if not is_kept(journal):
        return
    begin = options.dt - sub.clock[LEFT]
    keep_state(journal, sub.pose, sub.before)
    if differ(sub.before, sub.start):
        open_piece(journal, begin, 0.0, IMPACT, FROZEN)
        enter_bodies(journal, sub.pose, sub.start)
        enter_contact_rows(journal, sub.pose, rows, IMPACT_N, IMPACT_T)
    keep_state(journal, sub.pose, sub.start)
    open_piece(journal, begin, length, FORCES, FIXED if sub.clock[HELD] > 0.0 else FROZEN)
    enter_bodies(journal, bodies.pose, bodies.twist)
    enter_contact_rows(journal, sub.pose, rows, PN, PT)
    keep_state(journal, bodies.pose, bodies.twist)


@inner_kernel
def enter_release(bodies: Bodies, rows: Rows, sub: SubStep, options: Options, length: float) -> None:
    """Enter the rebounds that were held for ``length`` and got their speed at the end of it (E22)."""
    if is_kept(sub.journal):
        open_piece(sub.journal, options.dt - sub.clock[LEFT] + length, 0.0, RELEASE, FROZEN)
        enter_bodies(sub.journal, bodies.pose, bodies.twist)
        enter_contact_rows(sub.journal, bodies.pose, rows, PN, PT)


@inner_kernel
def enter_fixed_step(journal: Journal, bodies: Bodies, rows: Rows, options: Options) -> None:
    """Enter a step at fixed dt, from what was kept before it."""
    if is_kept(journal):
        open_piece(journal, 0.0, options.dt, FORCES, FIXED)
        enter_bodies(journal, bodies.pose, bodies.twist)
        enter_contact_rows(journal, journal.pose, rows, PN, PT)
