"""Position correction by split impulse: pseudo-velocities that move bodies apart and are then forgotten (E16)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.model import Array
from reference_solver.tally import PROJECTED
from reference_solver.textbook.options import BLOCK, SPLIT, Options, push_speed, pushes_along
from reference_solver.textbook2.block import sweep_block_pushes
from reference_solver.textbook2.columns import EXTENT, GAP, PUSH, PUSH_TARGET, TARGET, A, B
from reference_solver.textbook2.kinematics import normal_velocity
from reference_solver.textbook2.sequential_impulses import sweep_pushes
from reference_solver.textbook2.state import CONTACTS, Bodies, Rows

#: With a residual stop, sweeps end when no row misses its correction by more than this share of the largest.
#: Positions feed back into the next step's correction, so that four digits per step are plenty.
PUSH_TOLERANCE = 1e-4
#: Bound on these sweeps: a column of 20 needs some 300.
PUSH_SWEEPS = 1000


@spliced_kernel
def missing_push(bodies: Bodies, rows: Rows) -> float:
    """Largest shortfall of a pseudo-velocity [m/s]."""
    worst = 0.0
    for c in range(rows.counts[CONTACTS]):
        worst = max(worst, rows.real[c, PUSH_TARGET] - normal_velocity(bodies.pseudo, rows, c))
    return worst


@spliced_kernel
def begin_pushes(bodies: Bodies, rows: Rows, options: Options, tally: Array) -> float:
    """Set the pseudo-velocity each contact needs beyond its motion, and start at rest; the largest, 0 without any push.

    Solved along with the velocities it must be known before them: the motion is what the velocity rows ask for.
    """
    if options.correction != SPLIT:
        return 0.0
    largest, along = 0.0, pushes_along(options)
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PUSH] = 0.0
        extent = min(bodies.real[rows.integer[c, A], EXTENT], bodies.real[rows.integer[c, B], EXTENT])
        parting = rows.real[c, TARGET] if along else normal_velocity(bodies.twist, rows, c)
        rows.real[c, PUSH_TARGET] = push_speed(rows.real[c, GAP], parting, extent, options)
        largest = max(largest, rows.real[c, PUSH_TARGET])
    if largest > 0.0:
        bodies.pseudo[:] = 0.0
        tally[PROJECTED] = max(tally[PROJECTED], options.dt * largest)
    return largest


@inner_kernel
def correct_positions(bodies: Bodies, rows: Rows, options: Options, tally: Array) -> bool:
    """Solve for pseudo-velocities where anything overlaps too far; True if there are any."""
    largest = begin_pushes(bodies, rows, options, tally)
    if largest <= 0.0:
        return False
    sweeps = options.iterations if options.residual < 0.0 else PUSH_SWEEPS
    relaxation = options.relaxation if options.relaxation > 0.0 else 1.0
    for s in range(sweeps):
        if options.solver == BLOCK:
            sweep_block_pushes(bodies, rows, relaxation)
        else:
            sweep_pushes(bodies, rows, relaxation)
        if options.residual >= 0.0 and s % 4 == 3 and missing_push(bodies, rows) <= PUSH_TOLERANCE * largest:
            break
    return True
