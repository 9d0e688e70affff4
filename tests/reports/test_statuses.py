"""Exit statuses: one table, in the documentation as in the code, and each one reached by what it says."""

import json
import os
import re
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from reports.command import main, selection, statuses
from validation.records.store import FILE, VERSION

ROOT = Path(__file__).resolve().parents[2]
SMALL = ["run", "impact", "--param", "v=6", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2", "--jobs", "1"]


def call(*arguments, **kwargs):
    return CliRunner().invoke(main, [str(a) for a in arguments], **kwargs)


def one_line(result):
    assert "Traceback" not in result.output
    lines = [line for line in result.stderr.splitlines() if line.startswith("crosscheck:")]
    assert len(lines) == 1, result.output
    return lines[0]


def test_the_documentation_has_the_table_of_the_code():
    rows = dict(re.findall(r"^\| (\d+) \| (.+?) \|$", (ROOT / "docs/reference/status.md").read_text(), re.MULTILINE))
    assert {int(status): meaning for status, meaning in rows.items()} == statuses.MEANING


def test_status_of_a_healthy_run_and_a_crash(plugins, tmp_path):
    assert call(*SMALL, "--out", tmp_path / "a").exit_code == statuses.FINE
    crash = call("run", "impact", "--param", "v=6", "--dim", 2, "--engine", "evil", "--profile", "raise", "--out",
                 tmp_path / "b")  # fmt: skip
    assert crash.exit_code == statuses.ALARM


@pytest.mark.parametrize("seconds", ["nan", "inf", "0", "-1", "1e9", "soon"])
def test_invalid_time_limit_as_a_wrong_call(tmp_path, seconds):
    result = call(*SMALL, "--timeout", seconds, "--out", tmp_path / "out")
    assert result.exit_code == statuses.WRONG_CALL
    assert "seconds" in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "command",
    [name for name in main.list_commands(None) if "jobs" in {p.name for p in main.get_command(None, name).params}],
)
def test_more_workers_than_cores_refused(command):
    """A number that was meant for another option started processes until the machine had none left."""
    (jobs,) = (each for each in main.get_command(None, command).params if each.name == "jobs")
    assert jobs.type.max == selection.MOST_JOBS <= 4096
    asked = {"bisect": ["chipmunk", "7.0.0..7.3.1"], "cure": ["chipmunk", "stack"], "tune": ["chipmunk"],
             "releases": ["chipmunk", "7.3.1"], "sweep": ["impact", "--grid", "e=0:1:3"]}  # fmt: skip
    result = call(command, *asked.get(command, []), "--jobs", selection.MOST_JOBS + 1)
    assert result.exit_code == statuses.WRONG_CALL
    assert one_line(result).startswith("crosscheck: jobs: 4097 is not in the range")


LONG = 300 * "x"
SWEEP = ["sweep", "impact", "--engine", "chipmunk"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["explain", "chipmunk/default/impact", "--run", ""], "run: is empty"),
        (["explain", ""], "CHECK: is empty"),
        (["show", ""], "RUN: is empty"),
        (["findings", "--prove", ""], "prove: is empty"),
        (["accept", "--engine", "chipmunk", "--family", ""], "family: is empty"),
        (["run", "impact", "--cluster", ""], "cluster: is empty"),
        (["run", "impact", "--junit", f"{LONG}.xml"], f"junit: {LONG[:40]}...: File name too long"),
        (["run", "impact", "--out", LONG], f"out: {LONG[:40]}...: File name too long"),
        (["run", "impact", "--iterations", "0"], "iterations: 0 is not in the range 1<=x<=1000000"),
        (["run", "impact", "--absent"], "No such option '--absent'"),
        ([*SWEEP, "--samples", "-1"], "samples: belongs to --random and --sobol"),
        ([*SWEEP, "--random", "e=0:1", "--samples", "-1"], "samples: -1 must be a whole number in [1, 131072]"),
        ([*SWEEP, "--samples", "many"], "samples: 'many' is not a valid integer"),
        ([*SWEEP, "--csv", f"{LONG}.csv"], f"csv: {LONG[:40]}...: File name too long"),
        (["report", "-o", LONG], f"output: {LONG[:40]}...: File name too long"),
        (["merge", LONG], f"FOLDER: {LONG[:40]}...: File name too long"),
        (["merge"], "FOLDER: is missing"),
        (["export", "impact", "--to", "python", "--engine", "chipmunk", "--profile", ""], "profile: is empty"),
        (["schema", "-o", LONG], f"output: {LONG[:40]}...: File name too long"),
        (["schema", "-o", ""], "output: is empty"),
        (["new-adapter", "mine", "--into", ""], "into: is empty"),
        (["new-adapter", "mine", "--into", LONG], f"into: {LONG[:40]}...: File name too long"),
        (["describe", "impact", "--measure"], "measure: impact is no engine"),
        (["list", "absent"], "'absent' is not one of"),
        (["list", "checks", "--sensitivity", "--engine", "absent"], "engine: there is no engine called 'absent'"),
        (["frontier", "thin_wall", "--engine", "chipmunk", "--profile", "absent"], "scenes: no breaking point fits"),
        (["cure", "chipmunk", "impact", "--param", "e=9"], "impact.e: 9 must lie in [0, 1]"),
        (["tune", "bullet", "--profile", "absent"], "profile: bullet has no profile 'absent', only"),
        (["releases", "--environments", "--remove", ""], "remove: is empty"),
        (["ports", "mujoco", "--release", ""], "release: is empty"),
        (["prune", "--older-than", "soon"], "older-than: 'soon' is not a number of days"),
        (["absent"], "No such command 'absent'"),
        (["--absent"], "No such option '--absent'"),
    ],
)
def test_wrong_word_in_one_line_that_names_it(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = call(*words)
    assert result.exit_code == statuses.WRONG_CALL and not result.stdout
    assert len(result.stderr.splitlines()) == 1 and said in one_line(result)
    assert not list(tmp_path.iterdir())


def test_call_without_a_command_as_the_list_of_commands():
    result = call()
    assert result.exit_code in (0, statuses.WRONG_CALL) and "Start here:" in result.output


@pytest.mark.parametrize("command", ["run", "bench", "compile", "residuals"])
def test_two_suites_at_once_are_refused(command, tmp_path):
    """The last one won: neither is what was asked for."""
    result = call(command, "bounce", "--full", "--quick")
    assert result.exit_code == statuses.WRONG_CALL
    assert one_line(result) == "crosscheck: --quick and --full: a run is of one suite"


@pytest.mark.parametrize("command", ["run", "show", "findings"])
def test_a_results_folder_without_a_name_is_refused(command):
    """It was the folder that one was in: a variable that is not set filled it with results."""
    result = call(command, "--out", "")
    assert result.exit_code == statuses.WRONG_CALL
    assert one_line(result).startswith("crosscheck: out: is empty")


def test_comparison_without_a_name(tmp_path):
    """It was the folder that one was in."""
    result = call("compare", "", str(tmp_path))
    assert result.exit_code == statuses.WRONG_CALL
    assert one_line(result) == "crosscheck: A: is empty"


@pytest.mark.parametrize(("arguments", "field"), [(["merge", ""], "FOLDER"), (["export", "--parquet", ""], "parquet")])
def test_folder_without_a_name_refused_for_merge_and_output(tmp_path, arguments, field):
    result = call(*arguments, "--out", tmp_path / "out")
    assert result.exit_code == statuses.WRONG_CALL
    assert one_line(result) == f"crosscheck: {field}: is empty"
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_pipe_refused_as_a_side_of_a_comparison(tmp_path):
    """It was waited for, without an end."""
    pipe = tmp_path / "rows.jsonl"
    os.mkfifo(pipe)
    result = call("compare", str(pipe), str(pipe))
    assert result.exit_code == statuses.WRONG_CALL
    assert one_line(result).endswith("it is not a regular file")


def test_repeated_parameter_refused_with_the_list_form(tmp_path):
    result = call(*SMALL, "--param", "e=.5", "--param", "e=.6", "--out", tmp_path)
    assert result.exit_code == statuses.WRONG_CALL
    assert one_line(result) == "crosscheck: param: e is given twice; crosscheck sweep --grid runs several values"


def test_missing_results_as_a_wrong_call(tmp_path):
    result = call("report", "--out", tmp_path)
    assert result.exit_code == statuses.WRONG_CALL
    assert "there are no results" in (line := one_line(result)) and "crosscheck run makes them" in line


def test_missing_engine_named_by_tune():
    result = call("tune", "nosuch")
    assert result.exit_code == statuses.WRONG_CALL
    assert "there is no engine called 'nosuch'" in one_line(result)


@pytest.mark.parametrize("command", [["report"], ["list", "runs"], ["compare", "latest", "latest"], SMALL])
def test_store_of_a_later_version(tmp_path, command):
    with sqlite3.connect(tmp_path / FILE) as database:
        database.execute(f"PRAGMA user_version = {VERSION + 1}")
    result = call(*command, "--out", tmp_path)
    assert result.exit_code == statuses.RESULTS
    assert f"version {VERSION + 1}" in one_line(result)


def test_status_of_a_named_missing_engine(plugins, tmp_path):
    result = call("run", "impact", "--param", "v=6", "--dim", 2, "--engine", "broken", "--out", tmp_path)
    assert result.exit_code == statuses.INCOMPLETE, result.output
    assert "broken did not run" in result.stderr


@pytest.mark.few(1)
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full on this system")
@pytest.mark.parametrize("arguments", [["list", "scenes"], ["describe", "bounce", "--json"], ["--help"]])
def test_a_full_stdout_is_said_in_one_line(arguments):
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "reports.command", *arguments], stdout=full,
                              stderr=subprocess.PIPE, text=True, cwd=ROOT)  # fmt: skip
    assert done.returncode == statuses.RESULTS
    assert done.stderr.startswith("crosscheck:") and len(done.stderr.splitlines()) == 1, done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="there are no broken pipes on Windows")
@pytest.mark.few(1)
@pytest.mark.parametrize("arguments", [["list", "scenes"], ["describe", "bounce", "--json"], ["describe", "nothing"]])
def test_status_after_a_closed_pipe(arguments):
    """``crosscheck show --all | head``: 3 would say that results are lost, 0 after an alarm that there is none."""
    read, write = os.pipe()
    os.close(read)  # nobody reads any more
    done = subprocess.run([sys.executable, "-m", "reports.command", *arguments], stdout=write,
                          stderr=subprocess.PIPE, text=True, cwd=ROOT)  # fmt: skip
    os.close(write)
    assert done.returncode == (statuses.WRONG_CALL if "nothing" in arguments else statuses.FINE)
    assert done.stderr == ("crosscheck: name: nothing is called 'nothing'; crosscheck list scenes, or list engines\n"
                           if "nothing" in arguments else "")  # fmt: skip


@pytest.mark.few(2)
@pytest.mark.skipif(sys.platform == "win32", reason="closes streams by >&-, which is a word of POSIX shells alone")
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
@pytest.mark.parametrize(
    ("arguments", "status"),
    [("list scenes", statuses.FINE), ("explain nothing", statuses.WRONG_CALL), ("run-cell", statuses.WRONG_CALL)],
)
def test_stream_closed_by_the_caller(tmp_path, closed, arguments, status):
    """A closed stdout was a traceback with status 1, which says that a verdict is bad."""
    said = tmp_path / "said"
    line = f'exec 3>"{said}"; "{sys.executable}" -m reports.command {arguments} </dev/null >&3 2>&3 {closed}'
    done = subprocess.run(["sh", "-c", line], cwd=ROOT, check=False)
    assert done.returncode == status
    assert "Traceback" not in said.read_text()


def test_batch_with_a_wrong_line(tmp_path):
    good = {"scene": "impact", "engine": "chipmunk", "profile": "tuned", "dt": "1/240", "params": {"v": 6.0}}
    wrong = ["{", "[1]", "7", json.dumps(good | {"engine": "chipmonk"}), json.dumps(good | {"dt": "nan"}),
             json.dumps(good | {"scene": 7}), json.dumps(good | {"params": {"v": "fast"}}), "[" * 100000,
             json.dumps(good | {"dimension": "two"}), json.dumps(good | {"profile": "tunned"})]  # fmt: skip
    text = "\n".join([wrong[0], json.dumps(good), *wrong[1:]]) + "\n\n"
    result = call("run-cell", "--batch", input=text)
    assert result.exit_code == statuses.WRONG_CALL
    answers = [json.loads(line) for line in result.stdout.splitlines()]
    assert [a["outcome"] for a in answers if "outcome" in a] == ["ok"]
    assert {a["line"] for a in answers if "error" in a} == {1, *range(3, len(wrong) + 2)}
    assert all("\n" not in a["error"] for a in answers if "error" in a)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="there is no ulimit on Windows")
def test_memory_limit_of_the_shell_told_without_crashes(tmp_path):
    command = [sys.executable, "-m", "reports.command", *SMALL, "--out", str(tmp_path)]
    script = 'ulimit -v "$0" && exec "$@"'
    done = subprocess.run(["bash", "-c", script, str(2**20), *command], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == statuses.INCOMPLETE, done.stderr
    assert "ulimit -v" in done.stderr and "Traceback" not in done.stderr
    enough = subprocess.run(["bash", "-c", script, str(3 * 2**20), *command], cwd=ROOT, capture_output=True, text=True)
    assert enough.returncode == statuses.FINE, enough.stderr


HIDING = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Hidden())
"""


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (["doctor"], statuses.FINE, "its compiler cannot be loaded"),
        (
            ["bench", "impact", "--engine", "chipmunk", "--dim", "2"],
            statuses.INCOMPLETE,
            "chipmunk did not run: No module",
        ),
        (
            ["run", "impact", "--param", "v=6", "--engine", "chipmunk"],
            statuses.INCOMPLETE,
            "chipmunk did not run: No module",
        ),
    ],
)
def test_missing_package_in_one_line_with_a_status(tmp_path, arguments, status, said):
    (tmp_path / "sitecustomize.py").write_text(HIDING.format(names=("numba", "pymunk")))
    out = ["--out", str(tmp_path / "out")] if arguments[0] in ("bench", "run") else []
    # What CI demands of its own engines must not be demanded here, where one is hidden.
    environment = {name: value for name, value in os.environ.items() if name != "CROSSCHECK_REQUIRE_ENGINES"}
    done = subprocess.run([sys.executable, "-m", "reports.command", *arguments, *out], cwd=ROOT, text=True,
                          capture_output=True, env=environment | {"PYTHONPATH": str(tmp_path)})  # fmt: skip
    assert done.returncode == status, done.stderr
    assert said in " ".join((done.stdout + done.stderr).split()) and "Traceback" not in done.stderr


def test_bench_without_a_result(tmp_path):
    """Chipmunk is planar: there is nothing to time in space."""
    result = call("bench", "impact", "--engine", "chipmunk", "--dim", 3, "--dt", "1/60", "--out", tmp_path)
    assert result.exit_code == statuses.INCOMPLETE
    assert "no case has a result" in one_line(result)


@pytest.mark.parametrize(
    ("asked", "status"), [((False,), 0), ((True,), 1), ((False, False), 4), ((True, False), 1), ((True, True), 1)]
)
def test_status_of_a_complete_run_by_its_alarms(asked, status):
    assert statuses.verdict(*asked) == status
