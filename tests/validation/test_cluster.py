"""Cells on a Dask cluster: the rows of the local pool, whoever dies on the way."""

import io
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from adapters.scene import SceneError
from reports import exports
from reports.command import main
from validation.cells import Observation, Outcome, Slot, prepare, slot_from_dict
from validation.records.store import Store, StoreError
from validation.workers import LimitError
from validation.workers.cluster import LEAST, MOST, MOST_LOST, _batches, _Driver, checked, run_cells_on

pytest.importorskip("distributed", reason="pip install 'contact-crosscheck[dask]'")
pytest.importorskip("pymunk")
ROOT = Path(__file__).resolve().parents[2]
STUDY = ["sweep", "impact", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2"]
SWEEP = [*STUDY, "--grid", "v=1:20:40"]
#: Fields of a row that say when it was made, not what came out.
VOLATILE = ("run", "wall_time_s")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="kills processes and reads /proc")


def bits(folder):
    rows = [row.as_dict() for row in exports.load_rows(folder)]
    return [{key: value for key, value in row.items() if key not in VOLATILE} for row in rows]


def journal(folder):
    return [json.loads(line) for line in (folder / "cluster.jsonl").read_text().splitlines()]


def wait_for(found, seconds=300.0):
    deadline = time.monotonic() + seconds
    while not (value := found()) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert value, "it did not come about in time"
    return value


def finished_cells(folder):
    try:
        store = Store(folder, create=False)
    except StoreError:  # it is not there yet
        return 0
    try:
        return len(store.observations(store.runs()[-1]))
    except (StoreError, IndexError):  # its tables or its run are not
        return 0
    finally:
        store.close()


class Scheduler:
    """A scheduler with workers, each a process that a test may kill."""

    def __init__(self, folder, workers):
        self.address = f"tcp://127.0.0.1:{self._port()}"
        port = self.address.rpartition(":")[2]
        self.scheduler = self._start(folder, "scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
        self.workers = [
            self._start(folder, "worker", self.address, "--no-nanny", "--nthreads", "1", "--no-dashboard")
            for _ in range(workers)
        ]

    @staticmethod
    def _port():
        import socket

        with socket.socket() as found:
            found.bind(("127.0.0.1", 0))
            return found.getsockname()[1]

    @staticmethod
    def _start(folder, *words):
        return subprocess.Popen([sys.executable, "-m", "dask", *words], cwd=folder, stdout=subprocess.DEVNULL,
                                stderr=subprocess.DEVNULL)  # fmt: skip

    def stop(self):
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path):
    made = Scheduler(tmp_path, 2)
    yield made
    made.stop()


def started(out, address):
    command = [sys.executable, "-m", "reports.command", *SWEEP, "--cluster", address, "--out", str(out)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    out = tmp_path_factory.mktemp("local")
    done = CliRunner().invoke(main, [*SWEEP, "--jobs", "1", "--out", str(out)])
    assert done.exit_code == 0, done.output
    return bits(out)


# 5000 cells took eleven minutes both ways on two busy cores, more than a test is given otherwise.
@pytest.mark.timeout(7200 if os.environ.get("CROSSCHECK_SOAK") else 600)
def test_a_study_has_the_rows_of_the_local_pool_and_runs_no_cell_twice(tmp_path):
    """As many batches as workers, and more; all 5000 cells under `make soak`'s switch. Prints how many a second."""
    count = 5000 if os.environ.get("CROSSCHECK_SOAK") else 120
    here, there = tmp_path / "here", tmp_path / "there"
    for out, where in ((here, ("--jobs", "2")), (there, ("--cluster", "local:2"))):
        begun = time.monotonic()
        done = CliRunner().invoke(main, [*STUDY, "--grid", f"v=1:20:{count}", *where, "--out", str(out)])
        assert done.exit_code == 0, done.output
        took = time.monotonic() - begun
        print(f"{' '.join(where)}: {count} cells in {took:.0f} s, {count / took:.1f} a second; load {os.getloadavg()}")
    rows = bits(here)
    asked = {slot_from_dict(row["slot"]).key() for row in rows}
    assert len(asked) == count and bits(there) == rows
    events = journal(there)
    ran = sorted(cell for event in events if event["event"] == "begun" for cell in event["cells"])
    assert ran == sorted(asked) and {event["event"] for event in events} == {"begun", "ended"}


def test_a_worker_that_dies_takes_nothing_along_and_every_cell_is_accounted_for(cluster, undisturbed, tmp_path):
    out = tmp_path / "out"
    run = started(out, cluster.address)
    wait_for(lambda: finished_cells(out) >= 3)
    begun = journal(out)[0]["worker"]
    cluster.workers[0].kill()
    assert run.wait(timeout=300) == 0, run.stderr.read()
    assert bits(out) == undisturbed
    events = journal(out)
    lost = [event for event in events if event["event"] in ("lost", "again")]
    ran = [cell for event in events if event["event"] == "begun" for cell in event["cells"]]
    again = {cell for cell in ran if ran.count(cell) > 1}
    assert begun and lost and again <= {cell for event in lost for cell in event["cells"]}


def test_a_scheduler_that_dies_loses_nothing_and_the_same_command_goes_on(cluster, undisturbed, tmp_path):
    out = tmp_path / "out"
    run = started(out, cluster.address)
    wait_for(lambda: finished_cells(out) >= 3)
    cluster.scheduler.kill()
    assert run.wait(timeout=300) == 4
    said = run.stderr.read()
    assert "the scheduler is gone; what finished is kept, the same command resumes" in said
    kept = finished_cells(out)
    assert 3 <= kept < len({row["cells"][0] for row in undisturbed})
    done = CliRunner().invoke(main, [*SWEEP, "--jobs", "1", "--out", str(out)])  # or on another cluster, or here
    assert done.exit_code == 0 and f"{kept} of 40 cells done" in done.stderr
    assert bits(out) == undisturbed


def test_a_parent_that_is_killed_goes_on_where_it_was(undisturbed, tmp_path):
    out = tmp_path / "out"
    run = started(out, "local:1")
    wait_for(lambda: finished_cells(out) >= 3)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    done = CliRunner().invoke(main, [*SWEEP, "--cluster", "local:1", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "cells done" in done.stderr and bits(out) == undisturbed


def test_scene_files_need_not_be_on_the_workers(tmp_path):
    """Their texts go with the batch; the file is gone before the cells run."""
    from validation import posed

    path = tmp_path / "drop.toml"
    text = (ROOT / "CONTRIBUTING.md").read_text().partition('```toml\nname = "sliding box"')[2].partition("```")[0]
    path.write_text('name = "sliding box"' + text)
    name = posed.pinned(str(path))
    path.unlink()
    slot = Slot(name, (), 2, "chipmunk", "tuned", 1 / 240)
    (found,) = run_cells_on("local:1", [slot], 60.0, tmp_path / "cluster.jsonl")
    assert found.outcome.value == "ok" and found.slot == slot


def test_batches_are_of_one_engine_and_neither_tiny_nor_huge():
    slots = [Slot("impact", (("v", float(k + 1)),), 2, e, "p", 0.1) for k in range(2000) for e in ("a", "b")]
    batches = list(_batches(slots, 2))
    assert sorted((s for batch in batches for s in batch), key=Slot.key) == sorted(slots, key=Slot.key)
    assert all(len({slot.engine for slot in batch}) == 1 and len(batch) <= MOST for batch in batches)
    assert [batch[0].engine for batch in batches[:4]] == ["a", "b", "a", "b"]
    assert len(next(_batches(slots[:LEAST], 64))) >= LEAST // 2


@pytest.mark.parametrize("address", ["", "local:0", "local:x", "http://a:1", "tcp://a", "tcp://a:b", "tcp://a b:1"])
def test_an_address_that_can_be_none_is_refused(address):
    with pytest.raises(SceneError, match="neither local:N nor tcp"):
        checked(address)


def test_without_dask_the_line_that_installs_it(monkeypatch, tmp_path):
    monkeypatch.setattr("validation.workers.cluster.find_spec", lambda name: None)
    done = CliRunner().invoke(main, [*SWEEP, "--cluster", "local:1", "--out", str(tmp_path)])
    assert done.exit_code == 2 and "pip install 'contact-crosscheck[dask]'" in done.output


def test_a_scheduler_that_is_not_there_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr("validation.workers.cluster.SILENCE", 1.0)
    with pytest.raises(LimitError, match="does not answer"):
        list(run_cells_on("tcp://127.0.0.1:9", [Slot("impact", (), 2, "chipmunk", "tuned", 0.1)], 9.0, tmp_path / "j"))


def test_texts_handed_to_run_cell_must_be_a_table():
    for line in ('{"scenes": 1}', '{"scenes": {"a.toml@00000000": "x"}}', '{"scenes": '):
        done = CliRunner().invoke(main, ["run-cell", "--batch"], input=line + "\n")
        assert done.exit_code == 2 and json.loads(done.output.splitlines()[0])["error"]


class Future:
    """What a cluster says of a batch: finished with a result, or lost with an error."""

    def __init__(self, result=None, error=None, status="finished"):
        self.status = "error" if error else status
        self._result, self._error = result, error

    def result(self):
        return self._result

    def exception(self):
        return self._error

    def add_done_callback(self, callback):
        pass

    def release(self):
        pass


class Client:
    """A cluster on which nothing runs: it remembers what was handed to it."""

    def __init__(self):
        self.status, self.handed = "running", []

    def submit(self, function, text, timeout, topic, name, **options):
        assert options["retries"] == 0 and options["pure"] is False
        self.handed.append([json.loads(line) for line in text.splitlines()[1:]])
        return Future()


@pytest.fixture
def driver():
    left = {}
    made = _Driver(Client(), io.StringIO(), 9.0, lambda slot, reason: left.__setitem__(slot, reason))
    made.left = left
    return made


def cells(count):
    return [Slot("impact", (("v", float(k + 1)),), 2, "chipmunk", "tuned", 1 / 240) for k in range(count)]


def answer(slot, **changed):
    found = Observation(slot, prepare(slot).cell.key(), 1, "7.3.1", Outcome.OK)
    return json.dumps(replace(found, **changed).as_dict())


def batch_of(driver, slots):
    driver._submit(list(slots))
    return f"{driver.topic}-{driver.made}"


def test_a_cell_that_comes_back_twice_counts_once(driver):
    (slot,) = cells(1)
    name = batch_of(driver, [slot])
    line = answer(slot)
    assert len(list(driver._heard({"batch": name, "line": line, "worker": "w"}))) == 1
    driver.futures[name] = Future({"lines": [line], "left": "", "said": "", "worker": "w"})
    assert list(driver._ended(name)) == [] and not driver.batches


def test_what_a_lost_batch_had_not_brought_back_is_asked_again_in_halves(driver):
    slots = cells(5)
    name = batch_of(driver, slots)
    driver._line(driver.batches[name], answer(slots[0]), "w").__next__()
    driver.futures[name] = Future(error=RuntimeError("its worker died"))
    assert list(driver._ended(name)) == []
    again = driver.client.handed[1:]
    assert [len(part) for part in again] == [2, 2]
    assert [each["params"]["v"] for part in again for each in part] == [2.0, 3.0, 4.0, 5.0]
    note = [json.loads(line) for line in driver.journal.getvalue().splitlines()][-1]
    assert note["event"] == "lost" and len(note["cells"]) == 4 and "its worker died" in note["reason"]


def test_a_cell_that_takes_its_worker_along_again_and_again_is_one_crash(driver):
    name = batch_of(driver, cells(1))
    for _ in range(MOST_LOST - 1):
        driver.futures[name] = Future(error=RuntimeError("gone"))
        assert list(driver._ended(name)) == []
        name = f"{driver.topic}-{driver.made}"
    driver.futures[name] = Future(error=RuntimeError("gone"))
    (found,) = driver._ended(name)
    assert found.outcome is Outcome.CRASHED and "lost with its worker 3 times" in found.reason
    assert not driver.batches


def test_cells_that_a_batch_left_are_left_and_not_asked_again(driver):
    slots = cells(2)
    name = batch_of(driver, slots)
    driver.futures[name] = Future({"lines": [], "left": "left: it timed out 3 times", "said": "", "worker": "w"})
    assert list(driver._ended(name)) == [] and len(driver.client.handed) == 1
    assert driver.left == dict.fromkeys(slots, "left: it timed out 3 times")


def test_a_worker_with_other_code_is_refused(driver):
    (slot,) = cells(1)
    name = batch_of(driver, [slot])
    with pytest.raises(LimitError, match="has other code than this machine"):
        list(driver._heard({"batch": name, "line": answer(slot, cell="0" * 16, engine_version="7.0"), "worker": "w"}))


def test_a_batch_that_begins_a_second_time_is_in_the_journal(driver):
    name = batch_of(driver, cells(2))
    for worker in ("a", "b"):
        list(driver._heard({"batch": name, "begun": worker}))
    notes = [json.loads(line) for line in driver.journal.getvalue().splitlines()]
    assert [(note["event"], note["worker"], len(note["cells"])) for note in notes] == [
        ("begun", "a", 2),
        ("again", "b", 2),
    ]


@pytest.mark.parametrize("line", ["", "{", '{"slot": 1}', "[]", '{"line": 1, "error": "left"}'])
def test_half_a_line_of_a_process_that_died_is_no_observation(driver, line):
    name = batch_of(driver, cells(1))
    assert list(driver._line(driver.batches[name], line, "w")) == [] and len(driver.batches[name].slots) == 1
