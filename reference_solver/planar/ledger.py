"""Contacts of a planar step are entered in its ledger (`stepping.ledger`)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.planar.columns import FEATURE, GAP, IMPACT_N, IMPACT_T, NUMBER, NX, NY, PN, POINT, PT, A, B
from reference_solver.planar.state import CONTACTS, Bodies, Rows
from reference_solver.stepping.ledger import Ledger, entry_of


@inner_kernel
def enter_contacts(bodies: Bodies, rows: Rows, ledger: Ledger) -> None:
    """Add the impulses of impacts and of the force phase to the entries of the same features.

    The ledger must have room for all rows. Geometry is that of the first sub-step in which a contact appears.
    """
    for c in range(rows.counts[CONTACTS]):
        a, b = bodies.kind[rows.integer[c, A], NUMBER], bodies.kind[rows.integer[c, B], NUMBER]
        k, new = entry_of(ledger, (a, b, rows.integer[c, FEATURE]))
        if new:
            ledger.real[k, 0], ledger.real[k, 1] = rows.real[c, POINT], rows.real[c, POINT + 1]
            ledger.real[k, 2], ledger.real[k, 3] = rows.real[c, NX], rows.real[c, NY]
            ledger.real[k, 6] = rows.real[c, GAP]
        nx, ny = rows.real[c, NX], rows.real[c, NY]
        pn = rows.real[c, IMPACT_N] + rows.real[c, PN]
        pt = rows.real[c, IMPACT_T] + rows.real[c, PT]
        ledger.real[k, 4] += pn * nx - pt * ny
        ledger.real[k, 5] += pn * ny + pt * nx
