"""Sweeping until done: a fixed number of sweeps, or a residual stop with over-relaxation estimated on the way."""

from __future__ import annotations

from reference_solver.compilation import kernel
from reference_solver.model import Array
from reference_solver.planar.iteration import CHECK_INTERVAL, RATE_INTERVAL, better_relaxation
from reference_solver.planar.state import BLOCK, Options
from reference_solver.spatial.block import sweep_blocks
from reference_solver.spatial.residual import natural_map
from reference_solver.spatial.sequential_impulses import sweep_points
from reference_solver.spatial.state import Bodies, Manifolds
from reference_solver.tally import RESIDUAL, SWEEPS, UNCONVERGED, WORST_SWEEPS


@kernel
def sweep(bodies: Bodies, manifolds: Manifolds, options: Options, relaxation: float) -> None:
    """One sweep of the solver chosen."""
    if options.solver == BLOCK:
        sweep_blocks(bodies, manifolds, options, relaxation)
    else:
        sweep_points(bodies, manifolds, options, relaxation)


@kernel
def solve_velocities(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array) -> None:
    """Sweep as `Options` asks and enter residual and sweeps in the tally."""
    relaxation = options.relaxation if options.relaxation > 0.0 else 1.0
    sweeps, residual, before = 0, 0.0, 0.0
    if options.residual < 0.0:
        for _ in range(options.iterations):
            sweep(bodies, manifolds, options, relaxation)
        sweeps, residual = options.iterations, natural_map(bodies, manifolds, options)
    else:
        residual = before = natural_map(bodies, manifolds, options)
        while residual > options.residual and sweeps < options.max_sweeps:
            sweep(bodies, manifolds, options, relaxation)
            sweeps += 1
            if sweeps > 2 and sweeps % CHECK_INTERVAL != 0:
                continue
            residual = natural_map(bodies, manifolds, options)
            if sweeps % RATE_INTERVAL == 0:
                if options.relaxation <= 0.0 and before > 0.0 and residual > 0.0:
                    relaxation = better_relaxation(relaxation, (residual / before) ** (1.0 / RATE_INTERVAL))
                before = residual
        if residual > options.residual:
            tally[UNCONVERGED] += 1.0
    tally[RESIDUAL] = max(tally[RESIDUAL], residual)
    tally[SWEEPS] += sweeps
    tally[WORST_SWEEPS] = max(tally[WORST_SWEEPS], sweeps)
