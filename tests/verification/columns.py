"""Gates of piles: what each interface carries, what a pile drifts, and how fast plain sweeps converge."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from reference_solver.model import Array, Body
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation
from tests.verification.gate import Gate
from tests.verification.space import GRAVITY, SPACES, Space, made_by

DT = 1 / 240


def gates() -> Iterator[Gate]:
    """Yield every row of piles."""
    for space in SPACES:
        yield from convergence(space)
        # Forces that corners share cost the cube of their number, which is twice as large in space.
        for n, steps in ((10, 100_000), (50, 1000), ({2: 200, 3: 100}[space.dimension], 1000)):
            yield from column(space, n, steps)
        for ratio, gate in ((1e2, 1e-12), (1e4, 1e-10), (1e6, 1e-8)):
            yield from heavy_on_light(space, ratio, gate)
            yield from alternating(space, ratio, gate)
        yield from pyramid(space)


def interface_impulses(simulation: Simulation, space: Space, count: int) -> Array:
    """Upward impulse that each body of a column gets from the one below it in the last step [N s]."""
    contacts = simulation.contacts()
    carried = np.zeros(count)
    np.add.at(carried, contacts.body_b - 1, contacts.impulse[:, space.up])
    return carried


def load_error(simulation: Simulation, space: Space, masses: Sequence[float]) -> float:
    """Largest relative error of the impulses between the bodies of a column."""
    above = np.cumsum(np.array(masses)[::-1])[::-1]
    weights = above * GRAVITY * simulation.settings.dt
    return float(np.abs(interface_impulses(simulation, space, len(masses)) / weights - 1.0).max())


def column(space: Space, n: int, steps: int) -> Iterator[Gate]:
    """Unit boxes on each other: impulses in the first step, solved from nothing, and the drift of the standing pile."""
    bodies = space.column([1.0] * n)
    simulation = space.simulation(bodies, Settings.reference(DT), GRAVITY, 0.0, 0.5)
    start = simulation.pose
    simulation.advance(1)
    name = made_by(space, "reference")
    error = load_error(simulation, space, [1.0] * n)
    yield Gate.at_most("column: impulses, relative", f"n = {n}, first step", error, 1e-10, name)
    simulation.advance(steps - 1)
    drift = np.abs(simulation.pose - start)[:, : space.dimension].max()
    yield Gate.at_most("column: drift [m]", f"n = {n}, {steps} steps", drift, 1e-12, name)


def heavy_on_light(space: Space, ratio: float, gate: float) -> Iterator[Gate]:
    """Impulses under a heavy body on a light one, worst of the steps of a second."""
    for case, shape in (("ball on ball", "ball"), ("box on box", "box")):
        yield loads(space, f"{case}, {ratio:g}", [1.0, ratio], shape, gate)


def alternating(space: Space, ratio: float, gate: float) -> Iterator[Gate]:
    """Impulses in a pile of light, heavy, light and heavy boxes, worst of the steps of a second."""
    yield loads(space, f"boxes, alternating, {ratio:g}", [1.0, ratio, 1.0, ratio], "box", gate)


def loads(space: Space, case: str, masses: Sequence[float], shape: str, gate: float, steps: int = 240) -> Gate:
    """Return the row of one pile: largest relative error of an impulse in any step, the first from nothing."""
    simulation = space.simulation(space.column(masses, shape), Settings.reference(DT), GRAVITY, 0.0, 0.5)
    worst = 0.0
    for _ in range(steps):
        simulation.advance(1)
        worst = max(worst, load_error(simulation, space, masses))
    return Gate.at_most("heavy on light: impulses, relative", case, worst, gate, made_by(space, "reference"))


def pyramid_of(space: Space, rows: int) -> list[Body]:
    """Return a floor and unit boxes in rows of rows .. 1, a tenth of a box apart."""
    bodies = [space.floor()]
    for level in range(rows):
        count = rows - level
        bodies += [space.box(1.1 * (i - 0.5 * (count - 1)), 0.5 + level) for i in range(count)]
    return bodies


def pyramid(space: Space, rows: int = 30, steps: int = 10) -> Iterator[Gate]:
    """Worst natural map (E14) of consecutive steps of a pyramid whose first step knows nothing."""
    simulation = space.simulation(pyramid_of(space, rows), Settings.fixed_step(DT), GRAVITY, 0.0, 0.5)
    simulation.advance(steps)
    residual = simulation.certificate["residual"]
    yield Gate.at_most(
        "pyramid: natural map", f"{rows} rows, {steps} steps", residual, 1e-10, made_by(space, "fixed_step")
    )


def convergence(space: Space) -> Iterator[Gate]:
    """1 - rho of the scalar sweeps over 1 - cos^2(pi / 2n), on a column of balls without friction (E13).

    The error of a cold first step after enough sweeps for the slowest mode to be alone (the second decays by
    cos^2(3 pi / 2n): after 2 n^2 sweeps it is e^-39 behind), and after n more.
    """
    worst = 0.0
    for n in range(2, 65):
        first, second = (sweep_error(space, n, sweeps) for sweeps in (2 * n * n, 2 * n * n + n))
        rate = (second / first) ** (1.0 / n)
        worst = max(worst, abs((1.0 - rate) / math.sin(math.pi / (2 * n)) ** 2 - 1.0))
    yield Gate.at_most(
        "column: 1 - rho, relative", "balls, mu = 0, n = 2..64", worst, 0.01, made_by(space, "classical")
    )


def sweep_error(space: Space, n: int, sweeps: int) -> float:
    """Largest error of the impulses in a column of balls after that many sweeps of a first step [N s]."""
    settings = dataclasses.replace(Settings.classical(DT, sweeps), warm_starting=False)
    simulation = space.simulation(space.column([1.0] * n, "ball"), settings, GRAVITY)
    simulation.advance(1)
    weights = GRAVITY * DT * np.arange(n, 0, -1)
    return float(np.abs(interface_impulses(simulation, space, n) - weights).max())
