"""The slots of a run: the cells that each scene declares, on every engine and profile.

quick
    dt 1/240; a few cells of each scene, which cover every check, law and family of findings: the representative cell in
    both dimensions, others in one of them where both show the same.
standard
    dt 1/240; the cells whose known failures are listed check by check.
full
    each scene's full cells at dt 1/240; the standard cells from 1/60 to 1/960 by halves as well, and at each engine's
    customary step; representative cells moved by 1 and 2 units in the last place (the floor that comparisons use).
"""

from __future__ import annotations

import math
import tomllib
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from adapters.engine import NOT_KNOWN, Engine, EngineError
from adapters.engine_folder import inside
from adapters.needs import needs
from adapters.plain import NAME, Notice, one_line
from adapters.registry import facts, find, is_ranked
from adapters.scene import Scene
from adapters.settings.own import kinds_of, near, own
from adapters.stages import stage
from validation.canonical import CanonicalScene, Suite, Variation
from validation.catalogue import CATALOGUE
from validation.cells import Slot, check_size, settings_of
from validation.files.expressions import FormulaError, value_of
from validation.posed import pinned, resolve

QUICK_DT = 1.0 / 240.0
#: File of an engine's folder with what its suites leave out (`left_out`).
LEFT_OUT = "left_out.toml"
FULL_DT = tuple(1.0 / rate for rate in (60.0, 120.0, 240.0, 480.0, 960.0))


@dataclass(frozen=True)
class Request:
    """A user's request; empty means everything.

    Parameters
    ----------
    scenes
        Names of the catalogue or paths.
    params
        Fixed parameters; if given, they replace the suite's variations.
    ulps
        Moves of the start, in units in the last place.
    floors
        Also run the representative cells moved by 1 and 2 units in the last place.
    sets
        A user's settings, by name, which every engine must have; without a profile they change the one as shipped, or a
        model's own.
    """

    scenes: Sequence[str]
    engines: Sequence[str]
    profiles: Sequence[str] = ()
    dimensions: Sequence[int] = ()
    dts: Sequence[float] = ()
    iterations: Sequence[int] = ()
    params: Mapping[str, float] | None = None
    suite: Suite = "quick"
    ulps: Sequence[int] = (0,)
    floors: bool = False
    sets: Sequence[tuple[str, Any]] = ()


@stage("choosing cases")
def slots(request: Request) -> list[Slot]:
    """All slots of a request, in display order.

    Raises
    ------
    EngineError, SceneError
        For unknown engines, profiles or parameters, before anything runs.
    """
    engines = [(name, find(name).engine) for name in request.engines]
    scenes = [resolve(argument) for argument in map(pinned, request.scenes)]
    known = {profile for _, engine in engines if engine for profile in engine.profiles}
    known |= {brought.profile for scene in scenes for brought in scene.brings.values()}
    for profile in request.profiles:
        if known and profile not in known:
            raise EngineError(f"profile: no chosen engine has a profile {profile!r}; known: {', '.join(sorted(known))}")
    found: dict[Slot, None] = {}
    for argument in map(pinned, request.scenes):
        canonical = resolve(argument)
        for dimension in canonical.dimensions:
            if request.dimensions and dimension not in request.dimensions:
                continue
            for name, engine in engines:
                found.update(dict.fromkeys(_engine_slots(request, argument, canonical, dimension, name, engine)))
    return list(found)


def _engine_slots(
    request: Request, argument: str, canonical: CanonicalScene, dimension: int, name: str, engine: Engine | None
) -> Iterable[Slot]:
    # An engine that is not installed gets rows too, under one profile.
    profiles = list(engine.profiles) if engine else [_one_profile(name)]
    if engine and name in canonical.brings:
        profiles.append(canonical.brings[name].profile)
    if request.sets and not request.profiles:
        profiles = [canonical.brings[name].profile if name in canonical.brings else _one_profile(name)]
    for profile in profiles:
        if request.profiles and profile not in request.profiles:
            continue
        asked = [Variation(request.params)] if request.params else canonical.variations(request.suite)
        for variation in asked:
            if not variation.runs_in(dimension):
                continue
            if not _is_asked(request, canonical, variation, name, profile):
                continue
            params = canonical.minimal(variation.params)
            brought = canonical.brought(name, profile)
            scene = canonical.scene(dimension, variation.params)
            for dt in (brought.dt,) if brought and not request.dts else _steps(request, engine, profile):
                base = Slot(argument, params, dimension, name, profile, dt)
                check_size(scene, dt)
                _say_if_large(engine, canonical, scene)
                sets = _own(request, engine, base, scene)
                if argument not in CATALOGUE:
                    canonical.checks(scene, dt)  # a scene that cannot be judged is refused before any run
                for iterations in _iterations(request, variation, engine, base):
                    if not _stepped(request, replace(base, iterations=iterations)):
                        continue
                    for ulp in (*request.ulps, *_moves(request, canonical, variation, dt, iterations)):
                        yield replace(base, iterations=iterations, ulp=ulp).with_own(sets)


def _say_if_large(engine: Engine | None, canonical: CanonicalScene, scene: Scene) -> None:
    """Tell of a scene with more bodies than the engine is meant for: it runs, and may take minutes."""
    most = engine.most_bodies if engine is not None else None
    if engine is not None and most is not None and len(scene.bodies) > most:
        said = f"{engine.name} is meant for {most} bodies: a case of {canonical.name} with {len(scene.bodies)}"
        warnings.warn(Notice(f"{said} may take minutes"), stacklevel=2)


def _own(request: Request, engine: Engine | None, slot: Slot, scene: Scene) -> tuple[tuple[str, Any], ...]:
    """A user's settings in the engine's form; unchanged where it is not installed."""
    # A request from another process has lists instead of tuples.
    sets = tuple((str(name), _worked_out(value, slot.dt, scene)) for name, value in request.sets)
    if request.iterations and any(name == "iterations" for name, _ in sets):
        raise EngineError("set: --iterations sets iterations as well")
    return sets if engine is None or not sets else own(engine, sets, settings_of(engine, slot, scene))


def _worked_out(value: Any, dt: float, scene: Scene) -> Any:
    """A value of a user's setting: formulas in g [m/s^2], dt [s] and e, if all pairs have one, become numbers."""
    if isinstance(value, list | tuple):
        return tuple(_worked_out(each, dt, scene) for each in value)
    if not isinstance(value, str):
        return value
    bounces = {restitution for restitution, _ in scene.materials()}
    names = {"g": math.hypot(*scene.gravity), "dt": dt} | ({"e": bounces.pop()} if len(bounces) == 1 else {})
    try:
        return value_of(value.replace("^", "**"), names)
    except FormulaError:  # a word, or nothing that the engine takes
        return value


def knowing(request: Request) -> list[str]:
    """Installed engines of a request that have all its settings and accept their values.

    Raises
    ------
    EngineError
        If there is none: which engine has which setting, a similar name, or why the value is refused.
    """
    canonical = resolve(pinned(request.scenes[0]))
    scene = canonical.scene(canonical.dimensions[-1])
    wanted, sets = needs(scene), [(name, _worked_out(value, QUICK_DT, scene)) for name, value in request.sets]
    here = {name: engine for name in request.engines if (engine := find(name).engine) is not None}
    profiles = {name: engine.settings(_one_profile(name), wanted, QUICK_DT) for name, engine in here.items()}
    known = {name: set(kinds_of(engine, profiles[name])) for name, engine in here.items()}
    asked = [name for name, _ in request.sets]
    found, refused = [], []
    for name in (name for name, names in known.items() if names.issuperset(asked)):
        try:
            own(here[name], sets, profiles[name])
        except EngineError as error:
            refused.append(error)
        else:
            found.append(name)
    if not found:
        if refused:
            raise refused[0]
        who = {name: [engine for engine, names in known.items() if name in names] for name in asked}
        lost = next((name for name in asked if not who[name]), None)
        if lost is not None:
            former = {name: said for engine in here.values() for name, said in engine.former.items()}
            close = near(lost, dict.fromkeys(name for names in known.values() for name in sorted(names)), former)
            raise EngineError(f"set: no installed engine has a setting {one_line(lost, NAME)!r}{close}")
        told = "; ".join(f"{name}: {', '.join(engines)}" for name, engines in who.items())
        raise EngineError(f"set: no engine has all of these settings ({told}); name one with --engine")
    return found


def _is_asked(request: Request, canonical: CanonicalScene, variation: Variation, engine: str, profile: str) -> bool:
    """Whether a suite runs this cell; the quick one runs unranked profiles in representative cells only."""
    if len(request.scenes) > 1 and canonical.name in left_out(engine):
        return False
    if request.suite != "quick" or request.params or profile in request.profiles or is_ranked(engine, profile):
        return True
    return canonical.stands_for_it(variation.params) and None in variation.iterations


def _one_profile(name: str) -> str:
    """Profile as shipped of an engine that is not installed; else its first known one."""
    told = facts(name)
    return (told.profile("shipped") or next(iter(told.roles), NOT_KNOWN)) if told else NOT_KNOWN


@cache
def left_out(engine: str) -> Mapping[str, str]:
    """Scenes that no suite runs on an engine, with the reason: ``left_out.toml`` of its folder.

    There no law explains its failures, and no setting switches their cause off. A run of one such scene alone still has
    its cases, without regression status.
    """
    path = inside(engine, LEFT_OUT)
    return {} if path is None else {str(scene): str(why) for scene, why in tomllib.loads(path.read_text()).items()}


def is_standard(slot: Slot) -> bool:
    """Whether the standard suite runs this slot, or uses it in a study: its FAILs are listed one by one."""
    if slot.dt != QUICK_DT or slot.ulp or slot.switched or slot.scene not in CATALOGUE:
        return False
    if slot.scene in left_out(slot.engine):
        return False
    canonical, own = CATALOGUE[slot.scene], dict(slot.params).items()
    return any(
        # Variations are compared by what differs from the defaults first, which is faster than a check of each.
        own <= variation.params.items()
        and slot.iterations in variation.iterations
        and variation.runs_in(slot.dimension)
        and slot.params == canonical.minimal(variation.params)
        for variation in canonical.variations("standard")
    ) or (bool(canonical.studies) and slot.iterations is None and not slot.params)


def _moves(
    request: Request, canonical: CanonicalScene, variation: Variation, dt: float, iterations: int | None
) -> tuple[int, ...]:
    wanted = request.floors and dt == QUICK_DT and iterations is None and canonical.stands_for_it(variation.params)
    return (1, 2) if wanted else ()


def _steps(request: Request, engine: Engine | None, profile: str) -> Iterable[float]:
    if request.dts:
        return request.dts
    if request.suite != "full":
        return (QUICK_DT,)
    customary = (engine.facts.customary_dt,) if engine and engine.facts.roles.get(profile) == "shipped" else ()
    return dict.fromkeys((*FULL_DT, *customary))


def _stepped(request: Request, slot: Slot) -> bool:
    """Whether the suite has this step: steps other than 1/240 s only where the standard suite has the cell.

    A user's steps, parameters and iteration counts are combined with all of them.

    All variations with all steps are 51 607 cells, 14 385 of which took 34 min of CPU; these are 19 704.
    """
    own = request.dts or request.params or request.iterations
    asked = own or slot.dt == QUICK_DT or slot.scene not in CATALOGUE
    return bool(asked) or is_standard(replace(slot, dt=QUICK_DT))


def _iterations(request: Request, variation: Variation, engine: Engine | None, slot: Slot) -> Iterable[int | None]:
    asked: Sequence[int | None] = tuple(request.iterations) or ((None,) if request.params else variation.iterations)
    if any(name == "iterations" for name, _ in request.sets):
        return (None,)
    if engine is None or not has_iterations(engine, slot):
        return (None,)
    return asked


def has_iterations(engine: Engine, slot: Slot) -> bool:
    """Whether the profile has an iteration count that can be replaced; one that fails reports it in its cells."""
    canonical = resolve(slot.scene)
    if canonical.brought(slot.engine, slot.base) is not None:
        return False
    scene = canonical.scene(slot.dimension, dict(slot.params))
    try:
        settings = engine.settings(slot.base, needs(scene), slot.dt)
    except EngineError:
        return False
    return any(setting.name == "iterations" for setting in settings)
