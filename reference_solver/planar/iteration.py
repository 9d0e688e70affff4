"""Sweeping until done: a fixed number of sweeps, or a residual stop with over-relaxation estimated on the way."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import FACTORISATIONS as OF_STEP
from reference_solver.direct.problem import HELD, Problem
from reference_solver.model import Array
from reference_solver.planar.block import sweep_blocks
from reference_solver.planar.direct import mend_velocities, solve_directly
from reference_solver.planar.residual import natural_map
from reference_solver.planar.sequential_impulses import sweep_rows
from reference_solver.planar.state import BLOCK, Bodies, Options, Rows
from reference_solver.tally import DIRECT, FACTORISATIONS, RESIDUAL, SWEEPS, UNCONVERGED, WORST_SWEEPS

#: Sweeps between two looks at the residual, once the first ones have not been enough.
CHECK_INTERVAL = 4
#: Sweeps over which a contraction rate is measured: long enough for the slowest mode to dominate.
RATE_INTERVAL = 16
#: Sweeps without a new smallest residual after which the factor is taken back.
PATIENCE = 64
#: Bound of the estimated factor; at 2 projected over-relaxation stops converging.
LARGEST_RELAXATION = 1.99
#: Sweeps before the direct solver may be asked: fewer have not shown a rate yet, and find most of the contacts that
#: open or slide. Where it does not finish, it is asked again after twice as many.
DIRECT_AFTER = 32
#: It is asked if the measured rate predicts more sweeps than this: what its usual 5 to 10 factorisations cost (6 sweeps
#: each in a column, 20 in a pyramid of 465 boxes).
DIRECT_WORTH = 100.0
#: Factorisations it may make before sweeps go on, times the number of times it was asked in the step.
DIRECT_BUDGET = 100
#: After a step of its own it is asked before any sweep, and already at this part of the residual allowed: what needed
#: it once is ill-conditioned, and leftovers of many steps add up.
DIRECT_KEEP = 0.02


@inner_kernel
def sweep(bodies: Bodies, rows: Rows, options: Options, relaxation: float) -> None:
    """One sweep of the solver chosen."""
    if options.solver == BLOCK:
        sweep_blocks(bodies, rows, options, relaxation)
    else:
        sweep_rows(bodies, rows, options, relaxation)


@inner_kernel
def better_relaxation(relaxation: float, rate: float, limit: float = LARGEST_RELAXATION) -> float:
    """Factor that suits a contraction ``rate`` per sweep measured at ``relaxation`` (E13).

    From Young's relation (rate + w - 1)^2 = rate w^2 mu^2 between the rate and mu, the spectral radius of the
    Jacobi iteration, follows mu and with it the best factor. At or past the best factor the rate is w - 1 and
    tells no more; a residual that grew tells nothing either.
    """
    if rate >= 1.0 or rate <= relaxation - 1.0:
        return relaxation
    jacobi = (rate + relaxation - 1.0) / (relaxation * math.sqrt(rate))
    best = 2.0 / (1.0 + math.sqrt(max(1.0 - jacobi * jacobi, 0.0)))
    return min(max(best, relaxation), limit)


@inner_kernel
def sweep_to_residual(bodies: Bodies, rows: Rows, problem: Problem, options: Options, tally: Array) -> None:
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
        residual = hand_over(bodies, rows, problem, options, tally, 1)
        handed = True
    before = best = residual
    sweeps, best_at, asked, next_direct = 0, 0, 0, DIRECT_AFTER
    while sweeps < options.max_sweeps and (stale or residual > options.residual):
        if residual <= options.residual:
            mend_velocities(bodies, rows, options)
            residual, stale = natural_map(bodies, rows, options), False
            continue
        sweep(bodies, rows, options, relaxation)
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
                residual = hand_over(bodies, rows, problem, options, tally, asked)
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


@inner_kernel
def sweeps_ahead(goal: float, residual: float, before: float) -> float:
    """Sweeps until the goal at the rate of the last `RATE_INTERVAL`; 0 if it is reached, infinite without progress."""
    if residual <= goal:
        return 0.0
    if residual >= before:
        return math.inf
    return RATE_INTERVAL * math.log(goal / residual) / math.log(residual / before)


@inner_kernel
def hand_over(bodies: Bodies, rows: Rows, problem: Problem, options: Options, tally: Array, times: int) -> float:
    """Let the direct solver improve the impulses; returns the residual (E14) measured on its answer.

    Asked again in the same step (`times`) it may do more, and every second time it starts from zero impulses: what the
    last start led to was no answer.
    """
    solve_directly(bodies, rows, options, problem, DIRECT_BUDGET * times, times % 2 == 0)
    residual = natural_map(bodies, rows, options)
    enter_direct(problem, residual, options, tally)
    return residual


@inner_kernel
def enter_direct(problem: Problem, residual: float, options: Options, tally: Array) -> None:
    """Add a call of the direct solver to the tally, and whether it finished the step."""
    problem.size[HELD] = 1 if residual <= options.residual else 0
    tally[FACTORISATIONS] += problem.size[OF_STEP]
    tally[DIRECT] += 1.0 if residual <= options.residual else 0.0


@inner_kernel
def enter(tally: Array, residual: float, sweeps: int) -> None:
    """Add one step to the tally of the run."""
    tally[RESIDUAL] = max(tally[RESIDUAL], residual)
    tally[SWEEPS] += sweeps
    tally[WORST_SWEEPS] = max(tally[WORST_SWEEPS], sweeps)


@inner_kernel
def solve_velocities(bodies: Bodies, rows: Rows, problem: Problem, options: Options, tally: Array) -> None:
    """Sweep as `Options` asks and enter residual and sweeps in the tally."""
    if options.residual >= 0.0:
        sweep_to_residual(bodies, rows, problem, options, tally)
        return
    relaxation = options.relaxation if options.relaxation > 0.0 else 1.0
    for _ in range(options.iterations):
        sweep(bodies, rows, options, relaxation)
    enter(tally, natural_map(bodies, rows, options), options.iterations)
