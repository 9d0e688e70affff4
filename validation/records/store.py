"""The result store: runs and their observations in one SQLite file; each cell is stored when it finishes.

Rows are read one by one: what is damaged is named in one line (`adapters.plain.Notice`) and left out.
"""

from __future__ import annotations

import hashlib
import json
import re
import sqlite3
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import quote

from adapters.plain import NAME, Notice, one_line, plain
from adapters.stages import stage
from validation import posed
from validation.bench.timing import Timing, timing_from_dict
from validation.cells import Observation, Slot, observation_from_dict, slot_from_dict
from validation.identity import code_hash, commit, machine
from validation.running.tracks import Recording, recording_from_bytes

FILE = "results.sqlite"
#: Version of the tables, kept as ``user_version``; 0 is a store from before versions, which had no scenes.
VERSION = 1
#: Wait for another process that writes [s]; after that a writer prints one line, and goes on waiting.
PATIENCE = 30.0
#: Title of runs with moved starts, for the scatter of another run; never the latest run.
SCATTER_TITLE = "scatter of "
#: Title of runs on another release of an engine (``release myengine==3.2.7: bounce``); never the latest run.
RELEASE_TITLE = "release "
#: Beginnings of the titles of runs that serve another purpose than an answer; none of them is the latest run.
HELPERS = ("bench ", SCATTER_TITLE, RELEASE_TITLE)
_SCHEMA = (
    """CREATE TABLE IF NOT EXISTS runs (
    id TEXT PRIMARY KEY, date TEXT NOT NULL, commit_hash TEXT NOT NULL, machine TEXT NOT NULL,
    title TEXT NOT NULL, plan TEXT NOT NULL, plan_hash TEXT NOT NULL, finished INTEGER NOT NULL DEFAULT 0)""",
    """CREATE TABLE IF NOT EXISTS observations (
    run TEXT NOT NULL REFERENCES runs(id), slot TEXT NOT NULL, cell TEXT NOT NULL, engine TEXT NOT NULL,
    scene TEXT NOT NULL, outcome TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (run, slot))""",
    """CREATE TABLE IF NOT EXISTS timings (
    run TEXT NOT NULL REFERENCES runs(id), slot TEXT NOT NULL, sampled INTEGER NOT NULL, round INTEGER NOT NULL,
    purpose TEXT NOT NULL, engine TEXT NOT NULL, scene TEXT NOT NULL, seconds REAL NOT NULL, body TEXT NOT NULL,
    PRIMARY KEY (run, slot, purpose, sampled, round))""",
    "CREATE TABLE IF NOT EXISTS protocols (run TEXT PRIMARY KEY REFERENCES runs(id), body TEXT NOT NULL)",
    """CREATE TABLE IF NOT EXISTS recordings (
    run TEXT NOT NULL REFERENCES runs(id), slot TEXT NOT NULL, request TEXT NOT NULL, body BLOB NOT NULL,
    PRIMARY KEY (run, slot))""",
    """CREATE TABLE IF NOT EXISTS scenes (
    run TEXT NOT NULL REFERENCES runs(id), name TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (run, name))""",
)
_COLUMNS = "id, date, commit_hash, machine, title, plan, finished"
#: Facts of a machine that pages name, for runs without them.
_MACHINE = ("cpu", "cores", "memory_gib", "system", "python")
_T = TypeVar("_T")
#: A run's id names files and folders, so an id of another store must be checked.
_ID = re.compile(r"[0-9A-Za-z][0-9A-Za-z_-]{0,63}")
#: The latest run, or the one of so many runs before it: ``latest~1``.
_LATEST = re.compile(r"latest(?:~(\d{1,6}))?")


class StoreError(RuntimeError):
    """The results cannot be written or read; one line."""


class MissingError(StoreError):
    """The requested result does not exist; one line."""


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
        Made if it does not exist. The store's file itself may be named instead.
    create
        False: results must be there.
    write
        Whether anything is written; by default only with ``create``. Otherwise not even a file beside the store.

    Raises
    ------
    MissingError
        If there are no results to read.
    StoreError
        If the folder or its file cannot be used, or is of a later version than this one.
    """

    def __init__(self, folder: Path, create: bool = True, write: bool | None = None) -> None:
        write = create if write is None else write
        self.path = folder if folder.is_file() else folder / FILE
        #: Whether something that was read was damaged and left out.
        self.lossy = False
        if not create and not self.path.exists():
            raise MissingError(f"out: there are no results at {self.path}; crosscheck run makes them")
        if self.path.is_fifo():  # which would be waited for
            raise StoreError(f"out: {self.path} is a pipe, not a file")
        with self._guarded("use"):
            if write:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._db = _patiently(self.path, lambda: _opened(self.path))
            else:
                self._db = opened_to_read(self.path)
            version = self._db.execute("PRAGMA user_version").fetchone()[0]
        if version > VERSION:
            self._db.close()
            raise StoreError(f"out: {self.path} is of version {version}, made by a later release; this one reads up "
                             f"to {VERSION}")  # fmt: skip
        if write and version < VERSION:
            with self._guarded("use"):
                self._make_tables()

    def _make_tables(self) -> None:
        with self._transaction():
            for table in _SCHEMA:
                self._db.execute(table)
            self._db.execute(f"PRAGMA user_version = {VERSION}")

    @contextmanager
    def _guarded(self, what: str) -> Iterator[None]:
        """Turn errors of a damaged, full, locked or foreign file into one line."""
        try:
            yield
        except (sqlite3.Error, OSError, KeyError, TypeError, ValueError, AttributeError) as error:
            said = f"{type(error).__name__}: {error}" if isinstance(error, KeyError | TypeError) else str(error)
            raise StoreError(f"out: cannot {what} {self.path}: {one_line(said)}") from None

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Write all or nothing; the write lock is taken before reading, so that two processes do not both write."""
        _patiently(self.path, lambda: self._db.execute("BEGIN IMMEDIATE"))
        try:
            yield
            self._db.execute("COMMIT")
        except BaseException:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise

    @contextmanager
    def writing(self) -> Iterator[sqlite3.Connection]:
        """The tables, in one transaction: for work on many runs (`validation.records.keeping`)."""
        with self._guarded("write"), self._transaction():
            yield self._db

    def _made(self, what: str, rows: Iterable[Sequence[Any]], make: Callable[..., _T]) -> list[_T]:
        """Results of ``make``, one a row; damaged rows are left out, and named in one line."""
        found, wrong = [], []
        for row in rows:
            try:
                found.append(make(*row))
            except Exception as error:  # a damaged row may raise anything
                wrong.append(one_line(f"{type(error).__name__}: {error}", NAME))
        if wrong:
            self.lossy = True
            self._tell(f"{what}: damaged and left out: {len(wrong)} of {len(found) + len(wrong)}, {wrong[0]}")
        return found

    def _tell(self, line: str) -> None:
        warnings.warn(Notice(f"out: {self.path}: {line}"), stacklevel=2)

    def compact(self) -> None:
        """Free the disk space of deleted data."""
        with self._guarded("write"):
            self._db.execute("VACUUM")
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    @stage("storing results")
    def start(self, title: str, slots: Sequence[Slot], fresh: bool = False, apart: str = "") -> tuple[Run, set[str]]:
        """Resume the unfinished run of the same plan and code, or start a new one.

        The plan names scene files with the hash of their text, and stores the text. Runs with another ``apart`` are
        never the same.

        Returns
        -------
        The run, and the keys of slots with a result.
        """
        plan = [slot.key() for slot in slots]
        asked = [sorted(plan), code_hash((s.scene, s.engine) for s in slots), *([apart] if apart else [])]
        plan_hash = hashlib.sha256(json.dumps(asked).encode()).hexdigest()[:16]
        made = json.dumps(machine()), title, json.dumps(plan), plan_hash
        here = commit()
        with self._guarded("write"), self._transaction():
            open_ones = [] if fresh else self._runs("plan_hash = ? AND finished = 0", plan_hash)
            row = (open_ones[-1].id,) if open_ones else ()
            if not row:
                now = datetime.now(UTC)
                row = (self._free_id(now.strftime("%Y%m%d-%H%M%S")),)
                date = now.isoformat(timespec="seconds")
                self._db.execute("INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, 0)", (*row, date, here, *made))
                texts = posed.texts_of(slot.scene for slot in slots)
                scenes = [(*row, name, text) for name, text in texts.items()]
                self._db.executemany("INSERT INTO scenes VALUES (?, ?, ?)", scenes)
            done = self._db.execute("SELECT slot FROM observations WHERE run = ?", row).fetchall()
        return self.run(row[0]), {slot for (slot,) in done}

    def _free_id(self, stem: str) -> str:
        taken = {row[0] for row in self._db.execute("SELECT id FROM runs")}
        return next(i for i in (stem, *(f"{stem}-{k}" for k in range(2, len(taken) + 3))) if i not in taken)

    @stage("storing results")
    def add(self, run: Run, observation: Observation) -> None:
        """Store an observation; it is on disk when this returns."""
        slot = observation.slot
        row = (run.id, slot.key(), observation.cell, slot.engine, slot.scene, observation.outcome.value)
        body = json.dumps(observation.as_dict(), default=str)
        self._write("INSERT OR REPLACE INTO observations VALUES (?, ?, ?, ?, ?, ?, ?)", (*row, body))

    def _write(self, statement: str, values: Sequence[Any]) -> None:
        with self._guarded("write"):
            _patiently(self.path, lambda: self._db.execute(statement, values))

    @stage("storing results")
    def finish(self, run: Run) -> None:
        """Mark the run as complete; the same plan then starts a new one."""
        self._write("UPDATE runs SET finished = 1 WHERE id = ?", (run.id,))

    def runs(self) -> list[Run]:
        """All runs, in the order in which they were started, not by their dates."""
        return self._runs("1")

    def run(self, run_id: str = "latest") -> Run:
        """Return one run by its id, or ``latest``; ``latest~1`` is the run before it.

        Runs of `HELPERS` do not count, but the latest is one of them if there is no other.

        Raises
        ------
        MissingError
            If there is no such run.
        StoreError
            If it is damaged.
        """
        latest = _LATEST.fullmatch(run_id)
        back = int(latest[1] or 0) if latest else 0
        helps = "(" + " OR ".join(f"title LIKE '{title}%'" for title in HELPERS) + ")"
        order = f"(? OR NOT {helps}) ORDER BY {helps}, rowid DESC"
        where, args = (order, (not back,)) if latest else ("id = ?", (run_id.encode(errors="replace").decode(),))
        with self._guarded("read"):
            for row in self._db.execute(f"SELECT {_COLUMNS} FROM runs WHERE {where}", args):
                try:
                    found = run_of(row)
                except ValueError as error:
                    if not latest:
                        raise StoreError(f"run: {self.path}: {error}") from None
                    self._tell(f"{error}; it is left out")
                    continue
                if not back:
                    return found
                back -= 1
            known = self._db.execute("SELECT id FROM runs ORDER BY rowid DESC LIMIT 20").fetchall()
            said = one_line(", ".join(str(r[0]) for r in known) or "none")
            raise MissingError(f"run: there is no run {run_id!r} in {self.path}; it has {said}")

    def _runs(self, where: str, *values: str) -> list[Run]:
        with self._guarded("read"):
            found = []
            for row in self._db.execute(f"SELECT {_COLUMNS} FROM runs WHERE {where} ORDER BY rowid", values):
                try:
                    found.append(run_of(row))
                except ValueError as error:
                    self._tell(f"{error}; it is left out, and crosscheck prune --unfinished deletes it")
            return found

    def damaged(self) -> dict[int, Run]:
        """Runs that cannot be read, by row: their ids made plain, and the reason as title."""
        with self._guarded("read"):
            found = {}
            for number, *row in self._db.execute(f"SELECT rowid, {_COLUMNS} FROM runs ORDER BY rowid"):
                try:
                    run_of(row)
                except ValueError as error:
                    found[number] = Run(one_line(row[0], NAME), "", "", {}, str(error), (), False)
            return found

    def timed_runs(self) -> list[Run]:
        """Runs with a protocol, which have timings; oldest first."""
        return [run for run in self._runs("id IN (SELECT run FROM protocols)") if self.protocol(run) is not None]

    def release_runs(self, engine: str, version: str = "") -> list[Run]:
        """Runs on other releases of an engine (or on one of them), oldest first."""
        name = f"{RELEASE_TITLE}{engine}=={version}" + (":" if version else "")
        return self._runs("substr(title, 1, length(?)) = ?", name, name)

    @stage("reading results")
    def observations(self, run: Run, engine: str = "", scene: str = "") -> list[Observation]:
        """Observations of a run, or of one engine or scene of it, in the order of its plan.

        Its scene files need not exist any more.
        """
        self.scenes(run)
        asked = {"run": run.id, "engine": engine, "scene": scene}
        where = " AND ".join(f"{name} = :{name}" for name, value in asked.items() if value)
        with self._guarded("read"):
            rows = self._db.execute(f"SELECT slot, body FROM observations WHERE {where}", asked).fetchall()
            order = {key: position for position, key in enumerate(run.plan)}
            rows.sort(key=lambda row: order.get(row[0], len(order)))
            return self._made(f"results of run {run.id}", rows, _observation)

    def digest(self, run: Run) -> str:
        """Hash of all results of a run, as they are stored."""
        digest = hashlib.sha256()
        with self._guarded("read"):
            for table in ("observations", "timings"):
                for (body,) in self._db.execute(f"SELECT body FROM {table} WHERE run = ? ORDER BY rowid", (run.id,)):
                    digest.update(str(body).encode() + b"\n")
        return digest.hexdigest()[:16]

    def missing(self, run: Run) -> int:
        """Number of planned cells of a run without observation: it was interrupted, or rows were deleted."""
        with self._guarded("read"):
            rows = self._db.execute("SELECT slot FROM observations WHERE run = ?", (run.id,)).fetchall()
            return len(set(run.plan) - {slot for (slot,) in rows})

    def scenes(self, run: Run) -> dict[str, str]:
        """Texts of the scene files of a run, by the name that its slots have for them."""
        with self._guarded("read"):
            if not self._db.execute("SELECT 1 FROM sqlite_master WHERE name = 'scenes'").fetchone():
                return {}  # a store of version 0
            rows = self._db.execute("SELECT name, body FROM scenes WHERE run = ?", (run.id,)).fetchall()
            return dict(self._made(f"scene files of run {run.id}", rows, _scene))

    def add_timings(self, run: Run, timings: Sequence[Timing]) -> None:
        """Store raw timings, in one transaction."""
        rows = []
        for timing in timings:
            slot, body = timing.slot, json.dumps(timing.as_dict())
            unit = (run.id, slot.key(), timing.sampled, timing.round, timing.purpose)
            rows.append((*unit, slot.engine, slot.scene, timing.seconds, body))
        with self._guarded("write"), self._transaction():
            self._db.executemany("INSERT OR REPLACE INTO timings VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)

    def clear_timings(self, run: Run) -> None:
        """Delete the timings of an interrupted run: rounds of two processes must not be mixed."""
        self._write("DELETE FROM timings WHERE run = ?", (run.id,))

    @stage("reading results")
    def timings(self, run: Run) -> list[Timing]:
        """Raw timings of a run, in order."""
        with self._guarded("read"):
            rows = self._db.execute("SELECT body FROM timings WHERE run = ? ORDER BY rowid", (run.id,)).fetchall()
            return self._made(f"times of run {run.id}", rows, lambda body: timing_from_dict(json.loads(body)))

    def set_protocol(self, run: Run, protocol: dict[str, Any]) -> None:
        """Store how a benchmark was made: seed, limits, clock, and what was left out and why."""
        self._write("INSERT OR REPLACE INTO protocols VALUES (?, ?)", (run.id, json.dumps(protocol)))

    def protocol(self, run: Run) -> dict[str, Any] | None:
        """Protocol of a benchmark; None for a run without timings, or if it is damaged."""
        with self._guarded("read"):
            rows = self._db.execute("SELECT body FROM protocols WHERE run = ?", (run.id,)).fetchall()
            found = self._made(f"protocol of run {run.id}", rows, lambda body: dict(plain(json.loads(body))))
            return found[0] if found else None

    @stage("storing results")
    def add_recording(self, run: Run, slot: Slot, recording: Recording) -> None:
        """Store the replay of a cell."""
        row = (run.id, slot.key(), json.dumps(slot.as_dict()), recording.to_bytes())
        self._write("INSERT OR REPLACE INTO recordings VALUES (?, ?, ?, ?)", row)

    @stage("reading results")
    def recordings(self, run: Run) -> list[tuple[Slot, Recording]]:
        """Recordings of a run, in the order of its plan."""
        self.scenes(run)
        with self._guarded("read"):
            found = "SELECT slot, request, body FROM recordings WHERE run = ?"
            rows = self._db.execute(found, (run.id,)).fetchall()
            order = {key: position for position, key in enumerate(run.plan)}
            rows.sort(key=lambda row: order.get(row[0], len(order)))
            return self._made(f"recordings of run {run.id}", rows, _recorded)


def run_of(row: Sequence[Any]) -> Run:
    """The run of a row of the table, in the order of the columns of `Run`.

    Raises
    ------
    ValueError
        Naming the run and the damaged columns, in one line.
    """
    name, date, made_at, here, title, plan, finished = row
    there, slots = _parsed(here), _parsed(plan)
    is_right = {
        "id": isinstance(name, str) and _ID.fullmatch(name),
        "date": isinstance(date, str) and _is_date(date),
        "machine": isinstance(there, dict),
        "title": isinstance(title, str),
        "plan": isinstance(slots, list) and all(isinstance(key, str) for key in slots),
    }
    if wrong := [column for column, right in is_right.items() if not right]:
        raise ValueError(f"run {one_line(name, NAME)!r} is damaged ({', '.join(wrong)})")
    told = dict.fromkeys(_MACHINE, "unknown") | plain(there)
    return Run(name, one_line(date), one_line(made_at), told, one_line(title), tuple(slots), bool(finished))


def _parsed(text: Any) -> Any:
    """Data of JSON; None if it is none."""
    try:
        return json.loads(text)
    except (ValueError, TypeError, RecursionError):
        return None


def _is_date(text: str) -> bool:
    try:
        return datetime.fromisoformat(text).tzinfo is not None
    except ValueError:
        return False


def _observation(slot: str, body: str) -> Observation:
    found = observation_from_dict(json.loads(body))
    if found.slot.key() != slot:
        raise ValueError("it is the result of another case")
    if posed.is_file(found.slot.scene):
        posed.resolve(found.slot.scene)  # its scene may be damaged
    return found


def _scene(name: str, text: str) -> tuple[str, str]:
    posed.remember({name: text})
    return name, text


def _recorded(_: str, slot: str, body: bytes) -> tuple[Slot, Recording]:
    return slot_from_dict(json.loads(slot)), recording_from_bytes(body)


def _opened(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(path, timeout=PATIENCE, isolation_level=None)
    connection.execute("PRAGMA journal_mode=WAL")
    # WAL with NORMAL survives the end of the process, which a run must survive.
    connection.execute("PRAGMA synchronous=NORMAL")
    connection.execute("PRAGMA temp_store=MEMORY")  # a full temporary folder does not matter here
    connection.text_factory = _as_text
    return connection


def _as_text(data: bytes) -> str:
    """Text of a column; bytes that are none must not hide the other rows."""
    return data.decode(errors="replace")


def opened_to_read(path: Path) -> sqlite3.Connection:
    """Open without writing; where the log's index cannot be created, as an immutable file."""
    address = f"file:{quote(str(path.resolve()))}?mode=ro"
    for suffix in ("", "&immutable=1"):
        connection = sqlite3.connect(address + suffix, uri=True, timeout=PATIENCE, isolation_level=None)
        connection.text_factory = _as_text
        try:
            connection.execute("PRAGMA temp_store=MEMORY")
            connection.execute("SELECT 1 FROM sqlite_master").fetchone()
            return connection
        except sqlite3.OperationalError:
            connection.close()
            if suffix or path.with_name(path.name + "-wal").exists():  # entries of the log must not be missed
                raise
    raise AssertionError("unreachable")


def _patiently(path: Path, action: Callable[[], _T]) -> _T:
    """Repeat a call until no other process has locked the file.

    A change of journal mode does not wait at all, and everything else for `PATIENCE`.
    """
    begun, told = time.monotonic(), False
    while True:
        try:
            return action()
        except sqlite3.OperationalError as error:
            if "locked" not in str(error):
                raise
        if not told and time.monotonic() - begun >= PATIENCE:
            warnings.warn(Notice(f"out: {path} is locked by another process; waiting for it"), stacklevel=2)
            told = True
        time.sleep(0.05)
