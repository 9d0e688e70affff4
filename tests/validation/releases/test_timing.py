"""Times of releases: against a loop on the same machine, taken once, and never of what has no answer."""

import json
from dataclasses import replace

import pytest
from click.testing import CliRunner

from adapters import registry
from reports.command import main
from reports.dashboard.series import panels
from validation.bench.stopwatch import Lap
from validation.bench.timing import Timing
from validation.cells import Observation, Outcome, Slot
from validation.records.store import RELEASE_TITLE, Store
from validation.releases import history, timing
from validation.releases.history import Told

DT = 1 / 240
SLOT = Slot("impact", (("e", 0.5),), 2, "toy", "default", DT)


def seen(slot=SLOT, outcome=Outcome.OK):
    return Observation(slot, "c", 1, "1.0", outcome)


def lap(slot=SLOT, round_=0, seconds=0.5, yardstick=0.25, void="", steps=10):
    return {"timed": slot.as_dict(), "round": round_, "order": 0, "yardstick": yardstick, "void": void, "steps": steps,
            "seconds": seconds, "wall_seconds": seconds, "bodies": 1, "state_hash": "ab"}  # fmt: skip


# ---- what is timed -------------------------------------------------------------------------------------------------


def test_timed_cells_of_a_run():
    spatial, other = replace(SLOT, dimension=3), replace(SLOT, profile="other")
    again = replace(SLOT, params=(("e", 0.8),))
    found = timing.timed_cells(map(seen, (SLOT, again, spatial, other)))
    assert found == [SLOT, spatial, other]


@pytest.mark.parametrize(
    "change",
    [{"iterations": 4}, {"ulp": 1}, {"dt": 1 / 60}, {"switched": (("a", 1),)},
     {"scene": "my.toml"}],
)  # fmt: skip
def test_cells_of_sweeps_experiments_and_files_are_not_timed(change):
    assert timing.timed_cells([seen(replace(SLOT, **change))]) == []


@pytest.mark.parametrize("outcome", [Outcome.CRASHED, Outcome.INVALID, Outcome.DIVERGED, Outcome.NOT_INSTALLED])
def test_missing_time_of_a_cell_without_an_answer(outcome):
    again = replace(SLOT, params=(("e", 0.8),))
    assert timing.timed_cells([seen(outcome=outcome), seen(again)]) == []


# ---- what is kept --------------------------------------------------------------------------------------------------


def stored(tmp_path, laps, version="1.0"):
    store = Store(tmp_path)
    run, _ = store.start(f"{RELEASE_TITLE}toy=={version}: times", [], fresh=True, apart=version)
    void = timing.kept(laps, version, lambda timings: store.add_timings(run, timings))
    store.finish(run)
    return store, void


def test_time_as_a_median_ratio_to_the_yardstick(tmp_path):
    """A machine that is four times slower in a round slows both; one lap that was disturbed is outvoted."""
    rounds = [(0.5, 0.25), (2.0, 1.0), (0.5, 0.25), (9.0, 0.25)]
    laps = [lap(round_=k, seconds=taken, yardstick=beside) for k, (taken, beside) in enumerate(rounds)]
    store, void = stored(tmp_path, laps)
    assert history.times(store, "toy", "1.0") == {("toy", "default", "impact", 2): pytest.approx(2.0)}
    assert void == {} and history.times(store, "toy", "2.0") == {} and history.versions(store, "toy") == ["1.0"]
    store.close()


def test_yardstick_per_profile_and_missing_time_when_void(tmp_path):
    other, gone = replace(SLOT, profile="other"), replace(SLOT, profile="gone")
    laps = []
    for k in range(3):
        laps += [lap(round_=k), lap(other, k, 0.75, 0.125), lap(gone, k, 0.0, 0.25, "it crashed")]
    store, void = stored(tmp_path, laps)
    assert history.times(store, "toy", "1.0") == {
        ("toy", "default", "impact", 2): pytest.approx(2.0), ("toy", "other", "impact", 2): pytest.approx(6.0)
    }  # fmt: skip
    assert list(void.values()) == ["gone impact 2-D: it crashed"]
    store.close()


def test_the_newest_times_of_a_release_count(tmp_path):
    stored(tmp_path, [lap(round_=k) for k in range(3)])[0].close()
    store, _ = stored(tmp_path, [lap(round_=k, seconds=1.0) for k in range(3)])
    assert list(history.times(store, "toy", "1.0").values()) == [pytest.approx(4.0)]
    store.close()


def test_pace_over_common_scenes():
    def told(**times):
        return Told("toy", "1", (), times={("toy", "p", scene, 2): time for scene, time in times.items()})

    first = told(a=1.0, b=2.0, c=4.0, gone=9.0)
    assert told(a=2.0, b=2.0, c=1.0, new=50.0).pace(first) == 1.0
    assert told(a=3.0, b=6.0, c=4.0).pace(first) == 3.0
    assert told(new=1.0).pace(first) is None and told().pace(first) is None


def test_lap_between_two_yardsticks(monkeypatch):
    class FakeLane:
        started = 0

        def __init__(self, patience):
            pass

        def start(self):
            FakeLane.started += 1

        def time(self, unit):
            void = "it crashed" if unit.slot.profile == "gone" else ""
            return Lap("1.0", 4.0, 5.0, 6.0, "ab", None, void=void)

        def stop(self):
            FakeLane.started = -FakeLane.started

    ticks = iter(range(1, 100))
    monkeypatch.setattr(timing, "Lane", FakeLane)
    monkeypatch.setattr(timing, "yardstick", lambda: float(next(ticks)))
    gone = replace(SLOT, profile="gone")
    found = list(timing.laps([SLOT, gone], rounds=2))
    assert [(lap["round"], lap["timed"]["profile"], lap["yardstick"], lap["void"]) for lap in found] == [
        (0, "default", 1.5, ""), (0, "gone", 2.5, "it crashed"), (1, "default", 4.5, "")]  # fmt: skip
    assert (found[0]["seconds"], found[0]["wall_seconds"], found[0]["order"], found[1]["order"]) == (4.0, 5.0, 0, 1)
    assert FakeLane.started == -2  # a process per round, and none is left


def test_a_yardstick_is_milliseconds_of_cpu_time():
    assert 1e-4 < timing.yardstick() < 1.0


# ---- on real environments of tiny releases -------------------------------------------------------------------------


@pytest.mark.long
def test_releases_are_timed_in_their_environments_once(toy, tmp_path, monkeypatch):
    def call(*more):
        registry.forget()
        words = ["releases", "toy", "1.0.0,1.2.0", "impact", "--dim", "2", "--param", "e=0.5", "--param", "v=10"]
        done = CliRunner().invoke(main, [*words, "--jobs", "1", "--out", str(tmp_path), *more])
        assert done.exit_code == 0, done.output + repr(done.exception)
        return done

    assert [each["time"] for each in json.loads(call("--json").stdout)["releases"]] == [None, None]
    told = json.loads(call("--times", "--json").stdout)["releases"]
    assert told[0]["time"] == 1.0 and 0.2 < told[1]["time"] < 5.0  # the same code, on a machine that is shared
    store = Store(tmp_path)
    runs = [run for run in store.runs() if run.title.endswith(": times")]
    timings = [each for run in runs for each in store.timings(run)]
    assert len(runs) == 2 and len(timings) == 2 * 2 * timing.ROUNDS
    assert {t.slot.engine for t in timings} == {"toy", "python"} and not any(t.void for t in timings)
    (panel,) = [panel for panel in panels(store, tmp_path) if panel.over == "releases"]
    assert panel.opponent == "a loop of Python" and all(point.ratio for point in panel.points)
    text = call("--times").stdout
    assert "time: relative to the first release" in text and "x1" in text
    assert len([run for run in store.runs() if run.title.endswith(": times")]) == 2  # what is stored is not timed again
    store.close()


def test_lap_kept_with_its_yardstick_under_one_profile():
    told = lap(round_=3, seconds=0.5, yardstick=0.25, void="it hung") | {
        "order": 4, "wall_seconds": 0.75, "bodies": 2, "steps": 120}  # fmt: skip
    own, beside = timing.timings_of(told, "1.5")
    assert own == Timing(
        purpose="work", slot=SLOT, cell="", engine_version="1.5", bodies=2, opponent="python/default", round=3, order=4,
        process=3, sampled=False, steps=120, seconds=0.5, wall_seconds=0.75, state_hash="ab", error=None,
        void="it hung",
    )  # fmt: skip
    assert beside == replace(
        own, slot=replace(SLOT, engine="python"), engine_version="", bodies=0, seconds=0.25, wall_seconds=0.25,
        state_hash="", void="",
    )  # fmt: skip


def test_timing_rounds_in_own_processes_and_void_only_once(monkeypatch):
    """A lap lies between two yardsticks and is told with their mean; the lane ends whatever happens."""
    did, sticks = [], iter(range(1, 100))
    other = replace(SLOT, profile="other")

    class Lane:
        def __init__(self, patience):
            did.append(("made", patience))

        def start(self):
            did.append("started")

        def stop(self):
            did.append("stopped")

        def time(self, unit):
            did.append(unit.slot.profile)
            if len(did) > 9:
                raise RuntimeError("the machine fell asleep")
            return Lap("1.0", 0.5, 0.75, 1.0, "ab", None, "it hung" if unit.slot == other else "")

    monkeypatch.setattr(timing, "Lane", Lane)
    monkeypatch.setattr(timing, "yardstick", lambda: float(next(sticks)))
    told = list(timing.laps([other, SLOT], 2))
    assert did == [("made", timing.PATIENCE), "started", "other", "default", "started", "default", "stopped"]
    unit = timing.work_unit(SLOT, "", None)
    plain = {"wall_seconds": 0.75, "seconds": 0.5, "steps": unit.steps, "bodies": unit.bodies, "state_hash": "ab"}
    assert told == [
        {"timed": other.as_dict(), "round": 0, "order": 0, "yardstick": 1.5, "void": "it hung", **plain},
        {"timed": SLOT.as_dict(), "round": 0, "order": 1, "yardstick": 2.5, "void": "", **plain},
        {"timed": SLOT.as_dict(), "round": 1, "order": 0, "yardstick": 4.5, "void": "", **plain},
    ]
    with pytest.raises(RuntimeError):
        list(timing.laps([SLOT], 5))
    assert did[-1] == "stopped"
