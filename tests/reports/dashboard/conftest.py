"""A generated history: 60 runs and benches of four series, with four planted steps and one flip."""

import numpy as np
import pytest

from reports.dashboard.series import panels
from validation.bench.timing import Timing
from validation.cells import Observation, Outcome, Slot
from validation.records import store as storing
from validation.records.store import Store

RUNS = 60
SERIES = (("chipmunk", "default"), ("chipmunk", "tuned"), ("bullet", "default"), ("bullet", "tuned"))
#: What is planted: series, error or time, first run of the new level, factor.
PLANTED = (
    (("chipmunk", "default"), "error", 20, 2.0),
    (("chipmunk", "default"), "error", 45, 0.5),
    (("bullet", "default"), "time", 30, 1.3),
    (("bullet", "tuned"), "time", 57, 1.6),
)
#: Run-to-run scatter of errors and of ratios of times (log-normal).
SCATTER = 0.03


def slot_of(who, v=6.0):
    return Slot("impact", (("e", 0.5), ("v", v)), 2, *who, 1.0 / 240.0)


def level(who, kind, run, planted=PLANTED):
    return float(np.prod([f for w, k, first, f in planted if (w, k) == (who, kind) and run >= first] or [1.0]))


def observed(who, error, version="1"):
    """A cell whose rebound is off by ``error``, absolute."""
    metrics = {"rebound_ratio": (0.5 + error, ""), "rebound_speed": ((0.5 + error) * 6.0, "")}
    return Observation(slot_of(who), "c", 1, version, Outcome.OK, metrics=metrics)


def timings(who, ratio):
    """Three rounds in which a unit takes ``ratio`` times as long as its opponent, in each."""
    for k in range(3):
        for slot, seconds in ((slot_of(who), 1e-3 * ratio), (slot_of(("reference", "reference")), 1e-3)):
            yield Timing(
                "work", slot, "c", "1", 1, "reference/reference", k, 0, 0, False, 100, seconds, seconds, "h", 0.0
            )


def fill(folder, monkeypatch, planted=PLANTED, runs=RUNS):
    rng = np.random.default_rng(7)
    store = Store(folder)
    for k in range(runs):
        monkeypatch.setattr(storing, "commit", lambda k=k: f"{k:012x}")
        slots = [slot_of(who) for who in SERIES]
        run, _ = store.start("quick: impact", slots, fresh=True)
        for who in SERIES:
            size = 0.05 * level(who, "error", k, planted) * float(np.exp(SCATTER * rng.normal()))
            store.add(run, observed(who, size))
        store.finish(run)
        bench, _ = store.start("bench quick: impact", slots, fresh=True)
        found = {}
        for who in SERIES:
            ratio = level(who, "time", k, planted) * float(np.exp(SCATTER * rng.normal()))
            found |= {(t.slot, t.round): t for t in timings(who, ratio)}
        store.add_timings(bench, list(found.values()))
        store.set_protocol(bench, {"mode": "quick"})
        store.finish(bench)
    store.close()


@pytest.fixture
def planted():
    """What is planted: series, error or time, first run of the new level, factor."""
    return PLANTED


@pytest.fixture
def observation():
    """`observation(who, error)`: a cell whose rebound is off by that much."""
    return observed


@pytest.fixture(scope="session")
def history_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("history")
    with pytest.MonkeyPatch.context() as monkeypatch:
        fill(folder, monkeypatch)
    return folder


@pytest.fixture(scope="session")
def history_panels(history_folder):
    store = Store(history_folder, create=False)
    found = panels(store, history_folder)
    store.close()
    return found


@pytest.fixture(scope="session")
def dashboard_file(history_panels, tmp_path_factory):
    from reports.dashboard import render

    path = tmp_path_factory.mktemp("dashboard") / "dashboard.html"
    path.write_text(render(history_panels, "generated"), encoding="utf-8")
    return path
