"""Finds engines by entry points and loads them when needed; a broken one loses its own rows only."""

from __future__ import annotations

import difflib
import json
import os
from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, PackageNotFoundError, entry_points
from multiprocessing.connection import Connection
from typing import Any

from adapters.engine import UNRANKED, Engine, EngineError, EngineFacts, Role
from adapters.extras import install, packages
from adapters.isolation.foreign import Found, checked_facts, probe, said_by, serve, trace_of
from adapters.plain import NAME, is_visible, one_line
from adapters.stages import stage

GROUP = "contact_crosscheck.engines"
#: Environment variable with the engines that must be installed, separated by commas: in continuous integration a
#: missing engine is a failure instead of rows with a reason.
REQUIRED = "CROSSCHECK_REQUIRE_ENGINES"


_here = False


class _Introduced(EntryPoint):
    """Registration of an engine of this process only: no package has it, so nothing is imported."""

    def __init__(self, engine: Engine) -> None:
        super().__init__(engine.name, f"here:{type(engine).__qualname__}", GROUP)
        vars(self)["made"] = engine  # an entry point refuses to set attributes

    def load(self) -> Any:
        """The factory of the engine."""
        return lambda: vars(self)["made"]


_introduced: dict[str, Found] = {}


def introduce(engine: Engine | type[Engine]) -> str:
    """Make an engine known in this process under its own name, until another of that name is introduced.

    Worker processes cannot load it. It has no folder, hence no contact laws and no findings.

    Returns
    -------
    Its name.

    Raises
    ------
    EngineError
        If it is not an engine, is broken, or has the name of an installed engine.
    """
    try:
        made = engine() if isinstance(engine, type) else engine
        if not isinstance(made, Engine):
            raise TypeError(f"{type(made).__name__} is not an adapters.engine.Engine")
        entry = _Introduced(made)
    except Exception as error:  # its code may raise anything
        raise EngineError(f"engine: cannot be made: {said_by(error)}") from None
    if entry.name in _entries():
        raise EngineError(f"engine: {one_line(entry.name, NAME)!r} is the name of an installed engine; choose another")
    found = loaded(entry)
    if found.engine is None:
        raise EngineError(f"engine: {one_line(entry.name, NAME)}: {found.reason}")
    _introduced[entry.name] = found
    find.cache_clear()
    return entry.name


def is_introduced(name: str) -> bool:
    """Whether an engine exists in this process only."""
    return name in _introduced


def load_engines_here() -> None:
    """From now on load engines of other packages in this process too: a crash may end it."""
    global _here
    _here = True
    find.cache_clear()


def is_ours(entry: EntryPoint) -> bool:
    """Whether an engine belongs to this project, so that it may be loaded anywhere."""
    return entry.value.startswith("adapters.")


@cache
def _read() -> Any:
    """Entry points of all installed packages: to read them takes 20 to 80 ms in a large environment."""
    return entry_points()


def installed(group: str) -> EntryPoints:
    """Entry points of ``group`` of all installed packages, which are read once a process, until `forget`."""
    found: EntryPoints = _read().select(group=group)
    return found


@cache
def _entries() -> dict[str, EntryPoint]:
    # Ours come last, so that another package cannot replace one by its name.
    return {entry.name: entry for entry in sorted(installed(GROUP), key=is_ours)}


def forget() -> None:
    """Forget what was read and loaded, so that installed packages are searched again; introduced engines stay."""
    for each in (_read, _entries, _facts, find):
        each.cache_clear()


def entry(name: str) -> EntryPoint | None:
    """Registration of the engine called ``name``; None if there is none."""
    return _entries().get(name)


def names() -> list[str]:
    """Names of all registered engines: ours first, of these the exact solver, then 2-D engines."""
    registered = _entries()
    return sorted(registered, key=lambda name: (not is_ours(registered[name]), *_place(registered[name]), name))


def usual() -> list[str]:
    """Engines of a run that names none: all except optional ones that are neither installed nor required.

    A missing engine of the extra `all` keeps its rows, with that reason.
    """
    wanted = _wanted()
    return [name for name in names() if name in wanted or not _set_apart(name) or find(name).engine is not None]


def _set_apart(name: str) -> bool:
    told = facts(name) if is_ours(_entries()[name]) else None
    return told is not None and told.apart


def _wanted() -> list[str]:
    """Names in `REQUIRED`."""
    return os.environ.get(REQUIRED, "").replace(",", " ").split()


def _place(entry: EntryPoint) -> tuple[bool, int]:
    """Sort key of an engine among ours, or among those of other packages, without loading these."""
    told = _facts(entry) if is_ours(entry) else None
    return (told.profile("solution") is None, min(told.dimensions)) if told else (True, 0)


@cache
def find(name: str) -> Found:
    """Look for the engine called ``name``; never raises for an engine that is missing or broken.

    An engine of another package is loaded in its own process (`adapters.isolation.foreign`), except after
    `load_engines_here`.

    Raises
    ------
    EngineError
        If no such engine is registered ("did you mean").
    """
    if name in _introduced:
        return _introduced[name]
    registered = _entries()
    if name not in registered:
        close = difflib.get_close_matches(name, registered, n=1)
        hint = f", did you mean {close[0]!r}?" if close else f"; known: {', '.join(names())}"
        raise EngineError(f"engine: there is no engine called {name!r}{hint}")
    entry = registered[name]
    return loaded(entry, brought_by(entry)) if _here or is_ours(entry) else probed(entry)


def probed(entry: EntryPoint) -> Found:
    """Look for an engine of another package in a process of its own; never raises because of it."""
    told = [entry.name, entry.value, entry.group, brought_by(entry)]
    return probe(entry.name, serve_engine, json.dumps(told).encode())


def serve_engine(connection: Connection) -> None:
    """Load the engine of `probed` and answer for it; runs in the child."""
    name, value, group, distribution = json.loads(connection.recv_bytes())
    serve(connection, loaded(EntryPoint(name, value, group), distribution))


def brought_by(entry: EntryPoint) -> str:
    """Name of the distribution that registers an engine; empty if unknown."""
    return one_line(entry.dist.name, NAME) if entry.dist is not None else ""


def listed(name: str) -> Found:
    """Look for an engine as `find` does, of ours without importing the engine itself: by the metadata of its package.

    Raises
    ------
    EngineError
        If no such engine is registered.
    """
    entry = _entries().get(name)
    return find(name) if entry is None or not is_ours(entry) else loaded(entry, imported=False)


@stage("loading engines")
def loaded(entry: EntryPoint, distribution: str = "", imported: bool = True) -> Found:
    """Load an engine in this process; for a broken one the result has the reason.

    Parameters
    ----------
    distribution
        The package that registers it, for the reason why it cannot be loaded.
    imported
        Whether the engine itself is imported, or only looked up in the metadata of its package.
    """
    engine: Engine | None = None
    facts: EngineFacts | None = None
    name = entry.name
    try:
        made = entry.load()
        told = getattr(made, "facts", None)  # available even if the engine itself is not installed
        facts = told if is_ours(entry) else checked_facts(told) if isinstance(told, EngineFacts) else None
        engine = made()
        if not isinstance(engine, Engine):
            raise TypeError(f"{entry.value} is not an adapters.Engine")
        facts = facts if is_ours(entry) else checked_facts(engine.facts)
        for profile in dict(engine.profiles):
            if not isinstance(profile, str) or not is_visible(profile) or not 0 < len(profile) <= NAME:
                raise EngineError(f"profiles: {one_line(profile, NAME)!r} is not the name of a profile")
        return Found(name, engine, one_line(engine.version() if imported else engine.listed(), NAME), "", facts)
    except ImportError as error:
        absent = isinstance(error, PackageNotFoundError)
        why = f"{one_line(error.name, NAME)} is not installed" if absent else one_line(error)
        reason = f"{why}; {_remedy(entry, facts, distribution)}"
        trace = "" if is_ours(entry) else trace_of(error)
        return Found(name, None, "", reason, facts, trace=trace)
    except BaseException as error:  # another package may raise anything; only its rows are lost
        return Found(name, None, "", said_by(error), facts, trace=trace_of(error))


def _remedy(entry: EntryPoint, facts: EngineFacts | None, distribution: str) -> str:
    """What to install where an import fails: the packages of the extra of one of ours, else the engine's own.

    An engine in the folder of another one is installed by that one's extra.
    """
    extras = (entry.name, entry.module.split(".")[1]) if is_ours(entry) else ()
    if extra := next(filter(packages, extras), None):
        return install(extra)
    if facts is not None:
        return f"pip install {one_line(facts.package, NAME)}"
    return f"it is an engine of {distribution or 'another distribution'}, which must be installed with all it needs"


def adapter(name: str) -> Engine | None:
    """Our adapter called ``name``, without importing its engine; None for another package's or an unknown one."""
    entry = _entries().get(name)
    return entry.load()() if entry is not None and is_ours(entry) else None


def facts(name: str) -> EngineFacts | None:
    """Constant facts of an engine, without importing the engine itself; None if its adapter cannot be loaded."""
    entry = _entries().get(name)
    if entry is None or not is_ours(entry):
        return find(name).facts if entry or is_introduced(name) else None
    return _facts(entry)


@cache
def _facts(entry: EntryPoint) -> EngineFacts | None:
    try:
        told: EngineFacts = entry.load().facts
    except ImportError:
        return None
    return told


def profile_of(name: str, role: Role) -> str | None:
    """Profile of an engine with this role; None if it has none or is not available."""
    told = facts(name)
    return told.profile(role) if told else None


def is_ranked(name: str, profile: str) -> bool:
    """Whether a profile of an engine is ranked and counts as a fix (`adapters.engine.UNRANKED`).

    A profile with settings of a user (``matched+cone=elliptic``) counts as its base profile.
    """
    told = facts(name)
    return told is None or told.roles.get(profile, told.roles.get(profile.partition("+")[0])) not in UNRANKED


def solver() -> str:
    """Name of our own solver: our engine with an exact profile.

    Raises
    ------
    EngineError
        If there is none.
    """
    for name, entry in _entries().items():
        told = _facts(entry) if is_ours(entry) else None
        if told is not None and told.profile("solution"):
            return name
    raise EngineError("engine: our own solver is not registered, install contact-crosscheck again")


def load(name: str) -> Engine:
    """Return the engine called ``name``, loaded in this process.

    Raises
    ------
    EngineError
        If it is unknown, not installed or broken.
    """
    found = find(name)
    if found.engine is not None and not (is_introduced(name) or is_ours(_entries()[name]) or _here):
        found = loaded(_entries()[name], brought_by(_entries()[name]))
    if found.engine is None:
        raise EngineError(f"engine: {name} is not installed: {found.reason}")
    return found.engine


def check_required() -> None:
    """Make sure that every engine named in `REQUIRED` can be loaded.

    Raises
    ------
    EngineError
        Naming those that cannot, with the reason of each.
    """
    absent = [f"{name} ({reason})" for name in _wanted() if (reason := _why_not(name))]
    if absent:
        raise EngineError(f"{REQUIRED}: not installed: {', '.join(absent)}")


def _why_not(name: str) -> str:
    """Why an engine cannot be loaded; empty if it can."""
    if name not in _entries():
        return "no such engine"
    found = find(name)
    return "" if found.engine is not None else found.reason
