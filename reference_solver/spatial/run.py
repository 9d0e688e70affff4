"""The loop over located steps that a whole run is one call of, and its samples."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.direct.problem import Problem
from reference_solver.journal import close_step
from reference_solver.model import Array
from reference_solver.spatial.islands import step_world
from reference_solver.spatial.state import Bodies, Buffer, Detection, Ledger, Manifolds, Memory, SubStep, World
from reference_solver.spatial.step import sample_state
from reference_solver.stepping.options import Options


@kernel
def run_located(
    bodies: Bodies,
    detection: Detection,
    room: Manifolds,
    memory: Memory,
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
        if not step_world(bodies, detection, room, memory, problem, sub, ledger, options, tally, world):
            return k
        close_step(sub.journal)
        if sampled:
            sample_located(bodies, ledger, buffer, (k + 1) // stride - 1)
    return steps


@inner_kernel
def sample_located(bodies: Bodies, ledger: Ledger, buffer: Buffer, s: int) -> None:
    """Write the state, and the contacts where the buffer has room for any, as sample s."""
    sample_state(bodies, buffer, s)
    start = buffer.offset[s]
    buffer.offset[s + 1] = start
    if len(buffer.real) > 0:
        buffer.offset[s + 1] = start + copy_ledger(ledger, buffer, start)


@kernel
def copy_ledger(ledger: Ledger, buffer: Buffer, start: int) -> int:
    """Write the contacts of the last step from index ``start`` on; return how many."""
    for c in range(ledger.filled[0]):
        for d in range(3):
            buffer.names[start + c, d] = ledger.names[c, d]
        for d in range(10):
            buffer.real[start + c, d] = ledger.real[c, d]
    return ledger.filled[0]
