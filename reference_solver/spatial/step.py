"""The step, and the loop over steps that a whole run is one call of.

    detect -> prepare (samples u before forces) -> accelerate -> warm start -> solve -> move -> remember
"""

from __future__ import annotations

from reference_solver.compilation import kernel
from reference_solver.model import Array
from reference_solver.planar.state import Buffer, Options
from reference_solver.spatial.iteration import solve_velocities
from reference_solver.spatial.manifolds import detect, remember, world_component
from reference_solver.spatial.motion import accelerate, displace, move
from reference_solver.spatial.position import correct_positions
from reference_solver.spatial.prepare import prepare, warm_start
from reference_solver.spatial.state import MANIFOLDS, POINTS, Bodies, Manifolds, Pairs


@kernel
def step(bodies: Bodies, pairs: Pairs, manifolds: Manifolds, options: Options, tally: Array) -> bool:
    """One step; False, with bodies untouched, if an array is too small."""
    if not detect(bodies, pairs, manifolds, options):
        return False
    touching = manifolds.count[MANIFOLDS] > 0
    if touching:
        prepare(bodies, pairs, manifolds, options)
    bodies.spin_before[:] = bodies.twist[:, 3:]
    accelerate(bodies, options)
    if touching:
        warm_start(bodies, manifolds, options)
        solve_velocities(bodies, manifolds, options, tally)
    # Pushes belong to the poses at which contacts were found, and so come before bodies move.
    pushed = touching and correct_positions(bodies, manifolds, options, tally)
    move(bodies, options)
    if pushed:
        displace(bodies, options.dt)
    remember(bodies, manifolds)
    return True


@kernel
def run_steps(
    bodies: Bodies,
    pairs: Pairs,
    manifolds: Manifolds,
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
        if sampled and buffer.gap.size > 0:
            if buffer.offset[k // stride] + POINTS * len(manifolds.body_a) > buffer.gap.size:
                return k
        if not step(bodies, pairs, manifolds, options, tally):
            return k
        if sampled:
            sample(bodies, manifolds, buffer, (k + 1) // stride - 1)
    return steps


@kernel
def sample(bodies: Bodies, manifolds: Manifolds, buffer: Buffer, s: int) -> None:
    """Write the state, and the contacts where the buffer has room for any, as sample s."""
    buffer.pose[s] = bodies.pose
    buffer.twist[s] = bodies.twist
    start = buffer.offset[s]
    buffer.offset[s + 1] = start
    if buffer.gap.size > 0:
        buffer.offset[s + 1] = start + copy_contacts(manifolds, buffer, start)


@kernel
def copy_contacts(manifolds: Manifolds, buffer: Buffer, start: int) -> int:
    """Write the contacts of the last step from index ``start`` on; return how many."""
    k = start
    for m in range(manifolds.count[MANIFOLDS]):
        for p in range(manifolds.points[m]):
            buffer.body_a[k], buffer.body_b[k] = manifolds.body_a[m], manifolds.body_b[m]
            buffer.feature[k] = manifolds.feature[m, p]
            buffer.gap[k] = manifolds.gap[m, p]
            for d in range(3):
                buffer.point[k, d] = manifolds.point[m, p, d]
                buffer.normal[k, d] = manifolds.frame[m, 2, d]
                buffer.impulse[k, d] = world_component(manifolds, m, p, d)
            k += 1
    return k - start
