"""The fixed step (`stepping.run` has the loop over steps).

detect -> prepare (samples u before forces) -> accelerate -> warm start -> solve -> move -> remember
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.planar.block import prepare_blocks
from reference_solver.planar.certificate import certify, open_solve
from reference_solver.planar.columns import COS, FEATURE, GAP, LOAD, MOTION, NX, NY, PN, POINT, PT, SHAPE, SIN, A, B
from reference_solver.planar.manifolds import detect, remember
from reference_solver.planar.position import begin_pushes, correct_positions
from reference_solver.planar.rows import prepare, warm_start
from reference_solver.planar.state import CONTACTS, DISC, FIXED, FREE, Bodies, Pairs, Rows
from reference_solver.planar.wide import solve_at_once
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.ledger import Buffer
from reference_solver.stepping.options import Options, pushes_along


@inner_kernel
def accelerate(bodies: Bodies, options: Options) -> None:
    """v* = v + h M^-1 f (E5)."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FREE:
            for k in range(3):
                bodies.twist[i, k] += options.dt * bodies.real[i, LOAD + k]


@inner_kernel
def way(bodies: Bodies, i: int, k: int, dt: float, pushed: bool) -> float:
    """How far coordinate k of body i goes (E17)."""
    own = dt * bodies.twist[i, k]
    return own + dt * bodies.pseudo[i, k] if pushed else own


@inner_kernel
def move(bodies: Bodies, dt: float, pushed: bool) -> None:
    """Advance x += h (v + pseudo-velocity) for everything that is not fixed (E17); a disc has no use for its angle."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FIXED:
            continue
        for k in range(3):
            bodies.pose[i, k] += way(bodies, i, k, dt, pushed)
        if way(bodies, i, 2, dt, pushed) != 0.0 and bodies.kind[i, SHAPE] != DISC:
            bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])


@inner_kernel
def step(bodies: Bodies, pairs: Pairs, rows: Rows, problem: Problem, options: Options, tally: Array) -> bool:
    """One step; False, with bodies untouched, if an array is too small."""
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
        if not solve_at_once(bodies, rows, options, tally, int(pushed)):
            solve_velocities(bodies, rows, problem, options, tally, int(pushed))
        if options.certified:
            certify(bodies, rows, options, tally)
        if not pushes_along(options):
            pushed = correct_positions(bodies, rows, options, tally)
    move(bodies, options.dt, pushed)
    remember(bodies, rows)
    return True


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
