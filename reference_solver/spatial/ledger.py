"""Contacts of a step with their impulses summed over its sub-steps."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.spatial.state import Ledger, Manifolds
from reference_solver.spatial.vector import Vector, row, times_transposed


@inner_kernel
def enter_contacts(manifolds: Manifolds, ledger: Ledger) -> None:
    """Add the impulses of impacts and of the force phase to the entries of the same features."""
    enter_impulses(manifolds, manifolds.hit, ledger)
    enter_impulses(manifolds, manifolds.impulse, ledger)


@inner_kernel
def enter_impulses(manifolds: Manifolds, impulses: Array, ledger: Ledger) -> None:
    """Add impulses (m, p, 3), in the frames of the manifolds.

    The ledger must have room for all points. Geometry is that of the first sub-step in which a contact appears.
    """
    k = 0
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            while k < ledger.filled[0] and order(manifolds, m, p, ledger, k) < 0:
                k += 1
            if k == ledger.filled[0] or order(manifolds, m, p, ledger, k) > 0:
                insert(manifolds, m, p, ledger, k)
            impulse: Vector = times_transposed(manifolds.frame, m, row(impulses[m], p, 0))
            for d in range(3):
                ledger.real[k, 6 + d] += impulse[d]


@inner_kernel
def order(manifolds: Manifolds, m: int, p: int, ledger: Ledger, k: int) -> int:
    """Whether entry k comes before point p of manifold m (-1), is the same (0), or comes after it (1)."""
    for d in range(3):
        name = manifolds.body_a[m] if d == 0 else manifolds.body_b[m] if d == 1 else manifolds.feature[m, p]
        if ledger.names[k, d] != name:
            return -1 if ledger.names[k, d] < name else 1
    return 0


@inner_kernel
def insert(manifolds: Manifolds, m: int, p: int, ledger: Ledger, k: int) -> None:
    """Make room at entry k for point p of manifold m, without impulse."""
    for j in range(ledger.filled[0], k, -1):
        for d in range(3):
            ledger.names[j, d] = ledger.names[j - 1, d]
        for d in range(10):
            ledger.real[j, d] = ledger.real[j - 1, d]
    ledger.names[k, 0], ledger.names[k, 1] = manifolds.body_a[m], manifolds.body_b[m]
    ledger.names[k, 2] = manifolds.feature[m, p]
    for d in range(3):
        ledger.real[k, d] = manifolds.point[m, p, d]
        ledger.real[k, 3 + d] = manifolds.frame[m, 2, d]
        ledger.real[k, 6 + d] = 0.0
    ledger.real[k, 9] = manifolds.gap[m, p]
    ledger.filled[0] += 1
