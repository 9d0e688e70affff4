"""The step, and the loop over steps that a whole run is one call of.

detect -> prepare (samples u before forces) -> accelerate -> warm start -> solve -> move -> remember
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.direct.problem import Problem
from reference_solver.journal import close_step, keep_state
from reference_solver.model import Array
from reference_solver.spatial.certificate import certify, open_solve
from reference_solver.spatial.entries import enter_fixed_step
from reference_solver.spatial.manifolds import detect, recall, remember, world_component
from reference_solver.spatial.motion import accelerate, displace, move
from reference_solver.spatial.position import correct_positions
from reference_solver.spatial.prepare import prepare, warm_start
from reference_solver.spatial.state import MANIFOLDS, POINTS, Bodies, Buffer, Detection, Manifolds, Memory
from reference_solver.spatial.sticking import prepare_wrenches
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.options import Options
from reference_solver.stepping.vectors import copy_vectors


@inner_kernel
def step(
    bodies: Bodies,
    detection: Detection,
    room: Manifolds,
    memory: Memory,
    problem: Problem,
    options: Options,
    tally: Array,
) -> bool:
    """One step; False, with bodies untouched, if an array is too small."""
    found = detect(bodies, detection, room, options)
    if found < 0:
        return False
    manifolds = room[:found]
    recall(bodies, detection, manifolds, memory, options)
    prepare(bodies, detection, manifolds, options)
    accelerate(bodies, options.dt)
    open_solve(bodies, options.dt, tally)
    pushed = False
    if found > 0:
        prepare_wrenches(bodies, manifolds, options)
        warm_start(bodies, manifolds, options)
        solve_velocities(bodies, manifolds, problem, options, tally)
        certify(bodies, manifolds, options, tally)
        # Pushes belong to the poses at which contacts were found, and so come before bodies move.
        pushed = correct_positions(bodies, manifolds, options, tally)
    move(bodies, options)
    if pushed:
        displace(bodies, options.dt)
    remember(bodies, detection, manifolds, memory)
    return True


@kernel
def run_steps(
    bodies: Bodies,
    detection: Detection,
    room: Manifolds,
    memory: Memory,
    problem: Problem,
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
        if sampled and len(buffer.real) > 0 and buffer.offset[k // stride] + POINTS * len(room) > len(buffer.real):
            return k
        keep_state(buffer.journal, bodies.pose, bodies.twist)
        if not step(bodies, detection, room, memory, problem, options, tally):
            return k
        enter_fixed_step(buffer.journal, bodies, room[: detection.found[MANIFOLDS]], options)
        close_step(buffer.journal)
        if sampled:
            sample(bodies, room[: detection.found[MANIFOLDS]], buffer, (k + 1) // stride - 1)
    return steps


@inner_kernel
def sample(bodies: Bodies, manifolds: Manifolds, buffer: Buffer, s: int) -> None:
    """Write the state, and the contacts where the buffer has room for any, as sample s."""
    copy_vectors(bodies.pose, buffer.pose[s])
    copy_vectors(bodies.twist, buffer.twist[s])
    start = buffer.offset[s]
    buffer.offset[s + 1] = start
    if len(buffer.real) > 0:
        buffer.offset[s + 1] = start + copy_contacts(manifolds, buffer, start)


@kernel
def copy_contacts(manifolds: Manifolds, buffer: Buffer, start: int) -> int:
    """Write the contacts of the last step from index ``start`` on; return how many."""
    k = start
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            buffer.names[k, 0], buffer.names[k, 1] = manifolds.body_a[m], manifolds.body_b[m]
            buffer.names[k, 2] = manifolds.feature[m, p]
            for d in range(3):
                buffer.real[k, d] = manifolds.point[m, p, d]
                buffer.real[k, 3 + d] = manifolds.frame[m, 2, d]
                buffer.real[k, 6 + d] = world_component(manifolds, m, p, d)
            buffer.real[k, 9] = manifolds.gap[m, p]
            k += 1
    return k - start
