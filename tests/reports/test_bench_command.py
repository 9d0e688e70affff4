"""``crosscheck bench``: errors and times of one engine end to end, its files, its refusals."""

import csv
import json
import math
from dataclasses import replace

import pytest
from click.testing import CliRunner

from reports import speed
from reports.command import main
from reports.command.benching import plan_of
from reports.command.selection import Cases, taken
from validation import workers
from validation.bench import reading
from validation.bench.lane import QUICK
from validation.bench.sweep import answered
from validation.cells import Slot
from validation.records.store import Store
from validation.running.execution import execute

ONE = ["bench", "impact", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2", "--dt", "1/60", "--dt", "1/240"]


def call(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    pytest.importorskip("pymunk")
    out = tmp_path_factory.mktemp("bench")
    return out, call(*ONE, "--seed", 3, "--json", "--out", out)


def test_error_and_time_of_bench_points(bench):
    _, result = bench
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    points = data["work_points"]
    assert [(p["dt"], p["cells"], p["outcome"]) for p in points] == [(1 / 60, 16, "ok"), (1 / 240, 16, "ok")]
    for point in points:
        assert 0.0 <= point["error"] < 1e-12  # Newton's law holds at every step, to round-off
        assert 0.0 < point["cost_low"] <= point["cost"] <= point["cost_high"] < 1.0
    # Half a second of one ball: four times the steps cost more, whatever the machine.
    assert points[1]["cost"] > 1.5 * points[0]["cost"]
    assert data["protocol"]["seed"] == 3 and data["protocol"]["primary"]["impact"]["because"]
    assert data["run"]["machine"]["cpu"] and data["run"]["title"].startswith("bench quick: impact --engine ")
    assert {row["scene"] for row in data["overhead"]} == {"empty", "free"}


def test_error_and_state_of_every_raw_timing(bench):
    out, _ = bench
    store = Store(out, create=False)
    (run,) = reading.bench_runs(store)
    timings = store.timings(run)
    assert run.finished and len(timings) >= QUICK.fewest * 6
    for timing in timings:
        assert timing.seconds > 0.0 and timing.state_hash and not timing.void
        assert timing.error is not None or timing.slot.scene == "empty"
    states = {(t.slot, t.purpose): set() for t in timings}
    for timing in timings:
        states[timing.slot, timing.purpose].add(timing.state_hash)
    assert all(len(found) == 1 for found in states.values())  # sampled or not, in any round: the same physics
    store.close()


def test_tables_are_written_as_csv_and_json(bench):
    out, result = bench
    assert json.loads((out / "bench" / "bench.json").read_text()) == json.loads(result.stdout)
    with (out / "bench" / "work_points.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["dt"]) for row in rows] == [1 / 60, 1 / 240]
    names = {path.name for path in (out / "bench").iterdir()}
    assert {"raw_timings.csv", "scaling.csv", "overhead.csv", "time_at_equal_error.csv", "ratios.csv"} <= names


def test_cells_of_a_dry_run(tmp_path):
    result = call(*ONE, "--dry-run", "--out", tmp_path / "none")
    assert result.exit_code == 0 and result.stdout == "32 cases\n"
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["bench", "bounse"], "did you mean 'bounce'"),
        (["bench", "impact", "--engine", "chipmonk"], "did you mean 'chipmunk'"),
        (["bench", "impact", "--against", "latest"], "there is no benchmark 'latest'"),
        (["bench", "impact", "--ulp", "1"], "no meaning for a benchmark"),
        (["bench", "impact", "--dt", "0"], "dt: 0 must be a positive"),
    ],
)
def test_status_and_line_of_a_bad_bench_call(tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    result = call(*arguments)
    assert result.exit_code == 2 and said in result.stderr and "Traceback" not in result.output


@pytest.mark.parametrize(
    ("seconds", "shown"), [(2.5, "2.5 s"), (3.14159e-3, "3.14 ms"), (412e-6, "412 us"), (8.4e-9, "8.4 ns")]
)
def test_durations_are_shown_with_a_fitting_unit(seconds, shown):
    assert speed.duration(seconds) == shown


def test_nan_as_null_in_json():
    import pandas as pd

    table = pd.DataFrame([{"a": math.nan, "b": 1.0, "c": "x"}])
    assert speed.plain(table) == [{"a": None, "b": 1.0, "c": "x"}]


@pytest.fixture
def asked(monkeypatch):
    """Slots that are run in worker processes, as they are asked for."""
    found = []

    def run_cells(slots, *args, **options):
        found.extend(slots)
        return workers.run_cells(slots, *args, **options)

    monkeypatch.setattr("reports.progress.run_cells", run_cells)
    return found


@pytest.mark.long
def test_bench_reuses_cells_of_the_last_run(tmp_path, asked):
    pytest.importorskip("pymunk")
    out, who = tmp_path / "out", ["--engine", "chipmunk", "--profile", "tuned", "--dim", "2"]
    assert call("run", "incline", "--quick", *who, "--out", out).exit_code == 0
    ran = set(asked)
    asked.clear()
    words = ["bench", "incline", *who, "--dt", "1/120", "--dt", "1/240", "--seed", 1, "--brief", "--out", out]
    done = call(*words)
    assert done.exit_code == 0 and "reusing 4 of 8 results" in done.stderr, done.stderr
    store = Store(out, create=False)
    judged, benched = store.runs()
    wanted = set(benched.plan)
    known = wanted & {slot.key() for slot in ran}
    assert known and {slot.key() for slot in asked} == wanted - known
    asked.clear()
    assert call(*words, "--fresh").exit_code == 0  # runs all of it
    assert {slot.key() for slot in asked} == wanted

    def answers(run):
        return {o.slot: replace(o, wall_time_s=0.0) for o in store.observations(run)}

    again = store.runs()[-1]
    assert answers(benched) == answers(again) and {o.slot for o in store.observations(judged)} & answers(again).keys()
    store.close()


def test_run_beside_its_benchmark(tmp_path, asked):
    pytest.importorskip("pymunk")
    words = ["slide", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2", "--quick", "--out", tmp_path]
    assert call("run", *words, "--for-bench").exit_code == 0
    store = Store(tmp_path, create=False)
    begun, judged = store.runs()
    steps = {slot.dt for slot in asked}
    assert len(asked) == len(set(asked)) and steps == {1 / 60, 1 / 240, 1 / 960}
    assert {o.slot.dt for o in store.observations(judged)} == {1 / 240} and judged.finished and not begun.finished
    assert store.run() == judged  # the latest is what was judged
    options = main.get_command(None, "bench").make_context("bench", [str(word) for word in words]).params
    _, title, cells = plan_of(taken(Cases, options))
    known = {o.slot for o in store.observations(begun)} | {o.slot for o in answered(store, cells)[1]}
    assert (begun.title, begun.plan) == (title, tuple(slot.key() for slot in cells)) and known == set(cells)
    assert {slot.dt for slot in asked if slot in set(cells)} == steps
    store.close()


@pytest.mark.parametrize(
    ("statement", "left"),
    [
        ("UPDATE observations SET body = json_set(body, '$.cell', 'another')", 0),
        ("UPDATE observations SET body = json_set(body, '$.outcome', 'crashed')", 0),
        ("UPDATE runs SET machine = json_set(machine, '$.cpu', 'another')", 0),
        ("UPDATE runs SET finished = 0", 0),
        ("UPDATE runs SET title = 'scatter of another'", 0),
        ("UPDATE runs SET title = 'release chipmunk==7.0.0: impact'", 0),
        ("UPDATE runs SET title = 'another'", 1),
    ],
)
def test_answer_of_another_cell_machine_or_run_not_reused(tmp_path, statement, left):
    pytest.importorskip("pymunk")
    slots = [Slot("impact", (("e", 0.5),), 2, "chipmunk", "tuned", 0.01)]
    store = Store(tmp_path)
    made, _ = store.start("quick: impact", slots)
    store.add(made, execute(slots[0]))
    store.finish(made)
    run, found = answered(store, slots)
    assert run == store.run().id and [o.slot for o in found] == slots and len(slots) == 1
    with store.writing() as db:
        db.execute(statement)
    assert len(answered(store, slots)[1]) == left
    store.close()
