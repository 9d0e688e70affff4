"""Fixes of an engine: settings in which a passing profile differs from a failing one."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from adapters import registry
from adapters.engine_folder import belongs_of
from adapters.scene import SceneError
from adapters.settings import text_of
from reports.wording import amount, number, params_text, quantity, setting_text
from validation.cells import Observation, Slot, format_dt, scene_of
from validation.cells import settings_of as settings_in
from validation.fixes.kept import Cure, Shown, cures_of, panels_of
from validation.fixes.panel import OTHERS, Panel, carried
from validation.fixes.search import asked_of
from validation.posed import is_file, resolve
from validation.running.plan import QUICK_DT
from validation.settings.decisive import ALONE, COMPLETES, NEEDED, Decisive, changes_of, decisive
from validation.settings.switching import switched

#: Text of a search without a result.
NONE_HELPS = "no setting helps"
#: Most cases that a fix breaks with their numbers.
NAMED = 2
#: Cases of the panel in its order.
ORDER = [words for words, *_ in OTHERS]
#: Words for the role of a setting in a fix.
ROLES = {
    ALONE: "enough alone",
    NEEDED: "needed",
    COMPLETES: "also needed, but replaceable",
    "": "not needed",
}


@dataclass(frozen=True)
class Change:
    """A setting that differs between two profiles; ``role`` is whether it matters, if measured."""

    name: str
    before: str
    after: str
    because: str
    role: str = ""


def shown_cell(
    observations: Sequence[Observation],
    scene: str,
    dimension: int,
    engine: str,
    profile: str,
    params: Mapping[str, float] | None = None,
) -> Observation | None:
    """The representative case of a profile on a scene, else the first one with settings.

    ``params`` (differences from the scene's defaults) selects another case.
    """
    own = [
        o for o in observations
        if o.slot.scene == scene and o.slot.engine == engine and o.slot.profile == profile
        and o.slot.dimension == dimension and o.settings and o.slot.iterations is None
    ]  # fmt: skip
    canonical = resolve(scene)
    wanted = canonical.minimal(canonical.representative if params is None else params)
    shown = [o for o in own if o.slot.params == wanted]
    return next(iter(shown or own), None)


def changes(
    observations: Sequence[Observation],
    scene: str,
    dimension: int,
    engine: str,
    before: str,
    after: str,
    params: Mapping[str, float] | None = None,
) -> list[Change]:
    """Settings that differ between profiles ``after`` and ``before``, in the engine's own words.

    They are those of the case of ``params``, see `shown_cell`.
    """
    cells = [shown_cell(observations, scene, dimension, engine, profile, params) for profile in (before, after)]
    old, new = ({s["name"]: s for s in cell.settings} if cell else {} for cell in cells)
    measured = decisive(engine, scene, dimension, before, after)
    roles = {part.setting: ROLES[part.decides] for part in measured.parts} if measured else {}
    belongs = belongs_of(engine)
    was, now = (_in_words(cell) if cell else {} for cell in cells)
    found = []
    for name, setting in new.items():
        if name in now and (name not in old or old[name]["value"] != setting["value"]):
            role = roles.get(name) or (f"part of {belongs[name]}" if measured and name in belongs else "")
            word, value = now[name]
            found.append(Change(word, was.get(name, ("", "as shipped"))[1], value, setting["because"], role))
    return found


def _in_words(cell: Observation) -> dict[str, tuple[str, str]]:
    """Settings of a case, by name: the engine's own names, and their values as text."""
    settings = {s["name"]: s["value"] for s in cell.settings}
    return in_words(cell.slot, settings)


def in_words(slot: Slot, settings: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Settings in words of the engine of a slot, by our name: its own name, and the value or formula as text.

    Without those included in another one; see `adapters.engine.Engine.words`.
    """
    loaded = registry.adapter(slot.engine)
    made = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    words = loaded.words(settings, made, slot.dt) if loaded else {}
    named = {name: words.get(name, (name, value)) for name, value in settings.items()}
    return {name: (word, setting_text(value)) for name, (word, value) in named.items() if word}


def decided_by(engine: str, version: str, scene: str, dimensions: Sequence[int], before: str, after: str) -> str:
    """Decisive settings of a fix by `validation.settings.decisive`; empty without a measurement for this release.

    The dimension of a measurement is named if rows of another one fail as well.
    """
    measured = {d: decisive(engine, scene, d, before, after) for d in dimensions}
    texts = {d: _decided(m) for d, m in measured.items() if m is not None and m.version == version}
    if len(texts) == len(dimensions) and len(set(texts.values())) == 1:
        return texts[dimensions[0]]
    return ", ".join(f"{text} ({d}-D)" for d, text in texts.items())


def _decided(measured: Decisive) -> str:
    """`Decisive.text` in the engine's own words."""
    slot = Slot(measured.scene, (), measured.dimension, measured.engine, measured.better, QUICK_DT)
    words = in_words(slot, _settings(slot))
    return re.sub(r"\w+", lambda name: words.get(name[0], (name[0], ""))[0], measured.text)


def _settings(slot: Slot) -> dict[str, Any]:
    """Settings of a slot by name; none for an engine of another package."""
    loaded = registry.adapter(slot.engine)
    if loaded is None:
        return {}
    made = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    return {s.name: s.value for s in settings_in(loaded, slot, made)}


def told_cures(engine: str, version: str, scene: str, shipped: str, dimensions: Sequence[int]) -> list[str]:
    """Measured fixes of a scene in each of ``dimensions``, with this release, from the committed table."""
    known = known_cures(engine, version, scene, shipped, dimensions)
    if len(known) == 2 and not any(cure.helps for cure, _ in known):
        return [f"{NONE_HELPS} ({', '.join(f'{cure.tried} tried in {where}' for cure, where in known)})"]
    return [recorded_text(*each) for each in known]


def known_cures(
    engine: str, version: str, scene: str, shipped: str, dimensions: Sequence[int]
) -> list[tuple[Cure, str]]:
    """The committed fixes of a scene with this release, each with its dimensions; equal ones of both only once."""
    listed = [cures_of(engine).get((scene, d)) for d in dimensions]
    known = [c for c in listed if c is not None and (c.version, c.shipped) == (version, shipped)]
    if len(known) == 2 and known[0].helps and known[0].changes == known[1].changes:  # a worse one is named
        worse = max(known, key=lambda cure: (cure.left, cure.times or 0.0))
        return [(worse, "2-D and 3-D")]
    return [(cure, f"{cure.dimension}-D") for cure in known]


def recorded_text(cure: Cure, where: str = "") -> str:
    """`cure_text` after what it achieves; only the count where it is not `Cure.recommended`."""
    where = where or f"{cure.dimension}-D"
    if cure.withdrawn:
        return f"{where}: {withdrawn_text(cure)}"
    if cure.helps and not cure.recommended:
        fixed = f"{cure.failing - cure.left} of {cure.failing} checks"
        return f"{where}: the best settings found fix {fixed} ({cure.tried} tried)"
    what = "smallest fix, " if not cure.left else "best settings found, "
    return (what if cure.helps else "") + cure_text(cure, where)


def withdrawn_text(cure: Cure) -> str:
    """Why a fix is not printed."""
    return f"no fix: what was found breaks more elsewhere than it fixes ({panel_text(cure.panel)})"


def told_cure(row: Mapping[str, Any]) -> str:
    """Measured fix of the check of one row, or that there is none, or no search.

    A fix belongs to the cases and the step of its search; for another case the text names the search command.
    """
    cure = _listed(row)
    if cure is None:
        return f"none was searched for in this case; to search: {search_command(row)}" if can_be_searched(row) else ""
    if cure.withdrawn:
        return withdrawn_text(cure)
    kinds = cure.mends or (cure.metric.partition("[")[0],)  # its own metric if no kind is fixed in all cases
    if not cure.helps or _is_mended(cure, row):
        return cure_text(cure)
    return f"none is known for this check; for {', '.join(kinds)} in this scene, {cure_text(cure)}"


def cure_of(row: Mapping[str, Any]) -> Cure | None:
    """The listed fix for the check of a row in its own case, with its values there; None if there is none."""
    cure = _listed(row)
    if cure is None or not cure.helps or cure.withdrawn or not _is_mended(cure, row):
        return None
    params = dict(_minimal(row))
    if params == dict(cure.params):
        return cure
    here = replace(cure, params=params)
    if not cure.profile:
        return here
    wanted = changes_of(_slot(here, {}), cure.profile)
    return replace(here, changes={name: wanted[name] for name in cure.changes if name in wanted})


def can_be_searched(row: Mapping[str, Any]) -> bool:
    """Whether a row belongs to the start profile of `search`, in a case with its own iterations."""
    brought = resolve(row["scene"]).brings.get(row["engine"])
    start = brought.profile if brought else registry.profile_of(row["engine"], "shipped")
    ran = row.get("outcome") not in ("unsupported", "not_installed") and row.get("iterations") is None
    return ran and row["profile"] == start


def _listed(row: Mapping[str, Any]) -> Cure | None:
    """The listed fix from a search in a row's own case, on its release."""
    cure = cures_of(row["engine"]).get((row["scene"], row["dimension"]))
    if cure is None or (cure.version, cure.shipped) != (row["engine_version"], row["profile"]):
        return None
    asked = dict(_minimal(row)) in [dict(cell) for cell in cure.cells]
    return cure if asked and row.get("dt", cure.dt) == cure.dt and row.get("iterations") is None else None


def _is_mended(cure: Cure, row: Mapping[str, Any]) -> bool:
    kinds = cure.mends or (cure.metric.partition("[")[0],)
    return is_shown(cure, row) or row["metric"].partition("[")[0] in kinds


def is_shown(shown: Cure | Shown, row: Mapping[str, Any]) -> bool:
    """Whether a row is the check that shows what a fix does."""
    return row["metric"] == shown.metric and dict(_minimal(row)) == dict(shown.params)


def is_standard(row: Mapping[str, Any]) -> bool:
    """Whether a row's case belongs to a default search of its scene."""
    if is_file(row["scene"]) or row.get("dt", QUICK_DT) != QUICK_DT or row.get("iterations") is not None:
        return False
    return dict(_minimal(row)) in asked_of(row["scene"], row["dimension"])


def search_command(row: Mapping[str, Any]) -> str:
    """Command that searches a fix for a row's case."""
    words = ["crosscheck", "cure", row["engine"], row["scene"]]
    return shlex.join(words if is_standard(row) else [*words, *_case(row)])


def _case(row: Mapping[str, Any]) -> list[str]:
    """Options that select a row's case."""
    words = [word for name, value in _minimal(row) for word in ("--param", f"{name}={value:.12g}")]
    brought = resolve(row["scene"]).brings.get(row["engine"])
    if row.get("dt", QUICK_DT) != (brought.dt if brought else QUICK_DT):
        words += ["--dt", format_dt(row["dt"])]
    return words if is_file(row["scene"]) else [*words, "--dim", str(row["dimension"])]


def _minimal(row: Mapping[str, Any]) -> tuple[tuple[str, float], ...]:
    """Parameters of a row that differ from its scene's defaults; all of them if the present scene lacks some.

    A row may belong to an older run with another name or range of a parameter.
    """
    params = row["slot"]["params"] if "slot" in row else row.get("params", {})
    try:
        return resolve(row["scene"]).minimal(params)
    except SceneError:
        return tuple(sorted(params.items()))


@dataclass(frozen=True)
class Told:
    """Words about a fix, piece by piece; pieces that do not apply are empty.

    Parameters
    ----------
    settings
        Names and values in the engine's own words.
    check, at
        The check that shows it, and its parameters.
    before, after, truth, unit
        Its values; the truth only if it is neither 0 nor the value after.
    left
        How many checks still fail.
    times
        Cost relative to that before.
    """

    settings: list[tuple[str, str]]
    check: str
    at: str
    before: str
    after: str
    truth: str
    unit: str
    left: str
    times: str


def told(cure: Cure) -> Told:
    """The pieces from which terminal and page describe a fix."""
    before, after, truth = told_apart(cure.before, cure.after, cure.truth)
    return Told(
        changes_in_words(cure, cure.changes),
        cure.metric,
        params_text(cure.params),
        before,
        after,
        truth if truth not in ("0", after) else "",
        "" if cure.unit == "1" else cure.unit,
        f"{cure.left} of {cure.failing} checks still fail" if cure.left else "",
        f"{cure.times:.2g}" if cure.times else "",
    )


def cure_text(cure: Cure, where: str = "") -> str:
    """``2-D: cone=elliptic, solimp=...: creep 0.016 -> 1e-6 m/s, at 1.7 times the cost``."""
    where = where or f"{cure.dimension}-D"
    if not cure.helps:
        return f"{where}: {NONE_HELPS} ({cure.tried} tried)"
    said = told(cure)
    aim = f" (true: {said.truth})" if said.truth else ""
    numbers = (
        f"{said.check}{f' at {said.at}:' if said.at else ''} {said.before} -> {amount(said.after, said.unit)}{aim}"
    )
    left = f", {said.left}" if said.left else ""
    cost = f", at {said.times} times the cost" if said.times else ""
    cost = ", at the same cost" if said.times == "1" else cost
    elsewhere = f"; {text}" if (text := panel_text(cure.panel)) else ""
    alone = ""
    if cure.alone_after is not None:
        alone = f"; {_assigned(changes_in_words(cure, cure.alone))} alone: {quantity(cure.alone_after, cure.unit, 3)}"
    return f"{where}: {_assigned(said.settings)}; {numbers}{left}{cost}{alone}{elsewhere}"


def panel_text(panel: Panel | None) -> str:
    """``tried in 24 other cases: breaks a thrown ball (forward_speed 1.4 -> 0.953 m/s, true 1.43)``.

    Every case that breaks is named, as a reader has to find their own among them: in the panel's order, where what most
    scenes have comes first, and those with numbers.
    """
    if panel is None:
        return ""
    named: dict[str, str] = {}
    for cost in sorted(panel.breaks, key=lambda each: each.case in ORDER and ORDER.index(each.case)):
        before, after, truth = told_apart(cost.before, cost.after, cost.truth)
        named.setdefault(cost.case, f"{cost.case} ({cost.metric} {before} -> {amount(after, cost.unit)}, true {truth})")
    told = ", ".join([*list(named.values())[:NAMED], *list(named)[NAMED:]])
    return f"tried in {panel.cases} other cases: breaks {told or 'nothing'}"


def profile_costs(columns: Iterable[tuple[str, str]]) -> list[str]:
    """What profiles break in other cases than those they were tuned for: a line each; empty for one as shipped."""
    found = []
    for engine, profile in dict.fromkeys(columns):
        panel = panels_of(engine).get(profile)
        if panel and panel.breaks:
            found.append(f"{engine}/{profile}, against the engine as shipped, {panel_text(panel)}")
    return found


def _assigned(settings: Iterable[tuple[str, str]]) -> str:
    return ", ".join(f"{name}={value}" for name, value in settings)


def told_apart(before: float | None, after: float | None, truth: float) -> tuple[str, str, str]:
    """The three numbers with the fewest digits, at least three, that distinguish the first two."""
    enough = (n for n in range(3, 18) if number(before, n) != number(after, n))
    digits = next(enough, 3)
    missing = "no value"  # no result of the engine there
    was, now = (missing if value is None else number(value, digits) for value in (before, after))
    return was, now, number(truth, digits)


def changes_in_words(cure: Cure, changes: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Settings that a fix changes (or another of its scene) in the engine's own words, with values as text."""
    slot = _slot(cure, changes)
    words = in_words(slot, {**changes, **_settings(slot)})
    return [words[name] for name in changes if name in words]


def _slot(cure: Cure, changes: Mapping[str, Any]) -> Slot:
    """The case of a fix, with settings replaced."""
    params = tuple(sorted(cure.params.items()))
    return switched(Slot(cure.scene, params, cure.dimension, cure.engine, cure.shipped, cure.dt), changes)


def recorded_fixes(scene: str, engines: Iterable[str]) -> list[Cure]:
    """Recorded fixes of engines as shipped on a scene: one each, in 3-D if the engine has it there too."""
    found = []
    for engine in engines:
        own = [cure for (name, _), cure in cures_of(engine).items() if name == scene]
        found += [max(own, key=lambda cure: cure.dimension)] if own else []
    return found


def recorded_paste(cure: Cure) -> str:
    """`cure_paste` of a fix that is `Cure.recommended`; empty for another."""
    return cure_paste(cure) if cure.recommended else ""


def cure_paste(cure: Cure) -> str:
    """The settings of a fix as lines in the engine's own language; empty if its adapter writes none."""
    loaded = registry.adapter(cure.engine)
    if loaded is None or not cure.changes:
        return ""
    here = _slot(cure, {})
    there = _at_usual_step(here)
    settings = _settings(switched(there, carried(cure.changes, here, there)))
    return loaded.snippet(settings, list(cure.changes), scene_of(there), there.dt)


def _at_usual_step(slot: Slot) -> Slot:
    """A case of the catalogue at the engine's usual step instead of ours: what is pasted has the numbers for it."""
    known = registry.facts(slot.engine)
    ours = slot.dt == QUICK_DT and not is_file(slot.scene)
    return replace(slot, dt=known.customary_dt) if known and ours else slot


def how_measured(engine: str, scene: str, dimension: int, before: str, after: str) -> str:
    """One sentence: decisive settings of a fix, checks, cases and release; or that there is no measurement."""
    measured = decisive(engine, scene, dimension, before, after)
    if measured is None:
        return "Which of these settings matter was not measured; they are all that differs between the profiles."
    cells = "; ".join(params_text(cell) or "defaults" for cell in measured.cells)
    what = f"{', '.join(measured.metrics) or 'all checks'} of {scene} {measured.dimension}-D at {cells}"
    return f"Measured setting by setting ({what}; {engine} {measured.version}). What fixes it: {_decided(measured)}."


def pasteable(
    observations: Sequence[Observation],
    scene: str,
    dimension: int,
    engine: str,
    before: str,
    after: str,
    params: Mapping[str, float] | None = None,
) -> str:
    """The changes as lines in the engine's own language, ready to paste; empty if its adapter writes none.

    Values that depend on material or step are those of the case of ``params``, see `shown_cell`.
    """
    cell = shown_cell(observations, scene, dimension, engine, after, params)
    loaded = registry.adapter(engine)
    if cell is None or loaded is None:
        return ""
    shipped = shown_cell(observations, scene, dimension, engine, before, params)
    old = {s["name"]: s["value"] for s in shipped.settings} if shipped else {}
    names = [s["name"] for s in cell.settings if s["name"] not in old or old[s["name"]] != s["value"]]
    there = _at_usual_step(cell.slot)
    return loaded.snippet(_settings(there), names, scene_of(there), there.dt)


def fix(row: Mapping[str, Any], observations: Sequence[Observation], better: str) -> tuple[str, str]:
    """Lines to paste that fix the check of a row, and their description; or that there are none.

    The smallest fix from a search in the row's own case, else all changes of the passing profile ``better``: both were
    run in this case. Empty for a row without a known fix.
    """
    cure = cure_of(row)
    if cure is None and not better:
        return "", ""
    if cure is not None:
        paste, what = cure_paste(cure), "the smallest change found that fixes this check"
    else:
        where = (row["scene"], row["dimension"], row["engine"], row["profile"], better)
        paste, what = pasteable(observations, *where, dict(_minimal(row))), f"all that profile {better} changes"
    if paste:
        return paste, f"to paste ({what}):"
    return "", nothing_to_paste(cure) if cure else _unpasted(row, ["--profile", better])


def nothing_to_paste(cure: Cure) -> str:
    """Text for a fix without lines to paste: the command that writes the engine's calls."""
    sets = [word for name, value in sorted(cure.changes.items()) for word in ("--set", f"{name}={text_of(value)}")]
    row = {name: getattr(cure, name) for name in ("engine", "scene", "dimension", "params", "dt")}
    return _unpasted(row, ["--profile", cure.shipped, *sets])


def _unpasted(row: Mapping[str, Any], profile: Sequence[str]) -> str:
    engine = row["engine"]
    words = ["crosscheck", "export", row["scene"], *_case(row), "--engine", engine, *profile, "--to", "python"]
    return f"nothing to paste: {engine} is set by calls; {shlex.join(words)} writes them"
