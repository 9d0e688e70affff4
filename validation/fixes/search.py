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
least of interleaved rounds in the benchmark's process, as shipped and fixed. Results are kept by
`validation.fixes.kept`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from adapters.engine_folder import belongs_of, candidates_of, instead_of, local_of
from adapters.registry import find, is_ranked, load, profile_of
from adapters.stepping import step_count
from validation.canonical import Params
from validation.catalogue import CATALOGUE
from validation.cells import Outcome, Slot, prepare
from validation.fixes.kept import Cure, Shown
from validation.fixes.panel import SIZE, Changes, Panel, carried, moved, tried, values_of
from validation.posed import resolve
from validation.running.plan import QUICK_DT, has_iterations
from validation.settings.decisive import changes_of
from validation.settings.switching import Reading, observe, readings, switched

#: Most cells of a search; with more, the scene's representative, planted and searched ones are used.
MOST_CELLS = 6
#: Rounds of timing; the least is the undisturbed time.
ROUNDS = 7
#: Most fixes of a scene that are tried on the panel as found.
BEST = 3
#: Errors within one order of magnitude of the largest, in tolerances, are as large.
NEAR = 10.0
#: Simulated time of a timing [s].
CLOCKED = 0.5
#: Another size and step [s] at which a fix must also hold: bodies of centimetres, as for grippers, instead of
#: decimetres and metres, and the usual step in robotics.
ELSEWHERE = (SIZE, 1.0 / 500.0)
#: Parts of a step before a blow, in scenes that set its time: bodies overlap by a whole step's way at the first step of
#: contact, or hardly. An engine whose contacts stiffen over an overlap rebounds differently there.
PHASES = (1.0 / 32.0, 31.0 / 32.0)
#: Share of the tolerance below which an improvement does not count.
INVISIBLE = 1e-3
#: Largest share of the error that may remain for a single setting to be shown beside a fix with several.
HALF = 0.5


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

    Each cell also runs in ``variants`` of itself, where a change must correct the same checks.
    """

    def __init__(
        self, slots: Sequence[Slot], jobs: int, variants: Callable[[Slot], Sequence[Slot]] = lambda slot: ()
    ) -> None:
        self.slots, self.jobs = slots, jobs
        self.seen: dict[Slot, list[Reading]] = {}
        self.found: list[_Found] = []
        self.own = [values_of(slot) for slot in slots]
        #: Variants of all cells together.
        self.variants = list(zip(*map(variants, slots), strict=True))
        names = _profiles(slots[0].engine) if self.variants else []
        #: Changes of each profile here and in a variant, cell by cell.
        self.profiles = [
            [[(changes_of(slot, name), changes_of(other, name)) for name in names]
             for slot, other in zip(slots, others, strict=True)]
            for others in self.variants
        ]  # fmt: skip
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

    def _elsewhere(self, changes: Sequence[Changes]) -> list[list[Slot]]:
        """The variants under a change: with the profile's values there, else with numbers for their step."""
        found: list[list[Slot]] = []
        for others, profiles in zip(self.variants, self.profiles, strict=True):
            found.append([])
            for slot, other, both, own in zip(self.slots, others, profiles, changes, strict=True):
                of_profile = (there for here, there in both if own.items() <= here.items())
                there = next(of_profile, None) or carried(own, slot, other)
                found[-1].append(switched(other, {name: there[name] for name in own if name in there}))
        return found

    def all(self, many: Sequence[Sequence[Changes]]) -> list[_Found]:
        """Try changes, all cells together."""
        kept = [[_differing(each, own) for each, own in zip(one, self.own, strict=True)] for one in many]
        kept = [one for one in kept if any(one)]
        self._run(slot for one in kept for slot in self._here(one))
        helpful = [one for one in kept if self._mends(one)]
        self._run(slot for one in helpful for others in self._elsewhere(one) for slot in others)
        self.found += (tried := [self._found(one) for one in kept])
        return tried

    def _mends(self, changes: Sequence[Changes]) -> bool:
        """Whether a change corrects a check in the scene's own size."""
        after = self._readings(self._here(changes))
        return any(old.badness > 1.0 >= new.badness for old, new in zip(self.start, after, strict=True))

    def badness(self, changes: Sequence[Changes]) -> list[float]:
        """Errors over tolerances with a change; for checks that failed as shipped the worst of all variants."""
        here, elsewhere = self._readings(self._here(changes)), self._elsewhere(changes)
        if any(slot not in self.seen for others in elsewhere for slot in others):  # it corrects nothing here
            return [found.badness for found in here]
        every = zip(self.start, here, *map(self._readings, elsewhere), strict=True)
        return [max(each.badness for each in (news if old.badness > 1.0 else news[:1])) for old, *news in every]

    def _found(self, changes: Sequence[Changes]) -> _Found:
        after = self.badness(changes)
        broken = any(old.badness <= 1.0 < new for old, new in zip(self.start, after, strict=True))
        bad = [min(max(each, INVISIBLE), 1e3) for each in after]
        failing = sum(b > 1.0 for b in bad)
        return _Found(tuple(changes), failing, broken, sum(math.log10(b / INVISIBLE) for b in bad))


def _differing(changes: Changes, own: Changes) -> Changes:
    """Settings that a change sets differently from the profile; an experiment may add others."""
    return {name: value for name, value in changes.items() if name not in own or own[name] != value}


def in_other_size(slot: Slot) -> list[Slot]:
    """A case in another size at another step (see `ELSEWHERE`); of a blow also at both ends of a step: see `PHASES`."""
    size, dt = ELSEWHERE
    other = replace(slot, scene=f"{slot.scene}@{size:g}", dt=dt)
    step = dt / math.sqrt(size)  # parameters of other sizes are in units of the scene's own
    before = resolve(slot.scene).scene(slot.dimension, dict(slot.params)).params.get("delay")
    times = [] if before is None else [(round(before / step) + part) * step for part in PHASES]
    return [other, *(replace(other, params=tuple(sorted((dict(slot.params) | {"delay": t}).items()))) for t in times)]


def at_other_steps(slot: Slot) -> list[Slot]:
    """A single case at half and double its step, and from moved starts: one that is mended at one step by chance."""
    return moved(slot, (0.5, 2.0))


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
    whole = scene in CATALOGUE and params is None and dt == QUICK_DT
    trials = _Trials(own, jobs, in_other_size if whole else at_other_steps)
    if not trials.start:
        return Unsearched(False, "no check of its cases is judged")
    failing = [found for found in trials.start if found.badness > 1.0]
    if not failing:
        return Unsearched(True, f"it passes all {len(trials.start)} checks")
    ranked = _best(engine, trials, own, len(failing))
    best, panel = on_panel(engine, trials, failing, ranked)
    singles = [each for each in ranked if best and each.size == 1 and each.failing == best.failing]
    return replace(_cure(engine, trials, failing, best, singles), panel=panel)


def on_panel(
    engine: str, trials: _Trials, failing: Sequence[Reading], found: Sequence[_Found]
) -> tuple[_Found | None, Panel | None]:
    """The fix of which the fewest checks fail, those of the panel that it breaks among them; with its panel.

    Tried are the best ones, also with settings of single bodies instead of the world; and, where the first breaks more
    than it mends, with what profiles have in the cases that it breaks. Such a one is taken only if there is no other.
    """

    def tried_on(each: _Found) -> Panel:
        """In the case of the shown check, or the first that it changes."""
        shown = _shown(trials, failing, each)[0].slot
        cases = zip(trials.slots, each.changes, strict=True)
        return tried(*max(cases, key=lambda case: (bool(case[1]), case[0] == shown)), trials.jobs)

    panels = [(each, tried_on(each)) for each in found[:BEST] if each.failing == found[0].failing]
    more = [each for each in _varied(engine, trials, panels) if each not in [known.changes for known in found]]
    for each in trials.all(more):
        if not each.broken and each.failing <= found[0].failing:
            panels.append((each, tried_on(each)))
    panels.sort(key=lambda each: (each[1].withdrawn, each[0].failing + len(each[1].breaks), *each[0].rank()))
    if not panels:
        return None, None
    best, panel = panels[0]

    def as_good(fewer: _Found) -> bool:
        """Elsewhere too: for what profiles have in broken cases, not every setting is needed."""
        now = tried_on(fewer)
        return now.withdrawn <= panel.withdrawn and len(now.breaks) <= len(panel.breaks)

    if best not in found:
        best = _smallest(trials, engine, best, as_good)
    return best, tried_on(best)


def _varied(engine: str, trials: _Trials, panels: Sequence[tuple[_Found, Panel]]) -> list[list[Changes]]:
    """Changes of fixes with what other profiles have in cases that they break, and those of single bodies."""
    found: list[list[Changes]] = []
    for each, panel in panels[:1]:
        for name in _profiles(engine) if panel.withdrawn else ():
            more: dict[str, Any] = {}
            for cost in panel.breaks:
                if cost.slot is not None:
                    more = carried(changes_of(cost.slot, name), cost.slot, trials.slots[0]) | more
            for some in (more, {n: value for n, value in more.items() if n in local_of(engine)}):
                found.append([{**some, **own} for own in each.changes] if some else [])
    for changes in [[dict(own) for own in each.changes] for each, _ in panels] + found:
        for of, instead in instead_of(engine):
            if any(of.items() <= own.items() for own in changes):
                kept = [{n: v for n, v in own.items() if n not in of} for own in changes]
                found.append([{**own, **instead} for own in kept])
    return [each for k, each in enumerate(found) if each and each not in found[:k]]


def _best(engine: str, trials: _Trials, own: Sequence[Slot], failing: int) -> list[_Found]:
    """Changes that mend something and break nothing, the best first."""
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
    return sorted(found, key=_Found.rank)


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
        counts = [int(values_of(slot)["iterations"]) for slot in own]
        singles.append([{"iterations": 10 * count} for count in counts])
    return [one for k, one in enumerate(singles) if one not in singles[:k]]


def _smallest(
    trials: _Trials, engine: str, whole: _Found, as_good: Callable[[_Found], bool] = lambda fewer: True
) -> _Found:
    """Changes after removing unnecessary ones, one at a time."""
    belongs = belongs_of(engine)
    best = whole
    for name in dict.fromkeys(name for each in whole.changes for name in each if name not in belongs):
        fewer = [{n: v for n, v in each.items() if belongs.get(n, n) != name} for each in best.changes]
        tried = trials.all([fewer])
        if tried and not tried[0].broken and tried[0].failing <= best.failing and as_good(tried[0]):
            best = tried[0]
    return best


def _cure(
    engine: str, trials: _Trials, failing: Sequence[Reading], best: _Found | None, singles: Sequence[_Found]
) -> Cure:
    shown = _shown(trials, failing, best)
    told = shown[0]
    place = trials.slots.index(told.slot)
    changes: Changes = best.changes[place] if best else {}
    if best and not changes:  # no setting corrects the shown check; show values of a cell with changes
        changes = next(each for each in best.changes if each)
    cured = switched(told.slot, best.changes[place]) if best else told.slot
    before_cost, after_cost = clocked([told.slot, cured]) if best else (None, None)
    others = tuple(each.changes[place] for each in singles if best and each.changes != best.changes)
    checks = tuple(_numbers(trials, one, best) for one in shown)
    alone, alone_after = _alone(trials, told, best)
    return Cure(
        engine, find(engine).version, told.slot.profile, told.slot.scene, told.slot.dimension,
        tuple(dict(slot.params) for slot in trials.slots), len(failing), best.failing if best else len(failing),
        len(trials.start), **vars(checks[0]), changes=changes, profile=_profile_of(engine, trials.slots, best),
        others=others, tried=len(trials.found), cost_before=before_cost, cost_after=after_cost,
        mends=_mended(trials, failing, best), dt=told.slot.dt, alone=alone, alone_after=alone_after, shown=checks,
    )  # fmt: skip


def _numbers(trials: _Trials, told: Reading, best: _Found | None) -> Shown:
    """A check with its values as shipped and with the fix."""
    check = told.check
    assert check.truth is not None and check.bound is not None  # only judged checks can fail
    cured = switched(told.slot, best.changes[trials.slots.index(told.slot)]) if best else told.slot
    after = next(each.value for each in trials.seen[cured] if each.check.metric == check.metric)
    return Shown(check.metric, check.unit, dict(told.slot.params), check.truth, check.bound, told.value, after)


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


def _shown(trials: _Trials, failing: Sequence[Reading], best: _Found | None) -> list[Reading]:
    """Of each kind of check that the fix corrects (or that fails, if none) the one with the largest error.

    First the kind that a headline names: the first of the scene's with an error within a factor `NEAR` of the largest.
    """
    after = trials.badness(best.changes) if best else []
    mended = [old for old, new in zip(trials.start, after, strict=False) if old.badness > 1.0 >= new]
    worst: dict[str, Reading] = {}
    for each in mended or failing:
        kind = _kind(each)
        worst[kind] = max(worst.get(kind, each), each, key=lambda one: one.badness)
    largest = max(each.badness for each in worst.values())
    first = next(each for each in worst.values() if NEAR * each.badness >= largest)
    return [first, *(each for each in worst.values() if each is not first)]


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
