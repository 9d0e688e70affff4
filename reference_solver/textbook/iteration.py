"""Sweeping until done: a fixed number of sweeps, or a residual stop with over-relaxation estimated on the way.

Of both dimensions: ``rows`` are the rows of the plane or the manifolds of space. What a dimension does by itself is
handed over as functions: ``sweep``, ``natural_map``, ``solve_directly`` and ``mend_velocities`` of `textbook2` or
`textbook3`.
"""

from __future__ import annotations

from typing import Any

from reference_solver.compilation import spliced_kernel
from reference_solver.direct.problem import HELD, Problem
from reference_solver.model import Array
from reference_solver.tally import UNCONVERGED
from reference_solver.textbook.options import Options
from reference_solver.textbook.sweeps import (
    CHECK_INTERVAL,
    DIRECT_AFTER,
    DIRECT_BUDGET,
    DIRECT_KEEP,
    DIRECT_WORTH,
    LARGEST_RELAXATION,
    PATIENCE,
    RATE_INTERVAL,
    better_relaxation,
    enter,
    enter_direct,
    sweeps_ahead,
)


@spliced_kernel
def sweep_to_residual(
    bodies: Any,
    rows: Any,
    problem: Problem,
    options: Options,
    tally: Array,
    sweep: Any,
    natural_map: Any,
    solve_directly: Any,
    mend_velocities: Any,
) -> None:
    """Sweep until the residual is reached, with the factor given or estimated.

    Young's theory is linear; contacts that change between sticking, sliding and open may send large factors round
    in circles. When the residual has made no progress for a while, the factor and its bound go half way to 1.
    Sweeps that turn out slow hand over to the direct solver (E44), and go on from its answer if it does not finish.
    Velocities that went through its hands are mended before they count.
    """
    relaxation = options.relaxation if options.relaxation > 0.0 else 1.0
    limit = LARGEST_RELAXATION
    residual = natural_map(bodies, rows, options)
    handed = stale = False
    if options.direct and problem.size[HELD] and residual > DIRECT_KEEP * options.residual:
        residual = hand_over(bodies, rows, problem, options, tally, 1, natural_map, solve_directly)
        handed = True
    before = best = residual
    sweeps, best_at, asked, next_direct = 0, 0, 0, DIRECT_AFTER
    while sweeps < options.max_sweeps and (stale or residual > options.residual):
        if residual <= options.residual:
            mend_velocities(bodies, rows, options)
            residual, stale = natural_map(bodies, rows, options), False
            continue
        sweep(bodies, rows, options, relaxation, 0, 0)
        problem.size[HELD], stale = 0, handed
        sweeps += 1
        if sweeps > 2 and sweeps % CHECK_INTERVAL != 0:
            continue
        residual = natural_map(bodies, rows, options)
        if residual < best:
            best, best_at = residual, sweeps
        if options.direct and sweeps >= next_direct and sweeps % RATE_INTERVAL == 0:
            if sweeps_ahead(options.residual, residual, before) > DIRECT_WORTH:
                asked += 1
                residual = hand_over(bodies, rows, problem, options, tally, asked, natural_map, solve_directly)
                handed, stale = True, False
                before, best, best_at, next_direct = residual, residual, sweeps, 2 * sweeps
                continue
        if options.relaxation <= 0.0:
            if sweeps - best_at >= PATIENCE:
                limit = 1.0 + 0.5 * (relaxation - 1.0)
                relaxation, best, best_at = limit, residual, sweeps
            elif sweeps % RATE_INTERVAL == 0 and before > 0.0 and residual > 0.0:
                relaxation = better_relaxation(relaxation, (residual / before) ** (1.0 / RATE_INTERVAL), limit)
        if sweeps % RATE_INTERVAL == 0:
            before = residual
    if residual > options.residual:
        tally[UNCONVERGED] += 1.0
    enter(tally, residual, sweeps)


@spliced_kernel
def hand_over(
    bodies: Any,
    rows: Any,
    problem: Problem,
    options: Options,
    tally: Array,
    times: int,
    natural_map: Any,
    solve_directly: Any,
) -> float:
    """Let the direct solver improve the impulses; returns the residual (E14) measured on its answer.

    Asked again in the same step (`times`) it may do more, and every second time it starts from zero impulses: what the
    last start led to was no answer.
    """
    solve_directly(bodies, rows, options, problem, DIRECT_BUDGET * times, times % 2 == 0)
    residual = natural_map(bodies, rows, options)
    enter_direct(problem, residual, options, tally)
    return residual


@spliced_kernel
def sweep_often(
    bodies: Any, rows: Any, options: Options, tally: Array, push: int, sweep: Any, natural_map: Any
) -> None:
    """Make the sweeps that `Options` says; ``push``: with the rows of pushes (E16)."""
    relaxation = options.relaxation if options.relaxation > 0.0 else 1.0
    for k in range(options.iterations):
        sweep(bodies, rows, options, relaxation, int(2 * k >= options.iterations), push)
    enter(tally, natural_map(bodies, rows, options) if options.certified else 0.0, options.iterations)
