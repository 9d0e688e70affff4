"""Known violations of metamorphic tests: dependences of an engine's results that should not exist, with reasons.

    breaks.toml    families: the profiles and relations they speak about, the scenes (or "*"), reason, source, releases
    breaks.csv     members: profile, scene, dimension, relation, the metric that changed most, and how far beyond what
                   it may, as a power of ten

They are beside an engine's other findings. A break is *known* while the same metric breaks by about as much, *drifted*
where it breaks differently or not any more, *new* where it is not listed. For an exact profile nothing is listed: every
break is new.
"""

from __future__ import annotations

import csv
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from packaging.specifiers import InvalidSpecifier, SpecifierSet

from validation.cells import Slot
from validation.findings import FindingsError, solutions_of
from validation.findings.files import findings_folder
from validation.judging.verdicts import Standing
from validation.posed import resolve
from validation.questions.invariance import Change
from validation.running.plan import QUICK_DT

FAMILIES, MEMBERS = "breaks.toml", "breaks.csv"
COLUMNS = ("family", "profile", "scene", "dimension", "relation", "metric", "decades")
#: A break is the same within this many powers of ten: the allowed change is the largest of ten from moved starts, which
#: in a wide scatter (some decades, in a chaotic scene) is right to one decade in 99 %.
BAND = 1.0
#: Entry for the size of a break where the engine has no result in the other pose, or loses a metric.
LOST = "lost"

#: Profile, scene, dimension, relation.
Key = tuple[str, str, int, str]


@dataclass(frozen=True)
class Family:
    """Breaks with one reason; see `validation.findings.Family` for its fields."""

    id: str
    profiles: tuple[str, ...]
    scenes: tuple[str, ...]
    relations: tuple[str, ...]
    reason: str
    source: str
    releases: str

    def covers(self, key: Key, version: str) -> bool:
        """Whether this family covers a break of this release."""
        named = zip((key[0], key[1], key[3]), (self.profiles, self.scenes, self.relations), strict=True)
        return all(name in names or "*" in names for name, names in named) and SpecifierSet(self.releases).contains(
            version, prereleases=True
        )


@dataclass(frozen=True)
class Break:
    """A member: the metric that changed most, and the power of ten of change over allowed; None where it is lost."""

    family: Family
    metric: str
    decades: float | None


@dataclass(frozen=True)
class Breaks:
    """All known breaks of one engine."""

    families: Mapping[str, Family]
    members: Mapping[Key, Break]


NOTHING: Breaks = Breaks({}, {})


def key_of(slot: Slot, change: Change) -> Key:
    """Key of a break in the list."""
    return slot.profile, slot.scene, slot.dimension, change.relation


def decades_of(change: Change) -> float | None:
    """Change over allowed change of a metric, as a power of ten; None where there is no result."""
    if change.lost or not math.isfinite(change.change):
        return None
    # Where no change is allowed, a change is measured in the smallest double.
    return math.log10(change.change) - math.log10(change.allowed or math.ulp(0.0))


def is_listed_cell(slot: Slot) -> bool:
    """Whether breaks of this cell are listed: each scene's representative one at the quick suite's step."""
    canonical = resolve(slot.scene)
    plain = slot.dt == QUICK_DT and slot.iterations is None and not slot.switched
    return plain and slot.params == canonical.minimal(canonical.representative)


def standing_of(slot: Slot, version: str, change: Change) -> tuple[Standing | None, str]:
    """Standing of one result, and why; None where it holds and is not listed, or for a cell without a list."""
    if not is_listed_cell(slot) or (change.refused and not change.lost):
        return None, ""
    member = breaks_of(slot.engine).members.get(key_of(slot, change))
    if member is None or not member.family.covers(key_of(slot, change), version):
        return (None, "") if change.holds else (Standing.NEW, "")
    if change.holds:
        return Standing.DRIFTED, f"listed as {member.family.id}, but holds now"
    found = decades_of(change)
    same = found is None if member.decades is None else found is not None and abs(found - member.decades) <= BAND
    if same and (change.lost or change.metric == member.metric):
        return Standing.KNOWN, member.family.reason
    return Standing.DRIFTED, f"listed as {member.family.id}: {member.metric or 'no answer'} by {_text(member.decades)}"


def _text(decades: float | None) -> str:
    return LOST if decades is None else f"10^{decades:.1f} of the allowed change"


@cache
def breaks_of(engine: str) -> Breaks:
    """Known breaks of ``engine``; none if none are listed.

    Raises
    ------
    FindingsError
        If its files are wrong.
    """
    folder = findings_folder(engine)
    return read(engine, folder) if folder is not None and (folder / FAMILIES).is_file() else NOTHING


def read(engine: str, folder: Path) -> Breaks:
    """Read and check the breaks of ``engine`` in ``folder``; raises `FindingsError` as `breaks_of` does."""
    path = folder / FAMILIES
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8")).get("family", [])
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise FindingsError(f"{path}: {error}") from None
    families: dict[str, Family] = {}
    for entry in entries:
        family = _family(engine, path, entry)
        if family.id in families:
            raise FindingsError(f"{path}: family {family.id} is listed twice")
        families[family.id] = family
    return Breaks(families, _members(folder / MEMBERS, families))


def _family(engine: str, path: Path, entry: Mapping[str, Any]) -> Family:
    label = f"{path}: family {entry.get('id', '?')}"
    values: dict[str, Any] = {}
    for name in Family.__dataclass_fields__:
        value = entry.get(name)
        if name in ("profiles", "scenes", "relations"):
            if not isinstance(value, list) or not value or not all(isinstance(each, str) and each for each in value):
                raise FindingsError(f"{label}: {name} must be a list of names")
            value = tuple(value)
        elif not isinstance(value, str) or not value.strip():
            raise FindingsError(f"{label}: {name} is missing")
        values[name] = value
    family = Family(**values)
    if "*" in family.scenes and "*" in family.relations:
        raise FindingsError(
            f"{label}: a reason cannot hold for every scene and every relation; name scenes or relations"
        )
    if promised := solutions_of(engine) & {*family.profiles} or ("*" in family.profiles and solutions_of(engine)):
        raise FindingsError(f"{label}: {engine}/{min(promised)} is an exact profile; its violations are never listed")
    try:
        SpecifierSet(family.releases)
    except InvalidSpecifier:
        raise FindingsError(f"{label}: releases {family.releases!r} is no version specifier such as >=1.2,<2") from None
    return family


def _members(path: Path, families: Mapping[str, Family]) -> dict[Key, Break]:
    if not path.exists():
        return {}
    rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    if not rows or tuple(rows[0]) != COLUMNS:
        raise FindingsError(f"{path}: the first line must be {','.join(COLUMNS)}")
    members: dict[Key, Break] = {}
    for number, row in enumerate(rows[1:], start=2):
        try:
            name, profile, scene, dimension, relation, metric, decades = row
            key = (profile, scene, int(dimension), relation)
            found = Break(families[name], metric, None if decades == LOST else float(decades))
        except (ValueError, KeyError) as error:
            raise FindingsError(f"{path}:{number}: {error} is not an entry of this table") from None
        if key in members:
            raise FindingsError(f"{path}:{number}: {profile} {scene} {dimension} {relation} is listed twice")
        members[key] = found
    return members


def listed(engine: str, version: str, found: Iterable[tuple[Slot, Change]]) -> dict[Key, Break]:
    """Members after these results are listed: breaks with a family; entries of cells that did not run stay."""
    known = breaks_of(engine)
    members = dict(known.members)
    for slot, change in found:
        if slot.engine != engine or not is_listed_cell(slot) or (change.refused and not change.lost):
            continue
        key = key_of(slot, change)
        members.pop(key, None)
        family = next((family for family in known.families.values() if family.covers(key, version)), None)
        if not change.holds and family is not None and slot.profile not in solutions_of(engine):
            members[key] = Break(family, change.metric, decades_of(change))
    return members


def write(folder: Path, members: Mapping[Key, Break]) -> None:
    """Write all members, sorted."""
    lines = sorted(
        (found.family.id, *map(str, key), found.metric, LOST if found.decades is None else f"{found.decades:.1f}")
        for key, found in members.items()
    )
    with (folder / MEMBERS).open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(lines)
    breaks_of.cache_clear()
