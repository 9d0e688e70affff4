"""The loop over located steps that a whole run is one call of, and its samples."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.direct.problem import Problem
from reference_solver.journal import close_step
from reference_solver.model import Array
from reference_solver.planar.islands import step_world
from reference_solver.planar.kinematics import copy_vectors
from reference_solver.planar.ledger import copy_ledger
from reference_solver.planar.state import Bodies, Buffer, Ledger, Pairs, Rows, SubStep, World
from reference_solver.stepping.options import Options


@kernel
def run_located(
    bodies: Bodies,
    pairs: Pairs,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
    world: World,
    buffer: Buffer,
    first: int,
    steps: int,
    stride: int,
) -> int:
    """Like `run_steps` in step.py, for located steps."""
    for k in range(first, steps):
        sampled = stride > 0 and (k + 1) % stride == 0
        if sampled and len(buffer.real) > 0 and buffer.offset[k // stride] + len(ledger.real) > len(buffer.real):
            return k
        if not step_world(bodies, pairs, rows, problem, sub, ledger, options, tally, world):
            return k
        close_step(sub.journal)
        if sampled:
            sample_located(bodies, ledger, buffer, (k + 1) // stride - 1)
    return steps


@inner_kernel
def sample_located(bodies: Bodies, ledger: Ledger, buffer: Buffer, s: int) -> None:
    """Write the state, and the contacts where the buffer has room for any, as sample s."""
    copy_vectors(bodies.pose, buffer.pose[s])
    copy_vectors(bodies.twist, buffer.twist[s])
    start = buffer.offset[s]
    buffer.offset[s + 1] = start
    if len(buffer.real) > 0:
        buffer.offset[s + 1] = start + ledger.used[0]
        copy_ledger(ledger, buffer, start)
