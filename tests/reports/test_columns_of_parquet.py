"""Parquet files column by column: what each line of a metric and of a sample says, and the kinds of both."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("pyarrow", reason="pip install -e '.[parquet]'")

import pyarrow.parquet as pq

from adapters.trajectory import Trajectory
from reports import parquet
from reports.brief import Judged
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot
from validation.judging.rows import rows_of
from validation.records.store import Run

RUN = Run("20260102-030405", "2026-01-02T03:04:05", "abc+", {}, "quick: impact", (), True)
EARLIER = Run("20260101-030405", "2026-01-01T03:04:05", "def", {}, "quick: impact", (), True)
FLAT = Slot("impact", (("v", 2.0), ("e", 0.5)), 2, "chipmunk", "tuned", 1 / 240, 7, 3)
SOLID = Slot("impact", (), 3, "mujoco", "default", 1 / 60)
METRICS = {"rebound_ratio": (0.25, ""), "impulse": (None, "it has none")}
VERSION = CATALOGUE["impact"].version
TOLD = Observation(FLAT, "cell-1", VERSION, "7.2.0", Outcome.OK, "", METRICS, "hash-1", 120, 0.5)
LOST = Observation(SOLID, "cell-2", VERSION, "3.2.7", Outcome.CRASHED, "signal 11")


def test_parquet_lines_of_cells_with_and_without_metrics():
    lines = list(parquet._metrics([(RUN, [TOLD, LOST]), (EARLIER, [LOST])]))
    cell = {
        "run": "20260102-030405", "date": "2026-01-02T03:04:05", "commit": "abc+", "engine": "chipmunk",
        "engine_version": "7.2.0", "profile": "tuned", "scene": "impact", "dimension": 2, "dt": 1 / 240,
        "iterations": 7, "ulp": 3, "slot": FLAT.key(), "cell": "cell-1", "outcome": "ok", "reason": "", "steps": 120,
        "state_hash": "hash-1", "wall_time_s": 0.5,
    }  # fmt: skip
    params = [json.loads(line.pop("params")) for line in lines]
    assert params == [{"v": 2.0, "e": 0.5}] * 2 + [{}] * 2
    assert lines[0] == cell | {"metric": "rebound_ratio", "value": 0.25, "why": ""}
    assert lines[1] == cell | {"metric": "impulse", "value": None, "why": "it has none"}
    lost = {
        "run": "20260102-030405", "date": "2026-01-02T03:04:05", "commit": "abc+", "engine": "mujoco",
        "engine_version": "3.2.7", "profile": "default", "scene": "impact", "dimension": 3, "dt": 1 / 60,
        "iterations": None, "ulp": 0, "slot": SOLID.key(), "cell": "cell-2", "outcome": "crashed",
        "reason": "signal 11", "steps": 0, "state_hash": "", "wall_time_s": 0.0,
        "metric": "", "value": None, "why": "",
    }  # fmt: skip
    assert lines[2] == lost
    assert lines[3] == lost | {"run": EARLIER.id, "date": EARLIER.date, "commit": "def"}


def motion(bodies, pose, twist):
    t = np.array([0.0, 0.25, 0.5])
    shape = (len(t), bodies)
    ways = np.arange(len(t) * bodies * pose, dtype=float).reshape(*shape, pose)
    return Trajectory(
        t, ways, 100.0 + np.arange(len(t) * bodies * twist).reshape(*shape, twist), None, 0.25, "completed"
    )


def test_sample_lines_per_body_in_plane_and_space(tmp_path):
    motion(2, 3, 3).save(tmp_path / f"{FLAT.key()}.npz")
    motion(1, 7, 6).save(tmp_path / f"{SOLID.key()}.npz")
    path = tmp_path / "trajectories.parquet"
    kept = [(RUN, TOLD), (EARLIER, TOLD), (RUN, LOST), (RUN, Observation(FLAT.with_params({}), "", 1, "", Outcome.OK))]
    assert parquet._trajectories(kept, tmp_path, path) == 9, "each file once, and none where none is kept"
    told = pd.read_parquet(path)
    assert list(told) == ["slot", "step", "t", "body", "x", "y", "angle", "z", "qw", "qx", "qy", "qz", "vx", "vy",
                          "omega", "vz", "wx", "wy", "wz"]  # fmt: skip
    kinds = {field.name: str(field.type) for field in pq.read_schema(path)}
    assert [kinds.pop(name) for name in ("slot", "step", "t", "body")] == ["string", "int64", "double", "int32"]
    assert set(kinds.values()) == {"double"}
    flat, solid = told[told.slot == FLAT.key()], told[told.slot == SOLID.key()]
    assert (len(flat), len(solid)) == (6, 3)
    assert flat.step.tolist() == [0, 0, 1, 1, 2, 2] and flat.body.tolist() == [0, 1] * 3
    assert flat.t.tolist() == [0.0, 0.0, 0.25, 0.25, 0.5, 0.5]
    assert flat[["x", "y", "angle"]].to_numpy().ravel().tolist() == list(range(18))
    assert flat[["vx", "vy", "omega"]].to_numpy().ravel().tolist() == [100.0 + k for k in range(18)]
    assert flat[["z", "qw", "qx", "qy", "qz", "vz", "wx", "wy", "wz"]].isna().all(axis=None)
    assert solid.step.tolist() == [0, 1, 2] and solid.body.tolist() == [0, 0, 0]
    assert solid[["x", "y", "z", "qw", "qx", "qy", "qz"]].to_numpy().ravel().tolist() == list(range(21))
    assert solid[["vx", "vy", "vz", "wx", "wy", "wz"]].to_numpy().ravel().tolist() == [100.0 + k for k in range(18)]
    assert solid[["angle", "omega"]].isna().all(axis=None)


def test_column_types_of_lists_and_unknown_numbers():
    judged = replace(TOLD, slot=replace(FLAT, ulp=0))
    table = parquet._rows(Judged.of(rows_of(RUN.id, [judged, LOST])).rows)
    assert len(table) and set(table["run"]) == {RUN.id}
    for name in ("params", "slot", "cells", "initial_change"):
        assert [type(json.loads(value)) for value in table[name]] == [
            {"params": dict, "slot": dict}.get(name, list)] * len(table)  # fmt: skip
    for name in ("value", "truth", "error", "tolerance", "floor", "skill"):
        assert table[name].dtype == np.float64, name
    assert json.loads(table["params"].iloc[0])["v"] == 2.0


def test_csv_into_a_new_folder(tmp_path, monkeypatch):
    class Kept:
        def observations(self, run):
            return {RUN.id: [TOLD, LOST], EARLIER.id: [LOST]}[run.id]

    monkeypatch.setattr(parquet, "judged", lambda store, run: Judged.of(rows_of(run.id, store.observations(run))))
    motion(2, 3, 3).save(tmp_path / f"{FLAT.key()}.npz")
    folder = tmp_path / "a" / "b"
    told = parquet.write(Kept(), [RUN, EARLIER], tmp_path, folder)
    assert parquet.write(Kept(), [RUN, EARLIER], tmp_path, folder) == told, "and again into the same one"
    assert sorted(path.name for path in folder.iterdir()) == [
        "observations.parquet", "rows.parquet", "trajectories.parquet"]  # fmt: skip
    tables = {name: pd.read_parquet(folder / f"{name}.parquet") for name in told}
    assert {name: len(table) for name, table in tables.items()} == told
    assert told["observations"] == 4 and told["trajectories"] == 6
    assert set(tables["rows"].run) == {RUN.id, EARLIER.id}
    assert not any(name.startswith("__index") or name == "index" for table in tables.values() for name in table)
    assert all(pq.read_schema(folder / f"{name}.parquet").names == list(table) for name, table in tables.items())
