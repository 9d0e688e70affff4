"""Position correction by split impulse: pseudo-velocities that move bodies apart and are then forgotten (E16)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.tally import PROJECTED
from reference_solver.textbook.options import SPLIT, Options, push_speed, pushes_along
from reference_solver.textbook3.kinematics import relative_twist, velocity_at
from reference_solver.textbook3.sequential_impulses import sweep_pushes
from reference_solver.textbook3.state import Bodies, Manifolds

#: With a residual stop, sweeps end when no row misses its law by more than this share of the largest target. Tighter
#: than in the plane: what sweeps leave between the points of a face tilts a body that should stay upright.
PUSH_TOLERANCE = 1e-11
#: Bound on these sweeps: a column of 20 needs some 1000 for four digits, and gets the rest in the steps that follow.
PUSH_SWEEPS = 1000


@inner_kernel
def push_residual(bodies: Bodies, manifolds: Manifolds, options: Options) -> float:
    """Largest natural-map residual of the pseudo-velocity rows, as a velocity [m/s]."""
    worst = 0.0
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.pseudo, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            excess = velocity_at(v, w, manifolds, m, p)[2] - manifolds.push_target[m, p]
            worst = max(worst, abs(min(excess, manifolds.push[m, p] * manifolds.matrix[m, p, 5])))
    return worst


@inner_kernel
def begin_pushes(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array) -> float:
    """Set the pseudo-velocity each contact needs beyond its motion, and start at rest; the largest, 0 without any push.

    Solved along with the velocities it must be known before them: the motion is what the velocity rows ask for.
    """
    if options.correction != SPLIT:
        return 0.0
    largest, along = 0.0, pushes_along(options)
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
        for p in range(manifolds.points[m]):
            manifolds.push[m, p] = 0.0
            parting = manifolds.target[m, p] if along else velocity_at(v, w, manifolds, m, p)[2]
            manifolds.push_target[m, p] = push_speed(manifolds.gap[m, p], parting, extent, options)
            largest = max(largest, manifolds.push_target[m, p])
    if largest > 0.0:
        bodies.pseudo[:] = 0.0
        tally[PROJECTED] = max(tally[PROJECTED], options.dt * largest)
    return largest


@inner_kernel
def correct_positions(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array) -> bool:
    """Solve for pseudo-velocities where anything overlaps too far; True if there are any."""
    largest = begin_pushes(bodies, manifolds, options, tally)
    if largest <= 0.0:
        return False
    relaxation = options.relaxation if options.relaxation > 0.0 else 1.0
    for s in range(options.iterations if options.residual < 0.0 else PUSH_SWEEPS):
        sweep_pushes(bodies, manifolds, options, relaxation)
        if options.residual >= 0.0 and s % 4 == 3:
            if push_residual(bodies, manifolds, options) <= PUSH_TOLERANCE * largest:
                break
    return True
