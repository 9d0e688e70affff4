"""Stores of several machines become one without losing or doubling a row; what is too old goes by rules."""

import hashlib
import sqlite3
from datetime import UTC, datetime, timedelta

import pytest

from validation.cells import Observation, Outcome, Slot
from validation.records import store as storing
from validation.records.keeping import TABLES, Rules, _copy, doomed, merge, prune
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


def test_merge_of_all_tables_of_runs(tmp_path):
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


def test_runs_of_one_id_from_two_machines_merged(tmp_path, monkeypatch):
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


def test_common_run_completed_and_ours_kept_at_differences(tmp_path, monkeypatch):
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


def test_store_that_cannot_be_merged_unchanged(tmp_path, monkeypatch):
    ours = filled(tmp_path / "a", "one", monkeypatch)
    before = contents(ours)
    with pytest.raises(StoreError, match="is the same store"):
        merge(ours, tmp_path / "a")
    with pytest.raises(StoreError, match="no results"):
        merge(ours, tmp_path / "nothing")
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / storing.FILE).write_bytes(b"no database" * 1000)
    with pytest.raises(StoreError):
        merge(ours, tmp_path / "b")
    assert contents(ours) == before


def test_run_id_of_another_machine(tmp_path, monkeypatch):
    """The id is that of the run and six digits of what it is, at most 63 characters; which it is does not change."""
    ours = filled(tmp_path / "a", "one", monkeypatch)
    long = "r" * 60
    for k, machine in enumerate(("one", "two", "two")):
        store = ours if k == 0 else filled(tmp_path / f"b{k}", machine, monkeypatch)
        db = sqlite3.connect(store.path)
        for table, column in (("runs", "id"), *((table, "run") for table in TABLES)):
            db.execute(f"UPDATE {table} SET {column} = ?", (long,))
        if k == 2:  # the same id once more, and of it the id that is made: somebody else's
            db.execute("UPDATE runs SET date = '2020-01-01T00:00:00+00:00'")
        db.commit()
    merge(ours, tmp_path / "b1")
    (_, second) = ours.runs()
    identity = sqlite3.connect(ours.path).execute("SELECT date, machine, plan FROM runs WHERE id = ?", (second.id,))
    digest = hashlib.sha256(repr(identity.fetchone()).encode()).hexdigest()[:6]
    assert second.id == f"{long[:56]}-{digest}"
    merge(ours, tmp_path / "b2")
    assert len({run.id for run in ours.runs()}) == 3
    db = sqlite3.connect(ours.path)
    db.execute("UPDATE runs SET date = '2019-01-01T00:00:00+00:00' WHERE id != ?", (long,))
    db.commit()
    with pytest.raises(StoreError, match=f"^merge: two runs are called {long} but differ$"):
        merge(ours, tmp_path / "b1")


def test_refusal_of_a_name_of_any_length(tmp_path, monkeypatch):
    ours = filled(tmp_path / "a", "one", monkeypatch)
    filled(tmp_path / "b", "two", monkeypatch)
    for folder in ("a", "b"):
        db = sqlite3.connect(tmp_path / folder / storing.FILE)
        db.execute("UPDATE runs SET id = ?", ("r" * 200,))
        db.commit()
    with pytest.raises(StoreError, match=r"is damaged \(id\)$") as caught:
        merge(ours, tmp_path / "b")
    assert len(str(caught.value)) < 500


def test_finished_state_of_a_run_in_either_store(tmp_path, monkeypatch):
    for here in (True, False):
        ours = filled(tmp_path / f"a{here}", "one", monkeypatch, finish=True)
        ours.close()
        (tmp_path / f"b{here}").mkdir()
        (tmp_path / f"b{here}" / storing.FILE).write_bytes(ours.path.read_bytes())
        open_one = ours.path if not here else tmp_path / f"b{here}" / storing.FILE
        db = sqlite3.connect(open_one)
        db.execute("UPDATE runs SET finished = 0")
        db.commit()
        ours = Store(tmp_path / f"a{here}")
        merge(ours, tmp_path / f"b{here}")
        assert [run.finished for run in ours.runs()] == [True]


def test_merge_of_a_store_without_a_later_table(tmp_path, monkeypatch):
    ours = filled(tmp_path / "a", "one", monkeypatch)
    filled(tmp_path / "b", "two", monkeypatch).close()
    db = sqlite3.connect(tmp_path / "b" / storing.FILE)
    db.execute("DROP TABLE protocols")
    db.commit()
    db.close()
    source = sqlite3.connect(tmp_path / "b" / storing.FILE)
    with ours.writing() as here:
        assert _copy(here, source, "protocols", "any", "any") == (0, 0)


def test_store_that_breaks_while_it_is_read(tmp_path, monkeypatch):
    from validation.records import keeping

    ours = filled(tmp_path / "a", "one", monkeypatch)
    filled(tmp_path / "b", "two", monkeypatch)

    def breaks(db, source):
        with pytest.raises(sqlite3.OperationalError, match="readonly"):
            source.execute("DELETE FROM runs")
        raise sqlite3.DatabaseError("disk image\nof 3 lines")

    monkeypatch.setattr(keeping, "_merged", breaks)
    with pytest.raises(StoreError, match=r"^merge: cannot read .*b/\S+: disk image[^\n]*$"):
        merge(ours, tmp_path / "b")


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
def test_pruning_rules_and_newest_run_of_a_title(rules, going):
    assert "".join(each.id for each in doomed(RUNS, rules, NOW)) == going


def test_rows_and_room_of_pruned_runs(tmp_path, monkeypatch):
    store = filled(tmp_path, "one", monkeypatch, [0.1 * k for k in range(40)])
    store.compact()
    size = store.path.stat().st_size
    newest = store.runs()[-1].id
    gone = prune(store, Rules(keep=1))
    assert len(gone) == 39 and [each.id for each in store.runs()] == [newest]
    assert {row[0] for rows in (contents(store)[table] for table in TABLES) for row in rows} == {newest}
    assert store.path.stat().st_size < size


def test_recordings_of_the_newest_finished_run_per_title(tmp_path, monkeypatch):
    store = filled(tmp_path, "one", monkeypatch, (0.1, 0.2))
    other, _ = store.start("quick: bounce", SLOTS, fresh=True)
    store.finish(other)
    last, _ = store.start("quick: impact", SLOTS, fresh=True)  # not finished: it is no newest
    with store.writing() as db:
        for each in store.runs():
            db.execute("INSERT INTO recordings VALUES (?, 's', '{}', x'00')", (each.id,))
    first, second, *_ = store.runs()
    assert prune(store, Rules()) == [] and len(contents(store)["recordings"]) == 4
    assert prune(store, Rules(recordings=True)) == []
    assert {row[0] for row in contents(store)["recordings"]} == {second.id, other.id}
    assert first.id != second.id and last.id in {run.id for run in store.runs()}


def test_run_age_from_now_or_a_given_time(tmp_path, monkeypatch):
    store = filled(tmp_path, "one", monkeypatch, (0.1, 0.2))
    assert doomed(store.runs(), Rules(days=1)) == [] and len(doomed(store.runs(), Rules(days=-1))) == 1
    tomorrow = datetime.now(UTC) + timedelta(days=1.5)
    assert prune(store, Rules(days=2), tomorrow) == []
    assert len(prune(store, Rules(days=1), tomorrow)) == 1


def test_run_of_exactly_the_rule_s_age_kept():
    assert doomed([run(1, days=3), run(2)], Rules(days=3), NOW) == []
