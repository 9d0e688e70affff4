"""Fixes: stock settings that correct an engine's failures as shipped on a scene, and their cost.

    as shipped          the standard cells of the scene: checks that fail
    one setting         every candidate of the engine's experiments, every setting that another profile changes, and
                        ten times the iterations, each alone
    one more            where no setting is enough alone: each candidate beside the best one
    another profile     all its changes, and then fewer and fewer of them, until none can be left out
    the fix             corrects most checks and breaks none; of equals the one with the fewest changes, then the
                        smallest error

The fix of a catalogue scene must hold for similar models: it counts only if it also works in other sizes at another
step (`ELSEWHERE`), with the values that its profile has there. A change that works at one step by the phase of a blow,
or at one size by an engine's margin in metres, is no fix.

Every engine has the same cells, candidates and rule. Error and cost are given side by side: CPU time per step, the
least of interleaved rounds in the benchmark's process, as shipped and fixed. Results are in ``cures.csv`` of the
engine's folder, by scene *and dimension*: a fix measured in 2-D is not claimed for 3-D.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine_folder import CURES, belongs_of, candidates_of, inside
from adapters.registry import find, is_ranked, load, profile_of
from adapters.stepping import step_count
from validation.canonical import Params
from validation.catalogue import CATALOGUE
from validation.cells import Outcome, Slot, prepare, settings_of
from validation.posed import resolve
from validation.running.plan import QUICK_DT, has_iterations
from validation.settings.decisive import changes_of
from validation.settings.switching import Reading, observe, readings, switched

#: Most cells of a search; with more, the scene's representative, planted and searched ones are used.
MOST_CELLS = 6
#: Rounds of timing; the least is the undisturbed time.
ROUNDS = 7
#: Simulated time of a timing [s].
CLOCKED = 0.5
#: Further sizes and the step [s] at which a fix must also hold: bodies of centimetres, as for grippers, instead of
#: decimetres and metres, and the usual step in robotics.
ELSEWHERE = (0.3, 1.0 / 500.0)
#: Share of the tolerance below which an improvement does not count.
INVISIBLE = 1e-3
#: Largest share of the error that may remain for a single setting to be shown beside a fix with several.
HALF = 0.5

Changes = Mapping[str, Any]


@dataclass(frozen=True)
class Cure:
    """The fix of an engine as shipped on one scene and dimension.

    Parameters
    ----------
    cells
        Parameters of the cells that ran, where they differ from the scene's defaults.
    failing, left, judged
        Number of checks of these cells that fail as shipped and with the fix, and of all.
    metric, unit, params
        The check that is shown: the first of the scene's checks that the fix corrects (or that fails, if none), in the
        cell with the largest error.
    truth, tolerance, before, after
        Its numbers; a value is None where the engine has no result.
    changes
        Settings of the fix with their values in that cell; empty if no change helps.
    profile
        Profile with all of these settings; empty if there is none.
    others
        Other single settings that correct as many checks alone.
    tried
        Number of tried changes.
    cost_before, cost_after
        CPU time per step [s] in that cell; None where it was not timed.
    mends
        Kinds of metrics, without index, that failed as shipped and pass in all cells with the fix. Nothing is claimed
        for other kinds; empty in older tables.
    dt
        Step of the cells [s].
    alone, alone_after
        Where the fix has several settings: the one with the largest effect alone that breaks nothing, if it removes at
        least half of the error of the shown check, and the value with it.
    """

    engine: str
    version: str
    shipped: str
    scene: str
    dimension: int
    cells: tuple[Params, ...]
    failing: int
    left: int
    judged: int
    metric: str
    unit: str
    params: Params
    truth: float
    tolerance: float
    before: float | None
    after: float | None
    changes: Changes
    profile: str
    others: tuple[Changes, ...]
    tried: int
    cost_before: float | None
    cost_after: float | None
    mends: tuple[str, ...] = ()
    dt: float = QUICK_DT
    alone: Changes = field(default_factory=dict)
    alone_after: float | None = None

    @property
    def helps(self) -> bool:
        """Whether there is a fix."""
        return self.left < self.failing

    @property
    def recommended(self) -> bool:
        """Whether it corrects at least half of the failing checks; otherwise most of what a user sees stays wrong."""
        return self.helps and 2 * self.left <= self.failing

    @property
    def times(self) -> float | None:
        """Cost of the fix over the cost as shipped."""
        return self.cost_after / self.cost_before if self.cost_before and self.cost_after else None


def asked_of(scene: str, dimension: int) -> tuple[Params, ...]:
    """Cells of a search: all standard ones at the profile's own iterations, or a selection."""
    canonical = resolve(scene)
    cells = [v.params for v in canonical.variations("standard") if v.runs_in(dimension) and None in v.iterations]
    if len(cells) > MOST_CELLS:
        searched = canonical.searched.cells if canonical.searched else ()
        cells = [canonical.representative, *canonical.planted, *searched][:MOST_CELLS]
    return tuple(dict(params) for params in dict.fromkeys(canonical.minimal(params) for params in cells))


@dataclass(frozen=True)
class _Found:
    """A tried change: failing checks, broken ones, and decades of error over tolerance."""

    changes: tuple[Changes, ...]
    failing: int
    broken: bool
    decades: float

    @property
    def size(self) -> int:
        return len({name for each in self.changes for name in each})

    def rank(self) -> tuple[int, int, float]:
        """Sort key of fixes: remaining failures, number of settings, decades."""
        return self.failing, self.size, self.decades


class _Trials:
    """Results of all cells under changes; a change may have another value in each cell. Each cell runs once.

    With ``elsewhere`` each cell also runs in other sizes at another step, where a change must correct the same checks.
    """

    def __init__(self, slots: Sequence[Slot], jobs: int, elsewhere: bool = False) -> None:
        self.slots, self.jobs = slots, jobs
        self.seen: dict[Slot, list[Reading]] = {}
        self.found: list[_Found] = []
        self.own = [_own(slot) for slot in slots]
        size, dt = ELSEWHERE
        self.others = [replace(slot, scene=f"{slot.scene}@{size:g}", dt=dt) for slot in slots] if elsewhere else []
        names = _profiles(slots[0].engine) if elsewhere else []
        #: Changes of each profile in both sizes, cell by cell.
        self.profiles = [
            [(changes_of(slot, name), changes_of(other, name)) for name in names]
            for slot, other in zip(slots, self.others, strict=elsewhere)
        ]
        self._run(slots)
        self.start = [found for slot in slots for found in self.seen[slot]]

    def _readings(self, slots: Sequence[Slot]) -> list[Reading]:
        """Results of one slot for each cell, in the order of `start`; without a value where there is none."""
        found = []
        for own, asked in zip(self.slots, slots, strict=True):
            seen = {reading.check.metric: reading for reading in self.seen[asked]}
            for old in self.seen[own]:
                found.append(seen.get(old.check.metric, Reading(asked, old.check, None, "was not measured")))
        return found

    def _here(self, changes: Sequence[Changes]) -> list[Slot]:
        return [switched(slot, own) for slot, own in zip(self.slots, changes, strict=True)]

    def _run(self, slots: Iterable[Slot]) -> None:
        new = [slot for slot in slots if slot not in self.seen]
        self.seen |= {slot: readings(found) for slot, found in observe(new, self.jobs).items()}

    def _elsewhere(self, changes: Sequence[Changes]) -> list[Slot]:
        """The cells in other sizes under a change, with the profile's values there."""
        found = []
        for other, profiles, own in zip(self.others, self.profiles, changes, strict=bool(self.others)):
            of_profile = (there for here, there in profiles if own.items() <= here.items())
            there = next(of_profile, own)
            found.append(switched(other, {name: there[name] for name in own if name in there}))
        return found

    def all(self, many: Sequence[Sequence[Changes]]) -> list[_Found]:
        """Try changes, all cells together."""
        kept = [[_differing(each, own) for each, own in zip(one, self.own, strict=True)] for one in many]
        kept = [one for one in kept if any(one)]
        self._run(slot for one in kept for slot in self._here(one))
        helpful = [one for one in kept if self._mends(one)]
        self._run(slot for one in helpful for slot in self._elsewhere(one))
        self.found += (tried := [self._found(one) for one in kept])
        return tried

    def _mends(self, changes: Sequence[Changes]) -> bool:
        """Whether a change corrects a check in the scene's own size."""
        after = self._readings(self._here(changes))
        return any(old.badness > 1.0 >= new.badness for old, new in zip(self.start, after, strict=True))

    def badness(self, changes: Sequence[Changes]) -> list[float]:
        """Errors over tolerances with a change; for checks that failed as shipped the worse of both sizes."""
        here, elsewhere = self._readings(self._here(changes)), self._elsewhere(changes)
        if not elsewhere or any(slot not in self.seen for slot in elsewhere):  # or it corrects nothing here
            return [found.badness for found in here]
        worse = zip(self.start, here, self._readings(elsewhere), strict=True)
        return [max(new.badness, other.badness) if old.badness > 1.0 else new.badness for old, new, other in worse]

    def _found(self, changes: Sequence[Changes]) -> _Found:
        after = self.badness(changes)
        broken = any(old.badness <= 1.0 < new for old, new in zip(self.start, after, strict=True))
        bad = [min(max(each, INVISIBLE), 1e3) for each in after]
        failing = sum(b > 1.0 for b in bad)
        return _Found(tuple(changes), failing, broken, sum(math.log10(b / INVISIBLE) for b in bad))


def _own(slot: Slot) -> dict[str, Any]:
    scene = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    return {setting.name: setting.value for setting in settings_of(load(slot.engine), slot, scene)}


def _differing(changes: Changes, own: Changes) -> Changes:
    """Settings that a change sets differently from the profile; an experiment may add others."""
    return {name: value for name, value in changes.items() if name not in own or own[name] != value}


@dataclass(frozen=True)
class Unsearched:
    """Why there was no search: the engine passes as shipped, or (not ``asked``) cannot run the scene."""

    asked: bool
    reason: str


def search(
    engine: str,
    scene: str,
    dimension: int,
    jobs: int = 1,
    params: Params | None = None,
    dt: float | None = None,
) -> Cure | Unsearched:
    """Search a fix for ``engine`` as shipped, if a check fails.

    Parameters
    ----------
    scene
        Name in the catalogue, or a scene file.
    params, dt
        One case and its step [s], searched in its own size and step only. Without params the scene's standard cells;
        without a step that of a model made for this engine, else `QUICK_DT`.

    Raises
    ------
    EngineError, SceneError
        For an unknown or missing engine, an unknown scene.
    """
    brought = resolve(scene).brings.get(engine)
    shipped = brought.profile if brought else profile_of(engine, "shipped")
    dt = dt or (brought.dt if brought else QUICK_DT)
    cells = asked_of(scene, dimension) if params is None else (dict(resolve(scene).minimal(params)),)
    if shipped is None:
        return Unsearched(False, f"{engine} has no profile as shipped")
    if not cells:
        return Unsearched(False, f"{scene} has no standard case in {dimension}-D at a profile's own iterations")
    own = [Slot(scene, tuple(sorted(cell.items())), dimension, engine, shipped, dt) for cell in cells]
    first = observe(own, jobs)
    for found in first.values():
        if found.outcome in (Outcome.UNSUPPORTED, Outcome.NOT_INSTALLED):
            return Unsearched(False, found.reason)
    trials = _Trials(own, jobs, elsewhere=scene in CATALOGUE and params is None and dt == QUICK_DT)
    if not trials.start:
        return Unsearched(False, "no check of its cases is judged")
    failing = [found for found in trials.start if found.badness > 1.0]
    if not failing:
        return Unsearched(True, f"it passes all {len(trials.start)} checks")
    best, singles = _best(engine, trials, own, len(failing))
    return _cure(engine, trials, failing, best, singles)


def _best(engine: str, trials: _Trials, own: Sequence[Slot], failing: int) -> tuple[_Found | None, list[_Found]]:
    """The best change, and all single settings that are as good."""
    others = [name for name in _profiles(engine) if name != own[0].profile]
    wholes = {name: [changes_of(slot, name) for slot in own] for name in others}
    singles = _singles(engine, own, list(wholes.values()))
    found = _useful(trials.all(singles), failing)
    if not found or found[0].failing:
        beside = [each.changes for each in found[:1]]
        pairs = [[{**a, **b} for a, b in zip(one, first, strict=True)] for first in beside for one in singles]
        found += _useful(trials.all(pairs), failing)
    if not found or min(each.failing for each in found):
        found += [_smallest(trials, engine, each) for each in _useful(trials.all(list(wholes.values())), failing)]
    found.sort(key=_Found.rank)
    best = found[0] if found else None
    return best, [each for each in found if best and each.size == 1 and each.failing == best.failing]


def _profiles(engine: str) -> list[str]:
    """Profiles with settings for a fix: ranked ones, since settings of others are not stock."""
    return [name for name in load(engine).profiles if is_ranked(engine, name)]


def _useful(found: Iterable[_Found], failing: int) -> list[_Found]:
    return sorted((each for each in found if not each.broken and each.failing < failing), key=_Found.rank)


def _singles(engine: str, own: Sequence[Slot], wholes: Sequence[Sequence[Changes]]) -> list[list[Changes]]:
    """Single settings: candidates, those of other profiles with dependent ones, and more iterations."""
    belongs = belongs_of(engine)
    singles: list[list[Changes]] = [
        [{name: value}] * len(own) for name, values in candidates_of(engine).items() for value in values
    ]
    for whole in wholes:
        for name in dict.fromkeys(name for each in whole for name in each):
            if belongs.get(name) is None:
                singles.append([{n: v for n, v in each.items() if belongs.get(n, n) == name} for each in whole])
    if all(has_iterations(load(engine), slot) for slot in own):
        counts = [int(_own(slot)["iterations"]) for slot in own]
        singles.append([{"iterations": 10 * count} for count in counts])
    return [one for k, one in enumerate(singles) if one not in singles[:k]]


def _smallest(trials: _Trials, engine: str, whole: _Found) -> _Found:
    """A profile's changes after removing unnecessary ones, one at a time."""
    belongs = belongs_of(engine)
    best = whole
    for name in dict.fromkeys(name for each in whole.changes for name in each if name not in belongs):
        fewer = [{n: v for n, v in each.items() if belongs.get(n, n) != name} for each in best.changes]
        tried = trials.all([fewer])
        if tried and not tried[0].broken and tried[0].failing <= best.failing:
            best = tried[0]
    return best


def _cure(
    engine: str, trials: _Trials, failing: Sequence[Reading], best: _Found | None, singles: Sequence[_Found]
) -> Cure:
    told = _told(trials, failing, best)
    place = trials.slots.index(told.slot)
    changes: Changes = best.changes[place] if best else {}
    if best and not changes:  # no setting corrects the shown check; show values of a cell with changes
        changes = next(each for each in best.changes if each)
    cured = switched(told.slot, best.changes[place]) if best else told.slot
    after = next(each for each in trials.seen[cured] if each.check.metric == told.check.metric)
    before_cost, after_cost = clocked([told.slot, cured]) if best else (None, None)
    others = tuple(each.changes[place] for each in singles if best and each.changes != best.changes)
    check = told.check
    assert check.truth is not None and check.bound is not None  # only judged checks can fail
    return Cure(
        engine, find(engine).version, told.slot.profile, told.slot.scene, told.slot.dimension,
        tuple(dict(slot.params) for slot in trials.slots), len(failing), best.failing if best else len(failing),
        len(trials.start), check.metric, check.unit, dict(told.slot.params), check.truth, check.bound, told.value,
        after.value, changes, _profile_of(engine, trials.slots, best), others, len(trials.found), before_cost,
        after_cost, _mended(trials, failing, best), told.slot.dt, *_alone(trials, told, best),
    )  # fmt: skip


def _alone(trials: _Trials, told: Reading, best: _Found | None) -> tuple[Changes, float | None]:
    """The single setting with the largest effect, and the shown check's value with it; see `Cure.alone`."""
    singles = [each for each in trials.found if each.size == 1 and not each.broken]
    if best is None or best.size == 1 or not singles:
        return {}, None
    changes = min(singles, key=_Found.rank).changes[trials.slots.index(told.slot)]
    seen = trials.seen[switched(told.slot, changes)] if changes else []
    after = next((each for each in seen if each.check.metric == told.check.metric), None)
    return (changes, after.value) if after and after.badness <= HALF * told.badness else ({}, None)


def _kind(found: Reading) -> str:
    return found.check.metric.partition("[")[0]


def _mended(trials: _Trials, failing: Sequence[Reading], best: _Found | None) -> tuple[str, ...]:
    """Kinds that fail as shipped and pass everywhere with the fix, in the scene's order."""
    if best is None:
        return ()
    left = {_kind(old) for old, new in zip(trials.start, trials.badness(best.changes), strict=True) if new > 1.0}
    return tuple(kind for kind in dict.fromkeys(_kind(each) for each in failing) if kind not in left)


def _told(trials: _Trials, failing: Sequence[Reading], best: _Found | None) -> Reading:
    """The shown check: the first of the scene's checks that the fix corrects, in its worst cell."""
    after = trials.badness(best.changes) if best else []
    mended = [old for old, new in zip(trials.start, after, strict=False) if old.badness > 1.0 >= new]
    shown = mended or failing
    first = next(each.check.metric for each in failing if each.check.metric in {one.check.metric for one in shown})
    return max((each for each in shown if each.check.metric == first), key=lambda each: each.badness)


def _profile_of(engine: str, slots: Sequence[Slot], best: _Found | None) -> str:
    """Profile with all settings of a fix."""
    for name in _profiles(engine) if best else ():
        wanted = [changes_of(slot, name) for slot in slots]
        if best and all(each.items() <= w.items() for each, w in zip(best.changes, wanted, strict=True)):
            return name
    return ""


def clocked(slots: Sequence[Slot]) -> tuple[float | None, ...]:
    """CPU time per step of each slot [s]: the least of `ROUNDS`, alternating in one process of the benchmark."""
    from validation.bench.lane import Lane
    from validation.bench.units import Unit

    units = []
    for slot in slots:
        scene = prepare(slot).scene
        steps = step_count(min(CLOCKED, scene.duration), slot.dt)
        units.append(Unit("work", slot, "", len(scene.bodies), 0, steps))
    lane = Lane(patience=120.0)
    lane.start()
    try:
        laps = [[lane.time(unit) for unit in units] for _ in range(ROUNDS)]
    finally:
        lane.stop()
    found = []
    for k, unit in enumerate(units):
        good = [lap[k].seconds / unit.steps for lap in laps if not lap[k].void and lap[k].seconds > 0.0]
        found.append(min(good) if good else None)
    return tuple(found)


# ---- the committed table ---------------------------------------------------------------------------------------------


@cache
def cures_of(engine: str) -> Mapping[tuple[str, int], Cure]:
    """Listed fixes by scene and dimension; empty for an engine without them."""
    path = inside(engine, CURES)
    try:
        found = read(path) if path else []
    except (OSError, ValueError, KeyError, TypeError):  # a file of another package; ours are tested
        return {}
    return {(cure.scene, cure.dimension): cure for cure in found if cure.engine == engine}


#: Format of fields of the table: JSON for composite or optional ones, text for the rest.
_PLAIN = ("engine", "version", "shipped", "scene", "metric", "unit", "profile")


def write(cures: Iterable[Cure], path: Path) -> None:
    """Write a table of fixes; the old one stays until it is complete."""
    fresh = path.with_suffix(".new")
    with fresh.open("w", encoding="utf-8", newline="") as lines:
        table = csv.writer(lines, lineterminator="\n")
        names = [field.name for field in fields(Cure)]
        table.writerow(names)
        for cure in cures:
            rounded = replace(cure, cost_before=_digits(cure.cost_before, 3), cost_after=_digits(cure.cost_after, 3))
            values = [getattr(rounded, name) for name in names]
            cells = [v if n in _PLAIN else json.dumps(v, default=_of_numpy) for n, v in zip(names, values, strict=True)]
            table.writerow(cells)
    fresh.replace(path)


def _of_numpy(value: Any) -> Any:
    """A numpy number as a Python number."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} cannot be written into a table of cures")


def _digits(value: float | None, digits: int) -> float | None:
    return None if value is None else float(f"{value:.{digits}g}")


def read(path: Path) -> list[Cure]:
    """Read a table of fixes."""
    with path.open(encoding="utf-8", newline="") as lines:
        return [_cure_of(row) for row in csv.DictReader(lines)]


def _cure_of(row: Mapping[str, str]) -> Cure:
    values: dict[str, Any] = {name: text if name in _PLAIN else json.loads(text) for name, text in row.items()}
    others = tuple(_settings(each) for each in values["others"])
    values |= {"cells": tuple(values["cells"]), "others": others}
    values |= {name: _settings(values[name]) for name in ("changes", "alone") if name in values}
    values["mends"] = tuple(values.get("mends", ()))  # older tables do not have it
    return Cure(**values)


def _settings(plain: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with tuples again, which JSON turned into lists."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in plain.items()}
