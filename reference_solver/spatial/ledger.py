"""Contacts of a step with their impulses summed over its sub-steps."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.model import Array
from reference_solver.spatial.state import Bodies, Buffer, Ledger, Manifolds
from reference_solver.spatial.vector import Vector, row, times_transposed


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
            name = (a, b, manifolds.feature[m, p])
            k = place_of(name, ledger)
            if k == ledger.filled[0] or order(name, ledger, k) > 0:
                insert(name, manifolds, m, p, ledger, k)
            impulse: Vector = times_transposed(manifolds.frame, m, row(impulses[m], p, 0))
            for d in range(3):
                ledger.real[k, 6 + d] += impulse[d]


@inner_kernel
def place_of(name: tuple[int, int, int], ledger: Ledger) -> int:
    """First entry that does not come before the contact of that name: halving."""
    low, high = 0, ledger.filled[0]
    while low < high:
        middle = (low + high) // 2
        if order(name, ledger, middle) < 0:
            low = middle + 1
        else:
            high = middle
    return low


@inner_kernel
def order(name: tuple[int, int, int], ledger: Ledger, k: int) -> int:
    """Whether entry k comes before the contact of that name (-1), is the same (0), or comes after it (1)."""
    for d in range(3):
        if ledger.names[k, d] != name[d]:
            return -1 if ledger.names[k, d] < name[d] else 1
    return 0


@inner_kernel
def insert(name: tuple[int, int, int], manifolds: Manifolds, m: int, p: int, ledger: Ledger, k: int) -> None:
    """Make room at entry k for point p of manifold m, without impulse."""
    for j in range(ledger.filled[0], k, -1):
        for d in range(3):
            ledger.names[j, d] = ledger.names[j - 1, d]
        for d in range(10):
            ledger.real[j, d] = ledger.real[j - 1, d]
    ledger.names[k, 0], ledger.names[k, 1], ledger.names[k, 2] = name
    for d in range(3):
        ledger.real[k, d] = manifolds.point[m, p, d]
        ledger.real[k, 3 + d] = manifolds.frame[m, 2, d]
        ledger.real[k, 6 + d] = 0.0
    ledger.real[k, 9] = manifolds.gap[m, p]
    ledger.filled[0] += 1


@kernel
def copy_ledger(ledger: Ledger, buffer: Buffer, start: int) -> int:
    """Write the contacts of the last step from index ``start`` on; return how many."""
    for c in range(ledger.filled[0]):
        for d in range(3):
            buffer.names[start + c, d] = ledger.names[c, d]
        for d in range(10):
            buffer.real[start + c, d] = ledger.real[c, d]
    return ledger.filled[0]
