"""Run-long sums and maxima that kernels keep in one float64 array."""

from __future__ import annotations

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
#: Worst scaled natural map of an answer as it was used; measured after all solvers, as are the entries that follow.
NATURAL = 5
#: Worst scaled distance of (p, u) from complementarity on the friction cone (E60).
CONE = 6
#: Worst scaled negative normal impulse, and excess of friction over mu p_n.
PULL, EXCESS = 7, 8
#: Worst overlap at detection, as a share of the smaller half width.
PENETRATION = 9
#: Worst scaled defect of M (v+ - v*) = J^T p, of one body (E61).
MOMENTUM = 10
#: Worst scaled difference between the change of kinetic energy and the work of impulses (E62).
ENERGY = 11
#: Largest energy that a contact solve with, and without, positive targets created, as a share of all its work (E63).
CREATED, PUMPED = 12, 13
#: Contact solves that created energy under a positive target (restitution): Kane's paradox (E63).
KANE = 14
#: Work of contacts on relative motion, of moving surfaces on free bodies, of loads, all steps [J].
CONTACT_WORK, SURFACE_WORK, LOAD_WORK = 15, 16, 17
#: Contact solves that left a velocity that is no number.
NOT_FINITE = 18
#: Contact solves that were certified.
SOLVES = 19
#: Contact solves whose answer is the direct solver's (E44), and its factorisations.
DIRECT, FACTORISATIONS = 20, 21
#: Contact solves whose velocities are proven to be the only answer (E66).
UNIQUE = 22
#: Worst overlap at the start of the run, as a share of the smaller half width.
START_OVERLAP = 23
#: Contact solves opened, contacts or none: tells the solve of the start.
OPENED = 24
#: Coarsest last place of a body's coordinates, as a share of its smallest half width.
RESOLUTION = 25

SIZE = 26

#: Entries that add up over a run; of all others the largest counts.
SUMS = (
    SWEEPS,
    UNCONVERGED,
    KANE,
    CONTACT_WORK,
    SURFACE_WORK,
    LOAD_WORK,
    NOT_FINITE,
    SOLVES,
    DIRECT,
    FACTORISATIONS,
    UNIQUE,
)


def new_tally() -> Array:
    """Return a tally of zeros."""
    return np.zeros(SIZE)


def merge(run: Array, part: Array) -> None:
    """Enter the tally of a part of a run into that of the run, in place."""
    total = run + part
    np.maximum(run, part, out=run)
    run[list(SUMS)] = total[list(SUMS)]
