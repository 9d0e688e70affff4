"""Piles of many bodies that fall between walls: laws, overlap, energy (E28, E29)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from reference_solver.model import Model
from reference_solver.piles import GRAVITY, RATE, planar_pile, spatial_pile
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation
from tests.verification.gate import Gate
from tests.verification.rotation import rotation_matrix

#: Seconds that a pile falls: in the last half of them bodies lie still or nearly so.
TIME = 2.0
#: Largest overlap, as a share of the smaller half width: ten times what closing gaps may leave by pushing a body into
#: one that it did not touch (E28), for sub-steps in which speeds close that. And what share of runs may be refused.
#: Which pile misses either is a matter of chance: piles multiply every last place.
OVERLAP, REFUSED = 1e-4, 0.05
#: Share of all energy that may come from nowhere, in all steps together: round-off in the plane; in space the mid-point
#: rule misses some (w h)^3 / 24 of the spin energy of bodies with unequal moments in a step, 3e-6 at 10 rad/s, and that
#: energy is a hundredth of all.
GAINED = {2: 1e-10, 3: 1e-6}


class Kind(NamedTuple):
    """Piles of one kind: dimension, number of bodies, share of round ones, seeds."""

    dimension: int
    bodies: int
    round: float
    seeds: tuple[int, ...]

    @property
    def profile(self) -> str:
        """Column of the gates."""
        return "planar" if self.dimension == 2 else "spatial"


#: What falls, those first that take longest: what is measured beside them is short. In space boxes cost minutes where
#: they are many: their phases are solved for the whole world.
KINDS = {
    "8 spatial boxes": Kind(3, 8, 0.0, (2, 1)),
    "50 spheres": Kind(3, 50, 1.0, (1, 2, 3)),
    "50 discs": Kind(2, 50, 1.0, (1, 2, 3, 4)),
    "50 boxes": Kind(2, 50, 0.0, (1, 2, 3, 4)),
    "50 discs and boxes": Kind(2, 50, 0.5, (1, 2, 3, 4)),
}
#: How the reason of a pile begins that broke the code instead of a law.
UNMEASURED = "could not be measured"
#: Every pile by its words: they are independent of each other, and can be measured side by side.
PILES = {f"pile of {name}, seed {seed}": (name, seed) for name, kind in KINDS.items() for seed in kind.seeds}


def gates(fallen: Callable[[str], Fall] | None = None) -> Iterator[Gate]:
    """Yield all rows; ``fallen`` answers for a pile of `PILES`: by letting it fall, where nothing else is said."""
    fallen = fallen or fall_of
    refused = 0
    for name, kind in KINDS.items():
        yield from laws(name, fallen)
        runs = [fallen(pile) for pile in piles_of(name)]
        case = f"{name}, {len(kind.seeds)} piles"
        refused += sum(bool(run.reasons) for run in runs)
        worst = max(run.overlap for run in runs)
        yield Gate.at_most("pile: overlap, of a half width", case, worst, OVERLAP, kind.profile)
    count = len(PILES)
    yield Gate.at_most(
        "share of piles whose certificate does not hold",
        f"{count} piles",
        refused / count,
        REFUSED,
        "planar, spatial",
    )


def laws(name: str, fallen: Callable[[str], Fall] | None = None) -> Iterator[Gate]:
    """Yield what no pile of a kind may break, however it falls: any law but that bodies do not overlap, and energy."""
    kind, fallen = KINDS[name], fallen or fall_of
    runs = {pile: fallen(pile) for pile in piles_of(name)}
    reasons = [(pile, reason) for pile, run in runs.items() for reason in run.reasons]
    for pile, reason in reasons:
        if reason.startswith(UNMEASURED):
            yield Gate.at_most(f"pile: {UNMEASURED}", f"{pile}{reason[len(UNMEASURED) :]}", math.nan, 0.0, kind.profile)
    case = f"{name}, {len(kind.seeds)} piles"
    broken = sum(not reason.startswith("bodies overlap") for _, reason in reasons)
    yield Gate.at_most("pile: laws broken, overlap apart", case, broken, 0, kind.profile)
    gained = max(run.gained for run in runs.values())
    yield Gate.at_most("pile: energy gained, of all", case, gained, GAINED[kind.dimension], kind.profile)


def piles_of(name: str) -> list[str]:
    """Words of the piles of a kind, by seed."""
    return [pile for pile, (kind, _) in PILES.items() if kind == name]


class Fall(NamedTuple):
    """What a run says: why it is refused, its largest overlap of a half width, the energy it gained of all."""

    reasons: tuple[str, ...]
    overlap: float
    gained: float


@cache
def fall_of(pile: str) -> Fall:
    """Let a pile of `PILES` fall; one that cannot be measured breaks a law, and all bounds."""
    name, seed = PILES[pile]
    kind = KINDS[name]
    make = planar_pile if kind.dimension == 2 else spatial_pile
    try:
        return fall(make(seed, kind.bodies, kind.round))
    except Exception as error:
        return Fall((f"{UNMEASURED}: {error!r}",), math.inf, math.inf)


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
    total, d = 0.0, model.dimension
    for i, body in enumerate(model.bodies):
        if body.motion == "free":
            pose, twist = simulation.pose[i], simulation.twist[i]
            spin = twist[d:] if d == 2 else rotation_matrix(pose[3:]).T @ twist[d:]
            total += 0.5 * body.mass * float(twist[:d] @ twist[:d])
            total += 0.5 * float(np.ravel(np.asarray(body.inertia)) @ (spin * spin))
            total += body.mass * GRAVITY * pose[d - 1]
    return float(total)
