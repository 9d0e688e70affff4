"""The folder of an engine: everything about one engine is in one folder, named by its entry point.

    [project.entry-points."contact_crosscheck.engines"]
    myengine = "mypackage.myengine:MyEngine"

    mypackage/myengine/
        __init__.py       MyEngine: the adapter, which imports the engine inside functions
        releases.py       RELEASES: what older releases do differently (`adapters.releases`)
        changes.toml      notes of the engine on changes over its releases (`validation.releases.notes`)
        laws.py           DEVIATIONS: what the engine does by design (`adapters.law`)
        targets.toml      how the bench compares the engine with our textbook step (validation/bench/targets.toml)
        tuning.toml       settings for tuning, fixes whose settings are measured, cases in which settings should act
                          (`adapters.experiment.files`)
        findings/         families.toml, which proves them too, and members.csv (`validation.findings`), breaks.toml
                          and breaks.csv
        experiments.py    the same as Python, where a package makes them: EXPERIMENTS, and CANDIDATES, BELONGS, CURED
                          where there is no tuning.toml (`adapters.experiment`)
        unset.py          UNSET: what the engine does when nothing is set (`adapters.unset`)
        numbers.csv       what is measured of it as shipped (`validation.settings.kept_numbers`)
        readings.py       READINGS: its ways to read contact forces (`adapters.readings`)
        readings.csv      whether they are true, as measured (`validation.questions.kept_readings`)
        force_script.py.txt   a script that reads a contact force rightly with the bare engine
        decisive.csv      decisive settings of its fixes, as measured (`validation.settings.decisive`)
        effects.csv       what each setting does in its case of tuning.toml (`validation.settings.effects`)
        cures.csv         fixes by scene, and their cost, as measured (`validation.fixes`)
        panels.csv        what its profiles break in other cases (`validation.fixes.panel`)
        ports.csv         whether its ports move bodies as it does (`validation.releases.kept`)

All except the first are optional; an entry point that names a plain module provides an adapter only. Ours are in
``adapters/<engine>/`` and found in the same way.

Laws and experiments are loaded wherever rows are judged. Those of another package are first imported in a separate
process; with an error that engine has no laws and experiments, and ``crosscheck doctor`` shows it (`problems`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from adapters import registry
from adapters.engine import EngineError
from adapters.experiment import Cured, Effect, Experiment
from adapters.experiment.files import Tuning, read_tuning
from adapters.isolation.foreign import importable, said_by
from adapters.law import Deviation, Law, Measure, Prediction
from adapters.plain import one_line
from adapters.readings import Reading
from adapters.scene import Scene
from adapters.unset import Unset

LAWS, EXPERIMENTS, FINDINGS, DECISIVE, UNSET = "laws", "experiments", "findings", "decisive.csv", "unset"
READINGS, READ, FORCE_SCRIPT = "readings", "readings.csv", "force_script.py.txt"
CURES, PANELS, TUNING, EFFECTS, NUMBERS = "cures.csv", "panels.csv", "tuning.toml", "effects.csv", "numbers.csv"
PORTS = "ports.csv"
Row = TypeVar("Row")


def located(module: str) -> Path | None:
    """File of a module, found without importing its packages: a plugin's import may do anything."""
    first, *rest = module.split(".")
    spec = find_spec(first)
    for name in rest:
        if spec is None or spec.submodule_search_locations is None:
            return None
        spec = PathFinder.find_spec(f"{spec.name}.{name}", spec.submodule_search_locations)
    return Path(spec.origin) if spec and spec.origin and spec.has_location else None


def folder_of(engine: str) -> Path | None:
    """Folder of ``engine``; None if it is not registered, or only as a plain module. Nothing is imported."""
    entry = registry.entry(engine)
    path = located(entry.module) if entry is not None else None
    return path.parent if path is not None and path.name == "__init__.py" else None


def inside(engine: str, name: str) -> Path | None:
    """File or folder called ``name`` in the folder of ``engine``; None if it is not there."""
    folder = folder_of(engine)
    path = folder / name if folder is not None else None
    return path if path is not None and path.exists() else None


def rows_of(engine: str, name: str, read: Callable[[Path], Iterable[Row]]) -> tuple[Row, ...]:
    """Rows of a kept table of ``engine``; none if it is not there, or cannot be read, as one of another package."""
    path = inside(engine, name)
    try:
        return tuple(read(path)) if path else ()
    except (OSError, ValueError, KeyError, TypeError):
        return ()


@cache
def laws_of(engine: str) -> tuple[Deviation, ...]:
    """All laws of ``engine``; none if its folder has none, or if they cannot be loaded (`problems`)."""
    return _laws(engine)[0]


def covering(engine: str, version: str, profile: str, scene: str, metric: str) -> Iterator[Deviation]:
    """Laws that cover a row.

    Raises
    ------
    EngineError
        If the engine has laws that cannot be loaded.
    """
    if _laws(engine)[1]:
        raise EngineError(f"{engine}: its laws cannot be loaded: {_laws(engine)[1]}")
    return (law for law in laws_of(engine) if law.covers(engine, version, profile, scene, metric))


def experiments_of(engine: str) -> tuple[Experiment, ...]:
    """Experiments on ``engine`` that its package states in Python; others are proofs of families."""
    return _experiments(engine)[0]


def cured_of(engine: str) -> tuple[Cured, ...]:
    """Fixes whose settings are measured one by one."""
    return _tuning(engine)[0].cured


def candidates_of(engine: str) -> Mapping[str, tuple[Any, ...]]:
    """Stock settings for tuning, with their values."""
    return _tuning(engine)[0].candidates


def local_of(engine: str) -> tuple[str, ...]:
    """Settings that single pairs or bodies can have, with those that belong to them."""
    return _tuning(engine)[0].local


def instead_of(engine: str) -> tuple[tuple[Mapping[str, Any], Mapping[str, Any]], ...]:
    """Settings of the world, each with those of single pairs or bodies that do the same."""
    return _tuning(engine)[0].instead


def belongs_of(engine: str) -> Mapping[str, str]:
    """Settings that need another one, with which they are switched."""
    return _tuning(engine)[0].belongs


@cache
def unset_of(engine: str) -> tuple[Unset, ...]:
    """Documented and measurable defaults of ``engine``; none if its folder has no table."""
    module, _ = _module(engine, UNSET)
    return tuple(each for each in getattr(module, "UNSET", ()) if isinstance(each, Unset))


@cache
def readings_of(engine: str) -> tuple[Reading, ...]:
    """Ways of ``engine`` to read contact forces; none if its folder lists none."""
    module, _ = _module(engine, READINGS)
    return tuple(each for each in getattr(module, "READINGS", ()) if isinstance(each, Reading))


def force_script_of(engine: str) -> str:
    """A script that reads a contact force rightly with the bare engine; empty if there is none."""
    path = inside(engine, FORCE_SCRIPT)
    return path.read_text(encoding="utf-8") if path else ""


def effects_of(engine: str) -> Mapping[str, Effect]:
    """Cases in which settings should act, by setting."""
    return _tuning(engine)[0].effects


def fault_of_tuning(engine: str) -> str:
    """Error in the file or module with the tuning of ``engine``; empty if there is none."""
    return _tuning(engine)[1] or _experiments(engine)[1]


def problems() -> list[str]:
    """One line for each engine and part, of laws, experiments and ``tuning.toml``, that cannot be loaded."""
    found = []
    for engine in registry.names():
        parts = ((LAWS, _laws(engine)), (EXPERIMENTS, _experiments(engine)), (TUNING, _tuning(engine)))
        found += [f"{engine}: its {part} cannot be loaded: {said}" for part, (_, said) in parts if said]
    return found


def forget() -> None:
    """Clear caches, so that installed packages are searched again."""
    registry.forget()
    for each in (laws_of, unset_of, readings_of, _laws, _experiments, _tuning, _module):
        each.cache_clear()


# ---- loading ---------------------------------------------------------------------------------------------------------


@cache
def _module(engine: str, part: str) -> tuple[ModuleType | None, str]:
    """Module ``part`` of the folder, or None and the error; None and nothing where it does not exist."""
    entry = registry.entry(engine)
    if entry is None or inside(engine, f"{part}.py") is None:
        return None, ""
    name = f"{entry.module}.{part}"
    if registry.is_ours(entry):
        return import_module(name), ""
    why = importable(name)
    if why:
        return None, why
    try:
        return import_module(name), ""
    except BaseException as error:  # its import worked in another process
        return None, said_by(error)


@cache
def _laws(engine: str) -> tuple[tuple[Deviation, ...], str]:
    module, why = _module(engine, LAWS)
    if module is None:
        return (), why
    entry, found = registry.entry(engine), getattr(module, "DEVIATIONS", ())
    if entry is not None and registry.is_ours(entry):
        return tuple(found), ""
    try:
        return tuple(_guarded(engine, law) for law in found), ""
    except Exception as error:  # another package may have anything under that name
        return (), said_by(error)


def _guarded(engine: str, law: Any) -> Deviation:
    """A law of another package, with cleaned texts and checked results."""
    if not isinstance(law, Deviation) or law.engine != engine:
        raise TypeError(f"DEVIATIONS has an entry that is not a Deviation of {engine}")
    checked = _checked(f"law: {engine} {one_line(law.scene)}/{one_line(law.metric)}", law.law)
    return replace(law, law=checked, because=one_line(law.because), source=one_line(law.source))


def _checked(label: str, law: Callable[..., Any]) -> Law:
    def guarded(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        try:
            said = law(scene, dt, measure)
            if said is None:
                return None
            value, band = (float(number) for number in said)
        except Exception as error:
            raise EngineError(f"{label}: {said_by(error)}") from None
        if not (math.isfinite(value) and math.isfinite(band) and band >= 0.0):
            raise EngineError(f"{label}: predicts {value:g} +- {band:g}")
        return value, band

    return guarded


@cache
def _experiments(engine: str) -> tuple[tuple[Experiment, ...], str]:
    """Content of the module, if everything has the right type."""
    module, why = _module(engine, EXPERIMENTS)
    for name, kind in (("EXPERIMENTS", Experiment), ("CURED", Cured)):
        if not all(isinstance(each, kind) for each in getattr(module, name, ())):
            return (), f"{name} has an entry that is not of type {kind.__name__}"
    for name in ("CANDIDATES", "BELONGS"):
        if not isinstance(getattr(module, name, {}), Mapping):
            return (), f"{name} is not a mapping"
    return tuple(getattr(module, "EXPERIMENTS", ())), why


@cache
def _tuning(engine: str) -> tuple[Tuning, str]:
    path = inside(engine, TUNING)
    if path is not None:
        try:
            return read_tuning(path), ""
        except EngineError as error:
            return Tuning(), str(error)
    module = None if _experiments(engine)[1] else _module(engine, EXPERIMENTS)[0]
    tried = {name: tuple(values) for name, values in getattr(module, "CANDIDATES", {}).items()}
    belongs = {name: str(other) for name, other in getattr(module, "BELONGS", {}).items()}
    return Tuning(tried, belongs, cured=tuple(getattr(module, "CURED", ()))), ""
