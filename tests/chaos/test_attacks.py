"""Attacks from outside: killed workers, two runs on one folder, copies in mid-write, a clock that jumps back."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from test_kills import bits, is_running, workers_of

from validation.cells import Observation, Outcome, Slot
from validation.records import store as storing
from validation.records.keeping import Rules, prune
from validation.records.store import FILE, Store, StoreError
from validation.running.execution import execute
from validation.workers import run_cells

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="kills processes and reads /proc")
ROOT = Path(__file__).resolve().parents[2]
DT = 1.0 / 240.0
SLOTS = [Slot("impact", (("v", float(v)),), 2, "chipmunk", "tuned", DT) for v in range(1, 9)]


@pytest.mark.parametrize("whose", ["the worker", "its guardian"])
def test_a_worker_that_is_killed_from_outside(dice, whose):
    """It costs the case that it ran, which says so; the others have their bits."""
    expected = {slot: execute(slot).state_hash for slot in SLOTS}
    before = set(workers_of(os.getpid()))  # of tests that ran in this process
    cells, found = run_cells(SLOTS, jobs=1), []
    killed_at = dice.randrange(1, len(SLOTS) - 1)
    for observation in cells:
        found.append(observation)
        if len(found) == killed_at:
            started = set(workers_of(os.getpid())) - before
            guardians = [pid for pid in started if workers_of(pid) and is_running(pid)]
            (worker,) = [child for pid in guardians for child in workers_of(pid)]
            os.kill(worker if whose == "the worker" else guardians[0], signal.SIGKILL)
    assert [each.slot for each in found] == SLOTS
    lost = [each for each in found if each.outcome is not Outcome.OK]
    assert len(lost) <= 1 and all("SIGKILL" in each.reason for each in lost)
    assert all(each.state_hash == expected[each.slot] for each in found if each not in lost)
    ends = time.monotonic() + 15.0
    while is_running(worker) and time.monotonic() < ends:  # its guardian's end takes it along a moment later
        time.sleep(0.01)
    assert not is_running(worker)


def test_two_runs_on_one_folder(tmp_path):
    """At the same time, of the same plan: every row is there once, with the bits of a run that was left alone."""
    command = [sys.executable, "-m", "reports.command", "run", "impact", "--dim", "2", "--engine", "chipmunk",
               "--jobs", "1", "--out"]  # fmt: skip
    alone = subprocess.run([*command, str(tmp_path / "alone")], cwd=ROOT, capture_output=True, text=True)
    both = [subprocess.Popen([*command, str(tmp_path / "both")], cwd=ROOT, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True) for _ in range(2)]  # fmt: skip
    said = [each.communicate(timeout=600) for each in both]
    assert [each.returncode for each in both] == [alone.returncode] * 2, said
    assert not any("Traceback" in text for each in said for text in each)
    store = Store(tmp_path / "both", create=False)
    assert all(run.finished and not store.missing(run) for run in store.runs())
    assert all([row for row in bits(tmp_path / "both")] == bits(tmp_path / "alone") for _ in store.runs())


def test_a_copy_of_a_store_in_mid_write(tmp_path):
    """File and log are copied one after the other: the copy has rows as they were written, or is refused in a line."""
    made = [Observation(slot, "c", 1, "1", Outcome.OK, readback={"long": ["x" * 100] * 200}) for slot in SLOTS]
    begun, done = threading.Event(), threading.Event()

    def write():
        store = Store(tmp_path)
        for k in range(30):
            run, _ = store.start(f"run {k}", SLOTS, fresh=True)
            for observation in made:
                store.add(run, observation)
            store.finish(run)
            begun.set()
        store.close()
        done.set()

    writer = threading.Thread(target=write)
    writer.start()
    begun.wait(60.0)
    read = 0
    for k in range(1000):
        folder = tmp_path / f"copy {k}"
        folder.mkdir()
        for name in (FILE, f"{FILE}-wal"):
            with suppress(FileNotFoundError):  # the log goes when the store is closed
                shutil.copy(tmp_path / name, folder)
        try:
            copy = Store(folder)
            rows = [observation for run in copy.runs() for observation in copy.observations(run)]
            copy.close()
            assert all(row in made for row in rows)
            read += bool(rows)
        except StoreError as error:
            assert "\n" not in str(error)
        if done.is_set():
            break
    writer.join()
    assert read and len(Store(tmp_path).runs()) == 30


def test_a_clock_that_jumps_back(tmp_path, monkeypatch):
    """A run is resumed, the next one is the latest and has an id of its own, and none is too old."""
    now = [datetime(2030, 1, 1, tzinfo=UTC)]

    class Clock(datetime):
        @classmethod
        def now(cls, tz=None):
            return now[0]

    monkeypatch.setattr(storing, "datetime", Clock)
    store = Store(tmp_path)
    first, _ = store.start("test", SLOTS)
    store.add(first, Observation(SLOTS[0], "c", 1, "1", Outcome.OK))
    now[0] -= timedelta(days=10_000)
    again, done = store.start("test", SLOTS)
    assert again == first and done == {SLOTS[0].key()}
    store.finish(again)
    second, _ = store.start("test", SLOTS)
    third, _ = store.start("test", SLOTS, fresh=True)
    assert len({first.id, second.id, third.id}) == 3 and store.run().id == third.id
    assert [run.id for run in store.runs()] == [first.id, second.id, third.id]
    assert prune(store, Rules(days=1.0), now[0]) == []
