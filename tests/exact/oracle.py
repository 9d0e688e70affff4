"""The answers of the reference solver, which the event loop is compared with.

    python tests/exact/oracle.py FILE [--kind KIND ...] [--count N] [--first SEED]

writes one line of JSON for each world into FILE (compressed by lzma): its poses at `SAMPLES` times, X, and what its
certificate says. Worlds that FILE has already are left out. The kept file beside this one holds the first seeds of
each kind and the cells of the standard suite; all 500 seeds of each kind take hours.
"""

from __future__ import annotations

import argparse
import json
import lzma
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import numpy as np

from adapters.reference.simulation import solver_model
from adapters.scene.drives import as_moving
from reference_solver import Model, Settings
from reference_solver.certificate.truth import certify
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
    """What the reference solver says of a world.

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


def keys(kind: str, count: int, first: int = 0) -> list[str]:
    """Return the keys of a kind: of the standard suite all of them."""
    return list(standard_slots()) if kind == "standard" else [f"{kind} {first + i}" for i in range(count)]


def answer(key: str) -> Answer:
    """Return what the reference solver says of a world, certified."""
    world = world_of(key)
    found = certify(world.model, Settings.reference(world.dt), world.samples * world.stride, world.stride)
    return Answer(
        key,
        found.holds,
        _finite(found.determined),
        found.unique,
        _finite(found.horizon),
        found.reasons,
        found.t.tolist(),
        [_finite(x) for x in found.error],
        np.where(np.isfinite(found.pose), found.pose, 0.0).tolist(),
    )


def _finite(x: float) -> float | None:
    return float(x) if math.isfinite(x) else None


def stored(path: Path = KEPT) -> Iterator[Answer]:
    """Yield the answers in a file."""
    if path.exists():
        with lzma.open(path, "rt") as lines:
            for line in lines:
                yield Answer(**json.loads(line))


def main() -> None:
    """Write the answers that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--kind", nargs="+", choices=[*SEEDED, "standard"], default=[*SEEDED, "standard"])
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args()
    there = {each.key for each in stored(asked.file)}
    for kind in asked.kind:
        for key in keys(kind, asked.count, asked.first):
            if key in there:
                continue
            try:
                said = answer(key)
            except Exception as error:  # a world that cannot be built or run is an answer as well
                said = Answer(key, False, None, "", None, (f"{type(error).__name__}: {error}",), [], [], [])
            with lzma.open(asked.file, "at") as lines:
                lines.write(json.dumps(asdict(said), separators=(",", ":")) + "\n")
            print(key, "holds" if said.holds else said.reasons[:1], flush=True)


if __name__ == "__main__":
    main()
