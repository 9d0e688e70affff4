"""Contacts of a spatial step are entered in its ledger (`stepping.ledger`)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.spatial.state import Bodies, Manifolds
from reference_solver.spatial.vector import Vector, row, times_transposed
from reference_solver.stepping.ledger import Ledger, entry_of


@inner_kernel
def enter_contacts(bodies: Bodies, manifolds: Manifolds, ledger: Ledger) -> None:
    """Add the impulses of impacts and of the force phase to the entries of the same features."""
    enter_impulses(bodies, manifolds, manifolds.hit, ledger)
    enter_impulses(bodies, manifolds, manifolds.impulse, ledger)


@inner_kernel
def enter_impulses(bodies: Bodies, manifolds: Manifolds, impulses: Array, ledger: Ledger) -> None:
    """Add impulses (m, p, 3), in the frames of the manifolds.

    The ledger must have room for all points. Geometry is that of the first sub-step in which a contact appears.
    """
    for m in range(len(manifolds)):
        a, b = bodies.number[manifolds.body_a[m]], bodies.number[manifolds.body_b[m]]
        for p in range(manifolds.points[m]):
            k, new = entry_of(ledger, (a, b, manifolds.feature[m, p]))
            impulse: Vector = times_transposed(manifolds.frame, m, row(impulses[m], p, 0))
            for d in range(3):
                if new:
                    ledger.real[k, d] = manifolds.point[m, p, d]
                    ledger.real[k, 3 + d] = manifolds.frame[m, 2, d]
                ledger.real[k, 6 + d] += impulse[d]
            if new:
                ledger.real[k, 9] = manifolds.gap[m, p]
