"""Sweeps of many manifolds at once, one in each lane (`reference_solver.lanes`), with the bits of one after the other.

Manifolds that share no free body do not affect each other. A manifold therefore has a level, one more than the
highest of those before it that share a free body with it: those of a level are solved together, level after level, and
every one meets the velocities that it meets in the order of `sequential_impulses.sweep_rows`. Blocks of `LANES`
manifolds are laid out once a step. Worth it where levels are wide, as in piles; a column has as many levels as boxes.
"""

from __future__ import annotations

from reference_solver.compilation import spliced_kernel
from reference_solver.lanes import LANES, from_lanes, into_lanes, lanes
from reference_solver.model import Array
from reference_solver.textbook.motion import FREE
from reference_solver.textbook.options import Options
from reference_solver.textbook.sweeps import enter
from reference_solver.textbook2.columns import INVERSE_INERTIA, INVERSE_MASS, MOTION, WIDE_REALS, A, B
from reference_solver.textbook2.residual import natural_map
from reference_solver.textbook2.sequential_impulses import push_pair, push_point, sweep_pair, sweep_point
from reference_solver.textbook2.state import CONTACTS, MANIFOLDS, Bodies, Rows, Wide

#: Fewer manifolds are not worth laying out.
LEAST_MANIFOLDS = 64
#: Columns of `Wide.velocity`: velocity, pseudo-velocity, inverse mass and, as in `Bodies.real`, moment of inertia.
PSEUDO, MASS = 3, 6
INERTIA = MASS + INVERSE_INERTIA - INVERSE_MASS
#: The impulses of a row are in the `LANES` columns from here.
SOLVED = 8


@spliced_kernel
def solve_at_once(wide: Wide, bodies: Bodies, rows: Rows, options: Options, tally: Array, push: int) -> bool:
    """See `iteration.sweep_often`; False, with nothing done, where that is faster."""
    if not sweep_at_once(wide, bodies, rows, options, push):
        return False
    enter(tally, natural_map(bodies, rows, options) if options.certified else 0.0, options.iterations)
    return True


@spliced_kernel
def sweep_at_once(wide: Wide, bodies: Bodies, rows: Rows, options: Options, push: int) -> bool:
    """Make all sweeps with `LANES` manifolds at once; False, with nothing done, where that is not worth it."""
    if len(wide.last) == 0 or rows.counts[MANIFOLDS] < LEAST_MANIFOLDS or rows.counts[CONTACTS] == len(rows.real):
        return False
    blocks = find_blocks(wide, bodies, rows)
    if blocks == 0:
        return False
    lay_out(wide, bodies, rows, blocks)
    relaxation = options.relaxation if options.relaxation > 0.0 else 1.0
    for k in range(options.iterations):
        sweep_blocks(wide, blocks, options, relaxation, int(2 * k >= options.iterations), push)
    put_back(wide, bodies, rows, blocks)
    return True


@spliced_kernel
def find_blocks(wide: Wide, bodies: Bodies, rows: Rows) -> int:
    """Give each manifold a slot; the number of blocks, 0 where more than half of their lanes would be empty."""
    count, levels = rows.counts[MANIFOLDS], 0
    wide.last[:] = 0
    for m in range(count):
        c = rows.manifold[m]
        a, b = rows.integer[c, A], rows.integer[c, B]
        level = max(wide.last[a], wide.last[b])
        for i in (a, b):
            if bodies.kind[i, MOTION] == FREE:
                wide.last[i] = level + 1
        wide.level[m] = 2 * level + rows.manifold[m + 1] - c - 1
        levels = max(levels, level + 1)
    wide.begin[: 2 * levels + 1] = 0
    for m in range(count):
        wide.begin[wide.level[m] + 1] += 1
    for k in range(2 * levels):
        slots = LANES * ((wide.begin[k + 1] + LANES - 1) // LANES)
        wide.begin[k + 1] = wide.begin[k] + slots
    slots = wide.begin[2 * levels]
    if slots > 2 * count:
        return 0
    wide.order[: slots // LANES] = -1
    for m in range(count):
        slot = wide.begin[wide.level[m]]
        wide.order[slot // LANES, slot % LANES] = m
        wide.begin[wide.level[m]] += 1
    return slots // LANES


@spliced_kernel
def lay_out(wide: Wide, bodies: Bodies, rows: Rows, blocks: int) -> None:
    """Copy what a sweep needs: velocities in a row for each body, rows and W in a lane for each manifold."""
    n = len(bodies.kind)
    for i in range(n):
        for k in range(3):
            wide.velocity[i, k], wide.velocity[i, PSEUDO + k] = bodies.twist[i, k], bodies.pseudo[i, k]
        wide.velocity[i, MASS] = bodies.real[i, INVERSE_MASS]
        wide.velocity[i, INERTIA] = bodies.real[i, INVERSE_INERTIA]
    none, point, block = rows.counts[CONTACTS], lanes(wide.point), lanes(wide.block)
    rows.real[none] = 0.0
    wide.velocity[n] = 0.0
    for q in range(blocks):
        body, row = wide.body[q], wide.row[q]
        for lane in range(LANES):
            m = wide.order[q, lane]
            c = rows.manifold[m] if m >= 0 else none
            row[0, lane], row[1, lane] = c, c + 1
            body[0, lane], body[1, lane] = (rows.integer[c, A], rows.integer[c, B]) if m >= 0 else (n, n)
            if m < 0:
                row[1, lane], wide.order[q, lane] = none, wide.order[q, 0]
        m = wide.order[q, 0]
        wide.points[q] = rows.manifold[m + 1] - rows.manifold[m]
        for i in range(wide.points[q]):
            for k in range(0, WIDE_REALS, LANES):
                into_lanes(rows.real[:, k:], row[i], point[2 * q + i, k:])
        if wide.points[q] == 2:
            for k in range(0, 4, 2):
                into_lanes(rows.block[:, k:], wide.order[q], block[q, k:])


@spliced_kernel
def sweep_blocks(wide: Wide, blocks: int, options: Options, relaxation: float, backwards: int, push: int) -> None:
    """See `sequential_impulses.sweep_rows`: bodies 0 and 1 are those of a block, row 2 q is the first of block q."""
    pair = lanes(wide.pair)
    bodies = Bodies(pair, pair, pair[:, PSEUDO:], pair[:, MASS - INVERSE_MASS :], wide.kind, pair, pair, pair)
    rows = rows_of_blocks(wide)
    for q in range(blocks):
        into_lanes(wide.velocity, wide.body[q, 0], pair[0])
        into_lanes(wide.velocity, wide.body[q, 1], pair[1])
        if wide.points[q] == 1:
            sweep_point(bodies, rows, 2 * q, options, relaxation)
            if push:
                push_point(bodies, rows, 2 * q, relaxation)
        else:
            sweep_pair(bodies, rows, q, backwards, options, relaxation)
            if push:
                push_pair(bodies, rows, 2 * q + backwards, 2 * q + 1 - backwards, relaxation)
        from_lanes(pair[0], wide.body[q, 0], wide.velocity)
        from_lanes(pair[1], wide.body[q, 1], wide.velocity)


@spliced_kernel
def rows_of_blocks(wide: Wide) -> Rows:
    """Rows of all blocks, as a sweep takes them."""
    none, impulse = wide.points, wide.velocity
    point, block = lanes(wide.point), lanes(wide.block)
    return Rows(none, wide.integer, point, wide.manifold, block, impulse, none, impulse)


@spliced_kernel
def put_back(wide: Wide, bodies: Bodies, rows: Rows, blocks: int) -> None:
    """Copy velocities and impulses back."""
    for i in range(len(bodies.kind)):
        for k in range(3):
            bodies.twist[i, k], bodies.pseudo[i, k] = wide.velocity[i, k], wide.velocity[i, PSEUDO + k]
    point = lanes(wide.point)
    for q in range(blocks):
        for i in range(wide.points[q]):
            from_lanes(point[2 * q + i, SOLVED:], wide.row[q, i], rows.real[:, SOLVED:])
