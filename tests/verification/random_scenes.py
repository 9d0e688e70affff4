"""Random planar scenes of two and three bodies against the event-driven oracle, as far as they can be foretold."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from reference_solver.exact import Refused
from reference_solver.model import Array, Body, Model
from reference_solver.settings import Settings
from reference_solver.shapes import Box, Disc, HalfSpace
from reference_solver.simulation import Simulation
from tests.verification.event_driven.errors import OracleError
from tests.verification.event_driven.oracle import EventDriven
from tests.verification.gate import Gate
from tests.verification.space import GRAVITY

#: Number of scenes, seed of the first, seconds and comparisons of each run.
SCENES, SEED, TIME, SAMPLES = 400, 7_000, 1.0, 24
#: Size of a disturbance of all velocities, and how often it may have grown for an answer to be foretold [m/s].
SIZE, HORIZON = 1e-9, 1e3
#: Events after which the oracle is given up: the end of a series of rebounds is not among them.
MOST_EVENTS = 2_000
#: Impacts, less one, of more than one pair within a time [s] that tell of an inelastic collapse.
CROWD, NO_TIME = 8, 1e-7
#: Largest difference from the oracle up to there [m, rad, m/s, rad/s], and share of runs that may end.
ALLOWED, ENDED = 1e-9, 0.01


def gates() -> Iterator[Gate]:
    """Yield all rows."""
    worst, ended, compared = 0.0, 0, 0
    for seed in range(SEED, SEED + SCENES):
        found = difference(seed)
        if found is None:
            continue
        compared += 1
        if np.isnan(found):
            ended += 1
        else:
            worst = max(worst, found)
    case = f"{compared} of {SCENES} random scenes"
    yield Gate.at_most("oracle: largest difference up to the horizon", case, worst, ALLOWED, "planar")
    yield Gate.at_most("oracle: share of runs that ended", case, ended / max(compared, 1), ENDED, "planar")
    yield Gate.at_least("oracle: share of scenes that it can answer", case, compared / SCENES, 0.5, "planar")


def scene(seed: int) -> Model:
    """Return a floor that may lean, and two or three bodies over it: discs, or a box and discs."""
    rng = np.random.default_rng(seed)
    lean = rng.choice([0.0, rng.uniform(-0.3, 0.3)])
    bodies = [Body(HalfSpace((float(np.sin(lean)), float(np.cos(lean)))), motion="fixed")]
    for i in range(int(rng.integers(2, 4))):
        mass = 10.0 ** rng.uniform(-1.0, 1.0)
        place = (1.4 * (i % 2) + rng.uniform(-0.2, 0.2), 1.2 + 1.3 * i, rng.uniform(-1.0, 1.0))
        twist = (rng.uniform(-1.5, 1.5), rng.uniform(-2.0, 1.0), rng.uniform(-3.0, 3.0))
        if i == 0 and rng.uniform() < 0.3:
            half = rng.uniform(0.2, 0.4, 2)
            bodies.append(Body(Box((float(half[0]), float(half[1]))), mass, mass * (half @ half) / 3.0, place, twist))
        else:
            radius = rng.uniform(0.2, 0.4)
            bodies.append(Body(Disc(radius), mass, 0.5 * mass * radius**2, place, twist))
    restitution = float(rng.choice([0.0, 1.0, rng.uniform(0.1, 0.9)]))
    return Model(2, bodies, (0.0, -GRAVITY), restitution, float(rng.choice([0.0, rng.uniform(0.05, 1.0)])))


def disturbed(model: Model, seed: int) -> Model:
    """Return the scene with all velocities moved by up to `SIZE`."""
    rng = np.random.default_rng(seed)
    moved = [
        dataclasses.replace(body, twist=tuple(np.array(body.twist) + SIZE * rng.uniform(-1.0, 1.0, 3)))
        if body.motion == "free"
        else body
        for body in model.bodies
    ]
    return dataclasses.replace(model, bodies=tuple(moved))


def samples(model: Model) -> Array:
    """Poses and velocities (SAMPLES, n, 6) by the solver, no numbers from where it refuses."""
    simulation = Simulation(model, Settings.reference(TIME / SAMPLES))
    found = np.full((SAMPLES, len(model.bodies), 6), np.nan)
    with suppress(Refused):
        for sample in found:
            simulation.advance(1)
            sample[:] = np.concatenate([simulation.pose, simulation.twist], axis=-1)
    return found


def collapses(oracle: EventDriven) -> bool:
    """Whether a body has fallen to rest between two others, by impacts without end on both in no time.

    Pairwise laws end there: what follows the last of them goes by convention, that of the oracle or another.
    """
    events = oracle.events
    for last in range(CROWD, len(events)):
        crowd = events[last - CROWD : last + 1]
        if crowd[-1].t - crowd[0].t < NO_TIME and len({(event.a, event.b) for event in crowd}) > 1:
            return True
    return False


def truths(model: Model) -> Array:
    """Poses and velocities (s, n, 6) by the oracle, at as many samples as it has an answer for."""
    found: list[Array] = []
    try:
        oracle = EventDriven(model, "N-SIM", MOST_EVENTS)
        for k in range(SAMPLES):
            oracle.advance(TIME * (k + 1) / SAMPLES)
            if collapses(oracle):
                break
            found.append(np.concatenate([oracle.pose, oracle.twist], axis=-1))
    except (OracleError, ValueError):
        pass
    return np.array(found)


def difference(seed: int) -> float | None:
    """Largest difference of a scene from the oracle up to its horizon; nan if it ended, None if there is no oracle."""
    model = scene(seed)
    truth = truths(model)
    if len(truth) == 0:
        return None
    found, other = samples(model)[: len(truth)], samples(disturbed(model, seed))[: len(truth)]
    if np.isnan(found).any():
        return float("nan")
    growth = np.maximum.accumulate(np.abs(other - found).max(axis=(1, 2)) / SIZE)
    foretold = growth < HORIZON
    return float(np.abs(found - truth)[foretold].max(initial=0.0))
