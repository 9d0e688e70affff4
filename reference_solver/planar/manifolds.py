"""Detection: from poses to contact rows in canonical order, with the impulses remembered from the step before."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.planar.broadphase import find_candidates
from reference_solver.planar.columns import FEATURE, IMPACT, PN, PT, A, B
from reference_solver.planar.narrowphase import collide
from reference_solver.planar.state import (
    BLOCK,
    CANDIDATES,
    CONTACTS,
    FEATURES,
    FIXED_STEP,
    MANIFOLDS,
    REMEMBERED,
    Bodies,
    Options,
    Pairs,
    Rows,
)

#: A gap below this fraction of the smaller half width is touching. Far above round-off, far below what a body
#: moves in a step.
TOUCHING = 1e-9


@inner_kernel
def detect(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> bool:
    """Fill the geometry of all rows; False if an array is too small (nothing but rows has changed then).

    Candidates come in ascending order and a pair's points in ascending feature, so rows are sorted by
    (body_a, body_b, feature): the same order in every run, whatever happened before.
    """
    if not find_candidates(bodies, pairs, rows, options):
        return False
    n = len(bodies.kind)
    contacts, manifolds = 0, 0
    for k in range(rows.counts[CANDIDATES]):
        if contacts + 2 > len(rows.real):
            return False
        a, b = pairs.candidate[k] // n, pairs.candidate[k] % n
        # What flies towards a rebound must not be slowed down before it gets there (E8).
        bounces = options.scheme == FIXED_STEP and options.restitution and pairs.restitution[a, b] > 0.0
        # The textbook asks for gaps alone; it keeps its bits.
        ahead = options.dt if options.solver == BLOCK else 0.0
        found = collide(bodies, a, b, TOUCHING if bounces else options.margin, ahead, rows, contacts)
        if found > 0:
            rows.manifold[manifolds] = contacts
            manifolds += 1
            contacts += found
    rows.manifold[manifolds] = contacts
    rows.counts[CONTACTS], rows.counts[MANIFOLDS] = contacts, manifolds
    recall(bodies, rows, options)
    return True


@inner_kernel
def row_key(bodies: Bodies, rows: Rows, c: int) -> int:
    """(a, b, feature) as one integer that sorts like the triple."""
    return (rows.integer[c, A] * len(bodies.kind) + rows.integer[c, B]) * FEATURES + rows.integer[c, FEATURE]


@inner_kernel
def recall(bodies: Bodies, rows: Rows, options: Options) -> None:
    """Give each row the impulse of the same feature one step before: a merge of two sorted key lists."""
    old = 0
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN] = rows.real[c, PT] = 0.0
        key = row_key(bodies, rows, c)
        while old < rows.counts[REMEMBERED] and rows.old_key[old] < key:
            old += 1
        if options.warm_starting and old < rows.counts[REMEMBERED] and rows.old_key[old] == key:
            rows.real[c, PN] = rows.old_impulse[old, 0]
            rows.real[c, PT] = rows.old_impulse[old, 1]


@inner_kernel
def remember(bodies: Bodies, rows: Rows) -> None:
    """Keep the impulses for the next step, but not those of an impact: it will not repeat."""
    for c in range(rows.counts[CONTACTS]):
        kept = 0.0 if rows.integer[c, IMPACT] else 1.0
        rows.old_key[c] = row_key(bodies, rows, c)
        rows.old_impulse[c, 0] = kept * rows.real[c, PN]
        rows.old_impulse[c, 1] = kept * rows.real[c, PT]
    rows.counts[REMEMBERED] = rows.counts[CONTACTS]
