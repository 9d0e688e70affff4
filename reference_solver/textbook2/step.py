"""The step and the loop over steps.

detect -> prepare (samples u before forces) -> accelerate -> warm start -> solve -> move -> remember
"""

from __future__ import annotations

import math

from reference_solver.compilation import kernel, spliced_kernel
from reference_solver.textbook.iteration import sweep_often, sweep_to_residual
from reference_solver.textbook.motion import FIXED, FREE
from reference_solver.textbook.options import BLOCK, Options, pushes_along
from reference_solver.textbook.samples import Buffer, end_step, lacks_room
from reference_solver.textbook2.block import prepare_blocks, sweep_blocks
from reference_solver.textbook2.certificate import certify, open_solve
from reference_solver.textbook2.columns import COS, FEATURE, GAP, LOAD, MOTION, NX, NY, PN, POINT, PT, SHAPE, SIN, A, B
from reference_solver.textbook2.direct import mend_velocities, solve_directly
from reference_solver.textbook2.manifolds import detect, remember
from reference_solver.textbook2.position import begin_pushes, correct_positions
from reference_solver.textbook2.residual import natural_map
from reference_solver.textbook2.rows import prepare, warm_start
from reference_solver.textbook2.sequential_impulses import sweep_rows
from reference_solver.textbook2.state import CONTACTS, DISC, Bodies, Plane, Rows
from reference_solver.textbook2.wide import solve_at_once


@spliced_kernel
def accelerate(bodies: Bodies, options: Options) -> None:
    """v* = v + h M^-1 f (E5)."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FREE:
            for k in range(3):
                bodies.twist[i, k] += options.dt * bodies.real[i, LOAD + k]


@spliced_kernel
def way(bodies: Bodies, i: int, k: int, dt: float, pushed: bool) -> float:
    """How far coordinate k of body i goes (E17)."""
    own = dt * bodies.twist[i, k]
    return own + dt * bodies.pseudo[i, k] if pushed else own


@spliced_kernel
def move(bodies: Bodies, dt: float, pushed: bool) -> None:
    """Advance x += h (v + pseudo-velocity) for everything that is not fixed (E17); a disc has no use for its angle."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FIXED:
            continue
        for k in range(3):
            bodies.pose[i, k] += way(bodies, i, k, dt, pushed)
        if way(bodies, i, 2, dt, pushed) != 0.0 and bodies.kind[i, SHAPE] != DISC:
            bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])


@spliced_kernel
def sweep(bodies: Bodies, rows: Rows, options: Options, relaxation: float, backwards: int, push: int) -> None:
    """One sweep of the solver chosen; ``backwards``, ``push``: see `sweep_rows`."""
    if options.solver == BLOCK:
        sweep_blocks(bodies, rows, options, relaxation)
    else:
        sweep_rows(bodies, rows, options, relaxation, backwards, push)


@spliced_kernel
def step(plane: Plane) -> bool:
    """One step; False, with bodies untouched, if an array is too small."""
    bodies, pairs, rows, options, tally = plane.bodies, plane.pairs, plane.rows, plane.options, plane.tally
    if not detect(bodies, pairs, rows, options):
        return False
    if rows.counts[CONTACTS] > 0:
        prepare(bodies, pairs, rows, options)
        prepare_blocks(bodies, rows)
    accelerate(bodies, options)
    if options.certified:
        open_solve(bodies, options.dt, tally)
    pushed = False
    if rows.counts[CONTACTS] > 0:
        if pushes_along(options):
            pushed = begin_pushes(bodies, rows, options, tally) > 0.0
        warm_start(bodies, rows, options)
        if options.residual >= 0.0:
            sweep_to_residual(
                bodies, rows, plane.problem, options, tally, sweep, natural_map, solve_directly, mend_velocities
            )
        elif not solve_at_once(plane.wide, bodies, rows, options, tally, int(pushed)):
            sweep_often(bodies, rows, options, tally, int(pushed), sweep, natural_map)
        if options.certified:
            certify(bodies, rows, options, tally)
        if not pushes_along(options):
            pushed = correct_positions(bodies, rows, options, tally)
    move(bodies, options.dt, pushed)
    remember(rows)
    return True


@kernel
def run(plane: Plane, buffer: Buffer, first: int, steps: int, stride: int) -> int:
    """Make steps ``first`` .. ``steps`` - 1, sampling after every ``stride`` of them (0: never).

    Returns the number of steps done: fewer than ``steps`` when an array must grow, or when the contact buffer could not
    take a full sample more. The caller grows it and calls again.
    """
    for k in range(first, steps):
        if lacks_room(buffer, k, stride, len(plane.rows.real)) or not step(plane):
            return k
        s = end_step(plane.bodies.pose, plane.bodies.twist, buffer, k, stride)
        if s >= 0:
            buffer.offset[s + 1] += copy_contacts(plane.rows, buffer, buffer.offset[s])
    return steps


@kernel
def copy_contacts(rows: Rows, buffer: Buffer, start: int) -> int:
    """Write the contacts of the last step from index ``start`` on; return how many."""
    for c in range(rows.counts[CONTACTS]):
        k = start + c
        nx, ny, pn, pt = rows.real[c, NX], rows.real[c, NY], rows.real[c, PN], rows.real[c, PT]
        buffer.names[k, 0], buffer.names[k, 1], buffer.names[k, 2] = (
            rows.integer[c, A],
            rows.integer[c, B],
            rows.integer[c, FEATURE],
        )
        buffer.real[k, 0], buffer.real[k, 1] = rows.real[c, POINT], rows.real[c, POINT + 1]
        buffer.real[k, 2], buffer.real[k, 3] = nx, ny
        buffer.real[k, 4], buffer.real[k, 5] = pn * nx - pt * ny, pn * ny + pt * nx
        buffer.real[k, 6] = rows.real[c, GAP]
    return int(rows.counts[CONTACTS])
