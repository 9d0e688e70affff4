"""Several planar worlds of one kind in step, a world in each lane (`reference_solver.lanes`).

A group is `LANES` worlds with the same bodies, of other sizes, masses, states and laws. Its textbook step is that of
`planar.step`, by the same functions: to the bit what each world does alone. What differs is who touches whom. A pair
that may touch in any world has room for its points in all of them; where a world has fewer points, the rows are solved
and what they did to it is taken back.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.coulomb import into_interval
from reference_solver.lanes import LANES, all_of, any_of, lanes, where
from reference_solver.many.contacts import GEOMETRY, NONE, are_found_at_once, collide_at_once
from reference_solver.model import Array
from reference_solver.planar.block import prepare_blocks
from reference_solver.planar.broadphase import bound_closely
from reference_solver.planar.columns import (
    APPROACH,
    COS,
    EXTENT,
    FEATURE,
    FRICTION,
    PN,
    PT,
    PUSH,
    SIN,
    VERTICES,
    A,
    B,
)
from reference_solver.planar.kinematics import apply_normal, apply_tangent, load_speed
from reference_solver.planar.manifolds import contact_key
from reference_solver.planar.narrowphase import collide
from reference_solver.planar.position import begin_pushes
from reference_solver.planar.rows import prepare_row
from reference_solver.planar.sequential_impulses import push_pair, push_point, sweep_pair, sweep_point
from reference_solver.planar.state import (
    CONTACTS,
    MANIFOLDS,
    REMEMBERED,
    Bodies,
    Indices,
    Pairs,
    Rows,
)
from reference_solver.planar.step import accelerate, move
from reference_solver.stepping.broadphase import Boxes, bodies_of, pair_bodies
from reference_solver.stepping.noise import TOUCHING
from reference_solver.stepping.options import Options
from reference_solver.structures import structure

#: Feature of a point that was not there in the step before: it matches nothing, nor does `NONE`.
GONE = -1.0


@structure
class Group(NamedTuple):
    """Worlds side by side. The last axis of all but indices is a lane; other axes are those of `Bodies`, `Rows`."""

    pose: Array  # (n, 3, LANES)
    twist: Array
    pseudo: Array
    real: Array  # (n, BODY_REALS, LANES)
    kind: Indices  # (n, BODY_INTEGERS)
    vertex: Array  # (k, 2, LANES)
    restitution: Array  # (n, n, LANES)
    friction: Array
    low: Array  # (n, 2, LANES): bounds of the bodies in each world
    high: Array
    boxes: Boxes  # bounds over all worlds, and the pairs that may touch
    row: Array  # (c, ROW_REALS, LANES)
    integer: Indices  # (c, ROW_INTEGERS)
    counts: Indices  # (COUNTS,)
    manifold: Indices  # (m + 1,)
    block: Array  # (m, 4, 4, LANES)
    found: Array  # (m, LANES): points of a pair in each world
    feature: Array  # (c, LANES): which features touch at each point
    impact: Array  # (c, LANES): 1 where bodies meet or part faster than the loads of one step explain
    old_pair: Indices  # (m,): pairs of the step before, as candidates; `old_count` of them
    old_first: Indices  # (m + 1,): first point of each
    old_count: Indices  # (1,)
    old: Array  # (c, 3, LANES): features and impulses of its points
    probe: Rows  # room for the points of one pair
    saved: Array  # (15, LANES): what is taken back where a world has no such row
    tally: Array  # (TALLY_SIZE, LANES)
    options: Options


#: Columns of `Group.old`.
OLD_FEATURE, OLD_N, OLD_T = 0, 1, 2


@inner_kernel
def step_group(group: Group) -> bool:
    """One textbook step of all worlds of a group; False, with bodies untouched, if an array is too small."""
    bodies, pairs, rows = bodies_of_group(group), pairs_of_group(group), rows_of_group(group)
    options, found = group.options, lanes(group.found)
    if not find_pairs(group, bodies, pairs, rows):
        return False
    detect(group, bodies, pairs, rows)
    recall(group, rows)
    prepare(group, bodies, pairs, rows)
    prepare_blocks(bodies, rows)
    accelerate(bodies, options)
    pushed = begin_pushes(bodies, rows, options, lanes(group.tally)) > 0.0
    warm_start(group, bodies, rows, found)
    relaxation, push = options.relaxation if options.relaxation > 0.0 else 1.0, int(any_of(pushed))
    for k in range(options.iterations):
        sweep(group, bodies, rows, found, relaxation, int(2 * k >= options.iterations), push)
    move(bodies, options.dt, pushed)
    remember(group, rows, found)
    return True


@inner_kernel
def bodies_of_group(group: Group) -> Bodies:
    """Bodies of all worlds, as the step of one world takes them."""
    pose, twist = lanes(group.pose), lanes(group.twist)
    return Bodies(pose, twist, lanes(group.pseudo), lanes(group.real), group.kind, lanes(group.vertex), twist, twist)


@inner_kernel
def pairs_of_group(group: Group) -> Pairs:
    """Laws of the pairs in all worlds, and bounds of the bodies in each."""
    b = group.boxes
    boxes = Boxes(lanes(group.low), lanes(group.high), b.candidate, b.found, b.begin, b.cell, b.bucket, b.after)
    return Pairs(lanes(group.restitution), lanes(group.friction), boxes)


@inner_kernel
def rows_of_group(group: Group) -> Rows:
    """Rows of all worlds; nothing is remembered in them."""
    p = group.probe
    return Rows(
        group.counts, group.integer, lanes(group.row), group.manifold, lanes(group.block), p.local,
        p.old_key, p.old_impulse, p.past_key, p.past_impulse, p.kept_key, p.kept_impulse, p.wide,
    )  # fmt: skip


@inner_kernel
def find_pairs(group: Group, bodies: Bodies, pairs: Pairs, rows: Rows) -> bool:
    """Give each pair that may touch in any world room for its points: one for a disc, else two."""
    bound_closely(bodies, pairs, group.options)
    boxes, n = group.boxes, len(group.kind)
    for i in range(n):
        for k in range(2):
            boxes.low[i, k], boxes.high[i, k] = math.inf, -math.inf
            for lane in range(LANES):
                low, high = group.low[i, k, lane], group.high[i, k, lane]
                if not low <= high:  # no numbers: such a body may touch all others, as in a world alone
                    low, high = -math.inf, math.inf
                boxes.low[i, k], boxes.high[i, k] = min(boxes.low[i, k], low), max(boxes.high[i, k], high)
    count = pair_bodies(bodies, boxes, group.options.broadphase)
    if count > len(boxes.candidate) or count >= len(group.manifold):
        return False
    contacts = 0
    for m in range(count):
        a, b = bodies_of(boxes.candidate[m])
        rows.manifold[m] = contacts
        points = 1 if group.kind[a, VERTICES] == 1 or group.kind[b, VERTICES] == 1 else 2
        if contacts + points > len(group.row):
            return False
        for c in range(contacts, contacts + points):
            rows.integer[c, A], rows.integer[c, B] = a, b
        contacts += points
    rows.manifold[count] = contacts
    rows.counts[CONTACTS], rows.counts[MANIFOLDS] = contacts, count
    return True


@inner_kernel
def detect(group: Group, bodies: Bodies, pairs: Pairs, rows: Rows) -> None:
    """Write the points of all pairs in all worlds, of simple shapes in all at once."""
    options, found, feature = group.options, lanes(group.found), lanes(group.feature)
    apart = False
    for m in range(rows.counts[MANIFOLDS]):
        c = rows.manifold[m]
        a, b = rows.integer[c, A], rows.integer[c, B]
        if not are_found_at_once(bodies, a, b):
            apart = True
            continue
        bounces = pairs.restitution[a, b] > (0.0 if options.restitution else math.inf)
        extent = min(bodies.real[a, EXTENT], bodies.real[b, EXTENT])
        reach = where(bounces, TOUCHING, options.margin) * extent
        near = ~are_apart(pairs.boxes.low, pairs.boxes.high, a, b)
        found[m] = collide_at_once(bodies, a, b, reach, near, rows, feature, c)
    if apart:
        for lane in range(LANES):
            detect_in(group, lane)


@inner_kernel
def are_apart(low: Array, high: Array, a: int, b: int) -> Any:
    """Whether the bounds of two bodies are apart, in one world or in each; see `broadphase.may_touch`."""
    along_x = (low[a, 0] > high[b, 0]) | (low[b, 0] > high[a, 0])
    return along_x | (low[a, 1] > high[b, 1]) | (low[b, 1] > high[a, 1])


@inner_kernel
def detect_in(group: Group, lane: int) -> None:
    """Write the points in one world of all pairs that `detect` has not looked at."""
    pose, twist = group.pose[:, :, lane], group.twist[:, :, lane]
    bodies = Bodies(pose, twist, twist, group.real[:, :, lane], group.kind, group.vertex[:, :, lane], twist, twist)
    low, high = group.low[:, :, lane], group.high[:, :, lane]
    probe, options = group.probe, group.options
    for m in range(group.counts[MANIFOLDS]):
        first, found = group.manifold[m], 0
        a, b = group.integer[first, A], group.integer[first, B]
        if are_found_at_once(bodies, a, b):
            continue
        if not are_apart(low, high, a, b):
            bounces = options.restitution and group.restitution[a, b, lane] > 0.0
            found = collide(bodies, a, b, TOUCHING if bounces else options.margin, 0.0, probe, 0)
        group.found[m, lane] = found
        for i in range(group.manifold[m + 1] - first):
            for k in GEOMETRY:
                group.row[first + i, k, lane] = probe.real[i, k] if i < found else 0.0
            group.feature[first + i, lane] = probe.integer[i, FEATURE] if i < found else NONE


@inner_kernel
def recall(group: Group, rows: Rows) -> None:
    """Give each point the impulse of the same feature one step before: pairs are merged, features compared."""
    feature, past, before = lanes(group.feature), lanes(group.old), 0
    for m in range(rows.counts[MANIFOLDS]):
        pair, first, last = group.boxes.candidate[m], 0, 0
        while before < group.old_count[0] and group.old_pair[before] < pair:
            before += 1
        if group.options.warm_starting and before < group.old_count[0] and group.old_pair[before] == pair:
            first, last = group.old_first[before], group.old_first[before + 1]
        for c in range(rows.manifold[m], rows.manifold[m + 1]):
            rows.real[c, PN] = rows.real[c, PT] = 0.0
            for k in range(first, last):
                same = past[k, OLD_FEATURE] == feature[c]
                rows.real[c, PN] = where(same, past[k, OLD_N], rows.real[c, PN])
                rows.real[c, PT] = where(same, past[k, OLD_T], rows.real[c, PT])


@inner_kernel
def prepare(group: Group, bodies: Bodies, pairs: Pairs, rows: Rows) -> None:
    """See `rows.prepare`; of points that are not there all is zero but masses and friction."""
    options, impact = group.options, lanes(group.impact)
    for c in range(rows.counts[CONTACTS]):
        prepare_row(bodies, pairs, rows, c, options)
        approach, push = rows.real[c, APPROACH], load_speed(bodies, rows, c, options.dt)
        impact[c] = where(abs(approach) > push, 1.0, 0.0)
        rows.real[c, PN] = where(approach > push, 0.0, rows.real[c, PN])
        rows.real[c, PT] = where(approach > push, 0.0, rows.real[c, PT])


@inner_kernel
def warm_start(group: Group, bodies: Bodies, rows: Rows, found: Array) -> None:
    """See `rows.warm_start`."""
    friction = group.options.friction
    for m in range(rows.counts[MANIFOLDS]):
        first = rows.manifold[m]
        for c in range(first, rows.manifold[m + 1]):
            there = found[m] > float(c - first)
            if not any_of(there):
                continue
            whole = all_of(there)
            if not whole:
                keep(group, bodies, rows, first)
            apply_normal(bodies, bodies.twist, rows, c, rows.real[c, PN])
            bound = rows.real[c, FRICTION] * rows.real[c, PN] if friction else 0.0 * rows.real[c, PN]
            rows.real[c, PT] = into_interval(rows.real[c, PT], bound)
            if friction:
                apply_tangent(bodies, bodies.twist, rows, c, rows.real[c, PT])
            if not whole:
                take_back(group, bodies, rows, first, there)


@inner_kernel
def sweep(group: Group, bodies: Bodies, rows: Rows, found: Array, relaxation: float, backwards: int, push: int) -> None:
    """See `sequential_impulses.sweep_rows`."""
    options = group.options
    for m in range(rows.counts[MANIFOLDS]):
        first, points = rows.manifold[m], found[m]
        two, one = points == 2.0, points == 1.0
        whole = all_of(two) or all_of(one)
        if any_of(two):
            if not whole:
                keep(group, bodies, rows, first)
            sweep_pair(bodies, rows, m, backwards, options, relaxation)
            if push:
                push_pair(bodies, rows, first + backwards, first + 1 - backwards, relaxation)
            if not whole:
                take_back(group, bodies, rows, first, two)
        if any_of(one):
            if not whole:
                keep(group, bodies, rows, first)
            sweep_point(bodies, rows, first, options, relaxation)
            if push:
                push_point(bodies, rows, first, relaxation)
            if not whole:
                take_back(group, bodies, rows, first, one)


#: What of a point solving it changes.
SOLVED = (PN, PT, PUSH)


@inner_kernel
def keep(group: Group, bodies: Bodies, rows: Rows, c: int) -> None:
    """Keep what solving the pair of point c changes, but impulses of its second point: with one point there is none."""
    saved = lanes(group.saved)
    for side in range(2):
        i = rows.integer[c, A + side]
        for k in range(3):
            saved[6 * side + k], saved[6 * side + 3 + k] = bodies.twist[i, k], bodies.pseudo[i, k]
    for k in range(3):
        saved[12 + k] = rows.real[c, SOLVED[k]]


@inner_kernel
def take_back(group: Group, bodies: Bodies, rows: Rows, c: int, there: Any) -> None:
    """Take back what solving the pair of point c has done where it is not ``there``."""
    saved = lanes(group.saved)
    for side in range(2):
        i = rows.integer[c, A + side]
        for k in range(3):
            bodies.twist[i, k] = where(there, bodies.twist[i, k], saved[6 * side + k])
            bodies.pseudo[i, k] = where(there, bodies.pseudo[i, k], saved[6 * side + 3 + k])
    for k in range(3):
        rows.real[c, SOLVED[k]] = where(there, rows.real[c, SOLVED[k]], saved[12 + k])


@inner_kernel
def remember(group: Group, rows: Rows, found: Array) -> None:
    """See `manifolds.remember`."""
    past, feature, impact = lanes(group.old), lanes(group.feature), lanes(group.impact)
    for m in range(rows.counts[MANIFOLDS]):
        first = rows.manifold[m]
        group.old_pair[m], group.old_first[m] = group.boxes.candidate[m], first
        for c in range(first, rows.manifold[m + 1]):
            kept = where(impact[c] > 0.0, 0.0, 1.0)
            past[c, OLD_FEATURE] = where(found[m] > float(c - first), feature[c], GONE)
            past[c, OLD_N], past[c, OLD_T] = kept * rows.real[c, PN], kept * rows.real[c, PT]
    group.old_first[rows.counts[MANIFOLDS]] = rows.counts[CONTACTS]
    group.old_count[0] = rows.counts[MANIFOLDS]


@kernel
def run_group(group: Group, pose: Array, twist: Array, first: int, steps: int, stride: int) -> int:
    """Make steps ``first`` .. ``steps`` - 1 of a group, and keep the states after every ``stride`` of them (0: never).

    ``pose``, ``twist``: (samples, n, 3, LANES). Returns the number of steps done, fewer where an array must grow.
    """
    for k in range(first, steps):
        if not step_group(group):
            return k
        if stride > 0 and (k + 1) % stride == 0:
            s = (k + 1) // stride - 1
            for i in range(len(group.pose)):
                for d in range(3):
                    for lane in range(LANES):
                        pose[s, i, d, lane], twist[s, i, d, lane] = group.pose[i, d, lane], group.twist[i, d, lane]
    return steps


@kernel
def hand_over(group: Group, lane: int, bodies: Bodies, rows: Rows) -> None:
    """Write the state of one world, and what it remembers, where it is to go on alone."""
    for i in range(len(group.kind)):
        for k in range(3):
            bodies.pose[i, k], bodies.twist[i, k] = group.pose[i, k, lane], group.twist[i, k, lane]
        bodies.real[i, COS], bodies.real[i, SIN] = group.real[i, COS, lane], group.real[i, SIN, lane]
    count = 0
    for m in range(group.old_count[0]):
        a, b = bodies_of(group.old_pair[m])
        for c in range(group.old_first[m], group.old_first[m + 1]):
            feature, pn, pt = group.old[c, OLD_FEATURE, lane], group.old[c, OLD_N, lane], group.old[c, OLD_T, lane]
            if feature != GONE:
                rows.old_key[count] = contact_key(a, b, int(feature))
                rows.old_impulse[count, 0], rows.old_impulse[count, 1] = pn, pt
                count += 1
    rows.counts[REMEMBERED] = count
