"""Detection: from poses to contact rows in canonical order, with the impulses remembered from the step before."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.planar.broadphase import find_candidates
from reference_solver.planar.columns import FEATURE, IMPACT, NUMBER, PN, PT, A, B
from reference_solver.planar.narrowphase import collide
from reference_solver.planar.state import (
    CANDIDATES,
    CONTACTS,
    FEATURES,
    KEPT,
    MANIFOLDS,
    MOST_BODIES,
    PAST,
    REMEMBERED,
    Bodies,
    Pairs,
    Rows,
)
from reference_solver.stepping.broadphase import bodies_of
from reference_solver.stepping.noise import TOUCHING
from reference_solver.stepping.options import BLOCK, FIXED_STEP, Options


@inner_kernel
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
def contact_key(a: int, b: int, feature: int) -> int:
    """(a, b, feature), by numbers in the world, as one integer that sorts like the triple."""
    return (a * MOST_BODIES + b) * FEATURES + feature


@inner_kernel
def row_key(bodies: Bodies, rows: Rows, c: int) -> int:
    """`contact_key` of row c."""
    a, b = bodies.kind[rows.integer[c, A], NUMBER], bodies.kind[rows.integer[c, B], NUMBER]
    return contact_key(a, b, rows.integer[c, FEATURE])


@inner_kernel
def recall(bodies: Bodies, rows: Rows, options: Options) -> None:
    """Give each row the impulse of the same feature one sub-step or one step before: a merge of ascending lists."""
    old, past = 0, 0
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN] = rows.real[c, PT] = 0.0
        if not options.warm_starting:
            continue
        key = row_key(bodies, rows, c)
        while old < rows.counts[REMEMBERED] and rows.old_key[old] < key:
            old += 1
        if old < rows.counts[REMEMBERED] and rows.old_key[old] == key:
            rows.real[c, PN] = rows.old_impulse[old, 0]
            rows.real[c, PT] = rows.old_impulse[old, 1]
            continue
        while past < rows.counts[PAST] and rows.past_key[past] < key:
            past += 1
        if past < rows.counts[PAST] and rows.past_key[past] == key:
            rows.real[c, PN] = rows.past_impulse[past, 0]
            rows.real[c, PT] = rows.past_impulse[past, 1]


@inner_kernel
def keep_remembered(rows: Rows) -> None:
    """Add what is remembered of one island to what is kept for the next step, in ascending order."""
    for old in range(rows.counts[REMEMBERED]):
        k = rows.counts[KEPT]
        while k > 0 and rows.kept_key[k - 1] > rows.old_key[old]:
            rows.kept_key[k] = rows.kept_key[k - 1]
            for d in range(2):
                rows.kept_impulse[k, d] = rows.kept_impulse[k - 1, d]
            k -= 1
        rows.kept_key[k] = rows.old_key[old]
        for d in range(2):
            rows.kept_impulse[k, d] = rows.old_impulse[old, d]
        rows.counts[KEPT] += 1
    rows.counts[REMEMBERED] = 0


@inner_kernel
def pass_on(rows: Rows) -> None:
    """What was kept is the past of the next step."""
    for k in range(rows.counts[KEPT]):
        rows.past_key[k] = rows.kept_key[k]
        for d in range(2):
            rows.past_impulse[k, d] = rows.kept_impulse[k, d]
    rows.counts[PAST], rows.counts[KEPT] = rows.counts[KEPT], 0


@inner_kernel
def remember(bodies: Bodies, rows: Rows) -> None:
    """Keep the impulses for the next step, but not those of an impact: it will not repeat."""
    for c in range(rows.counts[CONTACTS]):
        kept = 0.0 if rows.integer[c, IMPACT] else 1.0
        rows.old_key[c] = row_key(bodies, rows, c)
        rows.old_impulse[c, 0] = kept * rows.real[c, PN]
        rows.old_impulse[c, 1] = kept * rows.real[c, PT]
    rows.counts[REMEMBERED] = rows.counts[CONTACTS]
