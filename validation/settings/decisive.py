"""Decisive settings of a fix: each alone, each left out, and the smallest sufficient set.

    shipped profile + one change           does it pass with that alone?
    shipped profile + all changes but one  does it fail without that?
    shipped profile + fewer and fewer      where no change is enough alone: a set without unnecessary ones

Every number is the worst of the same checks of the same cells, run by `validation.settings.switching`. Results are
stored beside the engine's experiments (``decisive.csv``), with the engine's release; ``crosscheck tune ENGINE
--decisive`` measures them again.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from adapters.engine_folder import DECISIVE, belongs_of, cured_of, rows_of
from adapters.experiment import Cured
from adapters.registry import find, load
from validation.cells import Observation, Slot, scene_of, settings_of
from validation.running.plan import QUICK_DT
from validation.settings.switching import observe, readings, switched

#: How a setting matters: it is enough alone; or the check fails without it; or it belongs to a sufficient set, in which
#: another could replace it.
ALONE, NEEDED, COMPLETES = "alone", "needed", "completes"
COLUMNS = (
    "engine", "version", "shipped", "better", "scene", "dimension", "cells", "metrics", "before", "after",
    "setting", "value", "alone", "without", "decides",
)  # fmt: skip


@dataclass(frozen=True)
class Part:
    """One changed setting.

    Parameters
    ----------
    setting, value
        Its name, and its value in the better profile for each cell (one value if equal in all), as JSON.
    alone, without
        Error over tolerance of the shipped profile with this change only, and with all changes but this one: up to 1
        passes; infinite where the engine has no result.
    decides
        `ALONE`, `NEEDED`, `COMPLETES`, or empty: no effect on this check.
    """

    setting: str
    value: str
    alone: float
    without: float
    decides: str


@dataclass(frozen=True)
class Decisive:
    """The measured changes of one fix; ``before`` and ``after`` are the worst error over tolerance of its checks.

    ``cells`` and ``metrics`` are those of `adapters.experiment.Cured`.
    """

    engine: str
    version: str
    shipped: str
    better: str
    scene: str
    dimension: int
    cells: tuple[Mapping[str, float], ...]
    metrics: tuple[str, ...]
    before: float
    after: float
    parts: tuple[Part, ...]

    @property
    def settings(self) -> list[str]:
        """Decisive settings."""
        return [part.setting for part in self.parts if part.decides]

    def _so(self, decides: str) -> list[str]:
        return [part.setting for part in self.parts if part.decides == decides]

    @property
    def text(self) -> str:
        """``a or b`` where each is enough by itself; ``a and b with c``: not without a and b, and enough with c."""
        if self._so(ALONE):
            return " or ".join(self._so(ALONE))
        needed, others = _joined(self._so(NEEDED)), _joined(self._so(COMPLETES))
        return f"{needed} with {others}" if needed and others else needed or others


def _joined(names: Sequence[str]) -> str:
    """``a, b and c``."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def slots_of(engine: str, target: Cured) -> list[Slot]:
    """Cells of a fix with the shipped profile."""
    return [
        Slot(target.scene, tuple(sorted(cell.items())), target.dimension, engine, target.shipped, QUICK_DT)
        for cell in target.cells
    ]


def measure(engine: str, target: Cured, jobs: int = 1) -> Decisive:
    """Switch the changes of a fix, one by one.

    Raises
    ------
    ValueError
        If it is no fix: its checks pass as shipped, or one fails with all changes.
    """
    own = slots_of(engine, target)
    changes = {slot: changes_of(slot, target.better) for slot in own}
    belongs = belongs_of(engine)
    every = dict.fromkeys(name for each in changes.values() for name in each)
    names = [name for name in every if belongs.get(name) not in every]

    def badness(subsets: Sequence[Iterable[str]]) -> list[float]:
        asked = [
            [switched(slot, {n: v for n, v in changes[slot].items() if belongs.get(n, n) in set(some)}) for slot in own]
            for some in subsets
        ]
        found = observe([slot for each in asked for slot in each], jobs)
        return [max(worst(found[slot], target.metrics) for slot in each) for each in asked]

    before, after = badness([(), names])
    if not before > 1.0 or not after <= 1.0:
        what = f"{engine} {target.scene}"
        raise ValueError(
            f"{what}: {before:.3g} tolerances as shipped, {after:.3g} with every change, so this is no fix"
        )
    alone = dict(zip(names, badness([[name] for name in names]), strict=True))
    without = dict(zip(names, badness([[n for n in names if n != name] for name in names]), strict=True))
    enough = [name for name in names if alone[name] <= 1.0]
    decides = dict.fromkeys(enough, ALONE)
    if not enough:
        kept = smallest(names, without, badness)
        decides = {name: NEEDED if without[name] > 1.0 else COMPLETES for name in kept}
    parts = tuple(
        Part(
            name, as_text([changes[slot].get(name) for slot in own]), alone[name], without[name], decides.get(name, "")
        )
        for name in names
    )
    return Decisive(
        engine, find(engine).version, target.shipped, target.better, target.scene, target.dimension,
        target.cells, target.metrics, before, after, parts,
    )  # fmt: skip


def worst(observation: Observation, metrics: Sequence[str]) -> float:
    """Largest error over tolerance of the named checks (of all, if none is named) of an observation."""
    return max(found.badness for found in readings(observation) if not metrics or found.check.metric in metrics)


def smallest(
    names: Sequence[str], without: Mapping[str, float], badness: Callable[[Sequence[Iterable[str]]], list[float]]
) -> list[str]:
    """Changes of which none can be left out; those with the least effect are removed first."""
    kept = list(names)
    for name in sorted(names, key=lambda each: without[each]):
        fewer = [each for each in kept if each != name]
        if badness([fewer])[0] <= 1.0:
            kept = fewer
    return kept


def changes_of(slot: Slot, better: str) -> dict[str, Any]:
    """Settings that profile ``better`` sets differently from the slot's, with their values."""
    engine, scene = load(slot.engine), scene_of(slot)
    own = {s.name: s.value for s in settings_of(engine, slot, scene)}
    other = Slot(slot.scene, slot.params, slot.dimension, slot.engine, better, slot.dt)
    wanted = {s.name: s.value for s in settings_of(engine, other, scene)}
    return {name: value for name, value in wanted.items() if name not in own or own[name] != value}


def measure_all(engine: str, jobs: int = 1) -> list[Decisive]:
    """Measure every fix in the experiments of ``engine``."""
    return [measure(engine, target, jobs) for target in cured_of(engine)]


@cache
def measured_of(engine: str) -> tuple[Decisive, ...]:
    """Listed measurements of ``engine``; empty if there are none."""
    return tuple(entry for entry in rows_of(engine, DECISIVE, read) if entry.engine == engine)


def decisive(engine: str, scene: str, dimension: int, shipped: str, better: str) -> Decisive | None:
    """Measurement of one fix in this dimension; None if there is none."""
    wanted = (scene, dimension, shipped, better)
    return next((e for e in measured_of(engine) if (e.scene, e.dimension, e.shipped, e.better) == wanted), None)


def read(path: Path) -> list[Decisive]:
    """Read a list of measured fixes."""
    groups: dict[tuple[str, ...], list[Mapping[str, str]]] = {}
    with path.open(encoding="utf-8", newline="") as lines:
        for row in csv.DictReader(lines):
            groups.setdefault(tuple(row[name] for name in COLUMNS[:10]), []).append(row)
    return [_entry(rows) for rows in groups.values()]


def _entry(rows: Sequence[Mapping[str, str]]) -> Decisive:
    head = rows[0]
    parts = tuple(Part(r["setting"], r["value"], float(r["alone"]), float(r["without"]), r["decides"]) for r in rows)
    return Decisive(
        head["engine"], head["version"], head["shipped"], head["better"], head["scene"], int(head["dimension"]),
        tuple(json.loads(head["cells"])), tuple(json.loads(head["metrics"])), float(head["before"]),
        float(head["after"]), parts,
    )  # fmt: skip


def write(entries: Iterable[Decisive], path: Path) -> None:
    """Write a list of measured fixes."""
    with path.open("w", encoding="utf-8", newline="") as lines:
        table = csv.writer(lines, lineterminator="\n")
        table.writerow(COLUMNS)
        for e in entries:
            what = (e.scene, e.dimension, json.dumps(e.cells), json.dumps(e.metrics))
            head = [e.engine, e.version, e.shipped, e.better, *what]
            for p in e.parts:
                numbers = [_short(value) for value in (e.before, e.after)]
                table.writerow([*head, *numbers, p.setting, p.value, _short(p.alone), _short(p.without), p.decides])


def as_text(values: Sequence[Any]) -> str:
    """A setting's value in each cell as JSON text (tuples are lists there); one value where all are the same."""
    same = all(value == values[0] for value in values)
    return json.dumps(values[0] if same else list(values))


def _short(value: float) -> str:
    """Two digits, enough to show on which side of 1 it lies, and how far."""
    return f"{value:.2g}" if math.isfinite(value) else "inf"
