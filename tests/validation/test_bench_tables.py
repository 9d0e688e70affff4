"""Tables of a bench run, on planted observations and timings whose answer is known."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from adapters import registry
from validation.bench.agreement import agreement, ratios
from validation.bench.reading import bench_runs, overhead, scaling, scaling_fits, timings_summary
from validation.bench.sweep import Sweep, accuracy_slots, benched, timed_units
from validation.bench.timing import Timing, timing_from_dict
from validation.bench.work import COST_LEVELS, ERROR_LEVELS, error_at_equal_time, time_at_equal_error, work_points
from validation.cells import Observation, Outcome, Slot
from validation.files.distance import primary_of
from validation.posed import resolve
from validation.records.store import Store
from validation.running.plan import QUICK_DT, Request, slots

STEPS = (1 / 60, 1 / 240, 1 / 960)


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path)
    yield opened
    opened.close()


def impact_slot(engine, dt, phase=0, iterations=None, profile="default"):
    delay = primary_of("impact").variations(dt)[phase]["delay"]
    return Slot("impact", (("delay", delay),), 2, engine, profile, dt, iterations)


def observed(slot, error, outcome=Outcome.OK, reason=""):
    truth = resolve("impact").complete({})["e"]
    metrics = {"rebound_ratio": (truth + error, "")}
    return Observation(slot, "cell-" + slot.key(), 1, "1.0", outcome, reason, metrics)


def timing(slot, seconds, round_=0, purpose="work", steps=100, opponent="a/default", **more):
    fields = dict(cell="", engine_version="1.0", bodies=1, order=0, process=0, sampled=False, wall_seconds=seconds)
    fields |= dict(state_hash="s", error=None) | more
    return Timing(purpose, slot, opponent=opponent, round=round_, steps=steps, seconds=seconds, **fields)


def test_timing_stored_with_fields_that_are_gone():
    stored = timing(impact_slot("a", STEPS[0]), 1.0)
    assert timing_from_dict(stored.as_dict() | {"worlds": 1, "threads": 1, "kernel": ""}) == stored
    with pytest.raises(TypeError, match="unheard"):
        timing_from_dict(stored.as_dict() | {"unheard": 1})


def filled(store, errors, costs, title="bench test"):
    """A run with a work point per (engine, dt): supremum error, and cost in s/s."""
    cells = [
        observed(impact_slot(e, dt, k), error * (k + 1) / 16) for (e, dt), error in errors.items() for k in range(16)
    ]
    run, _ = store.start(title, [cell.slot for cell in cells], fresh=True)
    for cell in cells:
        store.add(run, cell)
    for (engine, dt), cost in costs.items():
        rounds = [
            timing(impact_slot(engine, dt), cost * 100 * dt * noise, k) for k, noise in enumerate((1.0, 1.01, 0.99))
        ]
        store.add_timings(run, rounds)
    store.set_protocol(run, {})
    return run


def test_raw_timings_come_back_as_they_went_in(store):
    run, _ = store.start("bench", [])
    kept = [timing(impact_slot("a", dt), 0.1, k, error=1e-3, sampled=bool(k % 2)) for k, dt in enumerate(STEPS)]
    store.add_timings(run, kept)
    assert store.timings(run) == kept
    store.clear_timings(run)
    assert store.timings(run) == []


def test_bench_run_beside_other_runs(store):
    first = filled(store, {}, {})
    assert store.run("latest").id == first.id and [run.id for run in bench_runs(store)] == [first.id]
    plain, _ = store.start("quick: impact", [impact_slot("a", 0.1)])
    filled(store, {("a", STEPS[0]): 0.1}, {})
    assert store.run("latest").id == plain.id


def test_work_point_of_the_worst_phase(store):
    run = filled(store, {("a", STEPS[0]): 0.4}, {("a", STEPS[0]): 0.02})
    (point,) = work_points(store, run).to_dict("records")
    assert point["error"] == pytest.approx(0.4) and point["cells"] == 16
    assert point["cost"] == pytest.approx(0.02) and point["cost_low"] <= point["cost"] <= point["cost_high"]
    assert point["worst"] == dict(impact_slot("a", STEPS[0], 15).params)
    assert point["slot"] == impact_slot("a", STEPS[0], 0).as_dict()
    assert point["iterations"] is None and point["reason"] == ""
    assert point["rounds"] == 3


def test_untimed_work_point_without_rounds(store):
    (point,) = work_points(store, filled(store, {("a", STEPS[0]): 0.4}, {})).to_dict("records")
    assert point["rounds"] == 0 and math.isnan(point["cost"]) and point["reason"] == "not timed"


@pytest.mark.parametrize("outcome", [Outcome.INVALID, Outcome.DIVERGED, Outcome.CRASHED, Outcome.UNSUPPORTED])
def test_point_with_one_invalid_phase(store, outcome):
    run = filled(store, {("a", STEPS[0]): 0.4, ("a", STEPS[1]): 0.1}, {})
    bad = replace(observed(impact_slot("a", STEPS[0], 7), 0.0), outcome=outcome, reason="it is not as declared")
    store.add(run, bad)
    point = work_points(store, run).set_index("dt").loc[STEPS[0]]
    assert math.isnan(point["error"]) and "it is not as declared" in point["reason"]
    assert point["outcome"] == outcome.value
    sweep = Sweep(Request(["impact"], []))
    assert {unit.slot.dt for unit in timed_units(sweep, store.observations(run))} == {STEPS[1]}


def test_a_void_timing_has_no_number(store):
    run = filled(store, {("a", STEPS[0]): 0.4}, {("a", STEPS[0]): 0.02})
    store.add_timings(run, [timing(impact_slot("a", STEPS[0]), 0.1, 3, void="the process ended")])
    (point,) = work_points(store, run).to_dict("records")
    assert math.isnan(point["cost"]) and point["error"] == pytest.approx(0.4)
    assert timings_summary(store, run)["void"].tolist() == ["the process ended"]


def random_points(store, seed):
    rng = np.random.default_rng(seed)
    keys = list(product("abc", STEPS))
    errors = {key: 10.0 ** rng.uniform(-6, 0) for key in keys}
    costs = {key: 10.0 ** rng.uniform(-4, 0) for key in keys}
    return errors, costs, work_points(store, filled(store, errors, costs, f"bench {seed}"))


@pytest.mark.parametrize("seed", range(5))
def test_cheapest_exact_enough_point_at_equal_error(store, seed):
    errors, costs, points = random_points(store, seed)
    table = time_at_equal_error(points).set_index(["engine", "level"])
    for engine, level in product("abc", ERROR_LEVELS):
        good = [costs[engine, dt] for dt in STEPS if errors[engine, dt] <= level]
        row = table.loc[(engine, level)]
        if good:
            assert row["cost"] == pytest.approx(min(good)) and row["error"] <= level and row["dt"] in STEPS
        else:
            smallest = min(errors[engine, dt] for dt in STEPS)
            assert math.isnan(row["cost"]) and f"{smallest:.2g}" in row["reason"]
    for level in ERROR_LEVELS:
        ranked = table.xs(level, level="level")["cost"].dropna().sort_values()
        if len(ranked):
            winner = table.loc[(ranked.index[0], level)]
            assert winner["rank"] == 1 and winner["times_cheapest"] == 1.0


@pytest.mark.parametrize("seed", range(5))
def test_most_exact_cheap_enough_point_at_equal_time(store, seed):
    errors, costs, points = random_points(store, seed)
    table = error_at_equal_time(points).set_index(["engine", "level"])
    for engine, level in product("abc", COST_LEVELS):
        good = [errors[engine, dt] for dt in STEPS if costs[engine, dt] <= level]
        row = table.loc[(engine, level)]
        assert row["error"] == pytest.approx(min(good)) if good else math.isnan(row["error"]) and row["reason"]


def test_best_points_undominated_by_any_engine(store):
    errors = {("a", STEPS[0]): 1e-1, ("a", STEPS[1]): 1e-3, ("b", STEPS[0]): 1e-2, ("b", STEPS[1]): 1e-2}
    costs = {("a", STEPS[0]): 1e-3, ("a", STEPS[1]): 1e-1, ("b", STEPS[0]): 1e-2, ("b", STEPS[1]): 2e-2}
    points = work_points(store, filled(store, errors, costs)).set_index(["engine", "dt"])
    assert points["best"].to_dict() == {key: key != ("b", STEPS[1]) for key in errors}
    assert points["on_front"].to_dict() == {key: key != ("b", STEPS[1]) for key in errors}


def test_cost_corrected_by_an_empty_scene(store):
    run = filled(store, {("a", STEPS[1]): 0.1}, {("a", STEPS[1]): 1e-3})
    empty = Slot("empty", (), 2, "a", "default", 1 / 240)
    store.add_timings(run, [timing(empty, 240e-6, k, "overhead", 240) for k in range(3)])  # 1 us a step
    (point,) = work_points(store, run).to_dict("records")
    assert point["cost_corrected"] == pytest.approx(1e-3 - 240 * 1e-6)
    assert overhead(timings_summary(store, run))["per_step"].tolist() == pytest.approx([1e-6])


def test_planted_scaling_is_found_above_the_overhead(store):
    run, _ = store.start("bench", [])
    for rows in (1, 2, 4, 7, 13, 24):
        n = rows * (rows + 1) // 2
        slot = Slot("pyramid", (("rows", float(rows)),), 2, "a", "default", 1 / 240)
        seconds = 24 * max(1e-6, 1e-7 * n**1.3) * (0 if rows == 24 else 1)
        void = "left out" if rows == 24 else ""
        store.add_timings(run, [timing(slot, seconds, 0, "bodies", 24, bodies=n, void=void)])
    (fit,) = scaling_fits(scaling(timings_summary(store, run))).to_dict("records")
    assert fit["exponent"] == pytest.approx(1.3, abs=1e-9) and fit["points"] == 3
    assert (fit["smallest"], fit["largest"]) == (10.0, 91.0)


def planted_lane(store, factor, title, jitter=0.005, seed=0):
    """Twenty rounds on a machine that becomes three times slower half-way; b takes ``factor`` times as long as a."""
    rng = np.random.default_rng(seed)
    run, _ = store.start(title, [], fresh=True)
    for dt, k in product(STEPS, range(20)):
        slow = 3.0 if k >= 10 else 1.0
        for engine, own in (("a", 1.0), ("b", factor)):
            seconds = 1e-3 * own * slow * (1.0 + jitter * rng.standard_normal())
            store.add_timings(run, [timing(impact_slot(engine, dt), seconds, k)])
    store.set_protocol(run, {})
    return run


def test_a_ratio_survives_a_machine_that_slows_down(store):
    run = planted_lane(store, 1.5, "bench one")
    summary = timings_summary(store, run)
    assert summary["drifts"].all() and (summary["drift"] > 1.5).all()
    found = ratios(store, run)
    assert (found["engine"] == "b").all() and len(found) == len(STEPS)
    # Twenty pairs with a jitter of 0.7 % each: the median is good to 0.2 %, five of them are allowed.
    assert found["ratio"].to_numpy() == pytest.approx(1.5, rel=0.01)
    assert ((found["ratio_low"] <= 1.5) & (found["ratio_high"] >= 1.5)).sum() >= 2


def test_equal_runs_and_a_slow_down_of_a_tenth(store):
    first, second = planted_lane(store, 1.5, "bench one", seed=1), planted_lane(store, 1.5, "bench two", seed=2)
    slower = planted_lane(store, 1.65, "bench three", seed=3)
    base = ratios(store, first)
    assert agreement(base, ratios(store, second))["agrees"].all()
    assert not agreement(base, ratios(store, slower))["agrees"].any()


def test_versions_that_differ_are_not_compared(store):
    first, second = planted_lane(store, 1.5, "bench one"), planted_lane(store, 1.5, "bench two")
    other = ratios(store, second).assign(opponent_version="2.0")
    assert len(agreement(ratios(store, first), other)) == 0


def test_phases_of_a_sweep():
    sweep = Sweep(Request(["impact"], ["reference"], profiles=["classical"], dimensions=[2]), dts=STEPS, iterations=[1])
    asked = accuracy_slots(sweep)
    assert len(asked) == 16 * len(STEPS) * 2
    assert {(slot.dt, slot.iterations) for slot in asked} == set(product(STEPS, (None, 1)))


def test_quick_benchmark_of_a_dozen_quick_suite_scenes():
    """At 1/240 s and each profile's own iterations; contact times within a step are the benchmark's alone."""
    scenes = benched("quick")
    asked = accuracy_slots(Sweep(Request(scenes, ["reference", "chipmunk"])))
    own = set(asked).difference(slots(Request(scenes, ["reference", "chipmunk"])))
    assert len(scenes) == 12 and len(own) < 0.8 * len(asked)
    assert {slot.scene for slot in own if slot.dt == QUICK_DT and slot.iterations is None} == {"impact"}


@pytest.mark.parametrize(("scene", "dimensions"), [("slide", (2, 3)), ("tumble", (3,))])
def test_dimensions_of_a_quick_benchmark(scene, dimensions):
    def asked(**more):
        return {slot.dimension for slot in accuracy_slots(Sweep(Request([scene], ["reference"], **more)))}

    assert asked() == {dimensions[0]} and asked(suite="full") == set(dimensions) == asked(dimensions=dimensions)


@pytest.mark.parametrize("suite", ["quick", "full"])
def test_bench_cases_of_the_error_even_at_defaults(suite):
    assert primary_of("slide").variations(1 / 240) == [{}] and len(resolve("slide").variations(suite)) > 1
    assert {slot.params for slot in accuracy_slots(Sweep(Request(["slide"], ["reference"], suite=suite)))} == {()}


def test_a_fixed_parameter_replaces_the_phases():
    sweep = Sweep(
        Request(["bounce"], ["reference"], profiles=["classical"], dimensions=[2]), [1 / 240], params={"height": 2.0}
    )
    assert [slot.params for slot in accuracy_slots(sweep)] == [(("height", 2.0),)]


def test_profiles_without_a_rank_neither_best_nor_tied(store, monkeypatch):
    """The dearest and least exact has the first rank, where the others have none."""
    monkeypatch.setattr("validation.bench.work.is_ranked", lambda engine, profile: engine != "b")
    run = filled(store, {("a", STEPS[0]): 0.05, ("b", STEPS[0]): 0.01}, {("a", STEPS[0]): 0.2, ("b", STEPS[0]): 0.1})
    points = work_points(store, run)
    assert dict(zip(points["engine"], points["best"], strict=True)) == {"a": True, "b": False}
    for table, column in ((time_at_equal_error(points), "cost"), (error_at_equal_time(points), "error")):
        reached = table[table[column].notna()]
        assert set(reached["engine"]) == {"a", "b"}
        ranks = reached.groupby("engine")["rank"].unique()
        assert ranks["a"].tolist() == [1.0] and np.isnan(ranks["b"]).all()
        assert not reached[reached["engine"] == "b"]["tied"].any() and reached[reached["engine"] == "a"]["tied"].all()


@pytest.mark.skipif(registry.find("mujoco").engine is None, reason="mujoco is not installed")
def test_bench_of_a_profile_without_a_rank():
    def benched(*profiles):
        sweep = Sweep(Request(["impact"], ["mujoco"], profiles, dimensions=[2]), dts=STEPS[:1])
        return {slot.profile for slot in accuracy_slots(sweep)}, {unit.slot.profile for unit in timed_units(sweep, [])}

    assert benched() == ({"default", "tuned"},) * 2
    assert benched("matched") == ({"matched"},) * 2


def test_ratios_without_an_iteration_count(store):
    first = ratios(store, planted_lane(store, 1.5, "bench one"))
    both = agreement(first, first)
    assert len(both) == len(first) > 0 and set(both["iterations"]) == {0.0}
    assert list(both["params_text"]) == [repr(sorted(params.items())) for params in first["params"]]
    assert (both["ratio_1"] == both["ratio_2"]).all() and both["agrees"].all()
