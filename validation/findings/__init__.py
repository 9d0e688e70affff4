"""Known findings: FAIL rows that are listed with a reason, and cells that are known to be unsupported.

``<engine>.csv`` lists the FAIL rows of the quick suite, one per line (status only, no values); ``reasons.toml`` holds
the reasons, each with the pattern of rows it speaks about and a source, and the patterns of cells that are
unsupported. An engine without a list is *unlisted*: its FAILs have no standing and do not fail the command.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from importlib.resources import files
from pathlib import Path

from validation.cells import Slot, format_dt
from validation.plan import in_quick_suite

COLUMNS = ("profile", "scene", "dimension", "params", "dt", "iterations", "metric", "status", "reason")
Key = tuple[str, ...]


@dataclass(frozen=True)
class Reason:
    """Why a group of rows fails."""

    id: str
    text: str
    source: str
    engine: str
    profile: str
    scene: str
    metric: str
    dimension: str = "*"
    params: str = "*"
    unsupported: bool = False

    def covers(self, engine: str, key: Key) -> bool:
        """Whether this reason speaks about the row with ``key`` (see `row_key`) of ``engine``."""
        profile, scene, dimension, params, _dt, _iterations, metric = key
        pairs = (
            (engine, self.engine),
            (profile, self.profile),
            (scene, self.scene),
            (metric, self.metric),
            (dimension, self.dimension),
            (params, self.params),
        )
        return all(fnmatchcase(value, pattern) for value, pattern in pairs)


@dataclass(frozen=True)
class Finding:
    """A known row: ``known`` (listed, fails), ``marginal`` (listed, may do either) or ``pattern``.

    ``pattern`` is a row outside the quick suite, which is not listed one by one: a FAIL is known if a written reason
    covers it, a PASS is nothing special.
    """

    status: str
    reason: Reason


def row_key(slot: Slot, metric: str) -> Key:
    """Identity of a row within its engine's list."""
    iterations = "" if slot.iterations is None else str(slot.iterations)
    dt = format_dt(slot.dt)
    return (slot.profile, slot.scene, str(slot.dimension), slot.params_text(), dt, iterations, metric)


@cache
def reasons() -> dict[str, Reason]:
    """All reasons by id, in the order of the file: the first that covers a row is its reason."""
    data = tomllib.loads(files(__name__).joinpath("reasons.toml").read_text(encoding="utf-8"))
    return {entry["id"]: Reason(**entry) for entry in data.get("reason", [])}


@cache
def listed(engine: str) -> dict[Key, Finding] | None:
    """Listed rows of ``engine`` by key; None if it has no list yet."""
    path = files(__name__).joinpath(f"{engine}.csv")
    if not path.is_file():
        return None
    known = reasons()
    rows = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    return {tuple(row[c] for c in COLUMNS[:7]): Finding(row["status"], known[row["reason"]]) for row in rows}


def reason_for(engine: str, key: Key, unsupported: bool = False) -> Reason | None:
    """First reason that covers a row (of a FAIL, or of an unsupported cell)."""
    chosen = (reason for reason in reasons().values() if reason.unsupported == unsupported)
    return next((reason for reason in chosen if reason.covers(engine, key)), None)


def finding_of(slot: Slot, metric: str) -> Finding | None:
    """What is known about a row: its entry in the list, or for slots outside the quick suite a reason's pattern."""
    known = listed(slot.engine)
    if known is None:
        return None
    key = row_key(slot, metric)
    if key in known or in_quick_suite(slot):
        return known.get(key)
    reason = reason_for(slot.engine, key)
    return Finding("pattern", reason) if reason else None


def write_list(engine: str, entries: Iterable[tuple[Key, str, str]], folder: Path | None = None) -> Path:
    """Write the list of ``engine``: ``(key, status, reason id)`` per row, sorted."""
    path = (folder or Path(str(files(__name__)))) / f"{engine}.csv"
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([*key, status, reason] for key, status, reason in sorted(entries))
    listed.cache_clear()
    return path
