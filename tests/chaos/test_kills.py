"""A run that is killed at random moments, again and again, ends with the bits of one that was left alone."""

import os
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest
from click.testing import CliRunner

from reports import exports, progress
from reports.command import main
from validation.records.store import Store

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="kills processes and reads /proc")
ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-m", "reports.command", "run", "impact", "bounce", "--dim", "2", "--engine", "chipmunk",
           "--jobs", "2"]  # fmt: skip
#: Fields of a row that say when it was made, not what came out.
VOLATILE = ("run", "wall_time_s")


def bits(folder):
    rows = [row.as_dict() for row in exports.load_rows(folder)]
    return [{key: value for key, value in row.items() if key not in VOLATILE} for row in rows]


def workers_of(pid):
    """Processes that a command has started."""
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def listening():
    """Let a command end on Ctrl-C although the tests run in the background, where a shell has it ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    started = time.monotonic()
    done = subprocess.run([*COMMAND, "--out", str(folder)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    return bits(folder), time.monotonic() - started


def test_finished_results_after_kills_at_random_moments(dice, soak, every, tmp_path, undisturbed):
    expected, seconds = undisturbed
    for _ in range(60 if soak else 5 if every else 1):
        process = subprocess.Popen([*COMMAND, "--out", str(tmp_path)], cwd=ROOT, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL, preexec_fn=listening)  # fmt: skip
        time.sleep(dice.uniform(0.0, 0.9 * seconds))
        workers = workers_of(process.pid)
        process.send_signal(dice.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT)))
        process.wait(timeout=60)
        deadline = time.monotonic() + 30.0
        while any(map(is_running, workers)) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not [pid for pid in workers if is_running(pid)], "a worker has outlived its run"
    done = subprocess.run([*COMMAND, "--out", str(tmp_path)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    store = Store(tmp_path, create=False)
    runs = store.runs()
    store.close()
    assert runs[-1].finished
    assert bits(tmp_path) == expected


@pytest.mark.parametrize("command", ["run", "sweep"])
def test_a_kill_before_the_files_of_a_finished_run(tmp_path, monkeypatch, command):
    """The same command writes them, and runs no case again."""
    words = [command, "impact", "--dim", "2", "--engine", "chipmunk", "--profile", "tuned", "--out", str(tmp_path)]
    words += ["--param", "v=2"] if command == "run" else ["--grid", "v=1:2:2"]
    module, name = (exports, "write_all") if command == "run" else (import_module("reports.command.sweeping"), "csv_of")

    def killed(*given):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(module, name, killed)
        assert CliRunner().invoke(main, words).exit_code == 130
    monkeypatch.setattr(progress, "run_cells", lambda todo, *rest, **more: iter([]) if not todo else killed())
    again = CliRunner().invoke(main, words)
    assert again.exit_code == 0, again.output
    (run,) = Store(tmp_path, create=False).runs()
    assert run.finished and (tmp_path / ("rows.jsonl" if command == "run" else "sweep.csv")).stat().st_size > 0


def test_processes_of_an_engine_ended_with_a_killed_run(faulty, tmp_path):
    """The engine's own child, in a session of its own, while the engine hangs."""
    (faulty / "faulty_engine.py").write_text(
        (faulty / "faulty_engine.py").read_text().replace(
            "def hang():\n", 'def hang():\n    subprocess.Popen(["sleep", "4711"])\n'
        )
    )  # fmt: skip
    command = [sys.executable, "-m", "reports.command", "run", "impact", "--param", "v=2", "--dim", "2", "--engine",
               "faulty", "--profile", "hang", "--out", str(tmp_path)]  # fmt: skip
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    sleepers = wait_for(lambda: running("sleep\x004711") or process.poll() is not None, 300.0)
    assert sleepers and process.poll() is None, "the engine was never asked"
    process.kill()
    process.wait()
    wait_for(lambda: not running("sleep\x004711"), 30.0)
    left = running("sleep\x004711")
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert not left


def wait_for(found, seconds):
    deadline = time.monotonic() + seconds
    while not (value := found()) and time.monotonic() < deadline:
        time.sleep(0.05)
    return value


def running(command):
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            if Path(f"/proc/{pid}/cmdline").read_text().startswith(command) and is_running(int(pid)):
                found.append(int(pid))
        except OSError:
            continue
    return found
