"""Finds engines by entry points and loads them late; a broken one costs its own rows only."""

from __future__ import annotations

import difflib
import os
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points

from adapters.engine import Engine, EngineError, EngineFacts

GROUP = "contact_crosscheck.engines"
#: Order in which our own engines are shown; others follow by name.
SHOWN_FIRST = ("reference", "chipmunk", "bullet", "mujoco")
#: Environment variable with the engines that must be installed, separated by commas: where an engine that is not
#: there must be a failure rather than rows that say so, as in a check of every change.
REQUIRED = "CROSSCHECK_REQUIRE_ENGINES"


@dataclass(frozen=True)
class Found:
    """An engine that was looked for: loaded, or the reason why not."""

    name: str
    engine: Engine | None
    version: str
    reason: str = ""


def _entries() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def names() -> list[str]:
    """Names of all registered engines, ours first."""
    registered = _entries()
    ours = [name for name in SHOWN_FIRST if name in registered]
    return ours + sorted(set(registered) - set(ours))


@cache
def find(name: str) -> Found:
    """Load the engine called ``name``; never raises for an engine that is missing or broken.

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
    engine: Engine | None = None
    try:
        engine = registered[name].load()()
        if not isinstance(engine, Engine):
            raise TypeError(f"{registered[name].value} is not an adapters.Engine")
        return Found(name, engine, engine.version())
    except ImportError as error:
        package = engine.facts.package if engine else name
        missing = str(error).partition("\n")[0]
        return Found(name, None, "", f"{missing}; pip install 'contact-crosscheck[{name}]' ({package})")
    except (Exception, SystemExit) as error:  # a third-party plugin may raise anything; only its rows may suffer
        return Found(name, None, "", f"{type(error).__name__}: {error}".splitlines()[0])


def facts(name: str) -> EngineFacts | None:
    """Constant facts of an engine, without importing the engine itself; None if its adapter cannot be loaded."""
    entry = _entries().get(name)
    try:
        return entry.load().facts if entry else None
    except (Exception, SystemExit):  # as in `find`: a broken plugin costs its own part only
        return None


def load(name: str) -> Engine:
    """Return the engine called ``name``.

    Raises
    ------
    EngineError
        If it is unknown, not installed or broken.
    """
    found = find(name)
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
    wanted = os.environ.get(REQUIRED, "").replace(",", " ").split()
    absent = [f"{name} ({reason})" for name in wanted if (reason := _why_not(name))]
    if absent:
        raise EngineError(f"{REQUIRED}: not installed: {', '.join(absent)}")


def _why_not(name: str) -> str:
    """Why an engine cannot be loaded; empty if it can."""
    if name not in _entries():
        return "no such engine"
    found = find(name)
    return "" if found.engine is not None else found.reason
