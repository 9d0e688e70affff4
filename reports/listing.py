"""Data of ``list``, ``describe`` and ``doctor``; the command prints it as text or JSON."""

from __future__ import annotations

import difflib
import importlib
import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from adapters import engine_folder, registry
from adapters.engine_folder import unset_of
from adapters.isolation.foreign import said_by
from adapters.needs import needs
from adapters.plain import one_line
from adapters.scene import Scene, SceneError
from adapters.unset import Unset
from validation.canonical import SUITES, CanonicalScene, Check, Variation
from validation.catalogue import CATALOGUE, broken
from validation.cells import plane_of
from validation.field.measured import facts_of
from validation.identity import commit, machine
from validation.posed import resolve
from validation.running.plan import QUICK_DT
from validation.running.warming import MARK
from validation.settings.effects import told_of


def scenes() -> list[dict[str, Any]]:
    """Scenes of the catalogue."""
    return [
        {"name": s.name, "version": s.version, "title": s.title, "dimensions": list(s.dimensions), "law": s.law}
        for s in CATALOGUE.values()
    ]


def suites() -> list[dict[str, Any]]:
    """Cases of each scene in the suites, for a profile with an iteration count at 1/240 s, and their parameters."""
    out: list[dict[str, Any]] = []
    for canonical in CATALOGUE.values():
        asked = {suite: canonical.variations(suite) for suite in SUITES}
        counts: dict[str, Any] = {
            suite: sum(len(v.iterations) * sum(map(v.runs_in, canonical.dimensions)) for v in variations)
            for suite, variations in asked.items()
        }
        out.append({"name": canonical.name} | counts | {"of_quick": [_cell(v) for v in asked["quick"]]})
    total = {suite: sum(entry[suite] for entry in out) for suite in SUITES}
    return [*out, {"name": "all", **total, "of_quick": []}]


def _cell(variation: Variation) -> str:
    """``n=10 at own/1/30 iterations``."""
    params = " ".join(f"{name}={value:g}" for name, value in variation.params.items()) or "defaults"
    counts = "/".join("own" if count is None else str(count) for count in variation.iterations)
    return params if variation.iterations == (None,) else f"{params} at {counts} iterations"


def engines(imported: bool = False) -> list[dict[str, Any]]:
    """All registered engines, installed or not; by the metadata of their packages unless each is imported."""
    out: list[dict[str, Any]] = []
    for name in registry.names():
        found = registry.find(name) if imported else registry.listed(name)
        profiles = list(found.engine.profiles) if found.engine else []
        status = "installed" if found.engine else "not installed"
        out.append(
            {"name": name, "version": found.version, "status": status, "profiles": profiles, "reason": found.reason}
        )
    return out


def checks() -> list[dict[str, Any]]:
    """Every check at the defaults of its scene and dt 1/240."""
    out: list[dict[str, Any]] = []
    for canonical in CATALOGUE.values():
        seen: dict[str, dict[str, Any]] = {}
        for variation in canonical.variations("standard"):
            scene = canonical.scene(canonical.dimensions[0], variation.params)
            for check in _stated(canonical, scene):
                name = f"{canonical.name}/{check.metric.partition('[')[0]}"
                seen.setdefault(name, {"name": name, **asdict(check)})
        out += seen.values()
    return out


def _stated(canonical: CanonicalScene, scene: Scene) -> list[Check]:
    """All checks of a scene, with that of planar motion for 3-D engines."""
    return [*canonical.checks(scene, QUICK_DT), *plane_of(canonical, scene, QUICK_DT)]


def describe(name: str, measure: bool = False) -> dict[str, Any]:
    """Everything about one scene or engine.

    ``measure`` runs the experiments that measure what an engine does when nothing is set: seconds of CPU time.

    Raises
    ------
    SceneError
        If nothing has that name.
    """
    if registry.entry(name) is not None:
        return _describe_engine(name, measure)
    try:
        return _describe_scene(name)
    except SceneError:
        close = difflib.get_close_matches(name, [*CATALOGUE, *registry.names()], n=1)
        hint = f"did you mean {close[0]!r}?" if close else "crosscheck list scenes, or list engines"
        raise SceneError(f"name: nothing is called {name!r}; {hint}") from None


def _describe_scene(name: str) -> dict[str, Any]:
    canonical = resolve(name)
    scene = canonical.scene(canonical.dimensions[0])
    return {
        "kind": "scene",
        "name": canonical.name,
        "version": canonical.version,
        "title": canonical.title,
        "figure": canonical.figure,
        "law": canonical.law,
        "notes": list(canonical.notes),
        "dimensions": list(canonical.dimensions),
        "parameters": [asdict(parameter) for parameter in canonical.parameters],
        "needs": asdict(needs(scene)),
        "checks_at_defaults": [asdict(check) for check in _stated(canonical, scene)],
    }


def _describe_engine(name: str, measure: bool) -> dict[str, Any]:
    found = registry.listed(name)
    out: dict[str, Any] = {"kind": "engine", "name": name, "version": found.version}
    why_not = _why_unmeasured(name) if measure else f"crosscheck describe {name} --measure does so"
    out |= {"unset": [_unset(row, why_not) for row in unset_of(name)]}
    try:
        settable = found.engine.settable() if found.engine else {}
    except ImportError:  # some ask the engine, which is listed and cannot be imported
        found, settable = registry.find(name), {}
    engine = found.engine or registry.adapter(name)  # most of it is known without the engine
    if engine is None:
        return {**out, "status": "not installed", "reason": found.reason}
    facts = engine.facts
    wanted = {scene.name: needs(scene.scene(scene.dimensions[-1])) for scene in CATALOGUE.values()}
    profiles = {
        profile: {name: [asdict(s) for s in engine.settings(profile, own, QUICK_DT)] for name, own in wanted.items()}
        for profile in engine.profiles
    }
    return {
        **out,
        "status": "installed" if found.engine else "not installed",
        "reason": found.reason,
        "title": facts.title,
        "package": facts.package,
        "dimensions": sorted(facts.dimensions),
        "scheme": asdict(facts.scheme),
        "profile_schemes": {profile: asdict(scheme) for profile, scheme in facts.profile_schemes.items()},
        "customary_dt": facts.customary_dt,
        "quirks": [asdict(quirk) for quirk in facts.quirks],
        "measured": [asdict(fact) | {"standing": fact.standing} for fact in facts_of(name)],
        "known_bad_versions": dict(facts.known_bad_versions),
        "effects": [asdict(told) for told in told_of(name)],
        "settable": [{"name": each, "must_be": kind(object())} for each, kind in settable.items()],
        "profiles": profiles,
    }


def _why_unmeasured(name: str) -> str:
    """Why an engine cannot be measured here; empty if it can."""
    entry, engine = registry.entry(name), registry.find(name).engine
    if engine is None:
        return f"{name} is not installed here"
    if entry is None or not registry.is_ours(entry):
        return f"{name} is loaded in worker processes only"
    kernels = engine.kernels()
    if kernels is not None and not any(kernels.glob(f"{MARK}*")):
        return f"its kernels are not compiled yet: crosscheck compile --engine {name}"
    return ""


def _unset(row: Unset, why_not: str) -> dict[str, Any]:
    """Documented behaviour without any settings, and the measured one; or the reason without a measurement."""
    data: dict[str, Any] = {"what": row.what, "documented": row.documented, "value": row.value, "source": row.source}
    data |= {"measured": None, "agrees": None, "reason": why_not or "there is no experiment for it"}
    if why_not or row.measure is None:
        return data
    try:
        measured = float(row.measure())
    except Exception as error:  # a release may raise any error in the calls
        return data | {"reason": said_by(error)}
    return data | {"measured": measured, "agrees": row.agrees(measured), "reason": ""}


def doctor() -> dict[str, Any]:
    """Health of the installation: engines, versions, caches, and the origin of our packages."""
    packages, problems = {}, []
    home = Path(__file__).resolve().parent.parent
    for name in ("reference_solver", "adapters", "validation", "reports"):
        path = Path(importlib.import_module(name).__file__ or "").resolve()
        packages[name] = str(path.parent)
        if path.parent.parent != home:
            problems.append(f"the package {name!r} on this path is not ours: {path.parent}")
    problems += broken() + engine_folder.problems()
    found = engines(imported=True)
    traces: dict[str, list[str]] = {}
    for engine in found:
        trace = registry.find(engine["name"]).trace
        traces |= {engine["name"]: trace.splitlines()} if trace else {}
        if engine["reason"] and engine["name"] in registry.usual():
            problems.append(f"{engine['name']}: {engine['reason']}")
        loaded = registry.find(engine["name"]).engine
        bad = loaded.facts.known_bad_versions.get(engine["version"]) if loaded else None
        if bad:
            problems.append(f"{engine['name']} {engine['version']} is known to be bad: {bad}")
    try:
        from reference_solver.compilation import cache_folder

        folder = cache_folder()
    except ImportError as error:
        folder = None
        problems.append(f"{registry.solver()}: its compiler cannot be loaded: {one_line(error)}")
    return {
        "machine": machine(),
        "commit": commit(),
        "executable": sys.executable,
        "packages": packages,
        "engines": found,
        "kernel_cache": {
            "folder": str(folder) if folder else None,
            "compiled": os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0"),
        },
        "problems": problems,
        "traces": traces,
    }
