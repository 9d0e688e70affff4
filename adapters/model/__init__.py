"""Model files of one engine, read as scenes for every engine.

An engine with a model language has a reader for it (`adapters.engine.Engine.reads`) in its folder, which may use the
engine's compiler. It runs in a separate process (`read`), so that a compiler that aborts, hangs or takes all memory
gives a one-line error.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from adapters import registry
from adapters.engine import EngineError, Setting
from adapters.isolation import Child, Lost
from adapters.plain import one_line, plain
from adapters.scene import Body, Pair, Scene, SceneError, scene_from_dict

#: Time limit [s] and address space [bytes] of a reader: a model of a thousand geoms takes a second, and an engine's
#: library alone may map most of a gigabyte.
PATIENCE, MEMORY = 60.0, 2 * 2**30
#: Name of the profile that runs a model as its own engine would.
PROFILE = "model"
#: Simulated time of a model [s], which has none itself.
DURATION = 2.0
#: Components of directions below this count as round-off of a compiler's angles.
ROUNDING = 1e-14
#: Relative tolerance within which a centre of mass or an axis equals that of its shape.
ALIGNED = 1e-9
#: Rods lie along z in models and along x here: rotated by -90 degrees about y, which keeps their plane.
ALONG = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


class ReaderMissing(EngineError):
    """The engine that reads a model is not installed; the message names the extra that installs it."""


@dataclass(frozen=True)
class Model:
    """A model as a scene.

    Parameters
    ----------
    scene
        Rigid bodies and their materials; the reader chooses the duration.
    notes
        Assumptions in the conversion, for readers of results.
    dropped
        Elements that were left out because a scene does not support them, one line each.
    settings
        Further settings for the model's own engine: contact softness, solver options.
    dt
        The model's own step [s].

    Raises
    ------
    SceneError
        If the step is not a positive, finite number.
    """

    scene: Scene
    notes: tuple[str, ...]
    dropped: tuple[str, ...]
    settings: tuple[Setting, ...]
    dt: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.dt) and self.dt > 0.0):
            raise SceneError(f"model: its time step of {self.dt:g} s must be positive and finite")

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready) that `model_from_dict` reads back."""
        settings = [asdict(setting) for setting in self.settings]
        rest = {"notes": list(self.notes), "dropped": list(self.dropped), "settings": settings, "dt": self.dt}
        return {"scene": self.scene.as_dict(), **rest}


#: ``read(text, drop)``; with ``drop`` unsupported elements are left out instead of refused.
Reader = Callable[[str, bool], Model]


def model_from_dict(data: Mapping[str, Any]) -> Model:
    """Inverse of `Model.as_dict`; texts are cleaned."""
    settings = tuple(Setting(s["name"], _tuples(s["value"]), s["because"], s["source"]) for s in data["settings"])
    notes, dropped = (tuple(one_line(line) for line in data[name]) for name in ("notes", "dropped"))
    return Model(scene_from_dict(data["scene"]), notes, dropped, settings, float(data["dt"]))


def _tuples(value: Any) -> Any:
    """A setting's value with tuples again, which JSON turned into lists."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def reader_of(suffix: str) -> str | None:
    """Our engine that reads files ending in ``suffix``; None if there is none."""
    for name in registry.names():
        adapter = registry.adapter(name)
        if adapter is not None and suffix.lower() in adapter.reads:
            return name
    return None


def read(engine: str, suffix: str, text: str, drop: bool) -> Model:
    """Read a model in a separate process.

    Raises
    ------
    SceneError
        Naming the unsupported element, or if the text is not a model.
    ReaderMissing
        If the engine is not installed.
    EngineError
        If its compiler ended or hung.
    """
    found = registry.find(engine)
    if found.engine is None:
        raise ReaderMissing(f"model: {suffix} is read by {engine}, which is not installed: {found.reason}")
    child = Child(_serve, MEMORY)
    try:
        child.send(json.dumps([engine, suffix, text, drop]).encode())
        answer = json.loads(child.receive(PATIENCE))
    except Lost as lost:
        raise EngineError(f"model: {engine}'s compiler gave no model: {lost}") from None
    finally:
        child.stop()
    if "refused" in answer:
        raise SceneError(one_line(answer["refused"]))
    if "failed" in answer:
        raise EngineError(one_line(answer["failed"]))
    return model_from_dict(answer["model"])


def _serve(connection: Connection) -> None:
    """Read one model; runs in the child."""
    engine, suffix, text, drop = json.loads(connection.recv_bytes())
    try:
        found = registry.load(engine).reads[suffix.lower()](text, drop).as_dict()
        answer: dict[str, Any] = {"model": {**found, "settings": [plain(s) for s in found["settings"]]}}
    except SceneError as error:
        answer = {"refused": str(error) + ("" if drop else _helped_by_drop(engine, suffix, text))}
    except Exception as error:  # the reader catches a compiler's errors; this is another one
        answer = {"failed": f"model: {type(error).__name__}: {error}"}
    connection.send_bytes(json.dumps(answer).encode())


def _helped_by_drop(engine: str, suffix: str, text: str) -> str:
    """A hint that the model can be read without the refused elements, if that works."""
    try:
        left_out = len(registry.load(engine).reads[suffix.lower()](text, True).dropped)
    except Exception:  # it is refused for another reason too, which the next call reports
        return ""
    return "; run --drop leaves it out" + (f" ({left_out} in all)" if left_out > 1 else "")


# ---- shared by readers -----------------------------------------------------------------------------------------------


def unit(vector: Any) -> tuple[float, ...]:
    """A direction or a quaternion of length 1, with round-off components set to 0."""
    clean = np.where(np.abs(vector) < ROUNDING, 0.0, vector)
    return tuple(float(x) + 0.0 for x in clean / np.linalg.norm(clean))


def unique(names: Iterable[str]) -> list[str]:
    """Valid unique names of bodies: repeated ones are numbered."""
    seen: Counter[str] = Counter()
    found = []
    for name in (one_line(name, 60) for name in names):
        seen[name] += 1
        found.append(name if seen[name] == 1 and name != "*" else f"{name}~{seen[name]}")
    return found


def pairs_of(frictions: Mapping[tuple[int, int], float], bodies: Sequence[Body]) -> tuple[Pair, ...]:
    """Friction of pairs of bodies, by index: the most common as the default, others by name."""
    usual = Counter(frictions.values()).most_common(1)[0][0] if frictions else 0.0
    others = [
        Pair(bodies[i].name, bodies[j].name, friction=friction)
        for (i, j), friction in frictions.items()
        if friction != usual
    ]
    return (Pair(friction=usual), *others)
