"""Stored answers of an earlier solver, which had other equations of motion and other events, for the event loop.

The kept file beside this one has one line of JSON for each world, compressed by lzma: its poses at `SAMPLES` times, X,
and what its certificate said. It holds the first seeds of each kind and the cells of the standard suite.
"""

from __future__ import annotations

import json
import lzma
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from adapters.reference.simulation import solver_model
from adapters.scene.drives import as_moving
from reference_solver import Model
from tests.verification import random_scenes
from tests.verification.fuzz.scenes import DRAWN
from validation.catalogue import CATALOGUE
from validation.cells import Slot, scene_of
from validation.running.plan import QUICK_DT, Request, slots

KEPT = Path(__file__).parent / "oracle.jsonl.xz"
#: Times at which poses are compared, evenly spread over a run: each event shows in what comes after it.
SAMPLES = 8


@dataclass(frozen=True)
class World:
    """A model and how it is run: ``samples`` times ``stride`` steps of ``dt`` [s]."""

    model: Model
    dt: float
    stride: int
    samples: int


@dataclass(frozen=True)
class Answer:
    """What the earlier solver said of a world.

    Parameters
    ----------
    key
        Kind and seed, or the key of the standard suite's cell.
    holds, determined, unique, horizon, reasons
        As in `reference_solver.certificate.truth.Certificate`; None for infinity.
    t, error
        (s,) times [s] and X [m], the start included.
    pose
        (s, n, 3 | 7) poses.
    """

    key: str
    holds: bool
    determined: float | None
    unique: str
    horizon: float | None
    reasons: tuple[str, ...]
    t: list[float]
    error: list[float | None]
    pose: list[list[list[float]]]


def sampled(model: Model, dt: float, steps: int) -> World:
    """Return a world whose run is looked at `SAMPLES` times; a few steps at the end may be left out."""
    samples = min(SAMPLES, steps)
    return World(model, dt, steps // samples, samples)


def random_world(seed: int) -> World:
    """Return a planar world of `random_scenes`."""
    rate = 240
    return sampled(random_scenes.scene(random_scenes.SEED + seed), 1.0 / rate, round(rate * random_scenes.TIME))


def drawn(kind: str, dimension: int) -> Callable[[int], World]:
    """Return the function that makes a world of ``tests.verification.fuzz`` from a seed."""

    def world(seed: int) -> World:
        scene = DRAWN[kind](seed, dimension)
        return sampled(scene.model, 1.0 / scene.rate, scene.steps)

    return world


#: Kinds of worlds that are drawn by a seed.
SEEDED = {
    "random": random_world,
    "fuzz2": drawn("any", 2),
    "fuzz3": drawn("any", 3),
    "chains2": drawn("chains", 2),
    "chains3": drawn("chains", 3),
}


@cache
def standard_slots() -> dict[str, Slot]:
    """Return the cells of the standard suite that the profile ``reference`` runs, by key."""
    asked = Request(list(CATALOGUE), ["reference"], ["reference"], dts=(QUICK_DT,), suite="standard")
    return {f"standard {slot.scene} {slot.dimension}-D {slot.params_text()}".strip(): slot for slot in slots(asked)}


def standard_world(key: str) -> World:
    """Return the world of a cell of the standard suite."""
    slot = standard_slots()[key]
    scene = scene_of(slot)
    return sampled(solver_model(as_moving(scene)), slot.dt, max(1, round(scene.duration / slot.dt)))


def world_of(key: str) -> World:
    """Return the world of a key."""
    kind, _, seed = key.partition(" ")
    return SEEDED[kind](int(seed)) if kind in SEEDED else standard_world(key)


def stored(path: Path = KEPT) -> Iterator[Answer]:
    """Yield the answers in a file."""
    if path.exists():
        with lzma.open(path, "rt") as lines:
            for line in lines:
                yield Answer(**json.loads(line))
