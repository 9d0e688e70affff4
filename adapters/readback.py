"""Shared parts of readbacks: parts of free bodies by name, and materials by pair."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from adapters.scene import Scene
from adapters.scene.meeting import told_pairs

#: A value of each body in the engine, and the rule that combines two.
Mixed = tuple[Sequence[Any], Callable[[Any, Any], float]]


def free_parts(scene: Scene, parts: Iterable[Any]) -> Iterator[tuple[str, Any]]:
    """Name of each free body and its part in the engine; ``parts`` has one for each body of the scene."""
    for body, part in zip(scene.bodies, parts, strict=True):
        if body.motion == "free":
            yield body.name, part


def pair_materials(scene: Scene, restitution: Mixed, friction: Mixed) -> dict[str, dict[str, float]]:
    """Materials of pairs from two bodies' values, by the names of the pairs."""
    (own_restitution, mix_restitution), (own_friction, mix_friction) = restitution, friction
    return {
        f"{scene.bodies[i].name}-{scene.bodies[j].name}": {
            "restitution": mix_restitution(own_restitution[i], own_restitution[j]),
            "friction": mix_friction(own_friction[i], own_friction[j]),
        }
        for i, j in told_pairs(scene)
    }
