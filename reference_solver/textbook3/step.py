"""The step and the loop over steps.

detect -> prepare (samples u before forces) -> accelerate -> warm start -> solve -> move -> remember
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.textbook.iteration import sweep_often, sweep_to_residual
from reference_solver.textbook.options import BLOCK, Options, pushes_along
from reference_solver.textbook.samples import Buffer, end_step, lacks_room
from reference_solver.textbook3.block import sweep_blocks
from reference_solver.textbook3.certificate import certify, open_solve
from reference_solver.textbook3.direct import mend_velocities, solve_directly
from reference_solver.textbook3.manifolds import detect, recall, remember, world_component
from reference_solver.textbook3.motion import accelerate, displace, move
from reference_solver.textbook3.position import begin_pushes, correct_positions
from reference_solver.textbook3.prepare import prepare, warm_start
from reference_solver.textbook3.residual import natural_map
from reference_solver.textbook3.sequential_impulses import sweep_points
from reference_solver.textbook3.state import MANIFOLDS, POINTS, Bodies, Manifolds, Space
from reference_solver.textbook3.sticking import prepare_wrenches


@inner_kernel
def sweep(bodies: Bodies, manifolds: Manifolds, options: Options, relaxation: float, backwards: int, push: int) -> None:
    """One sweep of the solver chosen; ``backwards``, ``push``: see `sweep_points`."""
    if options.solver == BLOCK:
        sweep_blocks(bodies, manifolds, options, relaxation)
    else:
        sweep_points(bodies, manifolds, options, relaxation, backwards, push)


@inner_kernel
def step(space: Space) -> bool:
    """One step; False, with bodies untouched, if an array is too small."""
    bodies, detection, memory, options, tally = space.bodies, space.detection, space.memory, space.options, space.tally
    found = detect(bodies, detection, space.room, options)
    if found < 0:
        return False
    manifolds = space.room[:found]
    recall(bodies, detection, manifolds, memory, options)
    prepare(bodies, detection, manifolds, options)
    accelerate(bodies, options.dt)
    if options.certified:
        open_solve(bodies, options.dt, tally)
    pushed = False
    if found > 0:
        # Pushes belong to the poses at which contacts were found, and so come before bodies move.
        if pushes_along(options):
            pushed = begin_pushes(bodies, manifolds, options, tally) > 0.0
        if options.solver == BLOCK:
            prepare_wrenches(bodies, manifolds, options)
        warm_start(bodies, manifolds, options)
        if options.residual >= 0.0:
            sweep_to_residual(
                bodies, manifolds, space.problem, options, tally, sweep, natural_map, solve_directly, mend_velocities
            )
        else:
            sweep_often(bodies, manifolds, options, tally, int(pushed), sweep, natural_map)
        if options.certified:
            certify(bodies, manifolds, options, tally)
        if not pushes_along(options):
            pushed = correct_positions(bodies, manifolds, options, tally)
    move(bodies, options)
    if pushed:
        displace(bodies, options.dt)
    remember(detection, manifolds, memory)
    return True


@kernel
def run(space: Space, buffer: Buffer, first: int, steps: int, stride: int) -> int:
    """Make steps ``first`` .. ``steps`` - 1; see `textbook2.step.run`."""
    for k in range(first, steps):
        if lacks_room(buffer, k, stride, POINTS * len(space.room)) or not step(space):
            return k
        s = end_step(space.bodies.pose, space.bodies.twist, buffer, k, stride)
        if s >= 0:
            manifolds = space.room[: space.detection.found[MANIFOLDS]]
            buffer.offset[s + 1] += copy_contacts(manifolds, buffer, buffer.offset[s])
    return steps


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
