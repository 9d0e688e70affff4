"""The kept table of readings of contact forces: ``readings.csv`` in an engine's folder, with its release."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, fields
from functools import cache
from pathlib import Path

from adapters.engine import Role
from adapters.engine_folder import READ, readings_of, rows_of
from adapters.registry import load
from validation.questions.readings import SITUATIONS, Judged, measured

#: Roles of the profiles that are measured.
PROFILES: tuple[Role, ...] = ("shipped", "tuned")


@dataclass(frozen=True)
class Known:
    """What a reading of a release is worth in a situation.

    Parameters
    ----------
    call
        Of the reading (`adapters.readings.Reading`).
    judged
        See `validation.questions.readings.Judged`.
    """

    engine: str
    version: str
    profile: str
    call: str
    judged: Judged


def measure_all(engine: str) -> Iterator[Known]:
    """Measure all readings of an installed engine in all situations, as shipped and as tuned.

    Raises
    ------
    EngineError
        If the engine is not installed.
    """
    loaded = load(engine)
    version = loaded.version()
    for profile in filter(None, map(loaded.facts.profile, PROFILES)):
        for reading in readings_of(engine):
            for situation in SITUATIONS:
                yield Known(engine, version, profile, reading.call, measured(loaded, profile, reading, situation))


_HEAD, _JUDGED = ("engine", "version", "profile", "call"), tuple(each.name for each in fields(Judged))


def write(entries: Iterable[Known], path: Path) -> None:
    """Write the table; two or three digits say how far a number is off."""
    with path.open("w", encoding="utf-8", newline="") as lines:
        table = csv.writer(lines, lineterminator="\n")
        table.writerow((*_HEAD, *_JUDGED))
        for each in entries:
            told = asdict(each.judged)
            digits = {"off": 2, "motion": 2, "most": 3}
            told |= {name: f"{told[name]:.{n}g}" for name, n in digits.items() if told[name] is not None}
            table.writerow([*(getattr(each, name) for name in _HEAD), *told.values()])


@cache
def known_of(engine: str) -> tuple[Known, ...]:
    """Kept table of an engine; empty if there is none."""
    return rows_of(engine, READ, _read)


def _read(path: Path) -> Iterator[Known]:
    with path.open(encoding="utf-8", newline="") as lines:
        for row in csv.DictReader(lines):
            off, motion, most = (float(row[name]) if row[name] else None for name in ("off", "motion", "most"))
            wrong, steps = (int(row[name]) if row[name] else None for name in ("wrong", "steps"))
            judged = Judged(row["situation"], row["verdict"], off, row["where"], motion, wrong, steps, most)
            yield Known(row["engine"], row["version"], row["profile"], row["call"], judged)
