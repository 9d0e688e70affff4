"""Gates of contacts that turn: errors against the truths of `turning_scenes`, a minute of a board."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from reference_solver.model import Array
from reference_solver.settings import TOLERANCE, Settings
from reference_solver.simulation import Simulation
from tests.verification.gate import Gate
from tests.verification.space import GRAVITY, Space
from tests.verification.turning_scenes import CASES, PLANE, board_on_log, case

#: Tolerances that cases are run to. Each takes some ten steps, which may err by the tolerance of the motion in them,
#: of a metre or a radian: so many tolerances an error may be.
TOLERANCES, STEPS = (1e-5, 1e-7, 1e-9, TOLERANCE), 10.0
#: Length of the long run of the board [s], and what its energy and amplitude may be off, as shares of their own.
LONG, KEPT = 60.0, 1e-8


def errors(space: Space, name: str) -> Iterator[Gate]:
    """Yield the error of one case to each tolerance, over the tolerance: it falls as that does."""
    for tolerance in TOLERANCES:
        off = case(space, name).error(tolerance) / tolerance
        yield Gate.at_most("turning contact: error, of the tolerance", f"{name}, {tolerance:g}", off, STEPS, space.name)


def long_board() -> Iterator[Gate]:
    """Yield what a minute of rocking changes of the energy of the board, and of its amplitude."""
    board = board_on_log(PLANE, time=0.0)
    simulation = Simulation(board.model(), Settings.reference(1.0 / 240.0))
    record = simulation.record(round(240.0 * LONG), 1)
    body, pose, twist = board.bodies[1], record.pose[:, 1], record.twist[:, 1]
    mass, inertia = float(body.mass), float(np.ravel(np.asarray(body.inertia))[0])
    kinetic = 0.5 * mass * (twist[:, :2] ** 2).sum(axis=1) + 0.5 * inertia * twist[:, 2] ** 2
    energy = kinetic + mass * GRAVITY * (pose[:, 1] - pose[0, 1])
    off = float(np.abs(energy - energy[0]).max() / kinetic[0])
    yield Gate.at_most("board on a log: energy lost or gained in 60 s", "share, 1/240", off, KEPT, "planar")
    # Turning points lie between samples: a polynomial of sixth degree through seven of them is off by 1e-12.
    swings = _peaks(pose[:, 2])
    lost = abs(swings[-1] / swings[0] - 1.0)
    yield Gate.at_most("board on a log: amplitude after 60 s", "share, 1/240", lost, KEPT, "planar")


def _peaks(angle: Array) -> Array:
    """Heights of all maxima, each from the polynomial through seven samples around it."""
    middle = np.flatnonzero((angle[2:-3] > angle[1:-4]) & (angle[2:-3] >= angle[3:-2])) + 2
    middle = middle[angle[middle] > 0.0]
    found = []
    for k in middle:
        t = np.arange(-3.0, 4.0)
        if k < 3 or k + 4 > len(angle):
            continue
        polynomial = np.polynomial.Polynomial.fit(t, angle[k - 3 : k + 4], 6)
        turning = polynomial.deriv().roots()
        inside = turning[(np.abs(turning.imag) < 1e-12) & (np.abs(turning.real) <= 1.0)].real
        found.append(max(float(polynomial(x)) for x in inside))
    return np.array(found)


def rows(space: Space) -> Iterator[Gate]:
    """Yield errors of all cases in one dimension."""
    for name in CASES[space.dimension]:
        yield from errors(space, name)


def gates() -> Iterator[Gate]:
    """Yield all rows of the plane; those of space are `turning_in_space`."""
    yield from rows(PLANE)
    yield from long_board()
