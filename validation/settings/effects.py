"""Settings that do nothing: each is set to another value where it should act, and the motions are compared.

    the case                     with the setting           other bits anywhere: it acts
    the case, with its needs     with the setting           only there: it acts only with another setting
    with the setting             with a value beyond it     equal: the engine clamps it

The cases are in ``tuning.toml`` of the engine (`adapters.experiment.Effect`); a scene file that one names is in this
folder. Results are kept beside the cases (``effects.csv``) by release of the engine; ``crosscheck tune ENGINE
--effects`` measures them again. They are compared bit by bit, in states, contacts that the scene reads, and metrics: no
setting that acts is taken for one that does not.
A setting acts if a metric changes by more than round-off of the engine's precision. Where no bit changes and no reason
is known, it may still act in another scene.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import astuple, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

from adapters.engine import Engine, Setting
from adapters.engine_folder import EFFECTS, effects_of, rows_of
from adapters.experiment import Effect
from adapters.needs import needs
from adapters.registry import find, load, profile_of
from adapters.scene import Scene
from adapters.settings import text_of
from adapters.settings.own import kinds_of
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot, scene_of, settings_of
from validation.posed import is_file, pinned, resolve
from validation.running.plan import QUICK_DT
from validation.settings.switching import observe, switched

ACTS, ROUNDED, UNSEEN, NOTHING, CLAMPED, ONLY_WITH, REFUSED, UNTRIED = (
    "acts", "within round-off", "not seen to act", "without effect", "clamped", "only with", "refused", "not tried",
)  # fmt: skip


@dataclass(frozen=True)
class Told:
    """What a setting does.

    Parameters
    ----------
    engine, version, setting
        Of which release.
    verdict
        `ACTS` and so on.
    value, scene, metric, before, after
        What it was set to, its case, and the metric without and with the setting; empty where there is none. Where the
        metric of the case is the same, that of the scene which changes most.
    read
        ``yes`` if what the engine reads back changes with it; ``no``; empty where it was not tried.
    because
        Why, as the engine has it; empty for one that acts.
    """

    engine: str
    version: str
    setting: str
    verdict: str
    value: str = ""
    scene: str = ""
    metric: str = ""
    before: str = ""
    after: str = ""
    read: str = ""
    because: str = ""


def settings_known(engine: str) -> list[str]:
    """Settings of an engine: those of its profiles, and those that a user may set."""
    found = load(engine)
    names: dict[str, None] = {}
    for profile in found.profiles:
        for canonical in CATALOGUE.values():
            for dimension in canonical.dimensions:
                own = found.settings(profile, needs(canonical.scene(dimension)), QUICK_DT)
                names |= dict.fromkeys(kinds_of(found, own))
    return sorted(names)


def measure(engine: str, jobs: int = 1) -> list[Told]:
    """Set every setting of ``engine`` where it should act."""
    cases = effects_of(engine)
    runs = {name: _slots(engine, name, effect) for name, effect in cases.items() if not effect.untried}
    seen = observe([slot for own in runs.values() for slot in own.values()], jobs)
    version, found = _release(find(engine).version), []
    for name in settings_known(engine):
        effect = cases.get(name, Effect(untried="no case is stated"))
        if effect.untried:
            found.append(Told(engine, version, name, UNTRIED, because=effect.untried))
        else:
            own = {part: seen[slot] for part, slot in runs[name].items()}
            found.append(judged(engine, version, name, effect, own, load(engine).facts.round_off))
    return found


def _slots(engine: str, name: str, effect: Effect) -> dict[str, Slot]:
    """The case without and with the setting; the same with what it needs; and beyond its limit."""
    profile = effect.profile or profile_of(engine, "shipped") or next(iter(load(engine).profiles))
    scene = pinned(str(Path(__file__).with_name(effect.scene))) if is_file(effect.scene) else effect.scene
    base = Slot(scene, tuple(sorted(effect.params.items())), effect.dimension, engine, profile, QUICK_DT)
    found = {"base": base, "set": switched(base, {name: effect.set})}
    if effect.needs:
        ready = switched(base, effect.needs)
        found |= {"ready": ready, "both": switched(ready, {name: effect.set})}
    if effect.beyond is not None:
        found["beyond"] = switched(base, {**effect.needs, name: effect.beyond})
    return found


def judged(
    engine: str, version: str, name: str, effect: Effect, seen: Mapping[str, Observation], round_off: float
) -> Told:
    """The verdict on a setting by the runs of its case.

    Parameters
    ----------
    seen
        Runs by ``base``, ``set``; ``ready``, ``both`` with what it needs; ``beyond``.
    round_off
        Of a metric of order 1, or of its own share; `adapters.engine.EngineFacts.round_off`.
    """
    base, tried = seen["base"], seen["set"]
    ready = seen["ready"] if effect.needs and seen["ready"].outcome in RAN else base
    verdict, because = NOTHING, effect.because
    if not because:
        verdict, because = UNSEEN, f"no bit of {effect.scene} changes"
    if _differ(base, tried):
        verdict, because = ACTS, effect.because
    elif effect.needs and _differ(ready, seen["both"]):
        base, tried = ready, seen["both"]
        verdict = ONLY_WITH
        others = ", ".join(f"{other}={text_of(value)}" for other, value in effect.needs.items())
        because = f"{others}: {effect.because}" if effect.because else others
    elif tried.outcome not in RAN:
        verdict, because = REFUSED, tried.reason
    metric = _changed(effect.metric, base, tried, round_off)
    if verdict in (ACTS, ONLY_WITH) and not metric and base.outcome == tried.outcome:
        verdict, because = ROUNDED, f"no metric of {effect.scene} changes by more"
    far = seen.get("beyond")
    if verdict in (ACTS, ONLY_WITH) and far and far.outcome in RAN and not _differ(far, tried):
        limit = text_of(effect.set) + (" at a step of 1/240 s" if effect.in_steps else "")
        verdict, because = CLAMPED, f"{text_of(effect.beyond)} is as {limit}: {effect.because}"
    metric = metric or effect.metric
    before, after = _texts(*_values(metric, base, tried))
    read = "" if tried.outcome not in RAN else "yes" if base.readback != tried.readback else "no"
    case = text_of(effect.set), effect.scene, metric
    return Told(engine, version, name, verdict, *case, before, after, read, because)


def _differ(one: Observation, other: Observation) -> bool:
    """Whether both ran, with other bits."""
    ran = one.outcome in RAN and other.outcome in RAN
    return ran and (one.outcome, one.state_hash, one.metrics) != (other.outcome, other.state_hash, other.metrics)


#: A setting that makes a run diverge, or an answer without a certificate, acts as well.
RAN = (Outcome.OK, Outcome.DIVERGED, Outcome.INVALID, Outcome.REFUSED)


def _values(metric: str, *runs: Observation) -> list[float | None]:
    """The metric of each run; None where it is no number."""
    found = [run.metrics.get(metric, (None, ""))[0] for run in runs]
    return [value if value is not None and math.isfinite(value) else None for value in found]


def _changed(metric: str, base: Observation, tried: Observation, round_off: float) -> str:
    """The metric, or where it is the same the one that changes most; empty if none changes by more than round-off."""

    def change(name: str) -> float:
        before, after = _values(name, base, tried)
        if before is None or after is None:
            return 0.0 if before == after else math.inf
        return abs(after - before) / max(1.0, abs(before), abs(after))

    changes = {name: change(name) for name in (metric, *base.metrics, *tried.metrics)}
    found = [name for name, size in changes.items() if size > round_off]
    if metric in found:
        return metric
    return max(found, key=lambda name: (changes[name] < math.inf, changes[name]), default="")


def _texts(*values: float | None) -> list[str]:
    """Numbers with four digits, or as many more as tell them apart; empty for one that is none."""
    for digits in range(4, 18):
        texts = ["" if value is None else f"{value:.{digits}g}" for value in values]
        if len(set(texts)) == len(set(values)):
            break
    return texts


# ---- what is kept ----------------------------------------------------------------------------------------------------

COLUMNS = tuple(field.name for field in fields(Told))


@cache
def told_of(engine: str) -> tuple[Told, ...]:
    """Kept results of ``engine``, of all releases; empty if there are none."""
    return tuple(entry for entry in rows_of(engine, EFFECTS, read) if entry.engine == engine)


def of_release(engine: str, version: str) -> dict[str, Told]:
    """Kept results of one release, by setting."""
    return {entry.setting: entry for entry in told_of(engine) if entry.version == _release(version)}


def _release(version: str) -> str:
    """A version without the hash of our solver's sources."""
    return version.partition("+")[0]


def read(path: Path) -> Iterator[Told]:
    """Read a kept table."""
    with path.open(encoding="utf-8", newline="") as lines:
        yield from (Told(**{name: row[name] for name in COLUMNS}) for row in list(csv.DictReader(lines)))


def write(entries: Iterable[Told], path: Path) -> None:
    """Write results; those of other releases stay."""
    new = list(entries)
    versions = {entry.version for entry in new}
    old = [entry for entry in (read(path) if path.exists() else ()) if entry.version not in versions]
    with path.open("w", encoding="utf-8", newline="") as lines:
        table = csv.writer(lines, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(map(astuple, [*old, *new]))
    told_of.cache_clear()


# ---- for those who set one -------------------------------------------------------------------------------------------


def idle_in(slots: Iterable[Slot]) -> list[str]:
    """One line for each setting, of a user or of a model, that does nothing as it is set in these cells."""
    found: dict[str, None] = {}
    for slot in {(each.scene, each.engine, each.profile, each.dt): each for each in slots}.values():
        installed = find(slot.engine)
        brought = resolve(slot.scene).brought(slot.engine, slot.base)
        if installed.engine is None or not (slot.is_own or brought):
            continue
        engine, scene = installed.engine, scene_of(slot)
        stock = {s.name: s.value for s in _shipped(engine, scene, slot.dt)}
        asked = (
            [(s.name, s.value) for s in brought.settings if stock.get(s.name, s.value) != s.value] if brought else []
        )
        asked += slot.switched
        own = {s.name: s.value for s in settings_of(engine, slot, scene)}
        found |= dict.fromkeys(idle(slot.engine, installed.version, asked, own, slot.dt))
    return list(found)


def _shipped(engine: Engine, scene: Scene, dt: float) -> list[Setting]:
    profile = engine.facts.profile("shipped")
    return engine.settings(profile, needs(scene), dt) if profile else []


def idle(
    engine: str, version: str, asked: Iterable[tuple[str, Any]], own: Mapping[str, Any], dt: float
) -> Iterator[str]:
    """One line for each setting that does nothing as it is set.

    Parameters
    ----------
    asked
        Settings of a user or of a model, with their values.
    own
        All settings of the run, with those.
    dt
        Its step [s].
    """
    kept, cases = of_release(engine, version), effects_of(engine)
    for name, value in asked:
        told, effect = kept.get(name), cases.get(name, Effect())
        label, where = f"{name}={text_of(value)}", f"{engine} {_release(version)}"
        if told is None or any(_has(own, other, free) for other, free in effect.unless.items()):
            continue
        if told.verdict == NOTHING:
            yield f"{label} does nothing in {where}: {told.because}"
        elif told.verdict == UNSEEN:
            yield f"{label} may do nothing in {where}: it changes no bit of scene {told.scene}, where it was tried"
        elif told.verdict == ONLY_WITH and not all(_has(own, other, need) for other, need in effect.needs.items()):
            others = " and ".join(f"{other}={text_of(need)}" for other, need in effect.needs.items())
            yield f"{label} acts in {where} only with another setting, such as {others}"
        elif told.verdict == CLAMPED and (limit := beyond(value, effect, dt)) is not None:
            yield f"{label} acts as {limit:.4g} in {where}: {effect.because}"


def _has(own: Mapping[str, Any], name: str, need: Any) -> bool:
    """Whether a setting is as another needs it: that word or flag, among words that one, of numbers any above 0."""
    value = own.get(name)
    if isinstance(need, tuple):
        return isinstance(value, tuple) and set(need) <= set(value)
    return value == need if isinstance(need, str) or need == 0 else bool(value)


def beyond(value: Any, effect: Effect, dt: float) -> Any:
    """The limit that a value of a setting lies beyond; None if it does not.

    A limit is the first number in which ``set`` and ``beyond`` differ. Numbers of the other sign mean
    something else.
    """
    rows = [each if isinstance(each, tuple | list) else (each,) for each in (value, effect.set, effect.beyond)]
    if len({len(each) for each in rows}) > 1 or any(isinstance(part, str) for each in rows for part in each):
        return None
    for given, limit, far in zip(*rows, strict=True):
        if limit != far:
            below, scaled = far < limit, limit * dt / QUICK_DT if effect.in_steps else limit
            outside = given < scaled if below else given > scaled
            return scaled if outside and given * limit >= 0.0 else None
    return None
