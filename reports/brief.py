"""What judging a run gave, stored beside the results: rows, costs in a benchmark, and a summary for dashboards.

Judging a run of the quick suite takes seconds, most commands need its rows, and a dashboard shows hundreds of runs. So
each run is judged once, at its end or by the first command that reads it, and ``OUT/judged.sqlite`` stores what that
gave, with the hash of the code, laws and lists of known failures that judged it, and of what was judged. With another
hash it is made again: the results themselves have no verdicts. The file may be deleted at any time.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, TypeVar

import adapters
import reference_solver
import validation
from adapters import registry
from adapters.engine_folder import folder_of
from adapters.stages import stage
from reports.answers import Costs
from validation.canonical import Primary
from validation.catalogue import CATALOGUE, OURS
from validation.cells import Observation, Slot, scene_of
from validation.identity import scene_code
from validation.judging.rows import ALARMING_OUTCOMES, Row, rows_of
from validation.posed import is_file, resolve
from validation.questions.nulls import null_rows, with_skill
from validation.records.store import Run, Store
from validation.running.plan import QUICK_DT

FILE = "judged.sqlite"
#: Name of stored rows.
ROWS = "rows"
T = TypeVar("T")
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
    scene = scene_of(observation.slot)
    with suppress(KeyError, ArithmeticError, ValueError):  # a case of another kind than the primary's
        return primary.error(scene, observation.slot.dt, observation.metrics)[0]
    return None


@dataclass(frozen=True)
class Judged:
    """Rows of a run with their skill, and rows of the trivial answers (`validation.questions.nulls`)."""

    rows: Sequence[Row]
    nulls: Sequence[Row]

    @classmethod
    def of(cls, rows: Sequence[Row]) -> Judged:
        """Judged rows, with skill and trivial answers."""
        return cls(with_skill(rows), null_rows(rows))

    def as_bytes(self) -> bytes:
        """Compressed JSON for `from_bytes`."""
        text = json.dumps([[row.as_dict() for row in rows] for rows in (self.rows, self.nulls)])
        return zlib.compress(text.encode(), 1)

    @classmethod
    def from_bytes(cls, data: bytes) -> Judged:
        """Inverse of `as_bytes`."""
        rows, nulls = ([Row(**row) for row in rows] for rows in json.loads(zlib.decompress(data)))
        return cls(rows, nulls)


def judged(store: Store, run: Run) -> Judged:
    """Rows of a run: stored ones, if this code judged the same observations, else judged now.

    Raises
    ------
    StoreError
        If the observations cannot be read.
    """
    store.scenes(run)  # those who show rows ask for the scenes of files too

    def judge() -> Judged:
        return Judged.of(rows_of(run.id, store.observations(run)))

    return _once(store, run, ROWS, judge, Judged.as_bytes, Judged.from_bytes)


def costs(store: Store, run: Run) -> Costs:
    """Cost of each profile in a benchmark (`reports.speed.cheapest_passing`), stored or computed now."""

    def computed() -> Costs:
        from reports.speed import cheapest_passing

        return cheapest_passing(store, run)

    return _once(store, run, "costs", computed, _text_of_costs, _costs_from_text)


@stage("writing files")
def keep(store: Store, run: Run, observations: Iterable[Observation], found: Judged) -> None:
    """Store the rows of a judged run, and its summary for dashboards."""
    kept = Kept(store.path.parent)
    kept.put(run.id, summarise(observations, found.rows))
    kept.write(run.id, ROWS, _code_of(store, run), found.as_bytes())
    kept.close()


def _once(
    store: Store,
    run: Run,
    what: str,
    make: Callable[[], T],
    write: Callable[[T], str | bytes],
    read: Callable[[Any], T],
) -> T:
    """What is stored of a run under the name ``what``, or is made now and stored.

    Not stored for a run that goes on, whose results will be others, nor where damaged results were left out: each
    command names those.
    """
    kept, code = Kept(store.path.parent), _code_of(store, run)
    try:
        found = kept.read(run.id, what, code, read)
        if found is None:
            found = make()
            if run.finished and not store.lossy:
                kept.write(run.id, what, code, write(found))
        return found
    finally:
        kept.close()


@cache
def judging_code() -> str:
    """Hash of the code that says whether a check passes."""
    return _hash_of([Path(validation.__file__ or "").parent])


@cache
def row_code() -> str:
    """Hash of all that a row depends on beside its observation: the code, laws and lists of known failures."""
    ours = [Path(package.__file__ or "").parent for package in (reference_solver, adapters, validation)]
    engines = [registry.entry(name) for name in registry.names()]
    others = [folder_of(entry.name) for entry in engines if entry is not None and not registry.is_ours(entry)]
    scenes = [scene_code(name) for name in CATALOGUE if name not in OURS]
    return "-".join([_hash_of([*ours, *filter(None, others)]), *scenes])


def _hash_of(folders: Iterable[Path]) -> str:
    """Hash of the code and tables in folders."""
    digest = hashlib.sha256()
    for root in folders:
        for path in sorted(p for p in root.rglob("*") if p.suffix in (".py", ".csv", ".toml")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


#: What a damaged file raises: a ValueError if not even the message is text.
_WRONG = (sqlite3.Error, ValueError)


class Kept:
    """What is stored of judged runs; without a writable file it is made each time."""

    def __init__(self, folder: Path) -> None:
        self._db: sqlite3.Connection | None = None
        with suppress(*_WRONG):
            self._db = sqlite3.connect(folder / FILE, timeout=10.0)
            table = "kept (name TEXT, what TEXT, code TEXT, body, PRIMARY KEY (name, what))"
            self._db.execute(f"CREATE TABLE IF NOT EXISTS {table}")

    def get(self, name: str) -> Summary | None:
        """The summary of that name, if the same code judged it."""
        return self.read(name, "summary", judging_code(), from_text)

    def put(self, name: str, summary: Summary) -> None:
        """Store a summary."""
        self.write(name, "summary", judging_code(), summary.as_text())

    @stage("reading results")
    def read(self, name: str, what: str, code: str, read: Callable[[Any], T]) -> T | None:
        """What is stored under these names, if it is of the same code."""
        if self._db is not None:
            with suppress(*_WRONG, zlib.error, KeyError, TypeError, IndexError):
                query = "SELECT body FROM kept WHERE name = ? AND what = ? AND code = ?"
                found = self._db.execute(query, (name, what, code)).fetchone()
                return read(found[0]) if found else None
        return None

    def write(self, name: str, what: str, code: str, body: str | bytes) -> None:
        """Store a text or bytes under these names."""
        if self._db is not None:
            with suppress(*_WRONG), self._db:
                self._db.execute("INSERT OR REPLACE INTO kept VALUES (?, ?, ?, ?)", (name, what, code, body))

    def forget(self, names: Iterable[str]) -> None:
        """Delete what is stored of deleted runs, and free the disk space."""
        if self._db is not None:
            with suppress(*_WRONG):
                with self._db:
                    self._db.executemany("DELETE FROM kept WHERE name = ?", [(name,) for name in names])
                self._db.execute("VACUUM")

    def close(self) -> None:
        """Close the file."""
        if self._db is not None:
            self._db.close()


def _text_of_costs(found: Costs) -> str:
    return json.dumps([[*key, cost] for key, cost in found.items()])


def _costs_from_text(text: str) -> Costs:
    return {
        (str(scene), int(dimension), str(engine), str(profile)): float(cost)
        for scene, dimension, engine, profile, cost in json.loads(text)
    }


def _code_of(store: Store, run: Run) -> str:
    """Hash of what judges the rows of a run, and of what it judges."""
    return f"{row_code()} {store.digest(run)}"
