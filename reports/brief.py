"""Summary of a run: primary error and number of failed checks of each case. Stored beside the results.

Judging a run of the quick suite takes seconds and a dashboard shows hundreds, so each is judged once: a run at its end
stores a summary in ``OUT/dashboard.sqlite`` under its name and the hash of the judging code. The file may be deleted at
any time.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections import defaultdict
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import validation
from adapters.stages import stage
from validation.canonical import Primary
from validation.cells import Observation, Slot
from validation.judging.rows import ALARMING_OUTCOMES, Row, rows_of
from validation.posed import is_file, resolve
from validation.running.plan import QUICK_DT

FILE = "dashboard.sqlite"
#: Outcomes about an engine's physics.
ANSWERED = ("ok", "diverged")
#: Brief of one case: error or None, checks that fail, checks that are judged, checks that fail for sure: a start moved
#: by the last place mends the others.
Brief = tuple[float | None, int, int, int]
#: Key of a panel.
Key = tuple[str, str, str, int]


@dataclass(frozen=True)
class Summary:
    """Cases of a run by panel, each under a key that is equal in all runs with the same case.

    Parameters
    ----------
    versions
        Of the engines.
    times
        Ratio to an opponent's time, and the opponent, if timed.
    """

    cells: Mapping[Key, Mapping[str, Brief]]
    versions: Mapping[str, str]
    times: Mapping[Key, tuple[float, str]] = field(default_factory=dict)

    def as_text(self) -> str:
        """JSON for `from_text`; each panel is a separate text, mostly equal to that of another run."""
        panels = [json.dumps([*key, dict(briefs)], separators=(",", ":")) for key, briefs in self.cells.items()]
        times = [[*key, *taken] for key, taken in self.times.items()]
        return json.dumps({"panels": panels, "versions": dict(self.versions), "times": times}, separators=(",", ":"))


def from_text(text: str) -> Summary:
    """Inverse of `Summary.as_text`; equal panels of two runs are one object."""
    data = json.loads(text)
    times = {_key(*asked): (float(ratio), str(opponent)) for *asked, ratio, opponent in data["times"]}
    return Summary(dict(map(_panel, data["panels"])), data["versions"], times)


@lru_cache(maxsize=100_000)
def _panel(text: str) -> tuple[Key, Mapping[str, Brief]]:
    """Cases of a panel; engines are repeatable, so hundreds of runs have few different texts."""
    *asked, briefs = json.loads(text)
    return _key(*asked), {slot: (error, fails, judged, sure) for slot, (error, fails, judged, sure) in briefs.items()}


def _key(engine: object, profile: object, scene: object, dimension: int) -> Key:
    return str(engine), str(profile), str(scene), int(dimension)


def summarise(observations: Iterable[Observation], rows: Iterable[Row] | None = None) -> Summary:
    """Judge observations and return the data of a dashboard: cases at the quick step with a profile's own settings.

    ``rows`` are theirs, if already judged.
    """
    everything = list(observations)
    moved: dict[str, list[Observation]] = defaultdict(list)
    for observation in everything:
        if observation.slot.ulp:
            moved[json.dumps(replace(observation.slot, ulp=0).as_dict(), sort_keys=True)].append(observation)
    observations = [o for o in everything if _shown(o.slot)]
    judged = list(rows) if rows is not None else rows_of("", observations)
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
    for row in judged:
        if row.cells and len(row.cells) == 1 and row.outcome not in ALARMING_OUTCOMES and row.physics:
            count = counts[json.dumps(row.slot, sort_keys=True)]
            count[0] += row.physics == "fail"
            count[1] += 1
            count[2] += row.physics == "fail" and not _mended(row, moved[json.dumps(row.slot, sort_keys=True)])
    cells: dict[Key, dict[str, Brief]] = defaultdict(dict)
    versions = {}
    for observation in observations:
        slot = observation.slot
        fails, all_of_them, sure = counts[json.dumps(slot.as_dict(), sort_keys=True)]
        brief = (_error(observation), fails, all_of_them, sure)
        if all_of_them or brief[0] is not None:
            cells[slot.engine, slot.profile, slot.scene, slot.dimension][slot.key()] = brief
        versions[slot.engine] = observation.engine_version
    return Summary(cells, versions)


def _mended(row: Row, moved: Iterable[Observation]) -> bool:
    """Whether one of the same case's moved starts passes the check that this row fails."""
    if row.truth is None or row.tolerance is None:
        return False
    values = (observation.metrics.get(row.metric, (None, ""))[0] for observation in moved)
    return any(value is not None and abs(value - row.truth) <= row.tolerance for value in values)


def _shown(slot: Slot) -> bool:
    own = slot.iterations is None and not slot.ulp and not slot.switched
    return own and slot.dt == QUICK_DT and not is_file(slot.scene)


def _error(observation: Observation) -> float | None:
    """Primary error of one case [unit of the primary], if its scene declares one and it can be computed there."""
    if observation.outcome.value not in ANSWERED or not observation.metrics:
        return None
    canonical = resolve(observation.slot.scene)
    primary: Primary | None = canonical.primary
    if primary is None:
        return None
    scene = canonical.scene(observation.slot.dimension, dict(observation.slot.params))
    with suppress(KeyError, ArithmeticError, ValueError):  # a case of another kind than the primary's
        return primary.error(scene, observation.slot.dt, observation.metrics)[0]
    return None


@cache
def judging_code() -> str:
    """Hash of all judging code: with other checks, summaries are made again."""
    digest = hashlib.sha256()
    root = Path(validation.__file__ or "").parent
    for path in sorted(p for p in root.rglob("*") if p.suffix in (".py", ".csv", ".toml")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


@stage("writing files")
def keep(folder: Path, run: str, observations: Iterable[Observation], rows: Iterable[Row]) -> None:
    """Store the summary of a judged run for dashboards."""
    kept = Kept(folder)
    kept.put(run, summarise(observations, rows))
    kept.close()


class Kept:
    """Stored summaries; without a writable file they are made each time."""

    def __init__(self, folder: Path) -> None:
        self._db: sqlite3.Connection | None = None
        with suppress(sqlite3.Error):
            self._db = sqlite3.connect(folder / FILE, timeout=10.0)
            table = "summaries (name TEXT PRIMARY KEY, code TEXT, body TEXT)"
            self._db.execute(f"CREATE TABLE IF NOT EXISTS {table}")

    def get(self, name: str) -> Summary | None:
        """The summary of that name, if the same code judged it."""
        if self._db is not None:
            with suppress(sqlite3.Error, ValueError, KeyError, TypeError, IndexError):
                query = "SELECT body FROM summaries WHERE name = ? AND code = ?"
                found = self._db.execute(query, (name, judging_code())).fetchone()
                return from_text(found[0]) if found else None
        return None

    def put(self, name: str, summary: Summary) -> None:
        """Store a summary."""
        if self._db is not None:
            with suppress(sqlite3.Error), self._db:
                row: tuple[Any, ...] = (name, judging_code(), summary.as_text())
                self._db.execute("INSERT OR REPLACE INTO summaries VALUES (?, ?, ?)", row)

    def close(self) -> None:
        """Close the file."""
        if self._db is not None:
            self._db.close()
