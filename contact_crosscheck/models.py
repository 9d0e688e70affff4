"""A user's own scenes: files of this project, and models of an engine."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from adapters.plain import kind_of
from adapters.scene import SceneError
from contact_crosscheck.apart import apart
from validation.canonical import CanonicalScene
from validation.catalogue import introduce, matching
from validation.posed import is_file, is_known, pinned, resolve, written
from validation.scenes import OURS


@dataclass(frozen=True)
class Scene:
    """A scene from a file, or of the catalogue, as `run`, `sweep` and `bench` take it.

    Parameters
    ----------
    name
        Name in the catalogue; for a file its path and the hash of its text, so later changes of the file have no
        effect.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> scene = cc.Scene.from_mjcf("model.xml")
    >>> scene.notes
    >>> cc.run(scene, engine="mujoco")
    """

    name: str

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], drop: bool = False) -> Scene:
        """Read a scene file (.toml, .json) or a model (.xml, .urdf, .sdf, .world).

        Parameters
        ----------
        drop
            Whether to leave out elements that a scene cannot have; `notes` lists them. Otherwise such a file is
            refused.

        Raises
        ------
        SceneError
            If the file cannot be read; or for an element that a scene cannot have, with its name.
        EngineError
            If the engine that reads such models is not installed.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> cc.Scene.from_file("drop.toml").parameters
        """
        path = os.fspath(path)
        if not is_file(path):
            raise SceneError(f"path: {path!r} does not end in .toml, .json, .xml, .urdf, .sdf or .world")
        with apart():
            name = pinned(path, drop)
            resolve(name)
        return cls(name)

    @classmethod
    def from_mjcf(cls, path: str | os.PathLike[str], drop: bool = False) -> Scene:
        """Read a model in MJCF (.xml); see `from_file`.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> cc.run(cc.Scene.from_mjcf("model.xml"), engine="reference")
        """
        return cls._of(path, drop, ".xml")

    @classmethod
    def from_urdf(cls, path: str | os.PathLike[str], drop: bool = False) -> Scene:
        """Read a model in URDF (.urdf); see `from_file`.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> cc.Scene.from_urdf("robot.urdf", drop=True).notes
        """
        return cls._of(path, drop, ".urdf")

    @classmethod
    def from_sdf(cls, path: str | os.PathLike[str], drop: bool = False) -> Scene:
        """Read a model in SDF (.sdf, .world); see `from_file`.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> cc.Scene.from_sdf("box.sdf").dimensions
        """
        return cls._of(path, drop, ".sdf", ".world")

    @classmethod
    def _of(cls, path: str | os.PathLike[str], drop: bool, *endings: str) -> Scene:
        if Path(path).suffix.lower() not in endings:
            raise SceneError(f"path: {os.fspath(path)!r} does not end in {' or '.join(endings)}")
        return cls.from_file(path, drop)

    @property
    def title(self) -> str:
        """Title in one line."""
        return resolve(self.name).title

    @property
    def dimensions(self) -> tuple[int, ...]:
        """2, 3 or both."""
        return tuple(resolve(self.name).dimensions)

    @property
    def parameters(self) -> pd.DataFrame:
        """Name, default, unit, range and meaning of each parameter."""
        names = ["name", "default", "unit", "low", "high", "because"]
        return pd.DataFrame(
            [[getattr(each, name) for name in names] for each in resolve(self.name).parameters], columns=names
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """How elements of the file were read, and which were left out."""
        return tuple(resolve(self.name).notes)


#: A scene by its name or file, from a file, as a scene file's content, or one that the caller has written.
AnyScene = str | os.PathLike[str] | Scene | CanonicalScene | Mapping[str, Any]


def scene_named(scene: AnyScene) -> str:
    """Name of a scene that no later change of a file affects; a file is read.

    Raises
    ------
    SceneError
        If there is no such scene, if several match, or as `Scene.from_file` does.
    """
    if isinstance(scene, Scene):
        return scene.name
    if isinstance(scene, CanonicalScene):
        if introduce(scene) not in OURS:
            resolve.cache_clear()  # another scene may have had the name
        return scene.name
    if isinstance(scene, Mapping):
        return written(scene)
    if not isinstance(scene, str | os.PathLike):
        raise SceneError(f"scene: {kind_of(scene)} was given; name a scene or a file, or give a Scene")
    name = os.fspath(scene)
    if is_known(name):
        return Scene.from_file(name).name if is_file(name) else name
    found = [each.name for each in matching(name)]
    raise SceneError(f"scene: {name!r} means {', '.join(found)}; name one")
