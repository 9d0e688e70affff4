"""Turns a scene argument (a name of the catalogue, or a path) into a canonical scene.

A scene file is *pinned* before anything runs: ``drop.toml`` becomes ``drop.toml@3f2a9c1d``, its name and the hash of
its text. Slots carry the pinned name, and the store keeps the text, so that a run keeps its scene even if the file
changes.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from adapters.plain import is_visible, one_line
from adapters.scene import SceneError
from validation.canonical import CanonicalScene
from validation.catalogue import CATALOGUE, matching

_FILE = re.compile(
    r"(?P<path>.+\.(?:toml|json|xml|urdf|sdf|world))(?:@(?P<digest>[0-9a-f]{8}))?", re.IGNORECASE | re.DOTALL
)
#: Endings of scene files; others are models of an engine.
_OWN = (".toml", ".json")
#: Texts of pinned scene files by pinned name.
_texts: dict[str, str] = {}
#: Contents of pinned scene files, read and checked in another process, by pinned name.
_stated: dict[str, dict[str, Any]] = {}


def is_file(argument: str) -> bool:
    """Whether the argument names a scene file rather than a scene of the catalogue."""
    return argument not in CATALOGUE and _FILE.fullmatch(argument) is not None


def is_model(argument: str) -> bool:
    """Whether the argument names a file that is a model of an engine."""
    found = _FILE.fullmatch(argument)
    return argument not in CATALOGUE and found is not None and not found["path"].lower().endswith(_OWN)


def is_known(argument: str) -> bool:
    """Whether the argument names a scene of the catalogue, or a file."""
    return argument in CATALOGUE or is_file(argument)


def pinned(argument: str, drop: bool = False) -> str:
    """Pinned name of a scene: a file's name gets the hash of its text.

    A model's text is the JSON of `validation.files.model_files`; with ``drop`` unsupported parts are left out, and a
    name that is already pinned keeps its text.

    Raises
    ------
    SceneError
        If the file cannot be read, or has changed since it was pinned.
    """
    found = _FILE.fullmatch(argument)
    if argument in CATALOGUE or argument in _texts or argument in _stated or found is None:
        return argument
    from validation.files.scene_text import read_text

    path, wanted = found["path"], found["digest"]
    if not is_visible(path):
        raise SceneError(f"scene: the name of {one_line(path)} has control characters; rename the file")
    text = read_text(Path(path))
    if Path(path).suffix.lower() not in _OWN:
        from validation.files import model_files

        try:
            # The hash belongs to a text that was read before, which shows whether something was left out.
            text = model_files.text_of(text, Path(path).suffix, drop or wanted is not None)
        except SceneError as error:  # the reader of a text does not have the file's name
            raise SceneError(f"{path}: {str(error).removeprefix('model: ')}") from None
    digest = _digest(text)
    if wanted and wanted.lower() != digest:
        raise SceneError(f"scene: {path} has changed since it was {wanted}; it is {digest} now")
    name = f"{path}@{digest}"
    _texts[name] = text
    return name


def texts_of(scenes: Iterable[str]) -> dict[str, str]:
    """Texts of those scenes that are pinned files, by name."""
    return {scene: _texts[scene] for scene in dict.fromkeys(scenes) if scene in _texts}


def known_texts() -> dict[str, str]:
    """Texts of all pinned scene files that this process knows, by name."""
    return dict(_texts)


def remember(texts: Mapping[str, str]) -> None:
    """Register pinned scenes in this process, so that their files are not needed.

    Raises
    ------
    SceneError
        If a text does not fit its name.
    """
    for name, text in texts.items():
        found = _FILE.fullmatch(name)
        if found is None or found["digest"] != _digest(text):
            raise SceneError(f"scene: the stored text of {name} is not that of the file")
        _texts[name] = text


def written(scene: Mapping[str, Any]) -> str:
    """Pinned name of the content of a scene file, given as plain data.

    Raises
    ------
    SceneError
        If it is not what a JSON file could hold, or not a valid scene.
    """
    try:
        text = json.dumps(scene, allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise SceneError(f"scene: is not what a scene file could hold: {one_line(error)}") from None
    name = f"{one_line(scene.get('name', 'scene'), 40).replace('/', '-')}.json@{_digest(text)}"
    remember({name: text})
    resolve(name)
    return name


def stated_of(scenes: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Contents of scenes from files, as plain data by pinned name: for a process that cannot read files."""
    from validation.files.scene_files import stated_from_text

    paths = {name: Path(name.rpartition("@")[0]) for name in texts_of(scenes)}
    return {name: stated_from_text(_texts[name], path).as_dict() for name, path in paths.items()}


def handed(scenes: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Data that `hand_over` received for those scenes."""
    return {scene: _stated[scene] for scene in dict.fromkeys(scenes) if scene in _stated}


def hand_over(stated: Mapping[str, dict[str, Any]]) -> None:
    """Register scenes in this process from data of `stated_of` in another."""
    _stated.update(stated)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:8]


@cache
def resolve(argument: str) -> CanonicalScene:
    """Return the canonical scene called ``argument``, or made from the file at that path.

    ``NAME@LENGTH`` is a scene of the catalogue with all lengths multiplied (`validation.scenes.sized`).

    Raises
    ------
    SceneError
        If there is no such scene, or the file is not a valid scene.
    """
    if argument in _stated:
        from validation.files.stated import canonical_of, stated_from_dict

        return canonical_of(stated_from_dict(_stated[argument]), "")
    if is_file(argument):
        from validation.files.scene_files import canonical_from_text

        name = pinned(argument)
        return canonical_from_text(_texts[name], Path(name.rpartition("@")[0]))
    name, _, length = argument.partition("@")
    if length and name in CATALOGUE:
        from validation.scenes.sized import sized

        return sized(CATALOGUE[name], float(length))
    return matching(argument)[0]
