"""Piles of many planar bodies that fall between walls: laws, overlap, energy (E28, E29)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from reference_solver.certification import Gate
from reference_solver.certification.space import GRAVITY
from reference_solver.model import Body, Model
from reference_solver.settings import Settings
from reference_solver.shapes import Box, Disc, HalfSpace
from reference_solver.simulation import Simulation

#: Bodies of a pile, seeds of each kind, steps a second, seconds: those of the last half of it lie still or nearly so.
BODIES, SEEDS, RATE, TIME = 50, (1, 2, 3, 4), 240, 2.0
#: Kinds, and the share of their bodies that are discs.
KINDS = {"discs": 1.0, "boxes": 0.0, "discs and boxes": 0.5}
#: Half widths [m], width of a place and height of a layer they fall from [m].
SMALL, LARGE, PLACE, LAYER = 0.25, 0.4, 1.2, 1.2
#: Largest overlap, as a share of the smaller half width: what weight closes in a step, g h^2. And what share of runs
#: may be refused. Which pile misses either is a matter of chance: piles multiply every last place.
OVERLAP, REFUSED = GRAVITY / RATE**2 / SMALL, 0.05
#: Share of all energy that may come from nowhere, in all steps together.
GAINED = 1e-10


def gates() -> Iterator[Gate]:
    """Yield all rows."""
    yield from laws()
    refused, count = 0, 0
    for kind in KINDS:
        runs = falls(kind)
        case = f"{BODIES} {kind}, {len(SEEDS)} piles"
        refused, count = refused + sum(bool(run.reasons) for run in runs), count + len(runs)
        worst = max(run.overlap for run in runs)
        yield Gate.at_most("pile: overlap, of a half width", case, worst, OVERLAP, "planar")
    share = refused / count
    yield Gate.at_most("share of piles whose certificate does not hold", f"{count} piles", share, REFUSED, "planar")


def laws() -> Iterator[Gate]:
    """Yield what no pile may break, however it falls: any law but that bodies do not overlap, and energy."""
    for kind in KINDS:
        runs = falls(kind)
        case = f"{BODIES} {kind}, {len(SEEDS)} piles"
        broken = sum(not reason.startswith("bodies overlap") for run in runs for reason in run.reasons)
        yield Gate.at_most("pile: laws broken, overlap apart", case, broken, 0, "planar")
        yield Gate.at_most("pile: energy gained, of all", case, max(run.gained for run in runs), GAINED, "planar")


class Fall(NamedTuple):
    """What a run says: why it is refused, its largest overlap of a half width, the energy it gained of all."""

    reasons: tuple[str, ...]
    overlap: float
    gained: float


@cache
def falls(kind: str) -> tuple[Fall, ...]:
    """Let one pile of a kind fall for every seed."""
    return tuple(fall(pile(seed, KINDS[kind])) for seed in SEEDS)


def pile(seed: int, discs: float) -> Model:
    """Return bodies of 1 kg at any angle, in layers between two walls over a floor; e = 0, mu = .5."""
    rng = np.random.default_rng(seed)
    across = round(math.sqrt(BODIES / 2))
    half_width = 0.5 * across * PLACE
    bodies = [Body(HalfSpace((0.0, 1.0)), motion="fixed")]
    bodies += [Body(HalfSpace((sign, 0.0), -half_width), motion="fixed") for sign in (1.0, -1.0)]
    for k in range(BODIES):
        x = -half_width + (k % across + 0.5) * PLACE + rng.uniform(-0.03, 0.03)
        place = (x, 0.6 + LAYER * (k // across), rng.uniform(0.0, 3.0))
        half = rng.uniform(SMALL, LARGE, 2)
        if rng.random() < discs:
            bodies.append(Body(Disc(float(half[0])), 1.0, 0.5 * half[0] ** 2, place))
        else:
            bodies.append(Body(Box((float(half[0]), float(half[1]))), 1.0, float(half @ half) / 3.0, place))
    return Model(2, bodies, (0.0, -GRAVITY), 0.0, 0.5)


def fall(model: Model) -> Fall:
    """Run a pile to its end."""
    simulation = Simulation(model, Settings.reference(1.0 / RATE))
    before = whole = energy(model, simulation)
    gained = 0.0
    for _ in range(round(RATE * TIME)):
        simulation.advance(1)
        after = energy(model, simulation)
        gained += max(after - before, 0.0)
        before = after
    certificate = simulation.certificate
    return Fall(certificate["reasons"], float(certificate["penetration"]), gained / whole)


def energy(model: Model, simulation: Simulation) -> float:
    """Kinetic and potential energy of the free bodies, from the floor [J]."""
    total = 0.0
    for i, body in enumerate(model.bodies):
        if body.motion == "free":
            vx, vy, w = simulation.twist[i]
            total += 0.5 * body.mass * (vx * vx + vy * vy) + 0.5 * float(np.squeeze(body.inertia)) * w * w
            total += body.mass * GRAVITY * simulation.pose[i, 1]
    return float(total)
