"""Kept numbers of an engine as shipped: ``numbers.csv`` in its folder, with its release.

What the experiments of `adapters.unset` measure where nothing is set; friction of a slide by heading, over mu N; and
whether cases that run twice, each time in a new process, end in the same bits.
"""

from __future__ import annotations

import csv
import math
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass, fields
from functools import cache
from pathlib import Path

from adapters.engine_folder import NUMBERS, rows_of, unset_of
from adapters.registry import load
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Slot, scene_of
from validation.running.plan import QUICK_DT
from validation.settings.switching import observe

#: Headings of the slides [degrees].
HEADINGS = (0.0, 22.5, 45.0)
_SCENES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
FRICTION, AGAIN = "friction over mu N at {:g} degrees", "share of cases that end in the same bits"


@dataclass(frozen=True)
class Kept:
    """A number of a release; ``what`` names it with its unit, as in `adapters.unset.Unset`."""

    engine: str
    version: str
    what: str
    value: float


def measure_all(engine: str) -> Iterator[Kept]:
    """Measure all numbers of an installed engine.

    Raises
    ------
    EngineError
        If the engine is not installed.
    """
    loaded = load(engine)
    version = loaded.version().partition("+")[0]
    for row in unset_of(engine):
        if row.measure is not None:
            yield Kept(engine, version, row.what, float(row.measure()))
    profile = loaded.facts.profile("shipped")
    if profile is None:
        return

    def slot(scene: str, dimension: int, **params: float) -> Slot:
        return Slot(scene, tuple(params.items()), dimension, engine, profile or "", QUICK_DT)

    slides = {
        heading: slot(_SCENES["headed"], 3, heading=heading) for heading in HEADINGS if 3 in loaded.facts.dimensions
    }
    seen = observe(slides.values())
    for heading, own in slides.items():
        if (share := _friction(seen[own])) is not None:
            yield Kept(engine, version, FRICTION.format(heading), share)
    again = [
        slot(name, d)
        for name in _SCENES["twice"]
        for d in sorted({*CATALOGUE[name].dimensions} & loaded.facts.dimensions)
    ]
    first, second = observe(again), observe(again)
    hashes = [(first[own].state_hash, second[own].state_hash) for own in again if first[own].state_hash]
    if hashes:
        yield Kept(engine, version, AGAIN, sum(one == other for one, other in hashes) / len(hashes))


def _friction(slide: Observation) -> float | None:
    """Mean friction over mu N; of engines that do not tell it the braking over mu g, which drag adds to."""
    told, scene = slide.metrics, scene_of(slide.slot)
    (mean, _), (braking, _) = (told.get(name, (None, "")) for name in ("friction[mean]", "braking"))
    if mean is not None and math.isfinite(mean):
        return mean
    return braking / (scene.params["mu"] * scene.params["g"]) if braking is not None else None


def write(entries: Iterable[Kept], path: Path) -> None:
    """Write the table, numbers to six digits."""
    with path.open("w", encoding="utf-8", newline="") as lines:
        table = csv.writer(lines, lineterminator="\n")
        table.writerow([field.name for field in fields(Kept)])
        table.writerows((*astuple(each)[:-1], f"{each.value:.6g}") for each in entries)
    known_of.cache_clear()


@cache
def known_of(engine: str) -> dict[str, float]:
    """Kept numbers of an engine by what they are; empty if there is no table."""
    return {each.what: each.value for each in rows_of(engine, NUMBERS, _read)}


def _read(path: Path) -> Iterator[Kept]:
    with path.open(encoding="utf-8", newline="") as lines:
        for row in csv.DictReader(lines):
            yield Kept(row["engine"], row["version"], row["what"], float(row["value"]))
