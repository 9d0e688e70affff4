"""Files of findings: ``families.toml`` (reasons and their proofs) and ``members.csv`` (rows) in one folder per engine.

They are in the engine's folder (`adapters.engine_folder`), for our engines and others alike; no engine is imported to
read them.
"""

from __future__ import annotations

import csv
import json
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from packaging.specifiers import InvalidSpecifier, SpecifierSet

from adapters import registry
from adapters.engine_folder import FINDINGS, folder_of
from adapters.experiment.files import NAME, Fields, Kind, checked, is_list_of, is_numbers, is_word, params_of
from adapters.plain import one_line
from validation.findings import Family, Finding, Findings, FindingsError, Key, Unsupported, solutions_of
from validation.findings.proofs import proof_of

FAMILIES, MEMBERS = "families.toml", "members.csv"
COLUMNS = ("family", "profile", "dimension", "params", "dt", "iterations", "metric", "value", "band")
#: Fields of families and of unsupported entries, without what may be left out.
OF_FAMILY = ("id", "profiles", "scene", "metrics", "reason", "source", "releases")
OF_UNSUPPORTED = ("id", "profiles", "scene", "dimension", "reason", "source")
#: Entry in the column ``value`` for a cell that ended with numbers that are not finite.
DIVERGED = "diverged"
#: Separator of the two ends of an asymmetric band.
TO = ".."


@cache
def findings_of(engine: str) -> Findings | None:
    """All known failures of ``engine``; None if it has no findings.

    Raises
    ------
    FindingsError
        If its files are wrong.
    """
    folder = findings_folder(engine)
    return read(engine, folder) if folder is not None and folder.is_dir() else None


def findings_folder(engine: str) -> Path | None:
    """Folder with the findings of ``engine``, whether or not it exists; None if the engine has no folder."""
    folder = folder_of(engine)
    return None if folder is None else folder / FINDINGS


def brought_by_ours(engine: str) -> bool:
    """Whether the findings of ``engine`` are this project's own."""
    entry = registry.entry(engine)
    return entry is not None and registry.is_ours(entry)


#: A test of a value, and what it must be.
_NAMES: Kind = (lambda value: bool(value) and is_list_of(is_word)(value), "a list of names")
#: Fields of families and unsupported entries that are not names.
_BOTH: Kind = (lambda value: value in (0, 2, 3), "2 or 3, or missing for both")
_TEXT: Kind = (is_word, "a text")
_KINDS: Fields = {"profiles": _NAMES, "metrics": _NAMES, "dimension": _BOTH, "reason": _TEXT, "source": _TEXT}


def read(engine: str, folder: Path) -> Findings:
    """Read and check the findings of ``engine`` in ``folder``.

    Raises
    ------
    FindingsError
        Naming file and entry that is missing, unknown, listed twice or not covered by its family.
    """
    path = folder / FAMILIES
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise FindingsError(f"{path}: {error}") from None
    families: dict[str, Family] = {}
    for family in (_family(engine, path, each) for entry in data.get("family", []) for each in _by_scene(path, entry)):
        if family.id in families:
            raise FindingsError(f"{path}: family {family.id} is listed twice")
        families[family.id] = family
    unsupported = tuple(
        _unsupported(path, each) for entry in data.get("unsupported", []) for each in _by_scene(path, entry)
    )
    return Findings(engine, families, unsupported, _members(engine, folder / MEMBERS, families))


def _fields(path: Path, kind: str, entry: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Check that exactly ``names`` are there, that lists are tuples of words, and that nothing is empty."""
    known = {name: _KINDS.get(name, NAME) for name in names}
    needed = [name for name in names if name != "dimension"]
    given = {name: value for name, value in entry.items() if not isinstance(value, str) or value.strip()}
    try:
        checked(f"{path}: {kind} {entry.get('id', '?')}", given, known, needed)
    except ValueError as error:
        raise FindingsError(str(error)) from None
    out = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    return {"dimension": 0, **out} if "dimension" in names else out


def _by_scene(path: Path, entry: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """One entry for each of its ``scenes``, called by both, with the proofs whose cells name it."""
    if "scenes" not in entry:
        return [entry]
    label, scenes, proofs = f"{path}: {entry.get('id', '?')}", entry["scenes"], entry.get("proof", [])
    if "scene" in entry or not _NAMES[0](scenes):
        raise FindingsError(f"{label}: scenes must be {_NAMES[1]}, in place of scene")
    if not is_list_of(lambda proof: isinstance(proof, dict) and isinstance(proof.get("cell"), dict))(proofs):
        raise FindingsError(f"{label}: proof must be a list of tables, [[family.proof]], each with a cell")
    for proof in proofs:
        if proof["cell"].get("scene") not in scenes:
            raise FindingsError(f"{label}: proof: cell: scene must be one of {', '.join(scenes)}")
    parts: list[Mapping[str, Any]] = []
    for scene in scenes:
        own = [proof for proof in proofs if proof["cell"]["scene"] == scene]
        cells = [{name: value for name, value in proof["cell"].items() if name != "scene"} for proof in own]
        told = [{**proof, "cell": cell} for proof, cell in zip(own, cells, strict=True)]
        rest = {name: value for name, value in entry.items() if name not in ("scenes", "proof")}
        name = f"{scene.replace('_', '-')}-{entry.get('id', '')}"
        parts.append({**rest, "id": name, "scene": scene, **({"proof": told} if told else {})})
    return parts


def _family(engine: str, path: Path, entry: Mapping[str, Any]) -> Family:
    """Read one entry; ``proof`` may be left out."""
    told = {name: value for name, value in entry.items() if name != "proof"}
    fields = _fields(path, "family", told, OF_FAMILY)
    family, label = Family(**fields), f"{path}: family {entry['id']}"
    if "*" in family.profiles and "*" in family.metrics:
        raise FindingsError(
            f"{label}: a reason cannot hold for every profile and every metric; name profiles or metrics"
        )
    if "*" in family.scene:
        raise FindingsError(f"{label}: scene must be the name of one scene")
    for profile in family.profiles:
        if profile in solutions_of(engine):
            raise FindingsError(f"{label}: {engine}/{profile} is an exact profile; its failures are never listed")
    try:
        SpecifierSet(family.releases)
    except InvalidSpecifier:
        raise FindingsError(f"{label}: releases {family.releases!r} is no version specifier such as >=1.2,<2") from None
    proofs = entry.get("proof", [])
    if not isinstance(proofs, list):
        raise FindingsError(f"{label}: proof must be a list of tables, [[family.proof]]")
    try:
        return replace(family, proofs=tuple(proof_of(family, proof) for proof in proofs))
    except ValueError as error:
        raise FindingsError(f"{label}: {one_line(error)}") from None


def _unsupported(path: Path, entry: Mapping[str, Any]) -> Unsupported:
    """Read one entry; ``params`` may be left out."""
    told = {name: value for name, value in entry.items() if name != "params"}
    fields = _fields(path, "unsupported", told, OF_UNSUPPORTED)
    params = entry.get("params", {})
    if not is_numbers(params):
        raise FindingsError(f"{path}: unsupported {entry['id']}: params must be a table of numbers")
    return Unsupported(**fields, params=tuple(sorted(params_of(params).items())))


def _members(engine: str, path: Path, families: Mapping[str, Family]) -> dict[Key, Finding]:
    if not path.exists():
        return {}
    try:
        rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FindingsError(f"{path}: {error}") from None
    if not rows or tuple(rows[0]) != COLUMNS:
        raise FindingsError(f"{path}: the first line must be {','.join(COLUMNS)}")
    members: dict[Key, Finding] = {}
    for number, row in enumerate(rows[1:], start=2):
        label = f"{path}:{number}"
        if len(row) != len(COLUMNS):
            raise FindingsError(f"{label}: has {len(row)} fields, not {len(COLUMNS)}")
        key, finding = _member(engine, label, row, families)
        if key in members:
            raise FindingsError(f"{label}: {' '.join(key)} is listed twice")
        members[key] = finding
    return members


def _member(engine: str, label: str, row: list[str], families: Mapping[str, Family]) -> tuple[Key, Finding]:
    name, profile, dimension, params, dt, iterations, metric, value, band = row
    family = families.get(name)
    if family is None:
        raise FindingsError(f"{label}: there is no family {name!r}")
    key = (profile, family.scene, dimension, params, dt, iterations, metric)
    if not family.covers(key):
        raise FindingsError(f"{label}: family {name} does not cover {profile} {metric}")
    if profile in solutions_of(engine):
        raise FindingsError(f"{label}: {engine}/{profile} is an exact profile; its failures are never listed")
    if value in ("", DIVERGED):
        return key, Finding(family, None, diverged=value == DIVERGED, text=(value, band))
    try:
        found, *widths = map(float, (value, *band.split(TO, 1)))
    except ValueError:
        raise FindingsError(f"{label}: value {value!r} and band {band!r} must be numbers") from None
    if not all(map(math.isfinite, (found, *widths))) or (len(widths) == 1 and widths[0] <= 0.0):
        raise FindingsError(f"{label}: value {value} and band {band} must be finite, the band above 0")
    if len(widths) == 1:
        return key, Finding(family, found, widths[0], text=(value, band))
    if not widths[0] <= found <= widths[1] or widths[0] == widths[1]:
        raise FindingsError(f"{label}: value {value} must lie between the ends of its band, {band}")
    return key, Finding(family, found, ends=(widths[0], widths[1]), text=(value, band))


def write_members(folder: Path, members: Mapping[Key, Finding]) -> None:
    """Write all members, sorted by family and row; new values to a tenth of their band, others as they were read.

    The first list of an engine may be empty: then each of its failures is new.
    """
    lines = sorted(_line(key, finding) for key, finding in members.items())
    folder.mkdir(parents=True, exist_ok=True)
    (folder / FAMILIES).touch()
    with (folder / MEMBERS).open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(lines)
    findings_of.cache_clear()


def _line(key: Key, finding: Finding) -> tuple[str, ...]:
    profile, _scene, *cell = key
    value, band = finding.text or (DIVERGED if finding.diverged else "", "")
    if finding.value is not None and finding.text is None:
        value, band = _texts(finding.value, finding)
    return (finding.family.id, profile, *cell, value, band)


def _texts(value: float, finding: Finding) -> tuple[str, str]:
    """Value and band; ends are rounded outwards, by at most a twentieth of their distance."""
    if finding.ends is None:
        return _digits(value, finding.band), f"{finding.band:.1e}"
    low, high = finding.ends
    told = _digits(value, min(value - low, high - value) or high - low)
    ends = [_outwards(end, way, 0.05 * (high - low)) for end, way in ((low, -1), (high, 1))]
    return told, TO.join((min(ends[0], told, key=float), max(ends[1], told, key=float)))


def _outwards(value: float, way: int, room: float) -> str:
    """Shortest decimal equal to ``value`` or beyond it in direction ``way``, at most ``room`` away."""
    shifted = value + 0.5 * way * room
    texts = (f"{number:.{n}g}" for n in range(1, 18) for number in (value, shifted))
    return next((text for text in texts if 0.0 <= (float(text) - value) * way <= room), repr(value))


def _digits(value: float, band: float) -> str:
    """Shortest decimal of ``value`` whose rounding is below a twentieth of ``band``."""
    return next(text for text in (f"{value:.{n}g}" for n in range(1, 18)) if abs(float(text) - value) <= 0.05 * band)


def add_entries(folder: Path, entries: Iterable[Family | Unsupported]) -> None:
    """Append entries to the file of reasons, which people edit."""
    text = "".join(map(_entry, entries))
    if text:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / FAMILIES).open("a", encoding="utf-8") as stream:
            stream.write(text)
        findings_of.cache_clear()


def _entry(entry: Family | Unsupported) -> str:
    kind, names = ("family", OF_FAMILY) if isinstance(entry, Family) else ("unsupported", OF_UNSUPPORTED)
    lines = [f"{name} = {_toml(getattr(entry, name))}" for name in names]
    return "\n".join(["", f"[[{kind}]]", *lines, ""])


def _toml(value: str | int | tuple[str, ...]) -> str:
    """A number, a string or a list of strings; TOML's basic strings are JSON's but for DEL."""
    return json.dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=False).replace("\x7f", "\\u007f")
