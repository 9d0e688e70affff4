"""What the tally of a run says about its answers: named values, whether they hold, and why not (E60 to E63)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver import tally as entries
from reference_solver.model import Array


class Gate(NamedTuple):
    """Largest value of one quantity with which a run may serve as truth, and the reason when it is exceeded."""

    name: str
    entry: int
    limit: float
    meaning: str


#: Gates on dimensionless shares, each of its own contact's or body's scale.
GATES = (
    # A residual r leaves an error of condition times r: 0.4 n^2 r in a column of n, 4e-7 of the load at n = 100.
    Gate("natural", entries.NATURAL, 1e-10, "contact equations unsolved"),
    # The same law once more as a cone complementarity; the term mu |u_t| amplifies by 1 + mu, up to 10 allowed.
    Gate("cone", entries.CONE, 1e-9, "friction cone complementarity violated"),
    # Normal impulses are clamped at zero, which is exact.
    Gate("pull", entries.PULL, 0.0, "a contact pulls"),
    # Friction is clamped to mu p_n with at most four roundings; 1e-14 is ten of an impulse's tenth (E14).
    Gate("excess", entries.EXCESS, 1e-14, "friction exceeds mu p_n"),
    # Past the smallest half width the nearest surface may be that on the other side.
    Gate("penetration", entries.PENETRATION, 1.0, "overlap deeper than the smallest half width"),
    # What the start state says is not what a scene means: bodies do not share space. A millionth is a rounded input.
    Gate("start_overlap", entries.START_OVERLAP, 1e-6, "bodies overlap at the start"),
    # A hundred roundings of a coordinate have to stay within a millionth of the body.
    Gate("resolution", entries.RESOLUTION, 1e-8, "coordinates too large for the size of a body"),
    # Velocities gather round-off with every sweep, 1e5 of them at most: 2e-11 if none cancelled.
    Gate("momentum", entries.MOMENTUM, 2e-11, "momentum does not balance"),
    # Twice the defect of momentum: energy is the square of it, and is measured against energies.
    Gate("energy", entries.ENERGY, 4e-11, "kinetic energy does not balance"),
    # Without a positive target p . (u+ + u*) <= 0 holds for every solution; what is left is the residual's share.
    Gate("pumped", entries.PUMPED, 1e-10, "energy created without restitution"),
)


def summary(tally: Array) -> dict[str, Any]:
    """Return the tally under its public names (see ``Simulation.certificate``)."""
    values: dict[str, Any] = {
        "residual": float(tally[entries.RESIDUAL]),
        "sweeps": int(tally[entries.SWEEPS]),
        "worst_sweeps": int(tally[entries.WORST_SWEEPS]),
        "converged": bool(tally[entries.UNCONVERGED] == 0.0),
        "projected": float(tally[entries.PROJECTED]),
        "solves": int(tally[entries.SOLVES]),
        "unique": int(tally[entries.UNIQUE]),
        "direct": int(tally[entries.DIRECT]),
        "factorisations": int(tally[entries.FACTORISATIONS]),
    }
    values |= {gate.name: float(tally[gate.entry]) for gate in GATES}
    values |= {
        "created": float(tally[entries.CREATED]),
        "kane": int(tally[entries.KANE]),
        "contact_work": float(tally[entries.CONTACT_WORK]),
        "surface_work": float(tally[entries.SURFACE_WORK]),
        "load_work": float(tally[entries.LOAD_WORK]),
    }
    found = reasons(tally)
    return values | {"holds": not found, "reasons": found}


def columns(tallies: Sequence[Array]) -> dict[str, NDArray[Any]]:
    """Return the numbers of `summary`, and ``holds``, as one array (s,) each over s tallies."""
    rows = [summary(tally) for tally in tallies]
    return {name: np.array([row[name] for row in rows]) for name in rows[0] if name != "reasons"}


def reasons(tally: Array) -> tuple[str, ...]:
    """Return what keeps a run from serving as truth, one sentence each; empty if nothing does."""
    missed = [gate for gate in GATES if not tally[gate.entry] <= gate.limit]
    found = [f"{gate.meaning}: {gate.name} {tally[gate.entry]:.3g}, at most {gate.limit:.3g}" for gate in missed]
    if tally[entries.NOT_FINITE] > 0.0:
        found.append(f"velocities are no numbers after {int(tally[entries.NOT_FINITE])} contact solves")
    return tuple(found)
