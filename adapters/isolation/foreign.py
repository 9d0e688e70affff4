"""Engines of other packages are imported and queried in a separate process, which may die.

    parent: ForeignEngine --("settings", profile, needs, dt)--> child: the plugin itself

A plugin that aborts, exits or hangs on import becomes a reason in a table; values of the wrong type are an error of
that engine. Only worker processes load plugins themselves (`adapters.registry.load_engines_here`).
"""

from __future__ import annotations

import json
import math
import re
import traceback
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, cast, get_args

from adapters.engine import (
    ROLES,
    Declared,
    Engine,
    EngineError,
    EngineFacts,
    Precision,
    Quirk,
    Role,
    Scheme,
    Setting,
    Simulation,
)
from adapters.isolation import Child, IsolationError, Lost
from adapters.needs import Needs
from adapters.plain import NAME, kind_of, lines, one_line, plain
from adapters.scene import Scene
from adapters.scene.drives import Ability

#: Time limit of an import [s]: the largest engines with Python bindings take about ten on a cold disk.
PATIENCE = 30.0
#: Time limit of a query to a loaded engine [s].
ANSWER = 10.0
#: Lines of a traceback: ten calls deep.
TRACE = 30


@dataclass(frozen=True)
class Found:
    """Result of a search for an engine: loaded (or described by its process), or the reason why not.

    ``fatal``: the plugin ends or hangs the process that imports it. ``trace``: where the error was raised.
    """

    name: str
    engine: Engine | None
    version: str
    reason: str = ""
    facts: EngineFacts | None = None
    fatal: bool = False
    trace: str = ""


class ForeignEngine(Engine):
    """An engine whose plugin is in another process: it has facts and settings, but cannot build worlds."""

    def __init__(self, child: Child, told: Mapping[str, Any], again: Callable[[], tuple[Child, Any]]) -> None:
        self.facts = facts_from(told["facts"])
        self.profiles = {name: partial(self._ask, name) for name in told["profiles"]}
        self._version = str(told["version"])
        self.sources = tuple(map(Path, told["sources"]))
        self._child, self._again = child, again

    def version(self) -> str:
        """Version reported by the plugin."""
        return self._version

    def _ask(self, profile: str, needs: Needs, dt: float) -> list[Setting]:
        question = {"profile": profile, "needs": asdict(needs), "dt": dt}
        try:
            self._child.send(json.dumps(question).encode())
            told = json.loads(self._child.receive(ANSWER))
        except Lost as lost:
            self._child.stop()
            self._child, _ = self._again()
            raise EngineError(f"settings: {self.name}/{profile}: {lost}") from None
        if "error" in told:
            raise EngineError(f"settings: {self.name}/{profile}: {told['error']}")
        return [Setting(**setting) for setting in told["settings"]]

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Not available outside the plugin's process."""
        raise EngineError(f"engine: {self.name} is loaded in worker processes only")

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Not available outside the plugin's process."""
        raise EngineError(f"engine: {self.name} is loaded in worker processes only")

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Not available outside the plugin's process."""
        raise EngineError(f"engine: {self.name} is loaded in worker processes only")


def probe(name: str, served: Callable[[Connection], None], question: bytes) -> Found:
    """Load a plugin in a separate process; never raises because of it.

    Parameters
    ----------
    served
        What runs there: it loads the plugin that ``question`` names, and calls `serve`.
    """
    again = partial(_asked, served, question)
    try:
        child, told = again()
    except IsolationError as error:
        return Found(name, None, "", str(error))
    facts = facts_from(told["facts"]) if told.get("facts") else None
    if told.get("reason"):
        child.stop()
        return Found(name, None, "", told["reason"], facts, bool(told.get("fatal")), told.get("trace", ""))
    return Found(name, ForeignEngine(child, told, again), told["version"], "", facts)


def _asked(served: Callable[[Connection], None], question: bytes) -> tuple[Child, dict[str, Any]]:
    child = Child(served)
    child.send(question)
    try:
        told: dict[str, Any] = json.loads(child.receive(PATIENCE))
    except Lost as lost:
        child.stop()
        said = one_line(child.tail().rpartition("\n")[2])
        reason = f"{lost} while it was imported" + (f": {said}" if said else "")
        return child, {"reason": reason, "fatal": True, "trace": lines(child.tail(), TRACE)}
    return child, told


def serve(connection: Connection, found: Found) -> None:
    """Answer for one plugin until the other end closes; runs in the child."""
    told: dict[str, Any] = {"version": found.version, "reason": found.reason, "trace": found.trace}
    if found.facts is not None:
        told["facts"] = plain_facts(found.facts)
    if found.engine is not None:
        told["profiles"] = list(found.engine.profiles)
        told["sources"] = list(map(str, found.engine.sources))
    connection.send_bytes(json.dumps(told).encode())
    while found.engine is not None:
        try:
            asked = json.loads(connection.recv_bytes())
        except EOFError:
            return
        connection.send_bytes(json.dumps(_settings(found.engine, asked)).encode())


def importable(module: str) -> str:
    """Import a module of another package in a separate process; returns why that fails, or nothing."""
    try:
        child = Child(serve_import)
    except IsolationError as error:
        return str(error)
    try:
        child.send(module.encode())
        return child.receive(PATIENCE).decode()
    except Lost as lost:
        return f"{lost} while it was imported"
    finally:
        child.stop()


def serve_import(connection: Connection) -> None:
    """Import one module and report the result; runs in the child."""
    try:
        import_module(connection.recv_bytes().decode())
        said = ""
    except BaseException as error:  # it may raise anything
        said = said_by(error)
    connection.send_bytes(said.encode())


def _settings(engine: Engine, asked: Mapping[str, Any]) -> dict[str, Any]:
    try:
        given = engine.settings(asked["profile"], Needs(**asked["needs"]), asked["dt"])
        return {"settings": [plain(asdict(setting)) for setting in checked_settings(given)]}
    except BaseException as error:  # an error of the plugin
        return {"error": said_by(error)}


def trace_of(error: BaseException) -> str:
    """Last lines of the traceback, each cleaned."""
    return lines("".join(traceback.format_exception(error)), TRACE)


def said_by(error: BaseException) -> str:
    """Type and first line of an error, in one line."""
    return one_line(f"{type(error).__name__}: {one_line(error)}".rstrip(": "))


def checked_settings(given: Any) -> list[Setting]:
    """Settings from an engine, if they are valid.

    Raises
    ------
    EngineError
        Naming the value of the wrong type.
    """
    if not isinstance(given, list | tuple):
        raise EngineError(f"settings: {kind_of(given)} was given, a list is needed")
    for setting in given:
        if not isinstance(setting, Setting) or not isinstance(setting.name, str):
            raise EngineError(f"settings: {kind_of(setting)} was given, a Setting with a name is needed")
        if isinstance(setting.value, float) and not math.isfinite(setting.value):
            raise EngineError(f"settings: {one_line(setting.name, NAME)} is {setting.value}, not a finite number")
    return list(given)


def checked_refusal(given: Any) -> str | None:
    """Refusal by an engine: a line, or None.

    Raises
    ------
    EngineError
        If it is neither.
    """
    if given is not None and not isinstance(given, str):
        raise EngineError(f"refuses: {kind_of(given)} was given, a sentence or None is needed")
    return one_line(given) if given is not None else None


def checked_facts(facts: Any) -> EngineFacts:
    """Facts of an engine with cleaned texts and checked types.

    Raises
    ------
    EngineError
        Naming the fact that is wrong.
    """
    if not isinstance(facts, EngineFacts):
        raise EngineError(f"facts: {kind_of(facts)} was given, EngineFacts are needed")
    try:
        return facts_from(plain_facts(facts))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise EngineError(f"facts: {said_by(error)}") from None


def plain_facts(facts: EngineFacts) -> dict[str, Any]:
    """Facts as JSON-ready data."""
    data = {name: getattr(facts, name) for name in facts.__dataclass_fields__}
    data["scheme"] = vars(facts.scheme)
    data["quirks"] = [vars(quirk) for quirk in facts.quirks]
    data["roles"] = dict(facts.roles)
    data["profile_schemes"] = {name: vars(scheme) for name, scheme in facts.profile_schemes.items()}
    return dict(plain(data))


def facts_from(data: Mapping[str, Any]) -> EngineFacts:
    """Inverse of `plain_facts`.

    Raises
    ------
    KeyError, TypeError, ValueError, AttributeError
        If the data is not that of facts.
    """
    dimensions = frozenset(int(d) for d in data["dimensions"])
    if not dimensions or not dimensions <= {2, 3}:
        raise ValueError(f"dimensions are {sorted(dimensions)}, 2 and 3 are possible")
    step = float(data["customary_dt"])
    if not (math.isfinite(step) and step > 0.0):
        raise ValueError(f"customary_dt is {step}, a positive number of seconds is needed")
    return EngineFacts(
        one_line(data["name"], NAME),
        one_line(data["title"], NAME),
        one_line(data["package"], NAME),
        dimensions,
        _scheme(data["scheme"]),
        step,
        tuple(Quirk(**{key: str(text) for key, text in quirk.items()}) for quirk in data["quirks"]),
        {str(version): str(why) for version, why in data["known_bad_versions"].items()},
        {str(name): _scheme(scheme) for name, scheme in data["profile_schemes"].items()},
        {str(name): _role(role) for name, role in data["roles"].items()},
        _colour(data["colour"]),
        _precision(data["precision"]),
        bool(data["apart"]),
        frozenset(map(_ability, data["abilities"])),
        one_line(data["port_of"], NAME),
    )


def _precision(text: Any) -> Precision:
    if text not in get_args(Precision):
        raise ValueError(f"precision is {one_line(text, NAME)!r}, possible are {', '.join(get_args(Precision))}")
    return cast(Precision, text)


def _ability(text: Any) -> Ability:
    if text not in get_args(Ability):
        raise ValueError(f"ability is {one_line(text, NAME)!r}, possible are {', '.join(get_args(Ability))}")
    return cast(Ability, text)


def _role(role: Any) -> Role:
    if role not in ROLES:
        raise ValueError(f"role is {one_line(role, NAME)!r}, possible are {', '.join(ROLES)}")
    return cast(Role, role)


def _colour(text: Any) -> str:
    if text and not (isinstance(text, str) and re.fullmatch(r"#[0-9a-fA-F]{6}", text)):
        raise ValueError(f"colour is {one_line(text, NAME)!r}, #rrggbb is needed")
    return text or ""


def _scheme(data: Mapping[str, Any]) -> Scheme:
    return Scheme(str(data["order"]), float(data["position_offset"]))
