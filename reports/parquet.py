"""Raw results as Parquet, for pandas, polars and duckdb without this project.

rows.parquet           judged rows of the chosen runs, as in `exports.load`; lists and tables as JSON text
observations.parquet   a line per metric of every case, as measured: run, slot, cell, versions, outcome, value
trajectories.parquet   a line per sample and body of every kept trajectory (``run --keep-trajectories``)
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from adapters.trajectory import load_trajectory
from reports.brief import judged
from validation.cells import Observation
from validation.judging.rows import Row, frame
from validation.records.store import Run, Store

#: Columns of a pose and a twist; planar ones have no z, and one angle.
POSE = {3: ("x", "y", "angle"), 7: ("x", "y", "z", "qw", "qx", "qy", "qz")}
TWIST = {3: ("vx", "vy", "omega"), 6: ("vx", "vy", "vz", "wx", "wy", "wz")}
STATE = tuple(dict.fromkeys((*POSE[3], *POSE[7], *TWIST[3], *TWIST[6])))


def write(store: Store, runs: Sequence[Run], trajectories: Path, folder: Path) -> dict[str, int]:
    """Write the files into ``folder``; return the number of lines of each."""
    folder.mkdir(parents=True, exist_ok=True)
    found = [(run, store.observations(run)) for run in runs]
    rows = pd.concat([_rows(judged(store, run).rows) for run in runs], ignore_index=True)
    tables = {"rows": rows, "observations": pd.DataFrame(_metrics(found))}
    for name, table in tables.items():
        table.to_parquet(folder / f"{name}.parquet", index=False)
    counts = {name: len(table) for name, table in tables.items()}
    kept = [(run, observation) for run, observations in found for observation in observations]
    return counts | {"trajectories": _trajectories(kept, trajectories, folder / "trajectories.parquet")}


def _rows(rows: Sequence[Row]) -> pd.DataFrame:
    table = frame(rows)
    for name in ("params", "slot", "cells", "initial_change"):
        table[name] = [json.dumps(value) for value in table[name]]
    for name in ("value", "truth", "error", "tolerance", "floor", "skill"):
        table[name] = table[name].astype(float)
    return table


def _metrics(found: Sequence[tuple[Run, Sequence[Observation]]]) -> Iterator[dict[str, Any]]:
    for run, observations in found:
        for observation in observations:
            slot = observation.slot
            cell = {
                "run": run.id, "date": run.date, "commit": run.commit, "engine": slot.engine,
                "engine_version": observation.engine_version, "profile": slot.profile, "scene": slot.scene,
                "dimension": slot.dimension, "params": json.dumps(dict(slot.params)), "dt": slot.dt,
                "iterations": slot.iterations, "ulp": slot.ulp, "slot": slot.key(), "cell": observation.cell,
                "outcome": observation.outcome.value, "reason": observation.reason, "steps": observation.steps,
                "state_hash": observation.state_hash, "wall_time_s": observation.wall_time_s,
            }  # fmt: skip
            for metric, (value, why) in observation.metrics.items() or [("", (None, ""))]:
                yield {**cell, "metric": metric, "value": value, "why": why}


def _trajectories(kept: Sequence[tuple[Run, Observation]], source: Path, path: Path) -> int:
    """One file after the other: a suite's trajectories do not fit into memory together."""
    schema = pa.schema([("slot", pa.string()), ("step", pa.int64()), ("t", pa.float64()), ("body", pa.int32()),
                        *((name, pa.float64()) for name in STATE)])  # fmt: skip
    lines = 0
    with pq.ParquetWriter(path, schema) as writer:
        for key in dict.fromkeys(observation.slot.key() for _, observation in kept):
            file = source / f"{key}.npz"
            if file.is_file():
                table = _trajectory(key, file)
                lines += len(table)
                writer.write_table(pa.Table.from_pandas(table, schema=schema, preserve_index=False))
    return lines


def _trajectory(key: str, file: Path) -> pd.DataFrame:
    found = load_trajectory(file)
    samples, bodies = found.pose.shape[:2]
    columns: dict[str, Any] = {
        "slot": [key] * (samples * bodies),
        "step": np.repeat(np.arange(samples), bodies),
        "t": np.repeat(found.t, bodies),
        "body": np.tile(np.arange(bodies, dtype=np.int32), samples),
    }
    for names, array in ((POSE, found.pose), (TWIST, found.twist)):
        flat = array.reshape(samples * bodies, -1)
        columns |= {name: flat[:, k] for k, name in enumerate(names[flat.shape[1]])}
    return pd.DataFrame(columns | {name: np.nan for name in STATE if name not in columns})
