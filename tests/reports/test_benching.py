"""A bench, from the units to what is printed and kept, where nothing is timed: laps are made up."""

import io
import json
from dataclasses import asdict
from types import SimpleNamespace

import pandas as pd
import pytest
from click.testing import CliRunner
from rich.console import Console

from reports.command import benching
from validation.cells import Slot
from validation.files.distance import primary_of
from validation.records.store import Run


def printed(width=120):
    out = io.StringIO()
    return out, Console(file=out, width=width, no_color=True)


def test_times_of_units_and_their_protocol(monkeypatch):
    """Each lap is kept as it comes; what stood there of the run before is gone first."""
    did, clock, loads = [], iter([100.0, 112.345]), iter([(0.5, 0.25, 0.125), (1.5, 0.5, 0.25)])
    store = SimpleNamespace(
        clear_timings=lambda run: did.append(("clear", run)),
        add_timings=lambda run, timings: did.append(("add", run, timings)),
        set_protocol=lambda run, protocol: did.append(("protocol", run, protocol)),
    )
    laps = [SimpleNamespace(round=k, slot=Slot("impact", (), 2, "toy", "tuned", 0.1)) for k in range(2)]

    def lane(units, limits, seed):
        did.append(("lane", units, limits, seed))
        yield from laps

    monkeypatch.setattr(benching, "run_lane", lane)
    monkeypatch.setattr(benching.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(benching.os, "getloadavg", lambda: next(loads))
    out, console = printed()
    benching.time_units(store, "run", ["impact", "slide"], ["u", "v", "w"], benching.QUICK, 7, console)
    assert out.getvalue() == "timing 3 cases, one at a time, in random order (seed 7)\n"
    protocol = did.pop()[-1]
    assert did == [
        ("clear", "run"), ("lane", ["u", "v", "w"], benching.QUICK, 7),
        ("add", "run", laps[:1]), ("add", "run", laps[1:])
    ]  # fmt: skip
    assert protocol == {
        "seed": 7, "limits": asdict(benching.QUICK), "lane_seconds": 12.3,
        "clock": "CPU time of the process (all threads), cost of reading the clock taken off; wall time beside it",
        "unit": "build outside the clock, warm, then one call advance(n); 'sampled': one step at a time, state read",
        "primary": {
            scene: {name: getattr(primary_of(scene), name) for name in ("name", "unit", "law", "because", "state")}
            for scene in ("impact", "slide")
        },
        "load_before": (0.5, 0.25, 0.125), "load_after": (1.5, 0.5, 0.25),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("as_json", "brief", "busy", "rows"), [(False, False, "", 1), (True, False, "it was busy", 0), (False, True, "", 1)]
)
def test_bench_output_ends_with_run_seed_and_path(monkeypatch, tmp_path, as_json, brief, busy, rows):
    """A busy machine is said and ranks nobody; tables that came to nothing are left out."""
    asked = []
    points = pd.DataFrame(columns=["engine", "profile"])
    tables = {name: name for name in ("timings", "overhead", "scaling", "scaling_fits")} | {"work_points": points}

    class Table:
        row_count = rows

        def __init__(self, name):
            self.name = name

        def __rich__(self):
            return f"table of {self.name}"

    def level_tables(points, ranked):
        asked.append((points, ranked))
        return [Table("levels")]

    speed = benching.speed
    monkeypatch.setattr(speed, "tables_of", lambda store, run: tables)
    monkeypatch.setattr(speed, "raw_of", lambda store, run: "raw")
    monkeypatch.setattr(
        speed, "write_all", lambda *given: asked.append(given) or [tmp_path / "bench" / "a.csv", tmp_path / "b.csv"]
    )
    monkeypatch.setattr(speed, "as_json", lambda run, protocol, tables: json.dumps([run.id, protocol, sorted(tables)]))
    monkeypatch.setattr(speed, "quality_line", lambda timings: f"quality of {timings}")
    monkeypatch.setattr(speed, "busy", lambda timings: busy if timings == "timings" else None)
    monkeypatch.setattr(speed, "level_tables", level_tables)
    monkeypatch.setattr(speed, "key", lambda ranked: f"ranked: {ranked}")
    monkeypatch.setattr(speed, "overhead_table", lambda table: Table(table))
    monkeypatch.setattr(speed, "scaling_table", lambda *given: Table("+".join(given)))
    run = Run("20260101-000000", "2026-01-01T00:00:00", "abc123", {}, "t", (), True)
    store = SimpleNamespace(protocol=lambda run: {"seed": 7} if not brief else None)
    out, console = printed(400)
    with CliRunner().isolation() as streams:
        benching._show(store, run, tmp_path, as_json, brief, console)
        plain = streams[0].getvalue().decode()
    protocol = {} if brief else {"seed": 7}
    assert asked[0] == (tmp_path, run, protocol, tables, "raw")
    assert asked[1:] == ([] if brief else [(points, not busy)])
    assert plain == (json.dumps([run.id, protocol, sorted(tables)]) + "\n" if as_json else "")
    told = [] if brief else ["table of levels", f"ranked: {not busy}"]
    beside = ["table of overhead", "table of scaling+scaling_fits"] if rows and not brief else []
    seed = None if brief else 7
    assert out.getvalue().splitlines() == [
        "quality of timings", *([busy] if busy else []), *told, *beside,
        f"run 20260101-000000, seed {seed}; written: {tmp_path / 'bench'}",
        f"figures of error against time: crosscheck report --open --out {tmp_path}",
    ]  # fmt: skip
