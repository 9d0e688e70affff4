"""Run-long sums and maxima that kernels keep in one float64 array, and their public form."""

from __future__ import annotations

from typing import Any

import numpy as np

from reference_solver.model import Array

#: Worst scaled natural map of a step (E14).
RESIDUAL = 0
#: Velocity sweeps, all steps.
SWEEPS = 1
#: Velocity sweeps of the worst step.
WORST_SWEEPS = 2
#: Steps that did not reach the residual asked for.
UNCONVERGED = 3
#: Largest distance that position correction moved a contact apart in one step [m].
PROJECTED = 4

SIZE = 5


def new_tally() -> Array:
    """Return a tally of zeros."""
    return np.zeros(SIZE)


def summary(tally: Array) -> dict[str, Any]:
    """Return the tally under its public names (see ``Simulation.certificate``)."""
    return {
        "residual": float(tally[RESIDUAL]),
        "sweeps": int(tally[SWEEPS]),
        "worst_sweeps": int(tally[WORST_SWEEPS]),
        "converged": bool(tally[UNCONVERGED] == 0.0),
        "projected": float(tally[PROJECTED]),
    }
