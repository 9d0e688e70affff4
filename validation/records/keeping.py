"""Merges stores of several machines, and deletes old runs.

A run is the same in two stores if id, date, machine and plan agree; otherwise one of them gets another id, a hash of
these, so that merging the same store twice adds nothing.
"""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from adapters.plain import one_line
from validation.records.store import Run, Store, StoreError, opened_to_read, run_of

#: Tables whose rows belong to a run, and their keys.
TABLES = {
    "observations": ("run", "slot"),
    "timings": ("run", "slot", "purpose", "sampled", "round"),
    "protocols": ("run",),
    "recordings": ("run", "slot"),
    "scenes": ("run", "name"),
}


@dataclass(frozen=True)
class Merged:
    """Result of a merge: new runs, known runs, new rows, rows that differ."""

    runs: int
    known: int
    rows: int
    differing: int


def merge(store: Store, other: Path) -> Merged:
    """Add all runs of another store; nothing here is changed or duplicated.

    Runs in both stores are completed; where a row differs, ours stays, and is counted.

    Raises
    ------
    StoreError
        If the other store cannot be read, has a damaged run, or is the same.
    """
    theirs = Store(other, create=False)  # checks version and damage
    path = theirs.path.resolve()
    theirs.close()
    if path == store.path.resolve():
        raise StoreError(f"merge: {path} is the same store")
    with store.writing() as db:
        source = opened_to_read(path)
        try:
            return _merged(db, source)
        except (sqlite3.DatabaseError, ValueError) as error:
            raise StoreError(f"merge: cannot read {path}: {one_line(error)}") from None
        finally:
            source.close()


def _merged(db: sqlite3.Connection, source: sqlite3.Connection) -> Merged:
    new, known, rows, differing = 0, 0, 0, 0
    for run in source.execute(
        "SELECT id, date, commit_hash, machine, title, plan, plan_hash, finished FROM runs ORDER BY rowid"
    ).fetchall():
        run_of((*run[:6], run[7]))  # a damaged one is refused
        name, added = _own_id(db, run)
        new, known = new + added, known + (not added)
        db.execute("UPDATE runs SET finished = max(finished, ?) WHERE id = ?", (run[-1], name))
        for table in TABLES:
            came, other = _copy(db, source, table, run[0], name)
            rows, differing = rows + came, differing + other
    return Merged(new, known, rows, differing)


def _own_id(db: sqlite3.Connection, run: Sequence[object]) -> tuple[str, bool]:
    """Id here of a run of the other store, and whether it is new."""
    identity = tuple(run[i] for i in (1, 3, 5))  # date, machine, plan
    digest = hashlib.sha256(repr(identity).encode()).hexdigest()[:6]
    for name in (str(run[0]), f"{str(run[0])[:56]}-{digest}"):
        there = db.execute("SELECT date, machine, plan FROM runs WHERE id = ?", (name,)).fetchone()
        if there == identity:
            return name, False
        if there is None:
            db.execute("INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?)", (name, *run[1:]))
            return name, True
    raise StoreError(f"merge: two runs are called {one_line(run[0], 80)} but differ")


def _copy(db: sqlite3.Connection, source: sqlite3.Connection, table: str, theirs: str, ours: str) -> tuple[int, int]:
    """Number of new rows of one run, and of rows that differ."""
    if not source.execute("SELECT 1 FROM sqlite_master WHERE name = ?", (table,)).fetchone():
        return 0, 0
    columns = [row[1] for row in db.execute(f"PRAGMA table_info({table})")]
    marks = ", ".join("?" * len(columns))
    where = " AND ".join(f"{name} = ?" for name in TABLES[table])
    came, other = 0, 0
    for row in source.execute(f"SELECT {', '.join(columns)} FROM {table} WHERE run = ?", (theirs,)):
        mine = (ours, *row[1:])
        came += db.execute(f"INSERT OR IGNORE INTO {table} VALUES ({marks})", mine).rowcount
        key = tuple(mine[columns.index(name)] for name in TABLES[table])
        other += db.execute(f"SELECT * FROM {table} WHERE {where}", key).fetchone() != mine
    return came, other


@dataclass(frozen=True)
class Rules:
    """Rules for deletion; without any rule nothing is deleted.

    Parameters
    ----------
    keep
        Number of newest runs that are kept of each title.
    days
        Delete runs older than this.
    unfinished
        Delete interrupted runs, and damaged ones.
    recordings
        Delete replay data of all runs except the newest of each title, not the runs.
    """

    keep: int | None = None
    days: float | None = None
    unfinished: bool = False
    recordings: bool = False


def doomed(runs: Iterable[Run], rules: Rules, now: datetime | None = None) -> list[Run]:
    """Runs that the rules delete; the newest finished run of each title always stays."""
    runs = list(runs)
    now = now or datetime.now(UTC)
    newest = {run.title: run.id for run in runs if run.finished}
    place: dict[str, int] = {}
    going = []
    for run in reversed(runs):
        place[run.title] = place.get(run.title, 0) + 1
        if newest.get(run.title) == run.id:
            continue
        old = rules.days is not None and now - datetime.fromisoformat(run.date) > timedelta(days=rules.days)
        beyond = rules.keep is not None and place[run.title] > rules.keep
        if old or beyond or (rules.unfinished and not run.finished):
            going.append(run)
    return going[::-1]


def prune(store: Store, rules: Rules, now: datetime | None = None) -> list[Run]:
    """Delete by the rules and free the disk space; returns the deleted runs."""
    damaged = store.damaged() if rules.unfinished else {}
    runs = store.runs()
    going = doomed(runs, rules, now)
    newest = {run.title: run.id for run in runs if run.finished}
    with store.writing() as db:
        for run in going:
            for table in TABLES:
                db.execute(f"DELETE FROM {table} WHERE run = ?", (run.id,))
            db.execute("DELETE FROM runs WHERE id = ?", (run.id,))
        for number in damaged:
            for table in TABLES:
                db.execute(f"DELETE FROM {table} WHERE run = (SELECT id FROM runs WHERE rowid = ?)", (number,))
            db.execute("DELETE FROM runs WHERE rowid = ?", (number,))
        if rules.recordings:
            kept = ", ".join("?" * len(newest))
            db.execute(f"DELETE FROM recordings WHERE run NOT IN ({kept})", tuple(newest.values()))
    store.compact()
    return [*going, *damaged.values()]
