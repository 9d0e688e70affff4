"""Explanations of changes by an engine's own notes: ``changes.toml`` in the engine's folder.

    [[change]]
    release = "3.12.0"
    scenes = ["stack"]              # "*": all
    profiles = ["default", "tuned"] # "*": all
    says = "the box-box collider was rewritten"
    source = "change log of 3.12.0, item 8"

An entry belongs to a release; a change between releases that do not follow each other may have entries of those in
between. A change without an entry is unexplained.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from typing import Any

from packaging.version import InvalidVersion, Version

from adapters.engine_folder import inside
from adapters.plain import one_line
from validation.findings import FindingsError

FILE = "changes.toml"
FIELDS = ("release", "scenes", "profiles", "says", "source")
UNEXPLAINED = "unexplained"


@dataclass(frozen=True)
class Note:
    """A statement of a release's notes or of a public issue."""

    release: Version
    scenes: tuple[str, ...]
    profiles: tuple[str, ...]
    says: str
    source: str

    def __str__(self) -> str:
        return f"{self.says} ({self.source})"


@cache
def notes_of(engine: str) -> tuple[Note, ...]:
    """All notes on an engine; none if its folder has no such file.

    Raises
    ------
    FindingsError
        Naming the wrong entry.
    """
    path = inside(engine, FILE)
    if path is None:
        return ()
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8")).get("change", [])
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise FindingsError(f"{path}: {one_line(error)}") from None
    return tuple(_note(f"{path}: change {number}", entry) for number, entry in enumerate(entries, start=1))


def _note(label: str, entry: Any) -> Note:
    if not isinstance(entry, dict) or set(entry) != set(FIELDS):
        raise FindingsError(f"{label}: needs exactly {', '.join(FIELDS)}")
    for name in ("scenes", "profiles"):
        if not isinstance(entry[name], list) or not entry[name] or not all(isinstance(w, str) for w in entry[name]):
            raise FindingsError(f"{label}: {name} must be a list of names")
    for name in ("release", "says", "source"):
        if not isinstance(entry[name], str) or not entry[name].strip():
            raise FindingsError(f"{label}: {name} is missing")
    try:
        release = Version(entry["release"])
    except InvalidVersion:
        raise FindingsError(f"{label}: release {one_line(entry['release'], 40)!r} is not a version") from None
    said = (one_line(entry[name]) for name in ("says", "source"))
    return Note(release, tuple(entry["scenes"]), tuple(entry["profiles"]), *said)


def explanations(engine: str, scene: str, profile: str, before: str, after: str) -> list[str]:
    """Notes on a change of this scene and profile after ``before``, up to ``after``; else *unexplained*."""
    low, high = Version(before), Version(after)
    found = [
        str(note) for note in notes_of(engine)
        if low < note.release <= high and _among(scene, note.scenes) and _among(profile, note.profiles)
    ]  # fmt: skip
    return found or [UNEXPLAINED]


def _among(name: str, names: tuple[str, ...]) -> bool:
    return name in names or "*" in names
