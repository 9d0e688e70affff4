"""Statements of an adapter about itself: facts, profiles, refusals, and their agreement with its behaviour."""

from __future__ import annotations

import importlib.util
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import adapters
from adapters.conformance.finding import NotAsked
from adapters.conformance.scenes import (
    DT,
    accepted,
    built,
    carried,
    driven,
    flying,
    in_all_dimensions,
    leaning,
    odd_pairs,
    resting,
    striking,
    values,
)
from adapters.engine import ROLES, Engine, EngineError, EngineFacts, Setting
from adapters.needs import Needs, needs
from adapters.plain import one_line
from adapters.scene import Scene
from adapters.scene.lift import lift
from adapters.stepping import posed_for


def packages(engine: Engine) -> str:
    """The package `adapters` on this path is the one of these checks."""
    spec = importlib.util.find_spec("adapters")
    found = Path(spec.origin).resolve().parent if spec and spec.origin else None
    ours = Path(str(adapters.__file__)).resolve().parent
    return "" if found == ours and ours in Path(__file__).resolve().parents else f"`adapters` on this path is {found}"


def facts(engine: Engine) -> str:
    """Facts contain the engine's name, its dimensions, its step order and a usual step."""
    stated = engine.facts
    if not isinstance(stated, EngineFacts) or not stated.name or not stated.package:
        return "facts need a name and the package to install"
    if not stated.dimensions or not stated.dimensions <= {2, 3}:
        return f"facts.dimensions: {set(stated.dimensions)} must be out of 2 and 3"
    for scheme in (stated.scheme, *map(engine.scheme, engine.profiles)):
        if not -1.0 <= scheme.position_offset <= 1.0:
            return f"scheme.position_offset: {scheme.position_offset!r} must lie in [-1, 1]"
    for profile, role in stated.roles.items():
        if profile not in engine.profiles or role not in ROLES:
            return (
                f"facts.roles: {profile!r} cannot be {role!r}: no such profile, or no such role; roles are "
                f"{', '.join(ROLES)}"
            )
    if not (math.isfinite(stated.customary_dt) and stated.customary_dt > 0.0):
        return f"facts.customary_dt: {stated.customary_dt!r} must be a positive number of seconds"
    return "" if isinstance(engine.version(), str) and engine.version() else "version() must return the version"


def profiles(engine: Engine) -> str:
    """Every profile gives the same settings each time, each with a name and a reason."""
    if not engine.profiles:
        return "there is no profile"
    for profile, asked in product(engine.profiles, all_needs(engine)):
        settings = engine.settings(profile, asked, DT)
        if settings != engine.settings(profile, asked, DT):
            return f"{profile}: differs from call to call"
        for setting in settings:
            if not isinstance(setting, Setting):
                return f"{profile}: {one_line(repr(setting), 40)} is no Setting"
        names = [setting.name for setting in settings]
        for setting in settings:
            if not setting.because:
                return f"{profile}: {setting.name} has no reason"
            if names.count(setting.name) > 1:
                return f"{profile}: {setting.name} is set twice"
            json.dumps(setting.value)
    return ""


def all_needs(engine: Engine) -> Iterator[Needs]:
    """Needs of elastic and plastic impacts, with and without friction, of rest and sliding, in every dimension."""
    base = replace(needs(striking()), top_speed=6.0, gravity=9.81, restitution=0.8, regime="impact")
    still = replace(base, friction=0.5, rotation=True, restitution=0.0, regime="rest")
    plastic, rough = replace(base, restitution=0.0), replace(base, restitution=0.5, friction=0.5, slide=True)
    kinds = (base, plastic, rough, still, replace(still, slide=True))
    for dimension in (2, 3) if 3 in engine.facts.dimensions else (2,):
        for kind in kinds:
            yield replace(kind, dimension=dimension)


def refusals(engine: Engine) -> str:
    """Unknown profiles and settings raise EngineError, and so do scenes of `refuses`; a refusal is one line."""
    first = next(iter(engine.profiles))
    scene = accepted(engine, first, resting(), resting(box=False))
    given = values(engine, first, scene)
    posed = posed_for(engine, scene)
    attempts: dict[str, Callable[[], Any]] = {
        "an unknown profile": lambda: engine.settings("no such profile", needs(scene), DT),
        "an unknown setting": lambda: engine.build(posed, DT, {**given, "no_such_setting": 1.0}),
    }
    wrong = _accepted_one(attempts)
    if wrong:
        return wrong
    for scene, profile in product((odd_pairs(), lift(odd_pairs()), leaning(), carried()), engine.profiles):
        if scene.dimension == 3 and 3 not in engine.facts.dimensions:
            continue
        answer = engine.refuses(posed_for(engine, scene), profile)
        if answer is not None and (not isinstance(answer, str) or len(answer.splitlines()) != 1):
            return f"{profile}: refuses() must give one line or None, not {answer!r}"
    return ""


def _accepted_one(attempts: dict[str, Callable[[], Any]]) -> str:
    """The first attempt without a refusal in one line, or nothing."""
    for what, attempt in attempts.items():
        try:
            made = attempt()
        except EngineError as error:
            if len(str(error).splitlines()) != 1:
                return f"{what} is refused in more than one line"
        else:
            getattr(made, "close", lambda: None)()
            return f"{what} is accepted"
    return ""


def bad_numbers(engine: Engine) -> str:
    """Steps and settings that are not numbers raise EngineError, and so do counts below 1."""
    for profile in engine.profiles:
        scene = accepted(engine, profile, resting(), resting(box=False))
        posed, given = posed_for(engine, scene), values(engine, profile, scene)
        build = partial(engine.build, posed)
        attempts: dict[str, Callable[[], Any]] = {
            f"a step of {dt:g} s": partial(build, dt, given) for dt in (0.0, -DT, math.nan, math.inf)
        }
        bad = [(name, math.nan) for name, value in given.items() if isinstance(value, float)]
        if isinstance(given.get("iterations"), int):
            bad += [("iterations", 0), ("iterations", -1)]
        attempts |= {f"{name} = {value}": partial(build, DT, {**given, name: value}) for name, value in bad}
        wrong = _accepted_one(attempts)
        if wrong:
            return f"{profile}: {wrong}"
    return ""


def capabilities(engine: Engine) -> str:
    """Scenes accepted by `refuses` are built and run correctly, refused ones are not; so for stated dimensions."""
    able = False
    for profile in engine.profiles:
        if 3 not in engine.facts.dimensions and not _refused(engine, lift(striking()), profile):
            return f"{profile}: facts.dimensions has no 3, and a spatial scene is built"
        for scene in (striking(), flying(), resting(), resting(box=False), odd_pairs(), carried(), leaning()):
            for asked in in_all_dimensions(engine, scene):
                able |= engine.refuses(posed_for(engine, asked), profile) is None
                wrong = _as_said(engine, asked, profile)
                if wrong:
                    return f"{profile}: {asked.name}, {asked.dimension}-D: {wrong}"
    if not able:
        raise NotAsked(f"every scene is refused, even {striking().name}")
    return ""


def _refused(engine: Engine, scene: Scene, profile: str) -> bool:
    try:
        simulation = engine.build(scene, DT, values(engine, profile, scene))
    except EngineError:
        return True
    simulation.close()
    return False


def _as_said(engine: Engine, scene: Scene, profile: str) -> str:
    """The contradiction between the engine's statement about a scene and its behaviour, or nothing."""
    reason = engine.refuses(posed_for(engine, scene), profile)
    try:
        simulation = built(engine, scene, profile)
    except EngineError as error:
        return "" if reason else f"not refused, but stopped by {error}"
    simulation.close()
    if reason:
        return f"refused ({reason}), but built"
    trajectory = driven(engine, scene, profile)
    for i, body in enumerate(scene.bodies):
        # A body with prescribed motion keeps its twist in every impact; so does a fixed one.
        if body.motion != "free" and abs(trajectory.twist[-1, i] - body.twist).max() > engine.facts.round_off:
            return f"{body.name} is {body.motion} but does not move like that"
    return trajectory.reason
