"""Stores of several machines become one without losing or doubling a row; what is too old goes by rules."""

import sqlite3
from datetime import UTC, datetime, timedelta

import pytest

from validation.cells import Observation, Outcome, Slot
from validation.records import store as storing
from validation.records.keeping import TABLES, Rules, doomed, merge, prune
from validation.records.store import Run, Store, StoreError

SLOTS = [Slot("impact", (("v", float(v)),), 2, "chipmunk", "tuned", 1 / 240) for v in range(1, 5)]


def observation(slot, value=0.5):
    return Observation(slot, "c", 1, "1", Outcome.OK, metrics={"rebound_ratio": (value, "")})


def filled(folder, machine, monkeypatch, values=(0.5,), finish=True):
    """A store with a run per value, made on that machine."""
    monkeypatch.setattr(storing, "machine", lambda: {"cpu": machine})
    store = Store(folder)
    for value in values:
        run, _ = store.start("quick: impact", SLOTS, fresh=True)
        for slot in SLOTS:
            store.add(run, observation(slot, value))
        store.set_protocol(run, {"value": value})
        if finish:
            store.finish(run)
    return store


def contents(store):
    db = sqlite3.connect(store.path)
    rows = {table: sorted(db.execute(f"SELECT * FROM {table}").fetchall()) for table in TABLES}
    return rows | {"runs": sorted(db.execute("SELECT * FROM runs").fetchall())}


def test_every_table_of_a_store_that_belongs_to_runs_is_merged(tmp_path):
    store = Store(tmp_path)
    query = "SELECT name FROM sqlite_master WHERE type = 'table'"
    names = {row[0] for row in sqlite3.connect(store.path).execute(query)}
    assert names == {*TABLES, "runs"}
    for table, key in TABLES.items():
        info = sqlite3.connect(store.path).execute(f"PRAGMA table_info({table})").fetchall()
        assert info[0][1] == "run" and {row[1] for row in info if row[5]} == set(key)


def test_runs_of_two_machines_stand_side_by_side(tmp_path, monkeypatch):
    ours = filled(tmp_path / "a", "one", monkeypatch, (0.5, 0.6))
    theirs = filled(tmp_path / "b", "two", monkeypatch, (0.7,))
    found = merge(ours, tmp_path / "b")
    assert (found.runs, found.known, found.rows, found.differing) == (1, 0, 5, 0)
    values = {o.metrics["rebound_ratio"][0] for run in ours.runs() for o in ours.observations(run)}
    assert values == {0.5, 0.6, 0.7} and len(ours.runs()) == 3
    assert {run.machine["cpu"] for run in ours.runs()} == {"one", "two"}
    assert len(theirs.runs()) == 1


def test_merging_twice_adds_nothing(tmp_path, monkeypatch):
    ours = filled(tmp_path / "a", "one", monkeypatch)
    filled(tmp_path / "b", "two", monkeypatch)
    merge(ours, tmp_path / "b")
    before = contents(ours)
    found = merge(ours, tmp_path / "b")
    assert (found.runs, found.known, found.rows, found.differing) == (0, 1, 0, 0)
    assert contents(ours) == before


def test_runs_of_one_id_from_two_machines_are_both_kept(tmp_path, monkeypatch):
    """Two machines that start in the same second give the same id."""
    ours = filled(tmp_path / "a", "one", monkeypatch)
    theirs = filled(tmp_path / "b", "two", monkeypatch, (0.9,))
    db = sqlite3.connect(theirs.path)
    (there,) = theirs.runs()
    for table, column in (("runs", "id"), *((table, "run") for table in TABLES)):
        db.execute(f"UPDATE {table} SET {column} = ? WHERE {column} = ?", (ours.runs()[0].id, there.id))
    db.commit()
    for _ in range(2):
        merge(ours, tmp_path / "b")
        first, second = ours.runs()
        assert first.id != second.id and second.id.startswith(first.id)
        assert ours.observations(first)[0].metrics["rebound_ratio"][0] == 0.5
        assert ours.observations(second)[0].metrics["rebound_ratio"][0] == 0.9


def test_a_run_that_both_have_is_completed_and_ours_stays_where_they_differ(tmp_path, monkeypatch):
    store = filled(tmp_path / "a", "one", monkeypatch, finish=False)
    (tmp_path / "b").mkdir()
    store.close()
    (tmp_path / "b" / storing.FILE).write_bytes((tmp_path / "a" / storing.FILE).read_bytes())
    ours, theirs = Store(tmp_path / "a"), Store(tmp_path / "b")
    (run,) = ours.runs()
    sqlite3.connect(ours.path).execute("PRAGMA wal_checkpoint")
    db = sqlite3.connect(ours.path)
    db.execute("DELETE FROM observations WHERE slot = ?", (SLOTS[0].key(),))
    db.commit()
    theirs.add(run, observation(SLOTS[1], 0.1))
    theirs.finish(run)
    found = merge(ours, tmp_path / "b")
    assert (found.runs, found.known, found.rows, found.differing) == (0, 1, 1, 1)
    (run,) = ours.runs()
    assert run.finished and ours.missing(run) == 0
    assert {o.slot: o.metrics["rebound_ratio"][0] for o in ours.observations(run)} == dict.fromkeys(SLOTS, 0.5)


def test_what_cannot_be_merged_is_one_line_and_changes_nothing(tmp_path, monkeypatch):
    ours = filled(tmp_path / "a", "one", monkeypatch)
    before = contents(ours)
    with pytest.raises(StoreError, match="is the store itself"):
        merge(ours, tmp_path / "a")
    with pytest.raises(StoreError, match="no results"):
        merge(ours, tmp_path / "nothing")
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / storing.FILE).write_bytes(b"no database" * 1000)
    with pytest.raises(StoreError):
        merge(ours, tmp_path / "b")
    assert contents(ours) == before


NOW = datetime(2026, 11, 22, tzinfo=UTC)


def run(number, title="quick: a", days=0, finished=True):
    return Run(str(number), (NOW - timedelta(days=days)).isoformat(), "c", {}, title, (), finished)


RUNS = [run(1, days=40), run(2, days=30, finished=False), run(3, "bench: a", days=20), run(4, days=10), run(5, days=1)]


@pytest.mark.parametrize(
    ("rules", "going"),
    [(Rules(), ""), (Rules(keep=1), "124"), (Rules(keep=2), "12"), (Rules(keep=9), ""), (Rules(days=25), "12"),
     (Rules(days=0), "124"), (Rules(unfinished=True), "2"), (Rules(recordings=True), ""),
     (Rules(days=35, keep=3), "1")],
)  # fmt: skip
def test_rules_let_go_what_they_say_and_never_the_newest_of_a_title(rules, going):
    assert "".join(each.id for each in doomed(RUNS, rules, NOW)) == going


def test_pruned_runs_leave_no_row_and_give_their_room_back(tmp_path, monkeypatch):
    store = filled(tmp_path, "one", monkeypatch, [0.1 * k for k in range(40)])
    store.compact()
    size = store.path.stat().st_size
    newest = store.runs()[-1].id
    gone = prune(store, Rules(keep=1))
    assert len(gone) == 39 and [each.id for each in store.runs()] == [newest]
    assert {row[0] for rows in (contents(store)[table] for table in TABLES) for row in rows} == {newest}
    assert store.path.stat().st_size < size
