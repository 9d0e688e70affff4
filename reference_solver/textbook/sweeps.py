"""When sweeps stop, over-relax or hand over to the direct solver (E13, E44); for both dimensions."""

from __future__ import annotations

import math

from reference_solver.compilation import spliced_kernel
from reference_solver.direct.problem import FACTORISATIONS as OF_STEP
from reference_solver.direct.problem import HELD, Problem
from reference_solver.model import Array
from reference_solver.tally import DIRECT, FACTORISATIONS, RESIDUAL, SWEEPS, WORST_SWEEPS
from reference_solver.textbook.options import Options

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


@spliced_kernel
def better_relaxation(relaxation: float, rate: float, limit: float = LARGEST_RELAXATION) -> float:
    """Factor that suits a contraction ``rate`` per sweep measured at ``relaxation`` (E13).

    From Young's relation (rate + w - 1)^2 = rate w^2 j^2 between the rate and j, the spectral radius of the
    Jacobi iteration, follows j and with it the best factor. At or past the best factor the rate is w - 1 and
    tells no more; a residual that grew tells nothing either.
    """
    if rate >= 1.0 or rate <= relaxation - 1.0:
        return relaxation
    jacobi = (rate + relaxation - 1.0) / (relaxation * math.sqrt(rate))
    best = 2.0 / (1.0 + math.sqrt(max(1.0 - jacobi * jacobi, 0.0)))
    return min(max(best, relaxation), limit)


@spliced_kernel
def sweeps_ahead(goal: float, residual: float, before: float) -> float:
    """Sweeps until the goal at the rate of the last `RATE_INTERVAL`; 0 if it is reached, infinite without progress."""
    if residual <= goal:
        return 0.0
    if residual >= before:
        return math.inf
    return RATE_INTERVAL * math.log(goal / residual) / math.log(residual / before)


@spliced_kernel
def enter_direct(problem: Problem, residual: float, options: Options, tally: Array) -> None:
    """Add a call of the direct solver to the tally, and whether it finished the step."""
    problem.size[HELD] = 1 if residual <= options.residual else 0
    tally[FACTORISATIONS] += problem.size[OF_STEP]
    tally[DIRECT] += 1.0 if residual <= options.residual else 0.0


@spliced_kernel
def enter(tally: Array, residual: float, sweeps: int) -> None:
    """Add one step to the tally of the run."""
    tally[RESIDUAL] = max(tally[RESIDUAL], residual)
    tally[SWEEPS] += sweeps
    tally[WORST_SWEEPS] = max(tally[WORST_SWEEPS], sweeps)
