"""Which bodies jam: clusters of bodies that touch each other, weighed at the start of a step (E28)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.spatial.impact import soft_speed
from reference_solver.spatial.state import FREE, Bodies, Manifolds, SubStep
from reference_solver.spatial.vector import length, row
from reference_solver.stepping.clock import JAMMED, hold_rest, hurry, jams
from reference_solver.stepping.islands import first_of
from reference_solver.stepping.noise import FROZEN
from reference_solver.stepping.options import MIDPOINT, Options

#: Columns of ``rate`` that hold the free bodies of a cluster, its rows, and its pairs that meet, until the flight
#: begins.
MEMBERS, ROWS, MEETINGS = 0, 1, 2
#: Freedoms of a body: what holds two bodies together has no more independent rows.
FREEDOMS = 6


@inner_kernel
def near_rows(bodies: Bodies, manifolds: Manifolds, m: int, options: Options) -> int:
    """Number of independent rows of the points of manifold m that touch, or that loads can close within the step."""
    count = 0
    for p in range(manifolds.points[m]):
        count += 1 if manifolds.gap[m, p] <= options.dt * soft_speed(bodies, manifolds, m, p, options.dt) else 0
    return min((3 if manifolds.friction[m] > 0.0 else 1) * count, FREEDOMS)


@inner_kernel
def weigh_clusters(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options, tally: Array) -> None:
    """Join all free bodies that touch, and weigh each cluster; uses up ``held`` and ``rate``.

    Where one that jams turns, the whole step goes at impulse level: otherwise its frozen solve is tried first.
    """
    label = sub_step.held
    for i in range(len(bodies)):
        label[i], bodies.rate[i, MEMBERS], bodies.rate[i, ROWS], bodies.rate[i, MEETINGS] = i, 0.0, 0.0, 0.0
    for m in range(len(manifolds)):
        a, b = manifolds.body_a[m], manifolds.body_b[m]
        if bodies.motion[a] == FREE and bodies.motion[b] == FREE and near_rows(bodies, manifolds, m, options) > 0:
            a, b = first_of(label, a), first_of(label, b)
            label[max(a, b)] = min(a, b)
    for i in range(len(bodies)):
        bodies.rate[first_of(label, i), MEMBERS] += 1.0 if bodies.motion[i] == FREE else 0.0
    for m in range(len(manifolds)):
        a = manifolds.body_a[m] if bodies.motion[manifolds.body_a[m]] == FREE else manifolds.body_b[m]
        near, cluster = near_rows(bodies, manifolds, m, options), first_of(label, a)
        bodies.rate[cluster, ROWS] += near
        bodies.rate[cluster, MEETINGS] += 1.0 if near > 0 else 0.0
    turns = False
    if options.scheme == MIDPOINT:
        sub_step.clock[JAMMED] = 1.0
    for i in range(len(bodies)):
        cluster = first_of(label, i)
        members, met = int(bodies.rate[cluster, MEMBERS]), int(bodies.rate[cluster, MEETINGS])
        if bodies.motion[i] == FREE and jams(int(bodies.rate[cluster, ROWS]), FREEDOMS * members, members, met):
            hurry(sub_step.clock)
            turns = turns or length(row(bodies.twist, i, 3)) * options.dt > FROZEN
    if turns:
        hold_rest(sub_step.clock, tally)
