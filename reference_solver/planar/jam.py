"""Which bodies jam: clusters of bodies that touch each other, weighed at the start of a step (E28)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar.columns import GAP, MOTION, A, B
from reference_solver.planar.impact import soft_speed
from reference_solver.planar.state import FREE, MANIFOLDS, Bodies, Rows, SubStep
from reference_solver.stepping.clock import JAMMED, hold_rest, hurry, jams
from reference_solver.stepping.islands import first_of
from reference_solver.stepping.noise import FROZEN
from reference_solver.stepping.options import MIDPOINT, Options

#: Columns of `SubStep.gain` that hold the free bodies of a cluster, its rows, and its pairs that meet, until the flight
#: begins.
MEMBERS, ROWS, MEETINGS = 0, 1, 2


@inner_kernel
def join_clusters(bodies: Bodies, rows: Rows, sub: SubStep, options: Options) -> None:
    """Join all free bodies that touch, or whose gap loads can close within the step; count bodies, rows and meetings.

    Of flush faces no more rows count than hold two bodies together: all others follow from them.
    """
    label = sub.closing
    for i in range(len(bodies.kind)):
        label[i], sub.gain[i, MEMBERS], sub.gain[i, ROWS], sub.gain[i, MEETINGS] = i, 0.0, 0.0, 0.0
    for m in range(rows.counts[MANIFOLDS]):
        a, b = rows.integer[rows.manifold[m], A], rows.integer[rows.manifold[m], B]
        free = bodies.kind[a, MOTION] == FREE and bodies.kind[b, MOTION] == FREE
        if free and near_rows(bodies, rows, m, options) > 0:
            a, b = first_of(label, a), first_of(label, b)
            label[max(a, b)] = min(a, b)
    for i in range(len(bodies.kind)):
        sub.gain[first_of(label, i), MEMBERS] += 1.0 if bodies.kind[i, MOTION] == FREE else 0.0
    for m in range(rows.counts[MANIFOLDS]):
        a, b = rows.integer[rows.manifold[m], A], rows.integer[rows.manifold[m], B]
        near = near_rows(bodies, rows, m, options)
        cluster = first_of(label, a if bodies.kind[a, MOTION] == FREE else b)
        sub.gain[cluster, ROWS] += min((1 + options.friction) * near, 2 + options.friction)
        sub.gain[cluster, MEETINGS] += 1.0 if near > 0 else 0.0


@inner_kernel
def near_rows(bodies: Bodies, rows: Rows, m: int, options: Options) -> int:
    """Number of rows of manifold m that touch, or that loads can close within the step."""
    count = 0
    for c in range(rows.manifold[m], rows.manifold[m + 1]):
        count += 1 if rows.real[c, GAP] <= options.dt * soft_speed(bodies, rows, c, options.dt) else 0
    return count


@inner_kernel
def weigh_clusters(bodies: Bodies, rows: Rows, sub: SubStep, options: Options, tally: Array) -> None:
    """Weigh each cluster of bodies at the start of a step; uses up ``sub.closing`` and ``sub.gain``.

    Where one that jams turns, the whole step goes at impulse level: otherwise its frozen solve is tried first.
    """
    join_clusters(bodies, rows, sub, options)
    turns = False
    if options.scheme == MIDPOINT:
        sub.clock[JAMMED] = 1.0
    for i in range(len(bodies.kind)):
        cluster = first_of(sub.closing, i)
        members, met = int(sub.gain[cluster, MEMBERS]), int(sub.gain[cluster, MEETINGS])
        if bodies.kind[i, MOTION] == FREE and jams(int(sub.gain[cluster, ROWS]), 3 * members, members, met):
            hurry(sub.clock)
            turns = turns or abs(bodies.twist[i, 2]) * options.dt > FROZEN
    if turns:
        hold_rest(sub.clock, tally)
