"""Series over runs and releases: exactly the planted steps are marked, and nothing is in series without a step."""

import json
import re
import time
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from reports.brief import FILE, Kept, Summary, summarise
from reports.command import main
from reports.dashboard import events, grid, render
from reports.dashboard.series import _divided, _Entry, _times, panels
from reports.dashboard.steps import ERROR, TIME, steps
from validation.catalogue import CATALOGUE
from validation.cells import Outcome, Slot
from validation.judging.rows import rows_of
from validation.posed import resolve
from validation.records.store import RELEASE_TITLE, Store
from validation.running.plan import QUICK_DT

SERIES = (("chipmunk", "default"), ("chipmunk", "tuned"), ("bullet", "default"), ("bullet", "tuned"))


def marked(found):
    for panel in found:
        for kind, own in (("error", panel.error_steps), ("time", panel.time_steps)):
            yield from ((panel.key[:2], kind, at) for at, _ in own)


def test_exactly_the_four_planted_steps_are_marked(history_panels, planted):
    assert sorted(marked(history_panels)) == sorted((who, kind, first) for who, kind, first, _ in planted)


def test_a_step_has_the_factor_that_was_planted(history_panels, planted):
    for who, kind, first, factor in planted:
        (panel,) = [p for p in history_panels if p.key[:2] == who]
        found = dict(panel.error_steps if kind == "error" else panel.time_steps)
        assert found[first].factor == pytest.approx(factor, rel=0.05)


def without_steps(seed):
    """A history of 60 runs of four series with scatter and no step."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(60):
        cells, ratios = {}, {}
        for who in SERIES:
            key = (*who, "impact", 2)
            cells[key] = {"s": (0.05 * float(np.exp(0.03 * rng.normal())), 1, 1, 1)}
            ratios[key] = (float(np.exp(0.08 * rng.standard_t(4))), "reference/reference")
        out.append(_Entry(str(k), str(k), str(k), Summary(cells, {}), ratios))
    return out


def test_false_alarms_of_twenty_histories_without_a_step():
    alarms = [mark for seed in range(20) for mark in marked(_divided(without_steps(seed), "runs"))]
    assert len(alarms) <= 1, alarms


def test_the_same_series_with_a_step_raise_one():
    """The other side: what raises no false alarm is not blind."""
    entries = without_steps(3)
    key = (*SERIES[0], "impact", 2)
    for entry in entries[35:]:
        ((slot, (error, *rest)),) = entry.summary.cells[key].items()
        entry.summary.cells[key][slot] = (1.5 * error, *rest)
    assert list(marked(_divided(entries, "runs"))) == [(SERIES[0], "error", 35)]


@pytest.mark.parametrize("n", [2, 3, 8, 22])
def test_steps_of_exactly_repeated_values(n):
    for at in range(1, n):
        (found,) = steps([1.0] * at + [1.1] * (n - at), ERROR)
        assert found.at == at and found.factor == pytest.approx(1.1)
    assert steps([1.0] * n, ERROR) == []
    assert steps([1.0] * (n - 1) + [1.005], ERROR) == [] and steps([1.0] * n + [1.08] * n, TIME) == []


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_short_series_without_a_step(n):
    assert steps([1.0] + [9.0] * (n - 1), TIME) == []


def test_single_outlier_of_time_and_lasting_change():
    assert steps([1.0] * 9 + [3.0] + [1.0] * 9, TIME) == []
    assert [step.at for step in steps([1.0] * 9 + [1.5] * 3, TIME)] == [9]


def test_mark_and_direction_of_a_flip():
    entries = []
    for k, fails in enumerate([0, 0, 1, 1, 0]):
        cells = {("e", "p", "impact", 2): {"s": (0.1, fails, 1, fails)}}
        entries.append(_Entry(str(k), str(k), str(k), Summary(cells, {})))
    (panel,) = _divided(entries, "runs")
    assert [(event.at, event.kind, event.worse) for event in events(panel)] == [(2, "flip", True), (4, "flip", False)]
    assert [event.text for event in events(panel)] == ["begins to fail: 1 case", "fixed: 1 case"]
    primary = resolve("impact").primary
    assert (panel.unit, panel.law) == (primary.unit, primary.law)


def test_cells_with_simultaneous_changes_in_one_line():
    entries = []
    for k, (one, other) in enumerate([(0, 1), (0, 1), (1, 0)]):
        cells = {("e", "p", "impact", 2): {"s": (0.1, one, 1, one), "r": (0.1, other, 1, other)}}
        entries.append(_Entry(str(k), str(k), str(k), Summary(cells, {})))
    (panel,) = _divided(entries, "runs")
    (event,) = events(panel)
    assert (event.at, event.text) == (2, "begins to fail: 1 case, fixed: 1 case")


def released(engine, histories):
    """Releases 1.0, 1.1, .. of an engine: per scene the error and how many of four checks fail, release by release."""
    entries = []
    for k, states in enumerate(zip(*histories.values(), strict=True)):
        cells = {(engine, "tuned", scene, 2): {"s": (error, fails, 4, fails)}
                 for scene, (error, fails) in zip(histories, states, strict=True)}  # fmt: skip
        entries.append(_Entry(f"1.{k}", f"{engine} 1.{k}", str(k), Summary(cells, {engine: f"1.{k}"})))
    return _divided(entries, "releases")


HISTORY = {
    "impact": [(0.4, 4), (0.4, 4), (0.4, 4), (1e-3, 0)],
    "bounce": [(0.1, 0), (0.2, 1), (0.2, 1), (0.2, 1)],
    "stack": [(0.3, 2)] * 4,
}


def test_grid_of_changed_scenes_and_failing_share_by_release():
    found = grid("releases", "e", released("e", HISTORY))
    assert found.labels == ["1.0", "1.1", "1.2", "1.3"] and found.same == 1
    assert [(scene, shares) for scene, _, shares in found.lines] == [
        ("impact", [1.0, 1.0, 1.0, 0.0]), ("bounce", [0.0, 0.25, 0.25, 0.25])
    ]  # fmt: skip


def test_opening_of_the_page_with_grid_and_largest_steps():
    panels_of = released("e", HISTORY)
    page = render(panels_of, "generated")
    said = re.sub(r"<[^>]+>", "", page)
    first, second = (
        "With e 1.3, the error of impact 2-D (tuned) falls from 0.4 to 0.001",
        "With e 1.1, the error of bounce",
    )
    assert 0 < page.index('id="grid"') < page.index('id="largest"') < page.index('id="moved"')
    assert 0 < said.index(first) < said.index(second) and "rises from 0.1 to 0.2 h0" in said
    assert '<span class="h w20">100 %</span>' in page and '<span class="h w5">25 %</span>' in page


def test_history_of_one_run_without_a_drawing():
    page = render(released("e", {scene: states[:1] for scene, states in HISTORY.items()}), "generated")
    assert "One run; nothing to compare yet." in page and "<figure" not in page and "<script>" not in page


def test_verdict_unstable_under_moved_starts_is_no_flip():
    """Of the four that fail in turn two pass from a moved start: they neither begin nor cease to fail."""
    entries = []
    for k, (fails, sure) in enumerate([(0, 0), (1, 0), (0, 0), (1, 1), (1, 0), (0, 0)]):
        cells = {("e", "p", "impact", 2): {"s": (0.1, fails, 1, sure)}}
        entries.append(_Entry(str(k), str(k), str(k), Summary(cells, {})))
    (panel,) = _divided(entries, "runs")
    assert [(i, point.lost, point.mended) for i, point in enumerate(panel.points) if point.lost + point.mended] == [
        (3, 1, 0)
    ]
    assert [point.fails for point in panel.points] == [0, 1, 0, 1, 1, 0]


def test_sure_failure_without_a_passing_moved_start(observation):
    who = ("chipmunk", "tuned")
    bad, good = observation(who, 0.2), observation(who, 0.0)
    worse = observation(who, 0.3)  # chaos: far from the other, and as wrong
    count = sum(row.physics == "fail" for row in rows_of("", [bad]))
    assert count

    def moved(of, ulp):
        return replace(of, slot=replace(of.slot, ulp=ulp))

    for others, sure in (
        ([], count),
        ([moved(worse, 1), moved(bad, 2)], count),
        ([moved(worse, 1), moved(good, 2)], 0),
    ):
        ((brief,),) = (c.values() for c in summarise([bad, *others]).cells.values())
        assert (brief[1], brief[3]) == (count, sure)


def test_no_step_between_runs_of_other_questions():
    """A cell that the newest run does not have decides nothing; a run that lacks one has no error."""
    key = ("e", "p", "impact", 2)
    good, bad = (0.1, 0, 1, 0), (9.0, 1, 1, 1)
    cells = [{"a": good}, {"a": good, "b": bad}, {"b": bad}, {"a": good}]
    (panel,) = _divided([_Entry(str(k), "", "", Summary({key: c}, {})) for k, c in enumerate(cells)], "runs")
    assert [point.error for point in panel.points] == [0.1, 0.1, None, 0.1] and not panel.moved


BRIEFS = st.tuples(
    st.none() | st.sampled_from([0.0, 1e-9, 0.1, 0.3]), st.integers(0, 2), st.integers(0, 2), st.integers(0, 2)
).map(lambda b: (b[0], min(b[1], b[2]), b[2], min(b[1], b[2], b[3])))
PANELS = st.dictionaries(st.sampled_from("abc"), BRIEFS, max_size=3)
KEY = ("e", "p", "impact", 2)


def by_definition(panels):
    """Errors, counts and flips of points as `Point` defines them, each point from all that came before it."""
    newest = [own for own in panels if own][-1]
    for k, own in enumerate(panels):
        cells = {slot: brief for slot, brief in own.items() if slot in newest}
        answers = [cells.get(slot, (None,))[0] for slot, brief in newest.items() if brief[0] is not None]
        lost = mended = 0
        for slot, (_, fails, judged, sure) in cells.items():
            earlier = [other[slot] for other in panels[:k] if slot in other]
            if earlier and judged:
                lost += sure > 0 and earlier[-1][1] == 0
                mended += earlier[-1][3] > 0 and fails == 0
        error = max(answers) if answers and None not in answers else None
        yield error, sum(b[1] for b in cells.values()), sum(b[2] for b in cells.values()), lost, mended


@given(st.lists(st.tuples(PANELS, st.booleans(), st.integers(1, 3)), min_size=1, max_size=8))
def test_points_of_repeated_missing_and_timed_runs(history):
    entries = [
        _Entry(f"{k}.{i}", "", "", Summary({KEY: own}, {}), {KEY: (1.0 + k, "reference/reference")} if timed else {})
        for k, (own, timed, times) in enumerate(history)
        for i in range(times)
    ]
    found = _divided(entries, "runs")
    present = [entry for entry in entries if entry.summary.cells[KEY] or entry.ratios]
    if not any(entry.summary.cells[KEY] for entry in present):
        assert found == []
        return
    (panel,) = found
    assert [point.label for point in panel.points] == [entry.label for entry in present]
    assert [point.ratio for point in panel.points] == [entry.ratios.get(KEY, (None,))[0] for entry in present]
    wanted = list(by_definition([entry.summary.cells[KEY] for entry in present]))
    assert [tuple(point[4:9]) for point in panel.points] == wanted


def long_history(folder, runs=500):
    """What the quick suite keeps of ``runs`` runs and benches: every tenth panel scatters, the others repeat."""
    engines = [(*who, dimension) for who in SERIES for dimension in (2, 3)]
    keys = [(engine, profile, scene, dim) for scene in CATALOGUE for engine, profile, dim in engines]
    names = [Slot("impact", (("v", float(v)),), 2, "e", "p", 1 / 240).key() for v in range(4)]
    rng, store, kept = np.random.default_rng(5), Store(folder), Kept(folder)
    for _ in range(runs):
        run, _ = store.start("quick: all", [], fresh=True)
        store.finish(run)
        factors = np.exp(0.03 * rng.normal(size=len(keys)) * (np.arange(len(keys)) % 10 == 0))
        briefs = ({name: (0.1 * v * float(f), 1, 4, 1) for v, name in enumerate(names)} for f in factors)
        kept.put(run.id, Summary(dict(zip(keys, briefs, strict=True)), {"bullet": "1"}))
        bench, _ = store.start("bench quick: all", [], fresh=True)
        store.set_protocol(bench, {})
        store.finish(bench)
        kept.put(
            bench.id,
            Summary({}, {}, {key: (float(f), "reference/reference") for key, f in zip(keys, factors, strict=True)}),
        )
    kept.close()
    return store, len(keys)


@pytest.mark.long
def test_dashboard_of_500_runs_and_benches_below_ten_seconds(tmp_path):
    store, count = long_history(tmp_path)
    begun = time.process_time()
    found = panels(store, tmp_path)
    page = render(found, "long")
    took = time.process_time() - begun
    store.close()
    assert len(found) == count > 400 and all(len(panel.points) == 500 for panel in found)
    assert page.count('class="panel"') == count and page.count('class="line time"') == count
    assert took < 10.0  # s, of one core; imports not counted


def test_exact_errors_as_one_level():
    key = ("e", "p", "impact", 2)
    sizes = [1e-16, 3e-9, 0.0, 2e-12]
    (panel,) = _divided(
        [_Entry(str(k), "", "", Summary({key: {"a": (s, 0, 1, 0)}}, {})) for k, s in enumerate(sizes)], "runs"
    )
    assert not panel.moved


def test_summary_made_once_per_code_version(history_folder, monkeypatch):
    store = Store(history_folder, create=False)
    panels(store, history_folder)
    assert (history_folder / FILE).exists()
    monkeypatch.setattr("reports.dashboard.series.summarise", lambda *a: pytest.fail("judged again"))
    monkeypatch.setattr("reports.dashboard.series.ratios", lambda *a: pytest.fail("ratios taken again"))
    panels(store, history_folder)
    monkeypatch.setattr("reports.brief.judging_code", lambda: "other code")
    with pytest.raises(pytest.fail.Exception):
        panels(store, history_folder)
    store.close()


def of_releases(folder, observation, answers):
    """A store in which releases of an engine answered one cell with these errors."""
    who, store = ("chipmunk", "tuned"), Store(folder)
    for version, error in answers:
        run, _ = store.start(f"{RELEASE_TITLE}chipmunk=={version}: impact", [], fresh=True, apart=version)
        store.add(run, replace(observation(who, error), engine_version=version))
        store.finish(run)
    return store


def test_release_points_by_version_apart_from_runs(tmp_path, observation):
    store = of_releases(tmp_path, observation, [("7.10.0", 0.3), ("7.9.0", 0.0)])
    (panel,) = panels(store, tmp_path)
    newest = store.release_runs("chipmunk", "7.10.0")[0].id
    store.close()
    assert (panel.key, panel.over) == (("chipmunk", "tuned", "impact", 2), "releases")
    assert [(point.label, point.version) for point in panel.points] == [("7.9.0", "7.9.0"), ("7.10.0", "7.10.0")]
    assert [point.error for point in panel.points] == [pytest.approx(0.0, abs=1e-15), pytest.approx(0.3)]
    assert panel.points[1].run == newest and "7.10.0" in panel.points[1].title
    assert panel.flips == [1] and panel.points[0].fails == 0 < panel.points[1].fails


def test_release_judged_again_after_new_cells(tmp_path, observation, monkeypatch):
    store = of_releases(tmp_path, observation, [("7.9.0", 0.0), ("7.10.0", 0.3)])
    judged = []

    def summarised(*of):
        judged.append(of[0][0].engine_version)
        return summarise(*of)

    monkeypatch.setattr("reports.dashboard.series.summarise", summarised)
    first = panels(store, tmp_path)
    assert judged == ["7.9.0", "7.10.0"]
    assert panels(store, tmp_path) == first and judged == ["7.9.0", "7.10.0"]
    store.close()
    store = of_releases(tmp_path, observation, [("7.9.0", 0.1)])
    (panel,) = panels(store, tmp_path)
    store.close()
    assert judged[2:] == ["7.9.0"] and panel.points[0].error == pytest.approx(0.1)


def test_kept_summary_not_judged_again(tmp_path, monkeypatch):
    """Of 500 runs the quick suite's judging takes an hour; reading what they kept takes seconds."""
    words = ["run", "impact", "--param", "e=0.5", "--dim", "2", "--engine", "chipmunk", "--dt", "1/240"]
    done = CliRunner().invoke(main, [*words, "--jobs", "1", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    store = Store(tmp_path, create=False)
    (made,) = store.runs()
    kept = Kept(tmp_path)
    assert kept.get(made.id) == summarise(store.observations(made))
    kept.close()
    monkeypatch.setattr("reports.dashboard.series.summarise", lambda *a: pytest.fail("judged again"))
    assert {panel.key for panel in panels(store, tmp_path)} == {
        ("chipmunk", profile, "impact", 2) for profile in ("default", "tuned")
    }
    store.close()


def test_summary_computed_each_time_without_a_writable_folder(tmp_path):
    kept = Kept(tmp_path / "missing")
    kept.put("run", Summary({}, {}))
    assert kept.get("run") is None
    kept.close()


def test_panel_equal_in_two_runs(tmp_path):
    kept, other = Kept(tmp_path), ("e", "q", "impact", 2)
    for run, error in (("first", 0.1), ("second", 0.2)):
        panel = {"s": (0.5, 0, 1, 0)}
        kept.put(run, Summary({KEY: panel, other: {"s": (error, 0, 1, 0)}}, {}, {KEY: (2.0, "a/b")}))
    first, second = kept.get("first"), kept.get("second")
    kept.close()
    assert first.cells[KEY] is second.cells[KEY] and first.cells[other] != second.cells[other]
    assert first.times == {KEY: (2.0, "a/b")}


def test_summary_written_by_older_code(tmp_path):
    kept, key = Kept(tmp_path), ("e", "p", "impact", 2)
    kept.put("old", Summary({key: {"s": (0.1, 0, 1)}}, {}))  # without the fourth number
    kept.put("new", Summary({key: {"s": (0.1, 0, 1, 0)}}, {}))
    assert kept.get("old") is None and kept.get("new").cells == {key: {"s": (0.1, 0, 1, 0)}}
    kept.close()


def test_failing_checks_counted_in_a_summary(observation):
    who = ("chipmunk", "tuned")
    good, bad = observation(who, 0.0), observation(who, 0.2)
    key = (*who, "impact", 2)
    (brief,) = summarise([bad]).cells[key].values()
    assert brief[0] == pytest.approx(0.2) and brief[1] > 0
    (brief,) = summarise([good]).cells[key].values()
    assert brief[0] == pytest.approx(0.0, abs=1e-15) and brief[1] == 0 and brief[2] > 0
    assert not summarise([replace(bad, outcome=Outcome.INVALID)]).cells
    other_step = replace(bad, slot=Slot("impact", (), 2, *who, 1.0 / 60.0))
    assert not summarise([other_step, replace(bad, slot=replace(bad.slot, iterations=4))]).cells


def test_page_and_moves_of_the_command(history_folder, tmp_path):
    path = tmp_path / "d.html"
    done = CliRunner().invoke(main, ["dashboard", "--out", str(history_folder), "-o", str(path), "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told == {"path": str(path), "panels": 4, "moved": 4}
    text = path.read_text()
    assert "<svg" in text and "4 series of " in text


def test_store_without_a_finished_run_in_one_line(tmp_path):
    Store(tmp_path).close()
    done = CliRunner().invoke(main, ["dashboard", "--out", str(tmp_path)])
    assert done.exit_code == 2 and "has no finished run" in done.output


@pytest.mark.parametrize("was", [True, False])
def test_garbage_collector_restored_after_an_error(was):
    import gc

    from reports.dashboard.series import _nothing_thrown_away

    before = gc.isenabled()
    try:
        (gc.enable if was else gc.disable)()
        with pytest.raises(RuntimeError), _nothing_thrown_away():
            assert not gc.isenabled()
            raise RuntimeError
        assert gc.isenabled() is was
    finally:
        (gc.enable if before else gc.disable)()


def test_time_per_unit_of_work_at_the_quick_step():
    def row(purpose, dt, ratio):
        return {"purpose": purpose, "dt": dt, "ratio": ratio, "opponent": "chipmunk/default", "engine": "reference",
                "profile": "classical", "scene": "stack", "dimension": 2}  # fmt: skip

    key = ("reference", "classical", "stack", 2)
    rows = [row("size", QUICK_DT, 9.0), row("work", 1 / 60, 2.0), row("work", QUICK_DT, 3.0), row("work", 1 / 960, 4.0)]
    assert _times(pd.DataFrame(rows)) == {key: (3.0, "chipmunk/default")}
    assert _times(pd.DataFrame(rows[:2])) == {key: (2.0, "chipmunk/default")}
    assert _times(pd.DataFrame(rows[:1])) == {}
