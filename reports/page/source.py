"""Data of the page: one run of a store, its replays, and the last bench in the same store."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from reports import speed
from reports.answers import Answer, answers
from reports.brief import judged
from validation.bench import reading
from validation.cells import Observation, Slot
from validation.records.store import Run, Store
from validation.running.tracks import Recording

Plain = Mapping[str, Any]


@dataclass(frozen=True)
class Bench:
    """A bench run: its protocol, the tables of `reports.speed.tables_of`, and PASS or FAIL of its cases."""

    run: Run
    protocol: Mapping[str, Any]
    tables: Mapping[str, pd.DataFrame]
    observations: Sequence[Observation]
    rows: Sequence[Plain]


@dataclass(frozen=True)
class Source:
    """Everything that is shown; the rest of the page reads no store and imports no engine.

    Parameters
    ----------
    rows
        Judged rows as plain data.
    observations
        Without the cases whose start was moved by some units in the last place (they measure the noise floor).
    replays
        Recordings with their slots.
    bench
        The last bench of the same store; None if there is none.
    missing
        Number of planned cases without an observation.
    scenes_kept
        Texts of the scene files of the run and of the bench, by pinned name.
    nulls
        Rows of the trivial answers (`validation.questions.nulls`).
    """

    run: Run
    rows: Sequence[Plain]
    observations: Sequence[Observation]
    replays: Sequence[tuple[Slot, Recording]] = ()
    bench: Bench | None = None
    missing: int = 0
    scenes_kept: Mapping[str, str] = field(default_factory=dict)
    nulls: Sequence[Plain] = ()
    columns: tuple[tuple[str, str], ...] = field(init=False)
    lines: tuple[tuple[str, int], ...] = field(init=False)
    _by_scene: Mapping[str, Sequence[Plain]] = field(init=False, repr=False, compare=False)
    _seen: Mapping[tuple[str, str], Sequence[Observation]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        columns = dict.fromkeys((row["engine"], row["profile"]) for row in self.rows)
        lines = dict.fromkeys((row["scene"], row["dimension"]) for row in self.rows)
        by_scene: dict[str, list[Plain]] = {}
        for row in self.rows:
            by_scene.setdefault(row["scene"], []).append(row)
        seen: dict[tuple[str, str], list[Observation]] = {}
        for observation in self.observations:
            seen.setdefault((observation.slot.engine, observation.slot.scene), []).append(observation)
        object.__setattr__(self, "_by_scene", by_scene)
        object.__setattr__(self, "_seen", seen)
        object.__setattr__(self, "columns", tuple(columns))
        object.__setattr__(self, "lines", tuple(lines))

    @cached_property
    def answers(self) -> list[Answer]:
        """What is wrong, and what fixes it."""
        return answers(self.rows)

    @property
    def named(self) -> list[tuple[str, str]]:
        """Engines and profiles on the page: those of the rows, then those that only the bench has."""
        timed = [(o.slot.engine, o.slot.profile) for o in self.bench.observations] if self.bench else []
        return list(dict.fromkeys([*self.columns, *timed]))

    @property
    def engines(self) -> list[str]:
        """Engines in the order of the rows."""
        return list(dict.fromkeys(engine for engine, _ in self.columns))

    @property
    def scenes(self) -> list[str]:
        """Scenes in the order of the rows."""
        return list(dict.fromkeys(scene for scene, _ in self.lines))

    def seen(self, engine: str, scene: str) -> Sequence[Observation]:
        """Observations of an engine in a scene."""
        return self._seen.get((engine, scene), ())

    def of(self, **wanted: Any) -> list[Plain]:
        """Rows whose fields have the wanted values."""
        rows = self._by_scene.get(wanted.pop("scene"), ()) if "scene" in wanted else self.rows
        return [row for row in rows if all(row[name] == value for name, value in wanted.items())]


def load_source(folder: Path, run: str = "latest") -> Source:
    """Read a run.

    Raises
    ------
    StoreError
        If the folder has no results or no such run.
    """
    store = Store(folder, create=False)
    try:
        chosen = store.run(run)
        found = judged(store, chosen)
        rows, nulls = ([row.as_dict() for row in each] for each in (found.rows, found.nulls))
        observations = [observation for observation in store.observations(chosen) if observation.slot.ulp == 0]
        benches = reading.bench_runs(store)
        bench = _bench(store, benches[-1]) if benches else None
        files = store.scenes(chosen) | (store.scenes(bench.run) if bench else {})
        recordings, missing = store.recordings(chosen), store.missing(chosen)
        return Source(chosen, rows, observations, recordings, bench, missing, files, nulls)
    finally:
        store.close()


def _bench(store: Store, run: Run) -> Bench:
    observations = store.observations(run)
    rows = [row for observation in observations for row in speed.physics(observation)]
    return Bench(run, store.protocol(run) or {}, speed.tables_of(store, run, observations), observations, rows)
