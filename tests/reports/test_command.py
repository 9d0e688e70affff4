"""The command: bad calls exit with 2 and one line; a run judges, stores, exports and resumes."""

import json
import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree

import pytest
from click.testing import CliRunner

from reports import exports
from reports.command import main
from reports.wording import row_id

ONE = ["run", "impact", "--param", "v=6", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2", "--jobs", "1"]


def call(*arguments, **kwargs):
    return CliRunner().invoke(main, [str(a) for a in arguments], **kwargs)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "bounse"], "did you mean 'bounce'"),
        (["run", "bounce", "--engine", "chipmonk"], "did you mean 'chipmunk'"),
        (["run", "bounce", "--profile", "tunned"], "profile"),
        (["run", "bounce", "--param", "e=1.2"], "bounce.e: 1.2 must lie in [0, 1]"),
        (["run", "stack", "--param", "mu=-0.1"], "stack.mu"),
        (["run", "bounce", "--param", "height=nan"], "bounce.height"),
        (["run", "bounce", "--param", "mass=0"], "bounce.mass"),
        (["run", "impact", "--param", "radius=0"], "impact.radius"),
        (["run", "impact", "--param", "elasticity=1"], "impact.elasticity: there is no such parameter"),
        (["run", "stack", "--param", "n=2.5"], "stack.n: 2.5 must be a whole number"),
        (["run", "bounce", "--param", "e"], "NAME=VALUE"),
        (["run", "bounce", "--param", "e=high"], "is not a number"),
        (["run", "bounce", "--dt", "0"], "dt: 0 must be a positive"),
        (["run", "bounce", "--dt", "-1/240"], "dt: -1/240 must be a positive"),
        (["run", "bounce", "--dt", "1/0"], "dt"),
        (["run", "bounce", "--dt", "nan"], "dt"),
        (["run", "bounce", "--dt", "3"], "dt: 3.0 s is longer than 0.1 s"),
        (["sweep", "bounce", "--grid", "e=0:1:2", "--dt", "0.11"], "dt: 0.11 s is longer than 0.1 s"),
        (["bench", "stack", "--dt", "1e300"], "dt: 1e+300 s is longer than 0.1 s"),
        (["export", "bounce", "--engine", "chipmunk", "--to", "python", "--dt", "3"], "dt: 3.0 s is longer than 0.1 s"),
        (["run", "bounce", "--dt", "fast"], "dt: 'fast' is not a number of seconds"),
        (["run", "bounce", "--iterations", "0"], "iterations"),
        (["run", "nowhere.toml"], "cannot read nowhere.toml"),
        (["describe", "nothing"], "nothing is called 'nothing'"),
        (["describe", "bounc"], "nothing is called 'bounc'; did you mean 'bounce'?"),
        (["list", "engines-and-more"], "engines-and-more"),
        (["check-adapter", "chipmonk"], "did you mean 'chipmunk'"),
    ],
)
def test_status_and_line_of_a_bad_call(tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    result = call(*arguments)
    assert result.exit_code == 2
    assert said in result.stderr
    assert "Traceback" not in result.output
    assert len([line for line in result.stderr.splitlines() if "rosscheck:" in line or "Error" in line]) == 1


def test_exception_while_building_as_a_row_with_its_reason(plugins, tmp_path):
    result = call("run", "impact", "--param", "v=6", "--dim", 2, "--engine", "evil", "--profile", "raise",
                  "--out", tmp_path, "--json")  # fmt: skip
    assert result.exit_code == 1
    rows = json.loads(result.stdout)
    assert {row["outcome"] for row in rows} == {"crashed"}
    assert {row["reason"] for row in rows} == {"RuntimeError: building failed"}


def test_scene_file_and_a_bad_one(tmp_path):
    path = tmp_path / "drop.toml"
    text = """
name = "drop"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.3
bodies = [
  { name = "floor", shape = { type = "half_space", normal = [0.0, 1.0] }, motion = "fixed" },
  { name = "ball", shape = { type = "disc", radius = 0.5 }, inertia = 0.125, pose = [0.0, 0.6, 0.0] },
]
pairs = [{ restitution = 0.5 }]
"""
    path.write_text(text)
    good = call("run", path, "--engine", "chipmunk", "--profile", "tuned", "--out", tmp_path / "out", "--json")
    assert good.exit_code == 0, good.stderr
    assert {row["metric"] for row in json.loads(good.stdout)} >= {"energy_growth", "penetration", "final[ball.y]"}
    ball = next(row for row in json.loads(good.stdout) if row["metric"] == "final[ball.y]")
    asked = call("explain", row_id(ball), "--out", tmp_path / "out")
    assert " 2-D; step 0.004167 s" in " ".join(asked.stdout.split())  # a file has no parameters to name
    path.write_text(text.replace("restitution = 0.5", "restitution = 1.2"))
    bad = call("run", path)
    assert bad.exit_code == 2
    assert "restitution" in bad.stderr and "Traceback" not in bad.stderr


FIELDS = set(
    [
        "run",
        "engine",
        "engine_version",
        "profile",
        "scene",
        "dimension",
        "params",
        "dt",
        "iterations",
        "check",
        "metric",
        "unit",
        "value",
        "truth",
        "error",
        "tolerance",
        "because",
        "outcome",
        "physics",
        "standing",
        "reason",
        "state_hash",
        "steps",
        "wall_time_s",
    ]
)


@pytest.fixture(scope="module")
def one_run(tmp_path_factory):
    out = tmp_path_factory.mktemp("one")
    junit, markdown = out / "junit.xml", out / "summary-2.md"
    result = call(*ONE, "--out", out, "--json", "--junit", junit, "--markdown", markdown)
    return out, result


def test_a_row_has_every_public_field(one_run):
    _, result = one_run
    assert result.exit_code == 0, result.stderr
    rows = json.loads(result.stdout)
    assert all(set(row) >= FIELDS for row in rows)
    values = {row["metric"]: row["value"] for row in rows}
    assert values["rebound_speed"] == pytest.approx(4.8, abs=1e-12)
    assert values["impulse"] == pytest.approx(5.4, abs=1e-12)
    assert values["velocity_change"] == pytest.approx(10.8, abs=1e-12)
    assert {row["physics"] for row in rows} == {"pass"}


def test_every_export_has_every_row(one_run):
    out, result = one_run
    rows = json.loads(result.stdout)
    lines = [json.loads(line) for line in (out / "rows.jsonl").read_text().splitlines()]
    assert lines == rows
    assert len((out / "rows.csv").read_text().splitlines()) == len(rows) + 1
    assert "chipmunk/tuned" in (out / "summary-2.md").read_text()
    suites = ElementTree.parse(out / "junit.xml").getroot()
    assert sum(int(suite.get("tests")) for suite in suites) == len(rows)
    table = exports.load(out)
    assert len(table) == len(rows)
    assert list(table["param.v"].unique()) == [6.0]


def test_list_describe_and_doctor_speak_json(one_run):
    out, _ = one_run
    for arguments in (["list", "scenes"], ["list", "engines"], ["list", "checks"], ["list", "runs", "--out", out]):
        assert json.loads(call(*arguments, "--json").stdout)
        assert call(*arguments).stdout
    assert json.loads(call("describe", "bounce", "--json").stdout)["parameters"]
    assert json.loads(call("describe", "chipmunk", "--json").stdout)["quirks"]
    doctor = call("doctor", "--json")
    assert doctor.exit_code == 0
    assert set(json.loads(doctor.stdout)["packages"]) == {"reference_solver", "adapters", "validation", "reports"}


def test_bits_of_results_with_any_number_of_jobs(tmp_path):
    tables = []
    for name, jobs in (("a", 1), ("b", 2)):
        result = call("run", "impact", "--dim", 2, "--engine", "chipmunk", "--out", tmp_path / name,
                      "--jobs", jobs, "--json")  # fmt: skip
        volatile = ("run", "wall_time_s")
        tables.append([{k: v for k, v in row.items() if k not in volatile} for row in json.loads(result.stdout)])
    assert tables[0] == tables[1]


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="kills a process group")
@pytest.mark.parametrize("blow", [signal.SIGINT, signal.SIGKILL])
def test_finished_cells_kept_and_resumed(tmp_path, blow):
    command = [sys.executable, "-m", "reports.command", "run", "bounce", "--engine", "chipmunk", "--jobs", "1"]
    command += ["--out", str(tmp_path)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    database = tmp_path / "results.sqlite"
    deadline = time.monotonic() + 60.0
    while finished(database) < 5 and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.02)
    if process.poll() is None:
        os.kill(process.pid, blow)
    process.communicate(timeout=60)
    # As the README says of Ctrl-C; a run that was quicker than the blow has a verdict.
    assert process.returncode in ((130, 0, 1) if blow == signal.SIGINT else (-blow, 0, 1))
    before = finished(database)
    assert before >= 5
    again = subprocess.run(command, capture_output=True, text=True)
    assert again.returncode in (0, 1)
    if process.returncode != 0:
        assert "resuming run" in again.stderr
        assert len({row.run for row in exports.load_rows(tmp_path)}) == 1


def finished(database):
    import sqlite3

    if not database.exists():
        return 0
    try:
        with sqlite3.connect(f"file:{database}?mode=ro", uri=True) as connection:
            return connection.execute("SELECT COUNT(*) FROM observations").fetchone()[0]
    except sqlite3.Error:
        return 0
