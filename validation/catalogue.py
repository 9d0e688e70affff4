"""The catalogue of canonical scenes: ours, and those of other installed packages.

    [project.entry-points."contact_crosscheck.scenes"]
    drop = "mypackage.drop:SCENE"

A scene is loaded at its first use. A scene of another package that cannot be loaded is left out, and `broken` has the
reason (shown by ``crosscheck doctor``).
"""

from __future__ import annotations

import difflib
import fnmatch
import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint

from adapters import registry
from adapters.plain import NAME, one_line
from adapters.scene import SceneError
from validation.canonical import CanonicalScene
from validation.scenes import OURS

GROUP = "contact_crosscheck.scenes"
#: A scene's name is written in commands, tables, anchors and files.
_NAME = re.compile(r"[a-z][a-z0-9_]*")


#: Scenes that the caller of this process has written, by name.
_introduced: dict[str, CanonicalScene] = {}


def introduce(scene: CanonicalScene) -> str:
    """Make a scene known in this process under its own name, until another of that name is introduced.

    Worker processes cannot load it.

    Raises
    ------
    SceneError
        If it has the name of another scene of the catalogue.
    """
    if scene.name in (*OURS, *_entries()):
        if _loaded(scene.name) is not scene:
            raise SceneError(f"scene: {one_line(scene.name, NAME)!r} is the name of an installed scene; choose another")
    elif not _NAME.fullmatch(scene.name):
        raise SceneError(
            f"scene: {one_line(scene.name, NAME)!r} is not a name of small letters, digits and underscores"
        )
    elif _introduced.get(scene.name) is not scene:
        _introduced[scene.name] = scene
        _loaded.cache_clear()
    return scene.name


def is_introduced(name: str) -> bool:
    """Whether a scene exists in this process only."""
    return name in _introduced


@cache
def _entries() -> dict[str, EntryPoint]:
    """Entry points of other packages by scene, without those that use the name of one of ours."""
    return {entry.name: entry for entry in sorted(registry.installed(GROUP)) if entry.name not in OURS}


@cache
def _loaded(name: str) -> CanonicalScene | SceneError:
    """The scene called ``name``, or why it cannot be loaded."""
    if name in OURS:
        ours: CanonicalScene = import_module(f"validation.scenes.{name}").SCENE
        return ours
    if name in _introduced:
        return _introduced[name]
    entry = _entries()[name]
    where = f"scene: {one_line(name, NAME)} of {one_line(entry.value, NAME)}"
    if not _NAME.fullmatch(name) or len(name) > NAME:
        return SceneError(f"{where} is not a name of small letters, digits and underscores")
    try:
        found = entry.load()
    except (Exception, SystemExit) as error:  # another package may raise anything; only its scene is lost
        return SceneError(f"{where} cannot be loaded: {type(error).__name__}: {one_line(error)}")
    if not isinstance(found, CanonicalScene) or found.name != name:
        return SceneError(f"{where} is not a CanonicalScene of that name")
    return found


def _names() -> list[str]:
    """Names of all scenes in their order, with those of other packages that cannot be loaded."""
    return [*OURS, *_entries(), *_introduced]


def module_of(name: str) -> str:
    """Module that a scene comes from."""
    if name in _introduced:  # its source may not be a file; its cells are not stored
        return "validation.canonical"
    return f"validation.scenes.{name}" if name in OURS else _entries()[name].module


def broken() -> list[str]:
    """One line for each scene of another package that cannot be loaded."""
    return [str(found) for name in _entries() if isinstance(found := _loaded(name), SceneError)]


def forget() -> None:
    """Forget loaded scenes, so that installed packages are searched again."""
    registry.forget()
    _entries.cache_clear()
    _loaded.cache_clear()


class _Catalogue(Mapping[str, CanonicalScene]):
    """Scenes by name: ours in their order, then those of others by name."""

    def __getitem__(self, name: str) -> CanonicalScene:
        if name not in _names():
            raise KeyError(name)
        found = _loaded(name)
        if isinstance(found, SceneError):
            raise KeyError(name)
        return found

    def __iter__(self) -> Iterator[str]:
        return (name for name in _names() if name in OURS or isinstance(_loaded(name), CanonicalScene))

    def __len__(self) -> int:
        return sum(1 for _ in self)


CATALOGUE: Mapping[str, CanonicalScene] = _Catalogue()


def matching(pattern: str) -> list[CanonicalScene]:
    """Scenes whose name is, or matches the glob, ``pattern``.

    Raises
    ------
    SceneError
        If there is none ("did you mean"), or it cannot be loaded.
    """
    names = fnmatch.filter(_names(), pattern)  # only these are loaded
    found = [scene for name in names if isinstance(scene := _loaded(name), CanonicalScene)]
    if found:
        return found
    if pattern in _entries() and isinstance(reason := _loaded(pattern), SceneError):
        raise reason
    close = difflib.get_close_matches(pattern, CATALOGUE, n=1)
    hint = f"did you mean {close[0]!r}?" if close else f"there are {len(CATALOGUE)}: crosscheck list scenes"
    raise SceneError(f"scene: there is no scene called {pattern!r}, {hint}")
