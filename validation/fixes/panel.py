"""The panel: other cases on which a fix is tried before it is printed, and what it mends and breaks there.

    own       its scene at other steps, in another size and mass, from moved starts; a check counts once for all of them
    others    cases of other groups, those of ``panel.toml``

A check that passes as shipped and fails with the fix is broken; so is one that fails by `WORSE` times as much. A check
that fails as shipped and passes with the fix is mended. A fix that breaks more than it mends is withdrawn.

What is run is what is printed: a number with a formula in step and gravity has its value in each case. Settings that
an engine has for single pairs or bodies (``local`` in its ``tuning.toml``) are meant for pairs that rebound, or do not,
as in the fix's scene; they are left out of cases of the other kind.
"""

from __future__ import annotations

import tomllib
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from adapters.engine_folder import local_of
from adapters.experiment.files import params_of
from adapters.needs import needs
from adapters.registry import adapter, facts, load
from validation.cells import Observation, Outcome, Slot, scene_of, settings_of
from validation.posed import is_file, pinned, resolve
from validation.running.plan import QUICK_DT
from validation.settings.switching import Reading, observe, readings, switched

Changes = Mapping[str, Any]
#: Steps at which a scene's own cases run, as multiples of theirs.
STEPS = (0.25, 4.0)
#: Size of another model of the scene, `validation.scenes.sized`, and moves of its starts [units in the last place].
SIZE, MOVES = 0.3, (-16, 16)
#: The cases of its own scene in words.
OWN_SCENE = "its own scene elsewhere"
#: Error with a fix, over that as shipped, from which a failing check counts as broken too. The factor is chosen: a
#: user loses little by more of an error that was there.
WORSE = 3.0
#: Factor of a number that is printed as a formula.
FALL = "*g*dt^2"
#: Readings as shipped and fixed, by case and kind of check.
Checks = dict[tuple[str, str], list[tuple[Reading, Reading]]]
_seen: dict[Slot, Observation] = {}
_FILES = Path(__file__).parent / "scenes"
#: Cases of other groups: words, a scene of the catalogue with parameters or a file beside this module, its dimensions
#: where not all, and a step [s].
OTHERS = tuple(
    (case["words"], case["scene"], params_of(case.get("params", {})), case.get("dimensions"), case.get("dt", QUICK_DT))
    for case in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["case"]
)


@dataclass(frozen=True)
class Cost:
    """A check that a fix breaks: the case in words, the check, its numbers as shipped, fixed and true.

    ``slot`` is the case as shipped while the panel is at hand; a table does not keep it.
    """

    case: str
    metric: str
    unit: str
    before: float | None
    after: float | None
    truth: float
    slot: Slot | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Panel:
    """What a fix does elsewhere.

    Parameters
    ----------
    cases
        Number of cases that ran.
    mends
        Number of checks that it mends.
    breaks
        Checks that it breaks, the worst first.
    """

    cases: int
    mends: int
    breaks: tuple[Cost, ...]

    @property
    def withdrawn(self) -> bool:
        """Whether it breaks more than it mends."""
        return len(self.breaks) > self.mends


def moved(slot: Slot, steps: Sequence[float]) -> list[Slot]:
    """A case at multiples of its step, and from moved starts."""
    return [*(replace(slot, dt=factor * slot.dt) for factor in steps), *(replace(slot, ulp=move) for move in MOVES)]


def own_cases(slot: Slot) -> list[Slot]:
    """A case of a fix at other steps, from moved starts, and in another size and mass."""
    found = moved(slot, STEPS)
    return found if is_file(slot.scene) else [*found, replace(slot, scene=f"{slot.scene}@{SIZE:g}")]


@cache
def other_cases(engine: str, profile: str) -> tuple[tuple[str, Slot], ...]:
    """The cases of other groups that an engine of these dimensions has, in 3-D if it has it."""
    known = facts(engine)
    dimensions = known.dimensions if known else frozenset({2})
    found = []
    for words, name, params, own, dt in OTHERS:
        scene = pinned(str(_FILES / name)) if name.endswith(".toml") else name
        fits = [d for d in own or resolve(scene).dimensions if d in dimensions]
        if fits:
            found.append((words, Slot(scene, resolve(scene).minimal(params), max(fits), engine, profile, dt)))
    return tuple(found)


def values_of(slot: Slot) -> dict[str, Any]:
    """Settings of a case by name; those of our engines do not need the engine itself."""
    engine = adapter(slot.engine) or load(slot.engine)
    return {setting.name: setting.value for setting in settings_of(engine, slot, scene_of(slot))}


def carried(changes: Changes, here: Slot, there: Slot) -> dict[str, Any]:
    """Settings of a fix of one case in another: numbers that are printed as a share of g dt^2 are those of its fall."""
    loaded = adapter(here.engine)
    if loaded is None or not changes:
        return dict(changes)
    told = loaded.words(values_of(switched(here, changes)), scene_of(here), here.dt)
    fall = needs(scene_of(there)).pull * there.dt**2
    found = dict(changes)
    for name in changes:
        formula = told.get(name, ("", ""))[1]
        if isinstance(formula, str) and formula.endswith(FALL):
            found[name] = float(formula.removesuffix(FALL)) * fall
    return found


def _meant(changes: Changes, here: Slot, there: Slot) -> dict[str, Any]:
    """Settings of a fix in a case of another group; without the local ones where no pair is of the fix's kind."""
    own = carried(changes, here, there)
    bounces = [{e > 0.0 for e, _ in scene_of(slot).materials()} for slot in (here, there)]
    if bounces[0] & bounces[1] or not bounces[1]:
        return own
    return {name: value for name, value in own.items() if name not in local_of(here.engine)}


def cases_of(here: Slot, change: Changes) -> list[tuple[str, Slot, Slot]]:
    """The cases of a fix in words, each as shipped and fixed; ``here`` is its own as shipped."""
    own = [(OWN_SCENE, there, carried(change, here, there)) for there in own_cases(here)]
    others = [
        (words, there, _meant(change, here, there))
        for words, there in other_cases(here.engine, here.profile)
        if there.scene != here.scene
    ]
    return [(words, there, switched(there, change)) for words, there, change in [*own, *others] if change]


def tried(here: Slot, change: Changes, jobs: int = 1) -> Panel:
    """Try the settings of a fix on the panel; ``here`` is its case as shipped."""
    return compared(cases_of(here, change), jobs)


def of_profile(engine: str, shipped: str, profile: str, jobs: int = 1) -> Panel:
    """A profile, with its own settings in each case of the panel, against the engine as shipped."""
    cases = other_cases(engine, shipped)
    return compared([(words, there, replace(there, profile=profile)) for words, there in cases], jobs)


def compared(asked: Sequence[tuple[str, Slot, Slot]], jobs: int = 1) -> Panel:
    """Cases in words, each as shipped and fixed."""
    found = _observed([slot for _, *both in asked for slot in both], jobs)
    sound = [each for each in asked if found[each[1]].outcome is Outcome.OK]
    checks: Checks = defaultdict(list)
    for words, there, fixed in sound:
        after = {each.check.metric: each for each in readings(found[fixed])}
        for before in readings(found[there]):
            if before.value is not None and before.check.metric in after:
                checks[words, before.check.metric.partition("[")[0]].append((before, after[before.check.metric]))
    return judged(checks, len(sound))


def _observed(slots: Iterable[Slot], jobs: int) -> dict[Slot, Observation]:
    """Cases that this process has not run yet are run: many fixes have the same settings."""
    slots = list(slots)
    _seen.update(observe([slot for slot in slots if slot not in _seen], jobs))
    return {slot: _seen[slot] for slot in slots}


def judged(checks: Checks, cases: int) -> Panel:
    """Count kinds of checks: of each, by case, the readings as shipped and fixed of one variant or several."""
    breaks, mends = [], 0
    for (words, _), both in checks.items():
        broken = (pair for pair in both if is_broken(*(each.badness for each in pair)))
        worst = max(broken, key=lambda pair: pair[1].badness, default=None)
        if worst:
            before, after = worst
            assert before.check.truth is not None
            numbers = before.value, after.value, before.check.truth
            breaks.append((after.badness, Cost(words, before.check.metric, before.check.unit, *numbers, before.slot)))
        mends += not worst and any(after.badness <= 1.0 < before.badness for before, after in both)
    breaks.sort(key=lambda each: -each[0])
    return Panel(cases, mends, tuple(cost for _, cost in breaks))


def is_broken(before: float, after: float) -> bool:
    """Whether a check is broken, from its errors in tolerances."""
    return after > max(1.0, WORSE * before if before > 1.0 else 1.0)
