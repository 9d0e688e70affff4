"""Searches stock settings that improve a tuned profile on all scenes.

    start       the present profile, on the cells of one group of scenes
    search      every candidate value of every setting, one at a time; the best that helps is kept; again with it
    accept      a change counts if it makes fewer checks fail, or the same number come clearly nearer, and if
                nothing that passed fails; on other cells, held out, nothing may get worse, and where a profile's
                own iterations are cut down nothing that passed may fail
    fairness    a shipped value that is as good as the tuned one is reported too

Every engine has the same cells, budget of candidates and rule. A result is adopted by hand in the adapter, with its
reason: a profile chooses by a scene's needs, a search only covers its cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from adapters.engine_folder import candidates_of
from adapters.needs import needs
from adapters.registry import load, profile_of
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Slot, settings_of
from validation.posed import resolve
from validation.running.plan import QUICK_DT, has_iterations
from validation.settings.switching import Reading, observe, readings, switched

Cells = tuple[tuple[str, Mapping[str, float]], ...]
#: Least gain that counts, in summed decades of error over tolerance: a tenth of a decade is a quarter of an error.
GAIN = 0.1
#: A check this far below its tolerance cannot be improved in a way that anyone sees.
INVISIBLE = 1e-3
#: Most settings that a search changes, one a round.
ROUNDS = 4


@dataclass(frozen=True)
class Score:
    """How bad a set of readings is: checks that fail, and decades of error over tolerance above `INVISIBLE`."""

    failing: int
    decades: float

    def better_than(self, other: Score) -> bool:
        """Fewer failures, or as many with clearly smaller errors."""
        if self.failing != other.failing:
            return self.failing < other.failing
        return self.decades < other.decades - GAIN


@dataclass(frozen=True)
class Trial:
    """One tried change: its scores, broken checks, and whether it was kept."""

    changes: Mapping[str, Any]
    score: Score
    broken: tuple[str, ...]


@dataclass(frozen=True)
class Search:
    """Result of a search of one group.

    ``needless`` are settings whose shipped value is as good as the profile's.
    """

    engine: str
    profile: str
    group: str
    before: Score
    after: Score
    changes: Mapping[str, Any]
    held_out: tuple[Score, Score]
    trials: tuple[Trial, ...]
    needless: Mapping[str, Any]


def score(found: Sequence[Reading]) -> Score:
    """Score readings; a check without a result counts as a thousand tolerances off."""
    bad = [min(max(each.badness, INVISIBLE), 1e3) for each in found]
    return Score(sum(b > 1.0 for b in bad), sum(math.log10(b / INVISIBLE) for b in bad))


def slots_of(engine: str, profile: str, cells: Cells, dimensions: Sequence[int]) -> list[Slot]:
    """Slots of cells in every dimension."""
    found = []
    for scene, params in cells:
        canonical = resolve(scene)
        own = [dimension for dimension in dimensions if dimension in canonical.dimensions]
        found += [Slot(scene, canonical.minimal(params), dimension, engine, profile, QUICK_DT) for dimension in own]
    return found


def groups() -> list[str]:
    """Groups of scenes that are searched together, as the scenes declare them (`validation.canonical.Searched`)."""
    return list(dict.fromkeys(scene.searched.group for scene in CATALOGUE.values() if scene.searched))


def cells_of(group: str, held_out: bool = False) -> Cells:
    """Cells of a group: those of the search, or those on which no check may get worse.

    Raises
    ------
    KeyError
        For an unknown group.
    """
    if group not in groups():
        raise KeyError(group)
    return tuple(
        (name, params)
        for name, scene in CATALOGUE.items() if scene.searched and scene.searched.group == group
        for params in (scene.searched.held_out if held_out else scene.searched.cells)
    )  # fmt: skip


Progress = Callable[[Mapping[str, Any], Score], None]


class _Bench:
    """Readings of the group's cells under changes; every cell runs once."""

    def __init__(self, slots: Sequence[Slot], jobs: int) -> None:
        self.slots, self.jobs = slots, jobs
        self.seen: dict[Slot, Observation] = {}

    def prepare(self, many: Sequence[Mapping[str, Any]]) -> None:
        """Run the cells of many changes together: starting workers costs more than a cell."""
        wanted = [switched(slot, changes) for changes in many for slot in self.slots]
        self.seen |= observe([slot for slot in wanted if slot not in self.seen], self.jobs)

    def readings(self, changes: Mapping[str, Any]) -> list[Reading]:
        """Readings of all cells, in the same order for every change."""
        self.prepare([changes])
        return [found for slot in self.slots for found in readings(self.seen[switched(slot, changes)])]


def broken(before: Sequence[Reading], after: Sequence[Reading]) -> tuple[str, ...]:
    """Checks that passed and fail."""
    return tuple(
        f"{old.slot.scene} {old.slot.dimension}-D {old.slot.params_text()} {old.check.metric}".replace("  ", " ")
        for old, new in zip(before, after, strict=True)
        if old.badness <= 1.0 < new.badness
    )


def search(
    engine: str,
    profile: str,
    group: str,
    jobs: int = 1,
    dimensions: Sequence[int] = (2, 3),
    progress: Progress = lambda changes, score: None,
) -> Search:
    """Search one profile of one engine on one group of scenes.

    Raises
    ------
    KeyError
        For an unknown group.
    EngineError
        For an unknown engine or profile.
    """
    bench = _Bench(slots_of(engine, profile, cells_of(group), dimensions), jobs)
    held = _Bench(slots_of(engine, profile, cells_of(group, held_out=True), dimensions), jobs)
    starved = _Bench(_starved(bench.slots), jobs)
    start, start_held, start_starved = bench.readings({}), held.readings({}), starved.readings({})
    changes: dict[str, Any] = {}
    best, trials = score(start), []
    for _ in range(ROUNDS):
        around = _around(engine, bench.slots[0], changes)
        bench.prepare(around)
        tried = [_trial(each, start, bench) for each in around]
        trials += tried
        for trial in tried:
            progress(trial.changes, trial.score)
        helpful = [trial for trial in tried if not trial.broken and trial.score.better_than(best)]
        helpful.sort(key=lambda trial: (trial.score.failing, trial.score.decades))
        held.prepare([trial.changes for trial in helpful])
        starved.prepare([trial.changes for trial in helpful])
        chosen = next(
            (
                trial
                for trial in helpful
                if _holds(start_held, held.readings(trial.changes))
                and ("iterations" in trial.changes or not broken(start_starved, starved.readings(trial.changes)))
            ),
            None,
        )
        if chosen is None:
            break
        changes, best = dict(chosen.changes), chosen.score
    after_held = score(held.readings(changes))
    needless = _needless(engine, bench, changes)
    return Search(
        engine, profile, group, score(start), best, changes, (score(start_held), after_held), tuple(trials), needless
    )


def _around(engine: str, slot: Slot, changes: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Every change by one more setting: all candidate values except the present ones."""
    return [
        {**changes, name: value}
        for name, values in candidates_of(engine).items()
        for value in values
        if changes.get(name, _own(slot, name)) != value
    ]


def _trial(changes: Mapping[str, Any], start: Sequence[Reading], bench: _Bench) -> Trial:
    found = bench.readings(changes)
    return Trial(changes, score(found), broken(start, found))


def _own(slot: Slot, name: str) -> Any:
    """Value of a setting in the profile, or None where it is as shipped."""
    found = load(slot.engine)
    scene = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    return {setting.name: setting.value for setting in settings_of(found, slot, scene)}.get(name)


def _starved(slots: Sequence[Slot]) -> list[Slot]:
    """Cells with the fewer iterations that their scenes declare, for profiles with an iteration count.

    A setting that needs convergence is no improvement.
    """
    counted = [(slot, CATALOGUE[slot.scene].searched) for slot in slots if has_iterations(load(slot.engine), slot)]
    return [replace(slot, iterations=n) for slot, searched in counted if searched for n in searched.starved]


def _holds(before: Sequence[Reading], after: Sequence[Reading]) -> bool:
    """Whether cells outside the search are not worse."""
    return not broken(before, after) and not score(before).better_than(score(after))


def _needless(engine: str, bench: _Bench, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of the profile whose shipped value is as good: same failures, nothing broken, not clearly worse."""
    slot = bench.slots[0]
    scene = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    as_shipped = profile_of(engine, "shipped")
    if as_shipped is None:
        return {}
    shipped = {s.name: s.value for s in load(engine).settings(as_shipped, needs(scene), slot.dt)}
    chosen = {name: changes.get(name, _own(slot, name)) for name in candidates_of(engine)}
    differing = [n for n, own in chosen.items() if n in shipped and own is not None and own != shipped[n]]
    bench.prepare([{**changes, name: shipped[name]} for name in differing])
    reference, found = bench.readings(changes), {}
    for name in differing:
        restored = bench.readings({**changes, name: shipped[name]})
        if not score(reference).better_than(score(restored)) and not broken(reference, restored):
            found[name] = shipped[name]
    return found
