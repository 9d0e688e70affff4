"""Position correction by split impulse: pseudo-velocities that move bodies apart and are then forgotten (E16)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar.position import PUSH_SWEEPS, PUSH_TOLERANCE
from reference_solver.planar.rows import ROUND_OFF
from reference_solver.planar.state import SPLIT, Options
from reference_solver.spatial.kinematics import relative_twist, velocity_at
from reference_solver.spatial.sequential_impulses import sweep_pushes
from reference_solver.spatial.state import Bodies, Manifolds
from reference_solver.tally import PROJECTED


@inner_kernel
def set_push_targets(bodies: Bodies, manifolds: Manifolds, options: Options) -> float:
    """Pseudo-velocity each contact needs beyond the motion it already has; returns the largest."""
    largest = 0.0
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
        for p in range(manifolds.points[m]):
            manifolds.push[m, p] = 0.0
            # A contact that parts by itself (a rebound) is not pushed as well: that would add energy to a bounce.
            parting = max(velocity_at(v, w, manifolds, m, p)[2], 0.0)
            excess = -(manifolds.gap[m, p] + options.dt * parting) - options.slop
            if abs(excess) <= ROUND_OFF * extent:
                excess = 0.0
            # Within what is allowed a contact may close, but not farther (negative target).
            manifolds.push_target[m, p] = (options.beta if excess > 0.0 else 1.0) * excess / options.dt
            largest = max(largest, manifolds.push_target[m, p])
    return largest


@inner_kernel
def missing_push(bodies: Bodies, manifolds: Manifolds, options: Options) -> float:
    """Largest shortfall of a pseudo-velocity [m/s]."""
    worst = 0.0
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.pseudo, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            worst = max(worst, manifolds.push_target[m, p] - velocity_at(v, w, manifolds, m, p)[2])
    return worst


@inner_kernel
def correct_positions(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array) -> bool:
    """Solve for pseudo-velocities where anything overlaps too far; True if there are any."""
    if options.correction != SPLIT:
        return False
    largest = set_push_targets(bodies, manifolds, options)
    if largest <= 0.0:
        return False
    for i in range(len(bodies)):
        for d in range(6):
            bodies.pseudo[i, d] = 0.0
    relaxation = options.relaxation if options.relaxation > 0.0 else 1.0
    for s in range(options.iterations if options.residual < 0.0 else PUSH_SWEEPS):
        sweep_pushes(bodies, manifolds, options, relaxation)
        if options.residual >= 0.0 and s % 4 == 3:
            if missing_push(bodies, manifolds, options) <= PUSH_TOLERANCE * largest:
                break
    tally[PROJECTED] = max(tally[PROJECTED], options.dt * largest)
    return True
