"""The store keeps every finished cell at once, resumes an unfinished plan, and never drops a second run."""

import pytest

from validation.cells import Observation, Outcome, Slot
from validation.records import store as store_module
from validation.records.store import SCATTER_TITLE, Store, StoreError

SLOTS = [Slot("impact", (("v", v),), 2, "chipmunk", "tuned", 1 / 240) for v in (1.0, 2.0, 3.0)]


def observed(slot, value=0.8):
    return Observation(slot, "cell", 1, "7.3.1", Outcome.OK, metrics={"rebound_ratio": (value, "")}, state_hash="ab")


def test_stored_results_equal_and_in_plan_order(tmp_path):
    store = Store(tmp_path)
    run, done = store.start("test", SLOTS)
    assert done == set()
    for slot in reversed(SLOTS):
        store.add(run, observed(slot))
    assert store.observations(run) == [observed(slot) for slot in SLOTS]


def test_unfinished_run_resumed_and_finished_one_not(tmp_path):
    first = Store(tmp_path)
    run, _ = first.start("test", SLOTS)
    first.add(run, observed(SLOTS[0]))  # not closed: as after kill -9
    second = Store(tmp_path)
    resumed, done = second.start("test", SLOTS)
    assert (resumed.id, done) == (run.id, {SLOTS[0].key()})
    second.finish(resumed)
    third, done = second.start("test", SLOTS)
    assert third.id != run.id
    assert done == set()
    second.add(third, observed(SLOTS[0], 0.7))
    assert [r.id for r in second.runs()] == [run.id, third.id]
    assert second.observations(run)[0].metrics["rebound_ratio"][0] == 0.8


def test_other_plan_as_another_run(tmp_path):
    store = Store(tmp_path)
    first, _ = store.start("test", SLOTS)
    second, _ = store.start("test", SLOTS[:2])
    assert first.id != second.id


def test_run_of_the_same_plan_by_other_code(tmp_path, monkeypatch):
    store = Store(tmp_path)
    first, _ = store.start("test", SLOTS)
    store.add(first, observed(SLOTS[0]))
    monkeypatch.setattr("validation.records.store.code_hash", lambda asked: "other code")
    second, done = store.start("test", SLOTS)
    assert second.id != first.id
    assert done == set()


def test_runs_before_the_latest(tmp_path):
    store = Store(tmp_path)
    first = store.start("quick: impact", SLOTS, fresh=True)[0]
    for title in (f"{SCATTER_TITLE}{first.id}", "bench quick: impact", "release toy==1: impact"):
        store.start(title, SLOTS, fresh=True)
    last = store.start("quick: bounce", SLOTS, fresh=True)[0]
    assert [store.run(name).id for name in ("latest", "latest~0", "latest~1")] == [last.id, last.id, first.id]
    for name in ("latest~2", "latest~", "latest~-1"):
        with pytest.raises(StoreError, match="no run 'latest~"):
            store.run(name)


def test_run_of_moved_starts_as_latest_only_alone(tmp_path):
    store = Store(tmp_path)
    first, _ = store.start("quick: impact", SLOTS)
    store.finish(first)
    second, _ = store.start(f"{SCATTER_TITLE}{first.id}", SLOTS)
    assert store.run().id == first.id != second.id
    assert store.run(second.id).id == second.id


def test_line_for_missing_results_and_runs(tmp_path):
    with pytest.raises(StoreError, match="there are no results"):
        Store(tmp_path / "nowhere", create=False)
    store = Store(tmp_path)
    with pytest.raises(StoreError, match="no run 'x'"):
        store.run("x")
    there, _ = store.start("test", SLOTS)
    with pytest.raises(StoreError, match=f"no run 'x' in .*; it has {there.id}$"):
        store.run("x")  # not the one that is there


def test_runs_by_id_and_the_last_without(tmp_path):
    store = Store(tmp_path)
    ids = [store.start(title, SLOTS, fresh=True)[0].id for title in ("one", "two", "three")]
    assert len(set(ids)) == 3
    assert [store.run(run).id for run in ids] == ids and store.run().id == store.run("latest").id == ids[-1]
    assert [store.run(run).title for run in ids] == ["one", "two", "three"]


def test_refusal_of_a_file_that_is_no_store(tmp_path):
    (tmp_path / "results.sqlite").write_text("this is not a database, but long enough to look like one" * 20)
    with pytest.raises(StoreError, match="out: cannot use"):
        Store(tmp_path)


def test_write_to_a_closed_store(tmp_path):
    store = Store(tmp_path)
    store.compact()
    store.close()
    with pytest.raises(StoreError, match=r"^out: cannot write .*results"):
        store.compact()


@pytest.mark.parametrize("name", ["a b", "x" * 200 + "\n", "20260101-000000\n", "", "20260101-000000; DROP"])
def test_invalid_run_id(name):
    row = [name, "2026-01-01T00:00:00+00:00", "abc", "{}", "title", "[]", 1]
    with pytest.raises(ValueError, match=r"^run '.{0,80}' is damaged \(id\)$") as error:
        store_module.run_of(row)
    assert name[:3].strip() in str(error.value)
    row = ["20260101-000000", row[1], "abc\x07", '{"cpu": "x\\u0007"}', "ti\ntle", '["a"]', 1]
    sound = store_module.run_of(row)
    machine = dict.fromkeys(("cores", "memory_gib", "system", "python"), "unknown") | {"cpu": r"x\u{7}"}
    assert sound == store_module.Run("20260101-000000", row[1], r"abc\u{7}", machine, "ti", ("a",), True)
    assert store_module.run_of([*row[:-1], 0]).finished is False
