"""The result store: runs and their observations in one SQLite file, each cell kept the moment it finishes."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from validation.bench.timing import Timing, timing_from_dict
from validation.cells import Observation, Slot, observation_from_dict, slot_from_dict
from validation.identity import code_hash, commit, machine
from validation.tracks import Recording, recording_from_bytes

FILE = "results.sqlite"
#: Runs from moved starts, for the scatter of what another run found; never the latest run.
SCATTER_TITLE = "scatter of "
_SCHEMA = """
CREATE TABLE IF NOT EXISTS runs (
    id TEXT PRIMARY KEY, date TEXT NOT NULL, commit_hash TEXT NOT NULL, machine TEXT NOT NULL,
    title TEXT NOT NULL, plan TEXT NOT NULL, plan_hash TEXT NOT NULL, finished INTEGER NOT NULL DEFAULT 0);
CREATE TABLE IF NOT EXISTS observations (
    run TEXT NOT NULL REFERENCES runs(id), slot TEXT NOT NULL, cell TEXT NOT NULL, engine TEXT NOT NULL,
    scene TEXT NOT NULL, outcome TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (run, slot));
CREATE TABLE IF NOT EXISTS timings (
    run TEXT NOT NULL REFERENCES runs(id), slot TEXT NOT NULL, sampled INTEGER NOT NULL, round INTEGER NOT NULL,
    purpose TEXT NOT NULL, engine TEXT NOT NULL, scene TEXT NOT NULL, seconds REAL NOT NULL, body TEXT NOT NULL,
    PRIMARY KEY (run, slot, purpose, sampled, round));
CREATE TABLE IF NOT EXISTS protocols (run TEXT PRIMARY KEY REFERENCES runs(id), body TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS recordings (
    run TEXT NOT NULL REFERENCES runs(id), slot TEXT NOT NULL, request TEXT NOT NULL, body BLOB NOT NULL,
    PRIMARY KEY (run, slot));
"""


class StoreError(RuntimeError):
    """The store cannot be used; one line."""


@dataclass(frozen=True)
class Run:
    """One execution of a plan."""

    id: str
    date: str
    commit: str
    machine: dict[str, Any]
    title: str
    plan: tuple[str, ...]
    finished: bool


class Store:
    """Runs and observations under one folder.

    Parameters
    ----------
    folder
        Made if it does not exist.

    Raises
    ------
    StoreError
        If the folder or its file cannot be used.
    """

    def __init__(self, folder: Path, create: bool = True) -> None:
        path = folder if folder.is_file() else folder / FILE
        if not create and not path.exists():
            raise StoreError(f"out: there are no results at {path}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._db = sqlite3.connect(path, timeout=30.0, isolation_level=None)
            self._db.execute("PRAGMA journal_mode=WAL")
            # WAL with NORMAL survives the death of the process, which is what a run must survive.
            self._db.execute("PRAGMA synchronous=NORMAL")
            self._db.executescript(_SCHEMA)
        except (OSError, sqlite3.Error) as error:
            raise StoreError(f"out: cannot use {path}: {error}") from None
        self.path = path

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def start(self, title: str, slots: Sequence[Slot], fresh: bool = False) -> tuple[Run, set[str]]:
        """Resume the unfinished run of the same plan and code, or start a new one.

        Returns
        -------
        The run, and the keys of the slots it already has.
        """
        plan = [slot.key() for slot in slots]
        plan_hash = hashlib.sha256(json.dumps([sorted(plan), code_hash()]).encode()).hexdigest()[:16]
        query = "SELECT id FROM runs WHERE plan_hash = ? AND finished = 0 ORDER BY date DESC, id DESC LIMIT 1"
        row = None if fresh else self._db.execute(query, (plan_hash,)).fetchone()
        if row is not None:
            done = self._db.execute("SELECT slot FROM observations WHERE run = ?", row).fetchall()
            return self.run(row[0]), {slot for (slot,) in done}
        now = datetime.now(UTC)
        run_id = self._free_id(now.strftime("%Y%m%d-%H%M%S"))
        self._db.execute(
            "INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, 0)",
            (
                run_id,
                now.isoformat(timespec="seconds"),
                commit(),
                json.dumps(machine()),
                title,
                json.dumps(plan),
                plan_hash,
            ),
        )
        return self.run(run_id), set()

    def _free_id(self, stem: str) -> str:
        taken = {row[0] for row in self._db.execute("SELECT id FROM runs")}
        return next(i for i in (stem, *(f"{stem}-{k}" for k in range(2, len(taken) + 3))) if i not in taken)

    def add(self, run: Run, observation: Observation) -> None:
        """Keep an observation; it is on disk when this returns."""
        slot = observation.slot
        self._db.execute(
            "INSERT OR REPLACE INTO observations VALUES (?, ?, ?, ?, ?, ?, ?)",
            (
                run.id,
                slot.key(),
                observation.cell,
                slot.engine,
                slot.scene,
                observation.outcome.value,
                json.dumps(observation.as_dict(), default=str),
            ),
        )

    def finish(self, run: Run) -> None:
        """Mark the run as complete, so that the same plan starts a new one next time."""
        self._db.execute("UPDATE runs SET finished = 1 WHERE id = ?", (run.id,))

    def runs(self) -> list[Run]:
        """All runs, oldest first."""
        ids = self._db.execute("SELECT id FROM runs ORDER BY date, id").fetchall()
        return [self.run(run_id) for (run_id,) in ids]

    def run(self, run_id: str = "latest") -> Run:
        """Return one run; the latest is a bench or a scatter only if there is nothing else.

        Raises
        ------
        StoreError
            If there is none of that name.
        """
        last = "1 ORDER BY title LIKE 'bench %' OR title LIKE ?, date DESC, id DESC LIMIT 1"
        where, args = ("id = ?", run_id) if run_id != "latest" else (last, f"{SCATTER_TITLE}%")
        columns = "id, date, commit_hash, machine, title, plan, finished"
        row = self._db.execute(f"SELECT {columns} FROM runs WHERE {where}", (args,)).fetchone()
        if row is None:
            known = ", ".join(r[0] for r in self._db.execute("SELECT id FROM runs")) or "none"
            raise StoreError(f"run: there is no run {run_id!r} in {self.path}; it has {known}")
        return Run(row[0], row[1], row[2], json.loads(row[3]), row[4], tuple(json.loads(row[5])), bool(row[6]))

    def observations(self, run: Run) -> list[Observation]:
        """Observations of a run, in the order of its plan."""
        rows = self._db.execute("SELECT slot, body FROM observations WHERE run = ?", (run.id,)).fetchall()
        order = {key: position for position, key in enumerate(run.plan)}
        rows.sort(key=lambda row: order.get(row[0], len(order)))
        return [observation_from_dict(json.loads(body)) for _, body in rows]

    def add_timings(self, run: Run, timings: Sequence[Timing]) -> None:
        """Keep raw timings, in one transaction."""
        rows = []
        for timing in timings:
            slot, body = timing.slot, json.dumps(timing.as_dict())
            unit = (run.id, slot.key(), timing.sampled, timing.round, timing.purpose)
            rows.append((*unit, slot.engine, slot.scene, timing.seconds, body))
        self._db.execute("BEGIN")
        self._db.executemany("INSERT OR REPLACE INTO timings VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)
        self._db.execute("COMMIT")

    def clear_timings(self, run: Run) -> None:
        """Drop the timings of a run that was interrupted: rounds of two lanes do not mix."""
        self._db.execute("DELETE FROM timings WHERE run = ?", (run.id,))

    def timings(self, run: Run) -> list[Timing]:
        """Raw timings of a run, in the order in which they were taken."""
        rows = self._db.execute("SELECT body FROM timings WHERE run = ? ORDER BY rowid", (run.id,)).fetchall()
        return [timing_from_dict(json.loads(body)) for (body,) in rows]

    def set_protocol(self, run: Run, protocol: dict[str, Any]) -> None:
        """Keep how a bench run was made: seed, limits, clock, what was left out and why."""
        self._db.execute("INSERT OR REPLACE INTO protocols VALUES (?, ?)", (run.id, json.dumps(protocol)))

    def protocol(self, run: Run) -> dict[str, Any] | None:
        """Protocol of a bench run; None for a run that timed nothing."""
        row = self._db.execute("SELECT body FROM protocols WHERE run = ?", (run.id,)).fetchone()
        return None if row is None else dict(json.loads(row[0]))

    def add_recording(self, run: Run, slot: Slot, recording: Recording) -> None:
        """Keep what a replay shows of a cell."""
        row = (run.id, slot.key(), json.dumps(slot.as_dict()), recording.to_bytes())
        self._db.execute("INSERT OR REPLACE INTO recordings VALUES (?, ?, ?, ?)", row)

    def recordings(self, run: Run) -> list[tuple[Slot, Recording]]:
        """Recordings of a run, in the order of its plan."""
        rows = self._db.execute("SELECT slot, request, body FROM recordings WHERE run = ?", (run.id,)).fetchall()
        order = {key: position for position, key in enumerate(run.plan)}
        rows.sort(key=lambda row: order.get(row[0], len(order)))
        return [(slot_from_dict(json.loads(slot)), recording_from_bytes(body)) for _, slot, body in rows]
