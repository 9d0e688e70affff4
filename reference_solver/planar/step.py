"""The step, and the loop over steps that a whole run is one call of.

    detect -> prepare (samples u before forces) -> accelerate -> warm start -> solve -> move -> remember
"""

from __future__ import annotations

import math

from reference_solver.compilation import kernel
from reference_solver.model import Array
from reference_solver.planar.block import prepare_blocks
from reference_solver.planar.iteration import solve_velocities
from reference_solver.planar.manifolds import detect, remember
from reference_solver.planar.position import correct_positions
from reference_solver.planar.rows import prepare, warm_start
from reference_solver.planar.state import BLOCK, CONTACTS, FIXED, FREE, Bodies, Buffer, Options, Pairs, Rows


@kernel
def accelerate(bodies: Bodies, options: Options) -> None:
    """v* = v + h M^-1 f (E5)."""
    for i in range(len(bodies.motion)):
        if bodies.motion[i] == FREE:
            for k in range(3):
                bodies.twist[i, k] += options.dt * bodies.acceleration[i, k]


@kernel
def move(bodies: Bodies, twist: Array, dt: float) -> None:
    """x += h v for everything that is not fixed (E17)."""
    for i in range(len(bodies.motion)):
        if bodies.motion[i] != FIXED:
            for k in range(3):
                bodies.pose[i, k] += dt * twist[i, k]
            if twist[i, 2] != 0.0:
                bodies.turn[i, 0] = math.cos(bodies.pose[i, 2])
                bodies.turn[i, 1] = math.sin(bodies.pose[i, 2])


@kernel
def step(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options, tally: Array) -> bool:
    """One step; False, with bodies untouched, if an array is too small."""
    if not detect(bodies, pairs, rows, options):
        return False
    if rows.count[CONTACTS] > 0:
        prepare(bodies, pairs, rows, options)
        if options.solver == BLOCK:
            prepare_blocks(bodies, rows)
    accelerate(bodies, options)
    if rows.count[CONTACTS] > 0:
        warm_start(bodies, rows, options)
        solve_velocities(bodies, rows, options, tally)
    move(bodies, bodies.twist, options.dt)
    if rows.count[CONTACTS] > 0 and correct_positions(bodies, rows, options, tally):
        move(bodies, bodies.pseudo, options.dt)
    remember(bodies, rows)
    return True


@kernel
def run_steps(
    bodies: Bodies,
    pairs: Pairs,
    rows: Rows,
    options: Options,
    tally: Array,
    buffer: Buffer,
    first: int,
    steps: int,
    stride: int,
) -> int:
    """Make steps ``first`` .. ``steps`` - 1, sampling after every ``stride`` of them (0: never).

    Returns the number of steps done: fewer than ``steps`` when an array must grow, or when the contact buffer
    could not take a full sample more. The caller grows it and calls again.
    """
    for k in range(first, steps):
        sampled = stride > 0 and (k + 1) % stride == 0
        if sampled and buffer.gap.size > 0 and buffer.offset[k // stride] + len(rows.gap) > buffer.gap.size:
            return k
        if not step(bodies, pairs, rows, options, tally):
            return k
        if sampled:
            sample(bodies, rows, buffer, (k + 1) // stride - 1)
    return steps


@kernel
def sample(bodies: Bodies, rows: Rows, buffer: Buffer, s: int) -> None:
    """Write the state, and the contacts where the buffer has room for any, as sample s."""
    buffer.pose[s] = bodies.pose
    buffer.twist[s] = bodies.twist
    start = buffer.offset[s]
    buffer.offset[s + 1] = start
    if buffer.gap.size > 0:
        copy_contacts(bodies, rows, buffer, start)
        buffer.offset[s + 1] = start + rows.count[CONTACTS]


@kernel
def copy_contacts(bodies: Bodies, rows: Rows, buffer: Buffer, start: int) -> None:
    """Contacts of the last step from index ``start`` on; points relative to where A was at detection."""
    for c in range(rows.count[CONTACTS]):
        k = start + c
        nx, ny = rows.normal[c, 0], rows.normal[c, 1]
        buffer.body_a[k], buffer.body_b[k], buffer.feature[k] = rows.body_a[c], rows.body_b[c], rows.feature[c]
        buffer.point[k] = rows.point[c]
        buffer.normal[k] = rows.normal[c]
        buffer.impulse[k, 0] = rows.impulse[c, 0] * nx - rows.impulse[c, 1] * ny
        buffer.impulse[k, 1] = rows.impulse[c, 0] * ny + rows.impulse[c, 1] * nx
        buffer.gap[k] = rows.gap[c]
