"""Which of the settings that a cure changes matters: each of them alone, each of them left out, and how few suffice.

    shipped profile + one change           does it pass with that alone?
    shipped profile + all changes but one  does it fail without that?
    shipped profile + fewer and fewer      where no change is enough alone: what cannot be left out any more

Every number is the worst of the same checks of the same cells, run by `validation.settings.switching`. What came out
stands beside the engine's experiments as data (``decisive.csv``), with the release that it was measured with;
``crosscheck tune ENGINE --decisive`` measures it again.
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

from adapters.engine_folder import DECISIVE, belongs_of, cured_of, inside
from adapters.experiment import Cured
from adapters.registry import find, load
from validation.cells import Observation, Slot, prepare, settings_of
from validation.running.plan import QUICK_DT
from validation.settings.switching import observe, readings, switched

#: How a setting decides: it is enough by itself; or the check fails without it; or it completes a set that is enough,
#: in which another might stand for it.
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
        Its name, and what the better profile sets it to in each cell (one value where it is the same in all), as JSON.
    alone, without
        Error over tolerance of the shipped profile with this change only, and with all changes but this one: up to 1
        passes; infinite where the engine gave no answer.
    decides
        `ALONE`, `NEEDED`, `COMPLETES`, or empty: it does not matter to this check.
    """

    setting: str
    value: str
    alone: float
    without: float
    decides: str


@dataclass(frozen=True)
class Decisive:
    """The changes of one cure, measured; ``before`` and ``after`` are the worst error over tolerance of its checks.

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
        """Settings that decide."""
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
    """Cells of a cure as the shipped profile has them."""
    return [
        Slot(target.scene, tuple(sorted(cell.items())), target.dimension, engine, target.shipped, QUICK_DT)
        for cell in target.cells
    ]


def measure(engine: str, target: Cured, jobs: int = 1) -> Decisive:
    """Switch the changes of a cure, one by one.

    Raises
    ------
    ValueError
        If the target is none: its checks pass as shipped, or one fails with all changes made.
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
        raise ValueError(f"{what}: {before:.3g} tolerances as shipped, {after:.3g} with every change: no cure")
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
    """Changes of which none can be left out; those without which it fares best are tried first."""
    kept = list(names)
    for name in sorted(names, key=lambda each: without[each]):
        fewer = [each for each in kept if each != name]
        if badness([fewer])[0] <= 1.0:
            kept = fewer
    return kept


def changes_of(slot: Slot, better: str) -> dict[str, Any]:
    """Settings that profile ``better`` sets otherwise than the slot's own, with their values."""
    engine, scene = load(slot.engine), prepare(slot).scene
    own = {s.name: s.value for s in settings_of(engine, slot, scene)}
    other = Slot(slot.scene, slot.params, slot.dimension, slot.engine, better, slot.dt)
    wanted = {s.name: s.value for s in settings_of(engine, other, scene)}
    return {name: value for name, value in wanted.items() if name not in own or own[name] != value}


def measure_all(engine: str, jobs: int = 1) -> list[Decisive]:
    """Measure every cure that the experiments of ``engine`` name."""
    return [measure(engine, target, jobs) for target in cured_of(engine)]


@cache
def measured_of(engine: str) -> tuple[Decisive, ...]:
    """What was measured of ``engine`` and is listed; nothing for an engine that nobody measured."""
    path = inside(engine, DECISIVE)
    try:
        return tuple(entry for entry in (read(path) if path else ()) if entry.engine == engine)
    except (OSError, ValueError, KeyError, TypeError):  # a file of another package; ours are read by a test
        return ()


def decisive(engine: str, scene: str, dimension: int, shipped: str, better: str) -> Decisive | None:
    """What was measured of one cure in this dimension; None where nothing was."""
    wanted = (scene, dimension, shipped, better)
    return next((e for e in measured_of(engine) if (e.scene, e.dimension, e.shipped, e.better) == wanted), None)


def read(path: Path) -> list[Decisive]:
    """Read a list of measured cures."""
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
    """Write a list of measured cures."""
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
    """Two digits: what is asked is on which side of 1 it lies, and how far."""
    return f"{value:.2g}" if math.isfinite(value) else "inf"
