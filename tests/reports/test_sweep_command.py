"""`crosscheck sweep`: which cells, the same ones again, resumed, and one line of a table for each."""

import json
import sys

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from adapters.extras import install
from reports.command import main
from validation.questions.sweeping import MOST_CELLS, Range, Study, grid, listed, points, study_slots
from validation.records.store import Store
from validation.running.plan import Request

pytest.importorskip("pymunk")
CELL = ("sweep", "impact", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2")


def call(*words, status=0):
    done = CliRunner().invoke(main, list(map(str, words)))
    assert done.exit_code == status, done.output + repr(done.exception)
    return done


def test_unsupported_dimension_absent_from_the_summary(tmp_path):
    told = call("sweep", "impact", "--engine", "chipmunk", "--profile", "tuned", "--out", tmp_path).output
    assert "impact 2-D" in told and "impact 3-D" not in told
    assert "7 cases" in told and "unsupported: 1 case, which the engine cannot run" in told
    assert set(pd.read_csv(tmp_path / "sweep.csv").dimension) == {2, 3}


def test_points_of_crossed_grids_and_lists():
    study = Study(dict([grid("e=0:1:3"), listed("v=1,2")]), [{"mass": 1.0}, {"mass": 2.0}])
    cells = list(study)
    assert len(cells) == len(study) == 12
    assert {cell["e"] for cell in cells} == {0.0, 0.5, 1.0}
    assert {(cell["e"], cell["v"], cell["mass"]) for cell in cells} == {
        (e, v, m) for e in (0.0, 0.5, 1.0) for v in (1.0, 2.0) for m in (1.0, 2.0)
    }


def test_ends_are_exact_and_a_logarithm_spreads_evenly():
    assert grid("v=0.1:20:5:log")[1][0] == 0.1 and grid("v=0.1:20:5:log")[1][-1] == 20.0
    values = np.array(grid("v=0.001:1000:7:log")[1])
    assert values[1:] / values[:-1] == pytest.approx(np.full(6, 10.0))
    assert Range("x", 1.0, 100.0).at(0.25) == pytest.approx(25.75)


@pytest.mark.parametrize("kind", ["random", "sobol"])
def test_range_and_seed_of_points(kind):
    pytest.importorskip("scipy")
    ranges = [(kind, Range("a", -1.0, 1.0)), (kind, Range("b", 1.0, 100.0, True))]
    first, again, other = (points(ranges, 100, seed) for seed in (3, 3, 4))
    assert first == again != other and len(first) == 100
    assert all(-1.0 <= p["a"] <= 1.0 and 1.0 <= p["b"] <= 100.0 for p in first)
    assert len({p["a"] for p in first}) == 100
    below = sum(p["b"] < 10.0 for p in first)  # half of them, evenly in the logarithm; 5 sd of chance are 25
    assert abs(below - 50) <= (25 if kind == "random" else 5)


def test_random_and_sobol_parameters_are_drawn_apart():
    pytest.importorskip("scipy")
    drawn = points([("random", Range("a", 0.0, 1.0)), ("sobol", Range("b", 0.0, 1.0))], 64, 0)
    counts = np.histogram([p["b"] for p in drawn], bins=8, range=(0.0, 1.0))[0]
    assert set(counts) == {8}  # what a Sobol sequence promises and chance does not
    assert abs(np.corrcoef([p["a"] for p in drawn], [p["b"] for p in drawn])[0, 1]) < 0.6


def test_whole_numbers_are_rounded():
    cells = study_slots(Request(["stack"], ["chipmunk"], ["tuned"], [2]), Study(dict([grid("n=1:3:5")]), [{}]))
    assert {dict(slot.params).get("n") for slot in cells} <= {None, 1.0, 2.0, 3.0}


@pytest.mark.parametrize(("words", "said"), [
    (("--grid", "e=0:1"), "grid: 'e=0:1' is not of the form NAME=LOW:HIGH:COUNT[:log]"),
    (("--grid", "e=0:1:many"), "is not of the form"),
    (("--grid", "e=0:1:3:4"), "is not of the form"),
    (("--grid", "e=1:0:3"), "e: 1 must be less than 0"),
    (("--grid", "e=0:inf:3"), "both finite"),
    (("--grid", "e=0:1:1"), "must be a whole number in [2,"),
    (("--grid", "e=0:1:3:log"), "0 has no logarithm"),
    (("--list", "e=a,b"), "list: 'e=a,b' is not of the form NAME=A,B,C"),
    (("--list", "e=2"), "impact.e: 2 must lie in [0, 1]"),
    (("--list", "speed=2"), "there is no such parameter"),
    (("--random", "e=0:1", "--samples", "0"), "samples: 0 must be"),
    (("--random", "e=0:1", "--list", "e=1"), "e is varied twice"),
    (("--random", "e=0:1", "--sobol", "e=0:1"), "e is varied twice"),
    (("--list", "e=1", "--param", "e=0.5"), "e is both fixed and varied"),
    (("--grid", "e=0:1:1000", "--grid", "v=1:2:1000"), f"are more than the {MOST_CELLS} of one sweep"),
])  # fmt: skip
def test_wrong_call_in_one_line_without_a_run(words, said, tmp_path):
    done = call(*CELL, *words, "--out", tmp_path / "out", status=2)
    assert said in done.output and len(done.output.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_sweep_without_a_scene_refused(tmp_path):
    assert "needs the name of a scene" in call("sweep", "--list", "e=1", "--out", tmp_path, status=2).output


def test_sweep_line_per_cell_and_repeatable_command(tmp_path):
    words = (*CELL, "--grid", "e=0:1:3", "--list", "v=1,2", "--jobs", 1, "--out", tmp_path)
    assert call(*words, "--dry-run").stdout == "6 cases\n"
    told = json.loads(call(*words, "--json").stdout)
    found = pd.read_csv(tmp_path / "sweep.csv")
    assert len(found) == len(told) == 6 and found.passes.all() and set(found.outcome) == {"ok"}
    assert found.rebound_ratio.to_numpy() == pytest.approx(found.e.to_numpy(), abs=1e-9)
    assert sorted(zip(found.e, found.v, strict=True)) == [(e, v) for e in (0.0, 0.5, 1.0) for v in (1.0, 2.0)]
    call(*words, "--fresh")
    again = pd.read_csv(tmp_path / "sweep.csv")
    assert list(again.state_hash) == list(found.state_hash)


def test_an_interrupted_sweep_is_resumed(tmp_path, monkeypatch):
    words = (*CELL, "--grid", "e=0:1:4", "--jobs", 1, "--out", tmp_path)
    from validation.records import store

    kept, add = [], store.Store.add

    def interrupted(self, run, observation):
        add(self, run, observation)
        kept.append(observation)
        if len(kept) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(store.Store, "add", interrupted)
    call(*words, status=130)
    done = call(*words)
    assert "2 of 4 cases done" in done.stderr and len(kept) == 4
    results = Store(tmp_path, create=False)
    assert len(results.runs()) == 1 and results.run().finished
    results.close()


def test_failure_and_crash_in_a_study(tmp_path, plugins):
    pytest.importorskip("pybullet")
    words = ("sweep", "impact", "--list", "v=3", "--dim", "2", "--jobs", 1)
    call(*words, "--engine", "bullet", "--profile", "default", "--out", tmp_path / "a")
    assert not pd.read_csv(tmp_path / "a" / "sweep.csv").passes.all()
    done = call(*words, "--engine", "evil", "--profile", "raise", "--out", tmp_path / "b", status=1)
    assert "no result" in done.stderr
    assert list(pd.read_csv(tmp_path / "b" / "sweep.csv").passes) == [False]


def test_parquet_has_the_same_table(tmp_path):
    pytest.importorskip("pyarrow")
    call(*CELL, "--list", "e=0.5", "--jobs", 1, "--out", tmp_path, "--parquet", tmp_path / "t.parquet")
    found = pd.read_parquet(tmp_path / "t.parquet")
    assert (
        found.rebound_ratio.iloc[0]
        == pd.read_csv(tmp_path / "sweep.csv", float_precision="round_trip").rebound_ratio[0]
    )


def test_sobol_without_scipy_says_how_to_get_it(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "scipy.stats", None)
    done = call(*CELL, "--sobol", "e=0:1", "--out", tmp_path, status=2)
    assert install("report") in done.output
