"""Detection: from poses to contact rows in canonical order, with the impulses remembered from the step before."""

from __future__ import annotations

from reference_solver.compilation import spliced_kernel
from reference_solver.textbook.broadphase import bodies_of
from reference_solver.textbook.noise import TOUCHING
from reference_solver.textbook.options import BLOCK, Options
from reference_solver.textbook2.broadphase import find_candidates
from reference_solver.textbook2.columns import FEATURE, IMPACT, PN, PT, A, B
from reference_solver.textbook2.narrowphase import collide
from reference_solver.textbook2.state import (
    CANDIDATES,
    CONTACTS,
    FEATURES,
    MANIFOLDS,
    MOST_BODIES,
    REMEMBERED,
    Bodies,
    Pairs,
    Rows,
)


@spliced_kernel
def detect(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> bool:
    """Fill the geometry of all rows; False if an array is too small (nothing but rows has changed then).

    Candidates come in ascending order and a pair's points in ascending feature, so rows are sorted by
    (body_a, body_b, feature): the same order in every run, whatever happened before.
    """
    if not find_candidates(bodies, pairs, rows, options):
        return False
    contacts, manifolds = 0, 0
    for k in range(rows.counts[CANDIDATES]):
        if contacts + 2 > len(rows.real):
            return False
        a, b = bodies_of(pairs.boxes.candidate[k])
        # What flies towards a rebound must not be slowed down before it gets there (E8).
        bounces = options.restitution and pairs.restitution[a, b] > 0.0
        # The textbook asks for gaps alone; it keeps its bits.
        ahead = options.dt if options.solver == BLOCK else 0.0
        found = collide(bodies, a, b, TOUCHING if bounces else options.margin, ahead, rows, contacts)
        if found > 0:
            rows.manifold[manifolds] = contacts
            manifolds += 1
            contacts += found
    rows.manifold[manifolds] = contacts
    rows.counts[CONTACTS], rows.counts[MANIFOLDS] = contacts, manifolds
    recall(rows, options)
    return True


@spliced_kernel
def contact_key(rows: Rows, c: int) -> int:
    """(a, b, feature) of row c as one integer that sorts like the triple."""
    return (rows.integer[c, A] * MOST_BODIES + rows.integer[c, B]) * FEATURES + rows.integer[c, FEATURE]


@spliced_kernel
def recall(rows: Rows, options: Options) -> None:
    """Give each row the impulse of the same feature one step before: a merge of two ascending lists."""
    old = 0
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN] = rows.real[c, PT] = 0.0
        if not options.warm_starting:
            continue
        key = contact_key(rows, c)
        while old < rows.counts[REMEMBERED] and rows.old_key[old] < key:
            old += 1
        if old < rows.counts[REMEMBERED] and rows.old_key[old] == key:
            rows.real[c, PN] = rows.old_impulse[old, 0]
            rows.real[c, PT] = rows.old_impulse[old, 1]


@spliced_kernel
def remember(rows: Rows) -> None:
    """Keep the impulses for the next step, but not those of an impact: it will not repeat."""
    for c in range(rows.counts[CONTACTS]):
        kept = 0.0 if rows.integer[c, IMPACT] else 1.0
        rows.old_key[c] = contact_key(rows, c)
        rows.old_impulse[c, 0] = kept * rows.real[c, PN]
        rows.old_impulse[c, 1] = kept * rows.real[c, PT]
    rows.counts[REMEMBERED] = rows.counts[CONTACTS]
