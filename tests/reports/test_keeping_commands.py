"""`export`, `merge` and `prune` as a user calls them."""

import json
import shutil

import pandas as pd
import pytest
from click.testing import CliRunner

from adapters.trajectory import load_trajectory
from reports.command import main
from validation.records.store import Store

pytest.importorskip("pyarrow", reason="pip install -e '.[parquet]'")
pytest.importorskip("pymunk")


def call(*words, status=0):
    done = CliRunner().invoke(main, list(map(str, words)))
    assert done.exit_code == status, done.output + repr(done.exception)
    return done


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """Results of two small runs with their trajectories."""
    folder = tmp_path_factory.mktemp("out")
    for v in (2, 3):
        cell = ("impact", "--engine", "chipmunk", "--dim", 2, "--param", f"v={v}")
        call("run", *cell, "--keep-trajectories", "--jobs", 1, "--out", folder)
    return folder


def test_rows_metrics_and_trajectories_read_again(out, tmp_path):
    told = json.loads(call("export", "--parquet", tmp_path / "p", "--out", out, "--json").stdout)
    rows, metrics, states = (
        pd.read_parquet(tmp_path / "p" / f"{name}.parquet") for name in ("rows", "observations", "trajectories")
    )
    assert (len(rows), len(metrics), len(states)) == (told["rows"], told["observations"], told["trajectories"])
    store = Store(out, create=False)
    observations = store.observations(store.run())
    store.close()
    raw = {(o.slot.key(), name): value for o in observations for name, (value, _) in o.metrics.items()}
    found = {(row.slot, row.metric): row.value for row in metrics.itertuples()}
    assert found == raw and len(raw) > 4
    ratio = rows[(rows.metric == "rebound_ratio") & (rows.profile == "tuned")]
    assert json.loads(ratio.params.iloc[0])["v"] == 3.0 and ratio.physics.iloc[0] == "pass"
    for key in {o.slot.key() for o in observations}:
        kept, own = load_trajectory(out / "trajectories" / f"{key}.npz"), states[states.slot == key]
        assert (own[["x", "y", "angle"]].to_numpy().reshape(kept.pose.shape) == kept.pose).all()
        assert (own[["vx", "vy", "omega"]].to_numpy().reshape(kept.twist.shape) == kept.twist).all()
        assert (own.t.to_numpy().reshape(len(kept.t), -1)[:, 0] == kept.t).all()


def test_export_of_all_runs_or_a_named_one(out, tmp_path):
    call("export", "--all", "--parquet", tmp_path / "p", "--out", out)
    runs = pd.read_parquet(tmp_path / "p" / "observations.parquet").run.unique()
    assert len(runs) == 2
    call("export", runs[0], "--parquet", tmp_path / "q", "--out", out)
    assert list(pd.read_parquet(tmp_path / "q" / "rows.parquet").run.unique()) == [runs[0]]


def test_polars_and_duckdb_read_the_same_numbers_as_pandas(out, tmp_path):
    polars, duckdb = (pytest.importorskip(name, reason=f"{name} is not installed") for name in ("polars", "duckdb"))
    call("export", "--parquet", tmp_path / "p", "--out", out)
    for name, column in (("rows", "value"), ("observations", "value"), ("trajectories", "vy")):
        path = tmp_path / "p" / f"{name}.parquet"
        wanted = pd.read_parquet(path)
        table = polars.read_parquet(path)
        assert table.columns == list(wanted.columns) and table.height == len(wanted) > 0
        assert table[column].drop_nulls().to_list() == wanted[column].dropna().tolist()
        counted = duckdb.sql(f"SELECT count(*), count({column}) FROM '{path}'").fetchall()
        assert counted == [(len(wanted), wanted[column].notna().sum())]
    query = f"SELECT value FROM '{tmp_path}/p/rows.parquet' WHERE metric = 'rebound_ratio' AND profile = 'tuned'"
    assert [round(value, 9) for (value,) in duckdb.sql(query).fetchall()] == [0.8]


def test_merge_reports_added_runs(out, tmp_path):
    first = call("merge", out, "--out", tmp_path)
    assert "2 new runs, 0 there already" in first.stdout
    assert "0 new runs, 2 there already, 0 results" in call("merge", out, "--out", tmp_path).stdout
    assert call("merge", tmp_path / "nothing", "--out", tmp_path / "new", status=2)
    assert not (tmp_path / "new").exists()


def test_rule_and_dry_run_of_prune(out, tmp_path):
    call("merge", out, "--out", tmp_path)
    assert "needs --keep" in call("prune", "--out", tmp_path, status=2).output
    # Two runs that ask differently have different titles: none is a repetition of the other.
    assert "0 runs would be deleted" in call("prune", "--keep", 1, "--dry-run", "--out", tmp_path).stdout
    again = ("impact", "--engine", "chipmunk", "--dim", 2, "--param", "v=3", "--fresh", "--jobs", 1)
    call("run", *again, "--out", tmp_path)
    assert "1 run would be deleted" in call("prune", "--keep", 1, "--dry-run", "--out", tmp_path).stdout
    assert "1 run deleted" in call("prune", "--keep", 1, "--out", tmp_path).stdout
    assert len(json.loads(call("list", "runs", "--json", "--out", tmp_path).stdout)) == 2


@pytest.mark.parametrize("days", ["nan", "inf", "-1", "old"])
def test_impossible_age_of_a_run(days):
    assert "older-than: " in call("prune", "--older-than", days, status=2).stderr


def test_name_of_a_run_that_is_no_text(out):
    assert "run: there is no run" in call("show", "\udcff", "--out", out, status=2).stderr


def test_run_unfinished_on_both_machines_after_a_merge(out, tmp_path):
    folders = [shutil.copytree(out, tmp_path / name) for name in ("ours", "theirs")]
    for folder in folders:
        store = Store(folder)
        with store.writing() as db:
            db.execute("UPDATE runs SET finished = 0")
        store.close()
    call("merge", folders[1], "--out", folders[0])
    store = Store(folders[0], create=False)
    assert [run.finished for run in store.runs()] == [False, False]
    store.close()


def test_refusal_of_a_folder_without_results(tmp_path):
    done = call("export", "--parquet", tmp_path / "p", "--out", tmp_path / "none", status=2)
    assert "out: there are no results at" in done.output and "crosscheck run makes them" in done.output
    assert not (tmp_path / "none").exists() and not list((tmp_path / "p").glob("*.parquet"))
