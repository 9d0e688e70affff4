"""Turns a scene argument (a name of the catalogue, or a path) into a canonical scene."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from validation.canonical import CanonicalScene
from validation.scenes import CATALOGUE, matching


def is_file(argument: str) -> bool:
    """Whether the argument names a scene file rather than a scene of the catalogue."""
    return argument not in CATALOGUE and Path(argument).suffix.lower() in (".toml", ".json")


@cache
def resolve(argument: str) -> CanonicalScene:
    """Return the canonical scene called ``argument``, or made from the file at that path.

    Raises
    ------
    SceneError
        If there is no such scene, or the file is not a valid scene.
    """
    if is_file(argument):
        from validation.scene_files import canonical_from_file

        return canonical_from_file(Path(argument))
    return matching(argument)[0]
