"""Files and folders named by options: wrong ones are refused before anything runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click


class _File(click.ParamType):  # type: ignore[type-arg]  # click before 8.5 takes none
    """Name of a file to write; a name that ends in a slash is a folder and refused."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        if str(value).endswith(("/", os.sep)):
            raise wrong(f"{called(param) or self.name}: {value} is a folder, not a file")
        return _possible(Path(value), called(param) or self.name)


class _Folder(click.ParamType):  # type: ignore[type-arg]  # click before 8.5 takes none
    """Name of a folder."""

    name = "folder"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        return _possible(Path(value), called(param) or self.name)


FILE, FOLDER = _File(), _Folder()


def called(param: click.Parameter | None) -> str:
    """Name of an option without its dashes, or of an argument as the help has it: messages begin with it."""
    if isinstance(param, click.Option):
        return max(param.opts, key=len).strip("-")
    return param.human_readable_name.rstrip(".") if param else ""


def _possible(path: Path, field: str) -> Path:
    """Return ``path`` if the system can have a file of that name, be it none yet."""
    try:
        path.exists()
    except OSError as error:  # its name is too long
        raise wrong(f"{field}: {path.name[:40]}...: {error.strerror}") from None
    return path


def writable(path: Path, field: str) -> Path:
    """Return ``path`` if a file can be written there.

    Raises
    ------
    SceneError
        With the name ``field``, if it is a folder, if its folder is missing, or if it is not writable.
    """
    if path.is_dir():
        raise wrong(f"{field}: {path} is a folder, not a file")
    folder = nearest(path.parent)
    if field != "output" and folder != path.parent:
        raise wrong(f"{field}: there is no folder {path.parent}")
    if not os.access(path if path.exists() else folder, os.W_OK):
        raise wrong(f"{field}: {path} may not be written")
    return path


def folder(path: Path, field: str = "out") -> Path:
    """Return ``path`` if it is a folder, or if one can be made there.

    Raises
    ------
    SceneError
        With the name ``field``, if there is a file of that name, or no folder can be made.
    """
    if path.exists() and not path.is_dir():
        raise wrong(f"{field}: {path} is a file, not a folder")
    there = nearest(path)
    if there == path and not os.access(path, os.W_OK):
        raise wrong(f"{field}: {path} may not be written; name a folder that may")
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise wrong(f"{field}: {path} cannot be made, {there} is not a folder that may be written")
    return path


def nearest(path: Path) -> Path:
    """The first of ``path`` and its parents that exists."""
    return next((p for p in (path, *path.absolute().parents) if p.exists()), path)


def wrong(text: str) -> Exception:
    """The error of a wrong call; its module is imported where there is one, since all commands import this one."""
    from adapters.scene import SceneError

    return SceneError(text)
