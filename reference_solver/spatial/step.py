"""The fixed step (`stepping.run` has the loop over steps).

detect -> prepare (samples u before forces) -> accelerate -> warm start -> solve -> move -> remember
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.spatial.certificate import certify, open_solve
from reference_solver.spatial.manifolds import detect, recall, remember, world_component
from reference_solver.spatial.motion import accelerate, displace, move
from reference_solver.spatial.position import begin_pushes, correct_positions
from reference_solver.spatial.prepare import prepare, warm_start
from reference_solver.spatial.state import Bodies, Detection, Manifolds, Memory
from reference_solver.spatial.sticking import prepare_wrenches
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.ledger import Buffer
from reference_solver.stepping.options import BLOCK, Options, pushes_along


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
        solve_velocities(bodies, manifolds, problem, options, tally, int(pushed))
        if options.certified:
            certify(bodies, manifolds, options, tally)
        if not pushes_along(options):
            pushed = correct_positions(bodies, manifolds, options, tally)
    move(bodies, options)
    if pushed:
        displace(bodies, options.dt)
    remember(bodies, detection, manifolds, memory)
    return True


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
