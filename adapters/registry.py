"""Finds engines by entry points and loads them late; a broken one costs its own rows only."""

from __future__ import annotations

import difflib
from functools import cache
from importlib.metadata import EntryPoint, entry_points

from adapters.engine import Engine, EngineError, EngineFacts
from adapters.foreign import Found, checked_facts, probe, said_by
from adapters.plain import NAME, is_visible, one_line

GROUP = "contact_crosscheck.engines"
#: Order in which our own engines are shown; others follow by name.
SHOWN_FIRST = ("reference", "chipmunk", "bullet", "mujoco")


_here = False


def load_engines_here() -> None:
    """Load the engines of others in this process as well, from now on: it is one that may die."""
    global _here
    _here = True
    find.cache_clear()


def is_ours(entry: EntryPoint) -> bool:
    """Whether an engine belongs to this project, so that it may be loaded anywhere."""
    return entry.value.startswith("adapters.")


def _entries() -> dict[str, EntryPoint]:
    # Ours come last: nobody else's engine takes their place by taking their name.
    return {entry.name: entry for entry in sorted(entry_points(group=GROUP), key=is_ours)}


def names() -> list[str]:
    """Names of all registered engines, ours first."""
    registered = _entries()
    ours = [name for name in SHOWN_FIRST if name in registered]
    return ours + sorted(set(registered) - set(ours))


@cache
def find(name: str) -> Found:
    """Look for the engine called ``name``; never raises for an engine that is missing or broken.

    An engine of somebody else's plugin is asked in a process of its own (`adapters.foreign`), except where
    `load_engines_here` was called.

    Raises
    ------
    EngineError
        If no such engine is registered ("did you mean").
    """
    registered = _entries()
    if name not in registered:
        close = difflib.get_close_matches(name, registered, n=1)
        hint = f", did you mean {close[0]!r}?" if close else f"; known: {', '.join(names())}"
        raise EngineError(f"engine: there is no engine called {name!r}{hint}")
    entry = registered[name]
    return loaded(entry) if _here or is_ours(entry) else probe(entry)


def loaded(entry: EntryPoint) -> Found:
    """Load an engine in this process; a broken one is a reason."""
    engine: Engine | None = None
    facts: EngineFacts | None = None
    name = entry.name
    try:
        made = entry.load()
        told = getattr(made, "facts", None)  # known even if the engine itself is not installed
        facts = told if is_ours(entry) else checked_facts(told) if isinstance(told, EngineFacts) else None
        engine = made()
        if not isinstance(engine, Engine):
            raise TypeError(f"{entry.value} is not an adapters.Engine")
        facts = facts if is_ours(entry) else checked_facts(engine.facts)
        for profile in dict(engine.profiles):
            if not isinstance(profile, str) or not is_visible(profile) or not 0 < len(profile) <= NAME:
                raise EngineError(f"profiles: {one_line(profile, NAME)!r} is not the name of a profile")
        return Found(name, engine, one_line(engine.version(), NAME), "", facts)
    except ImportError as error:
        package = facts.package if facts else name
        return Found(name, None, "", f"{one_line(error)}; pip install 'contact-crosscheck[{name}]' ({package})", facts)
    except BaseException as error:  # a third-party plugin may raise anything; only its rows may suffer
        return Found(name, None, "", said_by(error), facts)


def facts(name: str) -> EngineFacts | None:
    """Constant facts of an engine, without importing the engine itself; None if its adapter cannot be loaded."""
    entry = _entries().get(name)
    if entry is None or not is_ours(entry):
        return find(name).facts if entry else None
    try:
        told: EngineFacts = entry.load().facts
    except ImportError:
        return None
    return told


def load(name: str) -> Engine:
    """Return the engine called ``name``, loaded in this process.

    Raises
    ------
    EngineError
        If it is unknown, not installed or broken.
    """
    found = find(name)
    if found.engine is not None and not is_ours(_entries()[name]) and not _here:
        found = loaded(_entries()[name])
    if found.engine is None:
        raise EngineError(f"engine: {name} is not installed: {found.reason}")
    return found.engine
