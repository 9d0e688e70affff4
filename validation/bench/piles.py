"""Cost of steps that are cut at events over that of fixed steps, in piles, over the number of bodies.

A pile falls with the exact profile. At some instants both profiles start from its state, in random order, and `STEPS`
steps of each are timed. A state is pose and twist, so both start from the same.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reference_solver.model import Model
from reference_solver.piles import RATE, planar_pile, spatial_pile
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation
from validation.bench.statistics import Fit, Spread, power_law, spread

#: Kind of pile -> dimension, and share of round bodies.
KINDS = {"discs": (2, 1.0), "boxes": (2, 0.0), "spheres": (3, 1.0), "spatial boxes": (3, 0.0)}
#: Smallest number of bodies, which is then doubled; seeds of the piles; instants of the timings [s]: bodies fall onto
#: each other, settle, lie still.
LEAST, SEEDS, INSTANTS = 20, (1, 2), (0.4, 0.8, 1.2)
#: Steps in one lap.
STEPS = 12
#: CPU time after which a kind gets no larger piles [s]; the cost so far shows what they would cost.
PATIENCE = 120.0


@dataclass(frozen=True)
class Lap:
    """CPU time per step of both profiles from one state [s]."""

    kind: str
    bodies: int
    reference: float
    fixed_step: float

    @property
    def ratio(self) -> float:
        """Cost of a step that is cut at events over that of a fixed step."""
        return self.reference / self.fixed_step


@dataclass(frozen=True)
class Row:
    """Costs of a step [s] and their ratio for one kind and size, each with its interval."""

    kind: str
    bodies: int
    reference: Spread
    fixed_step: Spread
    ratio: Spread


def laps(kind: str, most: int, seed: int = 0, patience: float = PATIENCE) -> Iterator[Lap]:
    """Yield laps of one kind with 20 bodies, 40 and so on up to ``most``, or until ``patience`` [s] is used up."""
    dimension, share = KINDS[kind]
    pile = planar_pile if dimension == 2 else spatial_pile
    random = np.random.default_rng(seed)
    _warm(pile(SEEDS[0], LEAST, share))
    bodies, begun = LEAST, time.process_time()
    while bodies <= most and time.process_time() - begun < patience:
        for each in SEEDS:
            model = pile(each, bodies, share)
            falling = Simulation(model, Settings.reference(1.0 / RATE))
            done = 0
            for instant in INSTANTS:
                falling.advance(round(instant * RATE) - done)
                done = round(instant * RATE)
                yield _lap(kind, bodies, model, falling, random)
        bodies *= 2


def _warm(model: Model) -> None:
    for settings in (Settings.reference(1.0 / RATE), Settings.fixed_step(1.0 / RATE)):
        Simulation(model, settings).advance(2)


def _lap(kind: str, bodies: int, model: Model, falling: Simulation, random: np.random.Generator) -> Lap:
    state = zip(model.bodies, falling.pose, falling.twist, strict=True)
    here = replace(model, bodies=[replace(b, pose=tuple(p), twist=tuple(t)) for b, p, t in state])
    profiles = [Settings.reference(1.0 / RATE), Settings.fixed_step(1.0 / RATE)]
    seconds = [0.0, 0.0]
    for k in random.permutation(2).tolist():
        simulation = Simulation(here, profiles[k])
        gc.collect()
        start = time.process_time()
        simulation.advance(STEPS)
        seconds[k] = (time.process_time() - start) / STEPS
    return Lap(kind, bodies, *seconds)


def rows(found: Sequence[Lap]) -> list[Row]:
    """Summarize laps by kind and size."""
    keys = list(dict.fromkeys((lap.kind, lap.bodies) for lap in found))
    summary = []
    for key in keys:
        those = [lap for lap in found if (lap.kind, lap.bodies) == key]
        columns = ([lap.reference for lap in those], [lap.fixed_step for lap in those], [lap.ratio for lap in those])
        summary.append(Row(*key, *(spread(column) for column in columns)))
    return summary


def exponents(found: Sequence[Row]) -> dict[str, tuple[Fit | None, Fit | None]]:
    """Exponents of cost over bodies for each kind: of steps cut at events, and of fixed steps."""
    fits = {}
    for kind in dict.fromkeys(row.kind for row in found):
        those = [row for row in found if row.kind == kind]
        sizes = [row.bodies for row in those]
        columns = ([row.reference.median for row in those], [row.fixed_step.median for row in those])
        both = [power_law(sizes, column) if len(sizes) > 2 else None for column in columns]
        fits[kind] = (both[0], both[1])
    return fits
