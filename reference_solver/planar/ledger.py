"""Contacts of a step with their impulses summed over its sub-steps."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.planar.columns import FEATURE, GAP, IMPACT_N, IMPACT_T, NUMBER, NX, NY, PN, POINT, PT, A, B
from reference_solver.planar.manifolds import contact_key, row_key
from reference_solver.planar.state import CONTACTS, Bodies, Buffer, Ledger, Rows


@inner_kernel
def enter_contacts(bodies: Bodies, rows: Rows, ledger: Ledger) -> None:
    """Add the impulses of impacts and of the force phase to the entries of the same features.

    The ledger must have room for all rows. Geometry is that of the first sub-step in which a contact appears.
    """
    for c in range(rows.counts[CONTACTS]):
        key = row_key(bodies, rows, c)
        low, k = 0, ledger.used[0]
        while low < k:
            middle = (low + k) // 2
            if entry_key(ledger, middle) < key:
                low = middle + 1
            else:
                k = middle
        if k == ledger.used[0] or entry_key(ledger, k) != key:
            insert(bodies, rows, ledger, c, k)
        nx, ny = rows.real[c, NX], rows.real[c, NY]
        pn = rows.real[c, IMPACT_N] + rows.real[c, PN]
        pt = rows.real[c, IMPACT_T] + rows.real[c, PT]
        ledger.real[k, 4] += pn * nx - pt * ny
        ledger.real[k, 5] += pn * ny + pt * nx


@inner_kernel
def entry_key(ledger: Ledger, k: int) -> int:
    """`contact_key` of entry k."""
    return contact_key(ledger.integer[k, 0], ledger.integer[k, 1], ledger.integer[k, 2])


@inner_kernel
def insert(bodies: Bodies, rows: Rows, ledger: Ledger, c: int, k: int) -> None:
    """Make room at entry k for row c, without impulse."""
    for j in range(ledger.used[0], k, -1):
        for d in range(3):
            ledger.integer[j, d] = ledger.integer[j - 1, d]
        for d in range(7):
            ledger.real[j, d] = ledger.real[j - 1, d]
    ledger.integer[k, 0] = bodies.kind[rows.integer[c, A], NUMBER]
    ledger.integer[k, 1] = bodies.kind[rows.integer[c, B], NUMBER]
    ledger.integer[k, 2] = rows.integer[c, FEATURE]
    ledger.real[k, 0], ledger.real[k, 1] = rows.real[c, POINT], rows.real[c, POINT + 1]
    ledger.real[k, 2], ledger.real[k, 3] = rows.real[c, NX], rows.real[c, NY]
    ledger.real[k, 4] = ledger.real[k, 5] = 0.0
    ledger.real[k, 6] = rows.real[c, GAP]
    ledger.used[0] += 1


@kernel
def copy_ledger(ledger: Ledger, buffer: Buffer, start: int) -> None:
    """Contacts of the last step, from index ``start`` on."""
    for c in range(ledger.used[0]):
        for d in range(3):
            buffer.integer[start + c, d] = ledger.integer[c, d]
        for d in range(7):
            buffer.real[start + c, d] = ledger.real[c, d]
