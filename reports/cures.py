"""What cures an engine: the settings in which a profile that passes differs from the one that does not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from adapters import registry
from validation.cells import Observation, prepare
from validation.tracks import SHOWN


@dataclass(frozen=True)
class Change:
    """A setting that differs between two profiles of one engine."""

    name: str
    before: str
    after: str
    because: str


def settings_of(
    observations: Sequence[Observation], scene: str, dimension: int, engine: str, profile: str
) -> list[Mapping[str, Any]]:
    """Settings of a profile on a scene, as its representative cell (else its first one) got them."""
    cell = shown_cell(observations, scene, dimension, engine, profile)
    return list(cell.settings) if cell else []


def shown_cell(
    observations: Sequence[Observation], scene: str, dimension: int, engine: str, profile: str
) -> Observation | None:
    """The cell that stands for a profile on a scene: the representative one, else the first that has settings."""
    own = [
        o for o in observations
        if (o.slot.scene, o.slot.dimension, o.slot.engine, o.slot.profile) == (scene, dimension, engine, profile)
        and o.settings and o.slot.iterations is None
    ]  # fmt: skip
    shown = [o for o in own if o.slot.params == SHOWN.get(scene, ())]
    return next(iter(shown or own), None)


def changes(
    observations: Sequence[Observation], scene: str, dimension: int, engine: str, before: str, after: str
) -> list[Change]:
    """Settings that profile ``after`` sets otherwise than ``before``, on this scene."""
    old = {s["name"]: s for s in settings_of(observations, scene, dimension, engine, before)}
    new = {s["name"]: s for s in settings_of(observations, scene, dimension, engine, after)}
    found = []
    for name, setting in new.items():
        if name not in old or old[name]["value"] != setting["value"]:
            was = setting_text(old[name]["value"]) if name in old else "as shipped"
            found.append(Change(name, was, setting_text(setting["value"]), setting["because"]))
    return found


def pasteable(
    observations: Sequence[Observation], scene: str, dimension: int, engine: str, before: str, after: str
) -> str:
    """The changes as lines of the engine's own language, ready to paste; empty if its adapter knows none."""
    cell = shown_cell(observations, scene, dimension, engine, after)
    loaded = registry.find(engine).engine
    if cell is None or loaded is None:
        return ""
    names = [change.name for change in changes(observations, scene, dimension, engine, before, after)]
    settings = {s["name"]: s["value"] for s in cell.settings}
    return loaded.snippet(settings, names, prepare(cell.slot).scene, cell.slot.dt)


def setting_text(value: Any) -> str:
    """A setting's value as people write it."""
    if isinstance(value, bool) or value is None:
        return str(value)
    if isinstance(value, list | tuple):
        return " ".join(setting_text(item) for item in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)
