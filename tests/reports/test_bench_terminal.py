"""What ``crosscheck bench`` prints: the cheapest is marked, ties are ties, and a busy machine ranks nobody."""

import io
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from reports import speed
from reports.command import benching
from validation.bench import timing as timings
from validation.cells import Observation, Outcome, Slot
from validation.files.distance import primary_of
from validation.posed import resolve
from validation.records.store import Store

DT, STEPS = 1 / 240, 100
#: Cost of a simulated second [s] on three engines: the interval of the second reaches that of the first, of the third
#: not. Rounds scatter by one per cent to both sides.
COSTS = {"chipmunk": 1.0e-3, "mujoco": 1.006e-3, "bullet": 1.5e-3}
#: Largest error of each: bullet does not reach 1e-3.
ERRORS = {"chipmunk": 1e-6, "mujoco": 1e-6, "bullet": 5e-3}


def slot_of(engine, delay):
    return Slot("impact", (("delay", delay),), 2, engine, "default", DT)


def timed(slot, seconds, round_, wall):
    return timings.Timing(
        "work", slot, cell="", engine_version="1.0", bodies=1, order=0, process=0, sampled=False, steps=STEPS,
        opponent="chipmunk/default", round=round_, seconds=seconds, wall_seconds=seconds * wall, state_hash="s",
        error=None,
    )  # fmt: skip


@pytest.fixture
def printed(tmp_path):
    """Print a bench whose engines cost `COSTS`; ``busy`` of them had their core taken for half of the wall time."""
    stores = []

    def show(busy=(), planar=0):
        store = Store(tmp_path / f"results-{len(stores)}")
        stores.append(store)
        delays = [variation["delay"] for variation in primary_of("impact").variations(DT)]
        truth = resolve("impact").complete({})["e"]
        cells = [
            Observation(slot_of(engine, delay), f"{engine} {delay}", 1, "1.0", Outcome.OK,
                        metrics={"rebound_ratio": (truth + error, "")})
            for engine, error in ERRORS.items() for delay in delays
        ]  # fmt: skip
        for engine in ("chipmunk", "mujoco")[:planar]:
            slots = [replace(slot_of(engine, delay), dimension=3) for delay in delays]
            cells += [Observation(slot, slot.key(), 1, "1.0", Outcome.UNSUPPORTED, "it is planar") for slot in slots]
        run, _ = store.start("bench test", [cell.slot for cell in cells], fresh=True)
        for cell in cells:
            store.add(run, cell)
        for engine, cost in COSTS.items():
            for k, noise in enumerate((1.0, 1.01, 0.99, 1.0, 1.01, 0.99)):
                wall = 2.0 if engine in busy else 1.0
                store.add_timings(run, [timed(slot_of(engine, delays[0]), cost * STEPS * DT * noise, k, wall)])
        store.set_protocol(run, {"seed": 3})
        stream = io.StringIO()
        benching._show(store, run, tmp_path, False, False, Console(file=stream, width=160))
        return stream.getvalue()

    yield show
    for store in stores:
        store.close()


def marks(text):
    """Engine -> first characters of its cells in the table of costs at 1e-1 and 1e-3."""
    found = {}
    for line in text.splitlines():
        name = line.partition("/default")[0]
        if name in COSTS and "1/240" in line:
            cells = line.partition("/default")[2].split("  ")
            found[name] = [cell.strip() for cell in cells if cell.strip()]
    return found


def test_cheapest_marked_and_ties_named(printed):
    text = printed()
    cells = marks(text)
    assert [cells[name][0] for name in COSTS] == ["* 1 ms 1/240", "= 1.01 ms 1/240", "1.5 ms 1/240"]
    assert [cells[name][2] for name in COSTS] == ["* 1 ms 1/240", "= 1.01 ms 1/240", "-"]
    assert "=: no measurable difference from the cheapest" in text
    assert "The machine was busy" not in text


def test_absent_engines_and_empty_tables(printed):
    """``unsupport...`` stood where an error belongs, and headings over nothing."""
    text = printed(planar=2)
    assert text.count("chipmunk/default") == 1 and "impact 3-D" not in text and "unsupported" not in text
    assert "Overhead" not in text and "Cost of a step" not in text


def test_busy_machine_told_without_a_ranking(printed):
    text = printed(busy=("bullet",))
    assert "The machine was busy: for 33% of the cases wall time is more than 1.2 times CPU time." in text
    assert [cells[0] for cells in marks(text).values()] == ["1 ms 1/240", "1.01 ms 1/240", "1.5 ms 1/240"]
    assert (
        "*" not in text
        and "no measurable" not in text
        and "-: error not reached; 1/240 x30: time step, iterations" in text
    )


@pytest.mark.parametrize(
    ("loads", "warned"),
    [
        ([1.0] * 10, ""),
        ([1.0] * 9 + [2.0], ""),
        ([1.0] * 8 + [2.0] * 2, "20%"),
        ([1.2] * 10, ""),
        ([1.21] * 10, "100%"),
    ],
)
def test_busy_machine_from_a_tenth_of_the_units(loads, warned):
    table = pd.DataFrame({"load": [*loads, 50.0], "void": ["" for _ in loads] + ["no answer"]})
    said = speed.busy(table)
    assert bool(said) == bool(warned) and warned in said


def test_no_machine_note_without_timing():
    assert speed.busy(pd.DataFrame()) == ""
    assert speed.busy(pd.DataFrame({"load": [9.0], "void": ["no answer"]})) == ""


def test_the_quality_of_the_timings_is_one_line():
    table = pd.DataFrame({
        "void": ["", "", "no answer"], "width": [0.02, 0.1, math.nan], "rounds": [5, 7, 0],
        "drifts": [True, False, False], "load": np.array([1.0, 1.5, math.nan]),
    })  # fmt: skip
    assert speed.quality_line(table) == (
        "2 cases timed in 12 timings, good to about 6.0 % (median); 1 drifted, 1 not timed; "
        "wall time / CPU time 1.25 (median)"
    )
    assert speed.quality_line(table[table["void"] != ""]) == "nothing was timed"
    assert speed.quality_line(table.iloc[:0, :0]) == "nothing was timed", "a run that was ended before its first time"
