"""Cells on a Dask cluster: the rows of the local pool, whoever dies on the way."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from adapters.extras import install
from reports import exports
from reports.command import main
from validation.cells import Slot, slot_from_dict
from validation.records.store import Store, StoreError
from validation.workers import LimitError
from validation.workers.cluster import run_cells_on

pytest.importorskip("distributed", reason="pip install -e '.[dask]'")
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


@pytest.mark.long
# 5000 cells took eleven minutes both ways on two busy cores, more than a test is given otherwise.
@pytest.mark.timeout(7200 if os.environ.get("CROSSCHECK_SOAK") else 600)
def test_study_on_a_cluster_against_the_local_pool(tmp_path):
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


@pytest.mark.long
def test_every_cell_kept_after_a_dead_worker(cluster, undisturbed, tmp_path):
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


@pytest.mark.long
def test_resumed_run_after_a_dead_scheduler(cluster, undisturbed, tmp_path):
    out = tmp_path / "out"
    run = started(out, cluster.address)
    wait_for(lambda: finished_cells(out) >= 3)
    cluster.scheduler.kill()
    assert run.wait(timeout=300) == 4
    said = run.stderr.read()
    assert "the scheduler is gone; finished cases are kept, the same command resumes" in said
    kept = finished_cells(out)
    assert 3 <= kept < len({row["cells"][0] for row in undisturbed})
    done = CliRunner().invoke(main, [*SWEEP, "--jobs", "1", "--out", str(out)])  # or on another cluster, or here
    assert done.exit_code == 0 and f"{kept} of 40 cases done" in done.stderr
    assert bits(out) == undisturbed


@pytest.mark.long
def test_resumed_study_after_a_killed_parent(undisturbed, tmp_path):
    out = tmp_path / "out"
    run = started(out, "local:1")
    wait_for(lambda: finished_cells(out) >= 3)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    done = CliRunner().invoke(main, [*SWEEP, "--cluster", "local:1", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "cases done" in done.stderr and bits(out) == undisturbed


def test_scene_files_need_not_be_on_the_workers(tmp_path):
    """Their texts go with the batch; the file is gone before the cells run."""
    from validation import posed

    path = tmp_path / "drop.toml"
    text = (
        (ROOT / "docs/howto/own-scene.md").read_text().partition('```toml\nname = "sliding box"')[2].partition("```")[0]
    )
    path.write_text('name = "sliding box"' + text)
    name = posed.pinned(str(path))
    path.unlink()
    slot = Slot(name, (), 2, "chipmunk", "tuned", 1 / 240)
    (found,) = run_cells_on("local:1", [slot], 60.0, tmp_path / "cluster.jsonl")
    assert found.outcome.value == "ok" and found.slot == slot


def test_without_dask_the_line_that_installs_it(monkeypatch, tmp_path):
    monkeypatch.setattr("validation.workers.cluster.find_spec", lambda name: None)
    done = CliRunner().invoke(main, [*SWEEP, "--cluster", "local:1", "--out", str(tmp_path)])
    assert done.exit_code == 2 and install("dask") in done.output and "'distributed>=" in done.output


def test_missing_scheduler(tmp_path, monkeypatch):
    monkeypatch.setattr("validation.workers.cluster.SILENCE", 1.0)
    with pytest.raises(LimitError, match="does not answer"):
        list(run_cells_on("tcp://127.0.0.1:9", [Slot("impact", (), 2, "chipmunk", "tuned", 0.1)], 9.0, tmp_path / "j"))


def test_refusal_of_texts_that_are_no_table():
    for line in ('{"scenes": 1}', '{"scenes": {"a.toml@00000000": "x"}}', '{"scenes": '):
        done = CliRunner().invoke(main, ["run-cell", "--batch"], input=line + "\n")
        assert done.exit_code == 2 and json.loads(done.output.splitlines()[0])["error"]
