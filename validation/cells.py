"""Slots, cells and observations: what was requested, what ran, and the result."""

from __future__ import annotations

import hashlib
import json
import math
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from adapters import registry
from adapters.engine import Engine, Setting
from adapters.isolation import LOG_LINES
from adapters.isolation.foreign import checked_settings
from adapters.needs import needs
from adapters.plain import NAME, REASON, is_visible, lines, one_line, plain
from adapters.registry import find
from adapters.scene import Scene, SceneError
from adapters.settings.own import suffix_of
from adapters.stages import stage
from validation.bounds import planar
from validation.canonical import CanonicalScene, Check, Measured
from validation.identity import adapter_hash, scene_code
from validation.metrics import OUT_OF_PLANE, realised
from validation.posed import is_known, resolve

#: Largest iteration count (a C integer) and largest move in units in the last place (made one by one).
MOST_ITERATIONS, MOST_ULPS = 10**6, 10**4
#: Most steps of a cell, and most samples (steps times bodies): a state of a body takes up to 104 bytes.
MOST_STEPS, MOST_SAMPLES = 10**7, 5 * 10**7
#: Longest step [s]: the probes of an adapter resolve nothing coarser. At 0.15 s they cannot measure friction, at 0.25 s
#: their boxes turn over between two samples; a property check would measure the step, not the engine.
LONGEST_DT = 0.1
#: End of the reason of a case that ran once more, alone, and then had a result (`validation.workers.pool`).
ALONE = "alone it runs"
#: What is stored of each setting and property check.
SETTING = {field.name for field in fields(Setting)}
RECEIPT = {"quantity", "asked", "declared", "measured", "band", "holds", "because"}


class Outcome(Enum):
    """Outcome of a cell."""

    OK = "ok"
    UNSUPPORTED = "unsupported"
    NOT_INSTALLED = "not_installed"
    #: An exact profile gives no answer that it can certify, and says why.
    REFUSED = "refused"
    #: The measurement contradicts itself (`adapters.receipts.contradictions`).
    INVALID = "invalid"
    DIVERGED = "diverged"
    CRASHED = "crashed"
    TIMED_OUT = "timed_out"
    #: Planned, but there is no observation: shown with the run, never stored.
    MISSING = "missing"


def format_dt(dt: float) -> str:
    """``1/240`` where the step is one over a whole number, else the shortest decimal."""
    per_second = 1.0 / dt
    if not 1.0 <= per_second < math.inf:  # steps of more than a second, and those whose inverse overflows
        return repr(dt)
    return f"1/{round(per_second)}" if 1.0 / round(per_second) == dt else repr(dt)


def parse_dt(text: str) -> float:
    """Read a step [s] written as a decimal or a fraction.

    Raises
    ------
    SceneError
        If it is not a positive, finite number.
    """
    try:
        # Divided in floating point: 1/240 must be the double that 1 / 240 gives, not a rounded decimal.
        numerator, _, denominator = text.partition("/")
        dt = float(numerator) / float(denominator) if denominator else float(Fraction(text[:64]))
    except (ValueError, ZeroDivisionError, OverflowError):
        raise SceneError(f"dt: {text[:64]!r} is not a number of seconds such as 1/240 or 0.004") from None
    if not (math.isfinite(dt) and dt > 0.0):
        raise SceneError(f"dt: {text} must be a positive, finite number of seconds")
    return dt


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


@dataclass(frozen=True)
class Slot:
    """A requested cell; comparisons, findings and dashboards join on it.

    Parameters
    ----------
    scene
        Name in the catalogue, or path of a scene file.
    params
        Only what differs from the defaults, sorted by name.
    iterations
        None: the profile's own count.
    ulp
        Units in the last place by which the start height is moved (measures the noise floor), of the numbers that the
        engine computes with.
    switched
        Settings of the profile that are replaced, by name and sorted: an experiment (`validation.settings.switching`),
        or a user's, which then are part of the profile's name (`with_own`).
    """

    scene: str
    params: tuple[tuple[str, float], ...]
    dimension: int
    engine: str
    profile: str
    dt: float
    iterations: int | None = None
    ulp: int = 0
    switched: tuple[tuple[str, Any], ...] = ()

    @property
    def base(self) -> str:
        """The engine's profile: the slot's without the settings in its name."""
        return self.profile.removesuffix(suffix_of(self.switched))

    @property
    def is_own(self) -> bool:
        """Whether a user has set settings of it."""
        return bool(self.switched) and self.profile != self.base

    @property
    def stock(self) -> Slot:
        """The same with the profile's own settings."""
        return replace(self, profile=self.base, switched=())

    def with_own(self, settings: tuple[tuple[str, Any], ...]) -> Slot:
        """Return the slot with settings of a user, which become part of the profile's name."""
        return replace(self, profile=self.profile + suffix_of(settings), switched=settings)

    def key(self) -> str:
        """Sixteen hex digits that identify the slot."""
        return hashlib.sha256(json.dumps(_said(vars(self)), sort_keys=True).encode()).hexdigest()[:16]

    def params_text(self) -> str:
        """``e=0.8 height=1.03``."""
        return " ".join(f"{name}={value:.12g}" for name, value in self.params)

    def with_params(self, params: Mapping[str, float]) -> Slot:
        """Return the same slot with other parameters."""
        return replace(self, params=tuple(sorted(params.items())))

    def as_dict(self) -> dict[str, Any]:
        """Plain data that `slot_from_dict` reads back."""
        data = _said({**vars(self), "params": dict(self.params)})
        return data | {"switched": dict(self.switched)} if self.switched else data


def _said(data: Mapping[str, Any]) -> dict[str, Any]:
    """A slot without experiment omits that field, so older stored data and hashes stay equal."""
    return {name: value for name, value in data.items() if name != "switched" or value}


def slot_from_dict(data: Mapping[str, Any]) -> Slot:
    """Inverse of `Slot.as_dict`.

    Raises
    ------
    SceneError
        Naming a missing, unknown or malformed field.
    """
    fields = set(Slot.__dataclass_fields__)
    for name in data:
        if name not in fields:
            raise SceneError(f"slot.{name}: unknown field; fields are {', '.join(sorted(fields))}")
    for name in ("scene", "engine", "profile", "dt"):
        if name not in data:
            raise SceneError(f"slot.{name}: is missing")
    for name in ("scene", "engine", "profile"):
        if not isinstance(data[name], str) or not is_visible(data[name]):
            raise SceneError(f"slot.{name}: {one_line(data[name], NAME)!r} is not a name")
    dt = parse_dt(str(data["dt"]))
    iterations = data.get("iterations")
    if iterations is not None and (not _is_whole(iterations) or not 1 <= iterations <= MOST_ITERATIONS):
        raise SceneError(f"slot.iterations: {iterations!r} must be a whole number in [1, {MOST_ITERATIONS}]")
    try:
        params = tuple(sorted((str(k), float(v)) for k, v in dict(data.get("params", {})).items()))
    except (TypeError, ValueError, OverflowError):
        raise SceneError(f"slot.params: {data.get('params')!r} is not a table of numbers") from None
    dimension, ulp = data.get("dimension", 2), data.get("ulp", 0)
    if not _is_whole(dimension):
        raise SceneError(f"slot.dimension: {dimension!r} must be 2 or 3")
    if not _is_whole(ulp) or abs(ulp) > MOST_ULPS:
        raise SceneError(f"slot.ulp: {ulp!r} must be a whole number in [-{MOST_ULPS}, {MOST_ULPS}]")
    switched = data.get("switched", {})
    if not isinstance(switched, Mapping):
        raise SceneError(f"slot.switched: {switched!r} is not a table of settings")
    pairs = tuple(sorted((str(name), _as_set(value)) for name, value in switched.items()))
    return Slot(data["scene"], params, dimension, data["engine"], data["profile"], dt, iterations, ulp, pairs)


def _as_set(value: Any) -> Any:
    """A setting's value with tuples again, which JSON turned into lists."""
    return tuple(value) if isinstance(value, list) else value


@dataclass(frozen=True)
class Cell:
    """What ran: a slot and the identity of everything that determines its result."""

    slot: Slot
    scene_hash: str
    scene_code: str
    engine_version: str
    adapter_hash: str
    settings_hash: str
    python: str

    def key(self) -> str:
        """Sixteen hex digits that identify the cell."""
        data = vars(self) | {"slot": _said(vars(self.slot))}
        return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Observation:
    """Result of a cell. Measurements only: verdicts are derived from it, never stored."""

    slot: Slot
    cell: str
    scene_version: int
    engine_version: str
    outcome: Outcome
    reason: str = ""
    metrics: Mapping[str, Measured] = field(default_factory=dict)
    state_hash: str = ""
    steps: int = 0
    wall_time_s: float = 0.0
    settings: tuple[Mapping[str, Any], ...] = ()
    receipts: tuple[Mapping[str, Any], ...] = ()
    readback: Mapping[str, Any] = field(default_factory=dict)
    certificate: Mapping[str, Any] = field(default_factory=dict)
    initial_change: tuple[str, ...] = ()
    log: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready) that `observation_from_dict` reads back."""
        data = {name: getattr(self, name) for name in self.__dataclass_fields__}
        data |= {"slot": self.slot.as_dict(), "outcome": self.outcome.value}
        data["metrics"] = {name: list(measured) for name, measured in self.metrics.items()}
        return data


def observation_from_dict(data: Mapping[str, Any]) -> Observation:
    """Inverse of `Observation.as_dict`; the only entry for observations from workers and stores.

    All text is cleaned and shortened here.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the data is not that of an observation, for example of a later version.
    """
    values = dict(data)
    values |= {"slot": slot_from_dict(data["slot"]), "outcome": Outcome(data["outcome"])}
    values["metrics"] = {one_line(name): _measured(*found) for name, found in data["metrics"].items()}
    for name in ("settings", "receipts", "initial_change"):
        values[name] = tuple(plain(item) for item in data[name])
    for name in ("readback", "certificate"):
        values[name] = dict(plain(data[name]))
    for name, most in (("cell", NAME), ("engine_version", NAME), ("reason", REASON), ("state_hash", NAME)):
        values[name] = one_line(data[name], most)
    for name, kind in (("scene_version", int), ("steps", int), ("wall_time_s", float)):
        values[name] = kind(data[name])
    for name, keys in (("settings", SETTING), ("receipts", RECEIPT)):
        if not all(isinstance(item, dict) and keys <= item.keys() for item in values[name]):
            raise ValueError(f"{name}: each is a table of {', '.join(sorted(keys))}")
    if not math.isfinite(values["wall_time_s"]):
        raise ValueError("wall_time_s: is not a finite number")
    values["log"] = lines(str(data["log"]), LOG_LINES)
    values.pop("out_of_plane", None)  # of runs before it was a metric: one number of mixed units
    return Observation(**values)


def _measured(value: Any, reason: Any) -> Measured:
    """A measured value: a finite number, or None and a reason."""
    if value is None or math.isfinite(value):
        return (None if value is None else float(value)), one_line(reason)
    return None, one_line(f"{reason}; the value is {float(value)}, not a finite number".removeprefix("; "))


def checks_of(observation: Observation) -> tuple[Scene, list[Check]]:
    """Scene of an observation and all its checks.

    These are the scene's own, its plane where it is embedded in 3-D, and property checks that do not hold.

    Raises
    ------
    SceneError
        As `CanonicalScene.checks` does.
    """
    slot = observation.slot
    canonical, scene = resolve(slot.scene), scene_of(slot)
    lifted = OUT_OF_PLANE in observation.metrics
    own = [*canonical.checks(scene, slot.dt), *(lifted * plane_of(canonical, scene, slot.dt))]
    broken = [each for each in observation.receipts if realised(each["quantity"]) in observation.metrics]
    return scene, own + list(map(_realised, broken))


def _realised(receipt: Mapping[str, Any]) -> Check:
    """The property check as a check of its cell; all its quantities are ratios, shares, coefficients or signs."""
    told = f"{receipt['asked']:.4g} in the scene; {receipt['because']}"
    return Check(realised(receipt["quantity"]), "1", receipt["declared"], receipt["band"], told, "property check")


def scene_of(slot: Slot) -> Scene:
    """The scene of a slot, for those who judge it: made once for all engines, profiles and steps."""
    return _scene(slot.scene, slot.dimension, slot.params)


@lru_cache(maxsize=1024)
def _scene(name: str, dimension: int, params: tuple[tuple[str, float], ...]) -> Scene:
    return resolve(name).scene(dimension, dict(params))


def plane_of(canonical: CanonicalScene, scene: Scene, dt: float) -> list[Check]:
    """Check that a 2-D scene embedded in 3-D stays in its plane; none for 3-D scenes."""
    return [planar(scene, dt, canonical.growth(scene))] if scene.dimension == 2 else []


@dataclass(frozen=True)
class Prepared:
    """A slot with its scene and its cell."""

    canonical: CanonicalScene
    scene: Scene
    cell: Cell


@stage("preparing cases")
def prepare(slot: Slot) -> Prepared:
    """Make the slot's scene and the identity of its cell, without loading the engine's own library.

    Raises
    ------
    SceneError, EngineError
        For bad parameters, an unknown scene, engine or profile.
    """
    canonical = resolve(slot.scene)
    scene = canonical.scene(slot.dimension, dict(slot.params))
    check_size(scene, slot.dt)
    found = find(slot.engine)
    if slot.ulp:
        scene = _nudged(scene, slot.ulp, numbers_of(slot.engine))
    settings: list[Any] = []
    if found.engine is not None:
        settings = settings_of(found.engine, slot, scene)
    text = json.dumps([(s.name, plain(s.value)) for s in settings], sort_keys=True, default=str)
    settings_hash = hashlib.sha256(text.encode()).hexdigest()[:16]
    version = ".".join(platform.python_version_tuple()[:2])
    code = scene_code(slot.scene), found.version, adapter_hash(slot.engine)
    cell = Cell(slot, scene.hash(), *code, settings_hash, version)
    return Prepared(canonical, scene, cell)


def settings_of(engine: Engine, slot: Slot, scene: Scene) -> list[Setting]:
    """Settings of a slot: its profile's for the scene, with the switched ones replaced or added.

    Raises
    ------
    EngineError
        For an unknown profile, or an iteration count that the profile does not have.
    """
    # The benchmark has scenes outside the catalogue; they bring no profiles.
    brought = resolve(slot.scene).brought(slot.engine, slot.base) if is_known(slot.scene) else None
    if brought is not None:
        own = list(brought.settings)
    else:
        own = checked_settings(engine.settings(slot.base, needs(scene), slot.dt, slot.iterations))
    because = "set by the user" if slot.is_own else "switched for an experiment"
    switched = {name: Setting(name, value, because) for name, value in slot.switched}
    kept = [switched.pop(setting.name, setting) for setting in own]
    return [*kept, *switched.values()]


def check_size(scene: Scene, dt: float) -> None:
    """Refuse a cell with too many steps or too much data, before anything runs.

    Raises
    ------
    SceneError
        Naming the step, if it is longer than probes resolve, or needs too many steps or samples.
    """
    if dt > LONGEST_DT:
        raise SceneError(f"dt: {format_dt(dt)} s is longer than {LONGEST_DT:g} s: nothing can be measured at it")
    steps = scene.duration / dt
    if not steps <= MOST_STEPS:
        raise SceneError(f"dt: {format_dt(dt)} makes {steps:.3g} steps of {scene.duration:g} s, at most {MOST_STEPS:g}")
    if steps * len(scene.bodies) > MOST_SAMPLES:
        raise SceneError(
            f"dt: {format_dt(dt)} makes {steps:.3g} steps of {len(scene.bodies)} bodies; "
            f"steps times bodies are at most {MOST_SAMPLES:g}"
        )


def numbers_of(engine: str) -> type[np.floating[Any]]:
    """Return the precision of an engine: double where it is unknown."""
    facts = registry.facts(engine)
    return np.float32 if facts and facts.precision == "single" else np.float64


def _nudged(scene: Scene, ulp: int, kind: type[np.floating[Any]]) -> Scene:
    """Move every free body up by ``ulp`` units in the last place of its height, in the engine's precision.

    A single-precision engine rounds neighbouring doubles to the same start, so a move by their last place has no
    effect.
    """
    up, end = scene.dimension - 1, kind(math.copysign(math.inf, ulp))

    def nudge(pose: tuple[float, ...]) -> tuple[float, ...]:
        height = kind(pose[up])
        for _ in range(abs(ulp)):
            height = np.nextafter(height, end)
        return (*pose[:up], float(height), *pose[up + 1 :])

    bodies = tuple(replace(b, pose=nudge(b.pose)) if b.motion == "free" else b for b in scene.bodies)
    return replace(scene, bodies=bodies)
