"""Which slots a run consists of.

quick
    dt 1/240; bounce heights at e = 0.8 only, one height for the other e; iteration sweep at n = 10 only.
full
    dt from 1/60 to 1/960 by halves and each engine's customary step; all heights, all sweeps; representative
    cells moved by 1 and 2 units in the last place (the floor that comparisons use).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

from adapters.engine import Engine, EngineError
from adapters.needs import needs
from adapters.registry import find
from validation.canonical import CanonicalScene
from validation.cells import Slot, check_size
from validation.posed import pinned, resolve
from validation.scenes import CATALOGUE

Suite = Literal["quick", "full"]
QUICK_DT = 1.0 / 240.0
FULL_DT = tuple(1.0 / rate for rate in (60.0, 120.0, 240.0, 480.0, 960.0))
#: Sixteen drop heights [m], 1 cm apart: about half a step of 1/240 s each, so that phases are spread.
HEIGHTS = tuple(round(1.0 + 0.01 * k, 2) for k in range(16))
STACK_SWEEP = (1, 4, 10, 30, 100)
RATIOS = (0.5, 0.9, 0.99, 0.999, 1.001, 1.01, 1.1, 2.0)


@dataclass(frozen=True)
class Variation:
    """Parameters of a cell, and the iteration counts to run it at (None: the profile's own)."""

    params: Mapping[str, float]
    iterations: tuple[int | None, ...] = (None,)


def variations(scene: str, suite: Suite) -> list[Variation]:
    """Parameter sets of a catalogue scene in a suite; a scene without a list runs once at its defaults."""
    if scene == "impact":
        grid = product((0.0, 0.2, 0.5, 0.8, 0.95, 1.0), (0.1, 1.0, 6.0, 50.0))
        return [Variation({"e": e, "v": v}) for e, v in grid]
    if scene == "bounce":
        swept = (0.5, 0.8, 0.95, 1.0) if suite == "full" else (0.8,)
        single = [Variation({"e": e, "height": HEIGHTS[0]}) for e in (0.5, 0.95, 1.0) if e not in swept]
        return [Variation({"e": e, "height": h}) for e in swept for h in HEIGHTS] + single
    if scene == "stack":
        swept_n = (1, 2, 5, 10, 20) if suite == "full" else (10,)
        return [Variation({"n": n}, (None, *STACK_SWEEP) if n in swept_n else (None,)) for n in (1, 2, 5, 10, 20)]
    if scene == "incline":
        return [Variation({"ratio": ratio}) for ratio in RATIOS]
    return [Variation({})]


@dataclass(frozen=True)
class Request:
    """What a user asked to run; empty means everything.

    Parameters
    ----------
    scenes
        Names of the catalogue or paths.
    params
        Fixed parameters; any given replaces the suite's variation by this one.
    ulps
        Moves of the start, in units in the last place.
    floors
        Also run the representative cells moved by 1 and 2 units in the last place.
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


def slots(request: Request) -> list[Slot]:
    """All slots of a request, in the order in which they are shown.

    Raises
    ------
    EngineError, SceneError
        For unknown engines, profiles or parameters, before anything runs.
    """
    engines = [(name, find(name).engine) for name in request.engines]
    known = {profile for _, engine in engines if engine for profile in engine.profiles}
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
    # An engine that is not installed still gets its rows, under the one profile name every engine has a rule for.
    profiles = list(engine.profiles) if engine else ["default"]
    for profile in profiles:
        if request.profiles and profile not in request.profiles:
            continue
        for variation in _variations(request, argument):
            params = _minimal(canonical, variation.params)
            for dt in _steps(request, engine, profile):
                base = Slot(argument, params, dimension, name, profile, dt)
                scene = canonical.scene(dimension, variation.params)
                check_size(scene, dt)
                if argument not in CATALOGUE:
                    canonical.checks(scene, dt)  # a scene that cannot be judged is refused before it runs
                for iterations in _iterations(request, variation, engine, base):
                    for ulp in (*request.ulps, *_moves(request, argument, variation, dt, iterations)):
                        yield replace(base, iterations=iterations, ulp=ulp)


#: Parameters of the cell that stands for a scene: its noise floor is measured, its track is kept for replay.
REPRESENTATIVE: dict[str, Mapping[str, float]] = {
    "impact": {"e": 0.8, "v": 6.0},
    "bounce": {"e": 0.8, "height": HEIGHTS[0]},
    "stack": {"n": 10},
    "incline": {"ratio": 1.1},
}


def in_quick_suite(slot: Slot) -> bool:
    """Whether the quick suite runs this slot: its FAILs are listed row by row."""
    if slot.dt != QUICK_DT or slot.ulp or slot.switched or slot.scene not in CATALOGUE:
        return False
    canonical = CATALOGUE[slot.scene]
    return any(
        slot.params == _minimal(canonical, variation.params) and slot.iterations in variation.iterations
        for variation in variations(slot.scene, "quick")
    ) or (slot.iterations is None and not slot.params)


def is_representative(scene: str, params: Mapping[str, float]) -> bool:
    """Whether a cell with these parameters (any subset of a suite's) stands for its scene."""
    canonical = resolve(scene)
    return canonical.complete(params) == canonical.complete(REPRESENTATIVE.get(scene, {}))


def _moves(request: Request, scene: str, variation: Variation, dt: float, iterations: int | None) -> tuple[int, ...]:
    wanted = request.floors and dt == QUICK_DT and iterations is None and is_representative(scene, variation.params)
    return (1, 2) if wanted else ()


def _variations(request: Request, scene: str) -> list[Variation]:
    if request.params:
        return [Variation(request.params)]
    return variations(scene, request.suite)


def _minimal(canonical: CanonicalScene, params: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    """Parameters that differ from the scene's defaults, validated and sorted."""
    complete = canonical.complete(params)
    defaults = {parameter.name: parameter.default for parameter in canonical.parameters}
    return tuple(sorted((name, value) for name, value in complete.items() if value != defaults[name]))


def _steps(request: Request, engine: Engine | None, profile: str) -> Iterable[float]:
    if request.dts:
        return request.dts
    if request.suite == "quick":
        return (QUICK_DT,)
    customary = (engine.facts.customary_dt,) if engine and profile == "default" else ()
    return dict.fromkeys((*FULL_DT, *customary))


def _iterations(request: Request, variation: Variation, engine: Engine | None, slot: Slot) -> Iterable[int | None]:
    asked: Sequence[int | None] = tuple(request.iterations) or ((None,) if request.params else variation.iterations)
    if engine is None or not has_iterations(engine, slot):
        return (None,)
    return asked


def has_iterations(engine: Engine, slot: Slot) -> bool:
    """Whether the profile stops at an iteration count that can be replaced; one that fails says so in its cells."""
    scene = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    try:
        settings = engine.settings(slot.profile, needs(scene), slot.dt)
    except EngineError:
        return False
    return any(setting.name == "iterations" for setting in settings)
