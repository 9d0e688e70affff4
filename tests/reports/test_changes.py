"""What `compare` says in full: both sides, the headline, one line a family; and where its sides come from."""

import json
from dataclasses import replace

import pytest

from reports import changes
from reports.changes import Side, as_json, as_markdown, as_text, header, headline, load_side
from reports.wording import reproduce
from validation.bench.agreement import ratios
from validation.bench.reading import bench_runs
from validation.cells import Observation, Outcome, Slot
from validation.judging.comparison import Change, Kind
from validation.metrics import NEWER
from validation.records.store import MissingError, Store

SLOT = {"scene": "stack", "params": {"n": 5.0}, "dimension": 2, "engine": "bullet", "profile": "tuned",
        "dt": 1 / 240, "iterations": None, "ulp": 0}  # fmt: skip
FLIP = Change(Kind.FLIP, True, "bullet", "tuned", "stack", 2, "n=5", "drift", "pass 1e-6 m", "FAIL 3e-3 m", 2.5, SLOT,
              "3.2.6 -> 3.2.7")  # fmt: skip
MILDER = replace(FLIP, size=1.5, params="n=2")
BETTER = replace(FLIP, kind=Kind.ERROR, regressed=False, metric="interface_impulse[3]", size=-0.25, note="")
FASTER = replace(FLIP, kind=Kind.SPEED, regressed=False, metric="time", size=0.5, note="")
GONE = replace(FLIP, kind=Kind.REMOVED, regressed=False, metric="interface_impulse[1]", size=0.0, after="-")
ALSO_GONE = replace(GONE, metric="interface_impulse[2]")
ADDED = replace(FLIP, kind=Kind.ADDED, regressed=False, scene="incline", metric="creep", size=0.0, before="-")


def side(run, *engines, commit="", date=""):
    rows = [{"engine": name, "engine_version": version, "slot": {}, "metric": name} for name, version in engines]
    return Side(rows, (), run, date, commit)


A = side(
    "one", ("bullet", "3.2.6"), ("mujoco", "4.0.1"), ("chipmunk", "7.3.1"), ("ours", ""), commit="0123456789abcdef"
)
B = side("", ("bullet", "3.2.7"), ("mujoco", "4.0.1"), ("planck", "1.0"), date="today")


def test_header_of_changes():
    assert header(A, B) == [
        "A: one (commit 0123456789ab, 4 checks)",
        "B: checks (3 checks)",
        "versions that differ: bullet 3.2.6 -> 3.2.7, chipmunk 7.3.1 -> not run, planck not run -> 1.0",
        "same versions: mujoco 4.0.1",
    ]
    assert header(A, A)[2:] == ["same versions: bullet 3.2.6, mujoco 4.0.1, chipmunk 7.3.1"]
    assert header(side("x", ("a", "1")), side("y", ("a", "2")))[2:] == ["versions that differ: a 1 -> 2"]


def test_the_headline_counts_kinds_and_what_got_worse():
    assert headline([ADDED, GONE, BETTER, FLIP, FASTER, MILDER, ALSO_GONE], A, B) == (
        "2 in both: 2 newly failing; 1 value changed (0 worse); 1 speed changed (0 worse); 1 only in B; 2 not run in B"
    )
    assert headline([FLIP, replace(FLIP, regressed=False)], A, B) == "2 in both: 1 newly failing; 1 fixed"
    assert headline([], A, A) == "4 in both: none changed"


def test_headline_of_runs_of_different_extent():
    assert headline([GONE, ALSO_GONE, ADDED], A, B) == "2 in both: none changed; 1 only in B; 2 not run in B"
    timed = Side((), [{"purpose": "work", "slot": {}, "opponent": "toy"}])
    assert headline([], timed, timed) == "1 in both: none changed"
    newer = Side([{**row, "reason": NEWER} for row in A.rows], ())
    for other in (newer, Side((), ()), side("", ("rapier", "1"))):
        assert headline([GONE], A, other) == "no check is in both; 1 not run in B"


def test_lines_of_families_with_their_commands():
    again = reproduce(SLOT)
    lines = as_text([MILDER, GONE, BETTER, FLIP, ALSO_GONE, FASTER, ADDED], A, B).splitlines()
    assert lines[:5] == [*header(A, B), headline([MILDER, GONE, BETTER, FLIP, ALSO_GONE, FASTER, ADDED], A, B)]
    assert sorted(lines[5:]) == sorted([
        "newly failing: bullet/tuned stack 2-D n=5 drift: pass 1e-6 m -> FAIL 3e-3 m error +2.5 tolerances "
        "[3.2.6 -> 3.2.7], and 1 more like it",
        f"{Kind.ERROR.value} (not worse): bullet/tuned stack 2-D n=5 interface_impulse[3]: pass 1e-6 m -> "
        "FAIL 3e-3 m error -0.25 tolerances",
        f"{Kind.SPEED.value} (not worse): bullet/tuned stack 2-D n=5 time: pass 1e-6 m -> FAIL 3e-3 m x0.5",
        *3 * [f"    {again}"],
        f"{Kind.REMOVED.value}: bullet/tuned: 2 checks of stack",
        f"{Kind.ADDED.value}: bullet/tuned: 1 check of incline",
    ])  # fmt: skip
    assert as_text([], A, A).endswith("\n4 in both: none changed\n")


def test_one_sided_checks_by_profile_and_scene():
    scenes = ["arch", "bounce", "cradle", "domino", "edge_drop", "flat_box"]
    gone = [replace(GONE, engine="mujoco", profile="default", scene=scene, metric=m) for scene in scenes for m in "ab"]
    assert as_text(gone, A, B).splitlines()[5:] == [
        f"{Kind.REMOVED.value}: mujoco/default: 12 checks of arch, bounce, cradle, domino and 2 more",
        "Profiles: default: as shipped.",
    ]
    assert as_markdown(gone, A, B).endswith("\n\nProfiles: default: as shipped.\n")


def test_change_without_a_size():
    line, _ = as_text([replace(FLIP, size=0.0, params="")], A, B).splitlines()[5:]
    assert line.endswith("stack 2-D drift: pass 1e-6 m -> FAIL 3e-3 m [3.2.6 -> 3.2.7]")


def test_markdown_table_of_families_with_escaped_text():
    odd = replace(BETTER, metric="a|b`c", before="<1>", after="2 & 3")
    text = as_markdown([FLIP, MILDER, odd], A, B)
    value, flip = Kind.ERROR.value, "newly failing"
    assert text == "\n".join([
        f"**contact-crosscheck compare**: {headline([FLIP, MILDER, odd], A, B)}", "",
        *[f"* {line.replace('>', '&gt;')}" for line in header(A, B)], "",
        "| change | | checks | where | metric | before | after | size |",
        "|---|---|---|---|---|---|---|---|",
        f"| {flip} | worse | 2 | bullet/tuned stack 2-D n=5 | `drift` | pass 1e-6 m | FAIL 3e-3 m | "
        "error +2.5 tolerances |",
        f"| {value} |  | 1 | bullet/tuned stack 2-D n=5 | `a\\|b'c` | &lt;1&gt; | 2 &amp; 3 | "
        "error -0.25 tolerances |", "",
    ])  # fmt: skip
    assert "| change |" not in as_markdown([], A, B)


def test_markdown_says_how_many_families_it_leaves_out():
    every = [replace(FLIP, metric=f"m{k}") for k in range(53)]
    text = as_markdown(every, A, B)
    assert text.count("| worse |") == 50
    assert text.endswith("\n\n... and 3 more families; `crosscheck compare --json` lists every change\n")
    assert "more families" not in as_markdown(every[:50], A, B)
    assert as_markdown(every, A, B, most=52).endswith(
        "\n... and 1 more family; `crosscheck compare --json` lists every change\n"
    )


def test_json_has_both_sides_and_every_change():
    text = as_json([FLIP, MILDER], A, B)
    data = json.loads(text)
    assert data == {
        "a": {"run": "one", "date": "", "commit": "0123456789abcdef", "rows": 4,
              "versions": {"bullet": "3.2.6", "mujoco": "4.0.1", "chipmunk": "7.3.1"}},
        "b": {"run": "", "date": "today", "commit": "", "rows": 3,
              "versions": {"bullet": "3.2.7", "mujoco": "4.0.1", "planck": "1.0"}},
        "headline": headline([FLIP, MILDER], A, B),
        "in_both": 2,
        "changes": [FLIP.as_dict(), MILDER.as_dict()],
    }  # fmt: skip
    assert text.startswith('{\n "a": {\n  "run"')


# ---- where sides come from -----------------------------------------------------------------------------------------

CELL = Slot("impact", (("e", 0.8),), 2, "nameless", "default", 1 / 240)


@pytest.fixture
def results(tmp_path, request):
    """A folder with two runs, and their ids; one of them may be a bench."""
    bench = getattr(request, "param", None)
    store, ids = Store(tmp_path / "results"), []
    for e in (0.5, 0.8):
        asked = replace(CELL, params=(("e", e),))
        run, _ = store.start(f"{'bench ' if e == bench else ''}e = {e}", [asked])
        store.add(run, Observation(asked, f"cell {e}", 1, "1.0", Outcome.OK, metrics={"rebound_ratio": (e, "")}))
        store.finish(run)
        ids.append(run)
    store.close()
    return tmp_path / "results", ids


@pytest.fixture
def released(tmp_path):
    """A folder with what two releases of an engine said, the older one in two runs, and the newest run of each."""
    store, newest = Store(tmp_path / "results"), {}
    for version, e in (("9.0", 0.5), ("10.0", 0.8), ("9.0", 0.75)):
        asked = replace(CELL, params=(("e", e),))
        run, _ = store.start(f"release nameless=={version}: impact", [asked], fresh=True, apart=version)
        store.add(run, Observation(asked, "c", 1, version, Outcome.OK, metrics={"rebound_ratio": (e, "")}))
        store.finish(run)
        newest[version] = run
    store.close()
    return tmp_path / "results", newest


def test_side_of_a_release_with_all_its_runs(released, monkeypatch):
    folder, newest = released
    runs = {run.id: replace(run, date=f"on day {k}", commit=f"commit {k}") for k, run in enumerate(newest.values())}
    seen = changes.Store.runs
    seen = changes.Store.release_runs
    monkeypatch.setattr(
        changes.Store, "release_runs", lambda store, *asked: [runs.get(run.id, run) for run in seen(store, *asked)]
    )
    found = load_side("nameless==9.0", folder)
    own = runs[newest["9.0"].id]
    assert (found.run, found.date, found.commit) == ("nameless==9.0", own.date, own.commit)
    assert found.ratios == [] and found.versions == {"nameless": "9.0"}
    values = [row["value"] for row in found.rows if row["metric"] == "rebound_ratio"]
    assert values == [0.5, 0.75]
    assert value(load_side("nameless==10.0", folder)) == 0.8


def test_missing_release_refused_with_the_known_ones(released, tmp_path):
    folder, _ = released
    for argument, known in (("nameless==8.0", "9.0, 10.0"), ("another==9.0", "none")):
        with pytest.raises(MissingError) as caught:
            load_side(argument, folder)
        assert str(caught.value) == f"run: {Store(folder).path} has no release {argument}; it has {known}"
    with pytest.raises(MissingError):
        load_side("nameless==9.0", tmp_path / "not there")
    assert not (tmp_path / "not there").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (replace(FLIP, kind=Kind.SPEED, size=0.123456), "x0.123"),
        (replace(FLIP, size=0.123456), "error +0.123 tolerances"),
        (replace(FLIP, size=-0.5), "error -0.5 tolerances"), (replace(FLIP, size=0.0), ""),
    ],
)  # fmt: skip
def test_signs_and_digits_of_sizes(change, said):
    assert as_markdown([change], A, B).splitlines()[-1].endswith(f"| {said} |")


def value(found):
    (row,) = [row for row in found.rows if row["metric"] == "rebound_ratio"]
    return row["value"]


def test_side_by_run_or_folder(results, tmp_path):
    folder, (first, last) = results
    for argument, expected in [(first.id, first), (last.id, last), ("latest", last), (str(folder), last),
                               (f"{folder}:{first.id}", first), (f"{folder}:latest", last)]:  # fmt: skip
        elsewhere = tmp_path / "elsewhere" if argument.startswith(str(folder)) else folder
        found = load_side(argument, elsewhere)
        assert (found.run, found.date, found.commit) == (expected.id, expected.date, expected.commit), argument
        assert value(found) == (0.5 if expected is first else 0.8), argument
        assert {row["run"] for row in found.rows} == {expected.id}
        assert list(found.ratios) == []


@pytest.mark.parametrize("results", [0.8], indirect=True)
def test_times_of_the_last_or_a_named_run(results, monkeypatch):
    """The last run is a bench run here: rows are of the last that is none, ratios of the bench run."""
    import pandas as pd

    folder, (first, last) = results
    monkeypatch.setattr(changes, "bench_runs", lambda store: [run for run in store.runs() if run.id == last.id])
    monkeypatch.setattr(changes, "ratios", lambda store, bench: pd.DataFrame([{"of": bench.id, "ratio": 2.0}]))
    latest = load_side("latest", folder)
    assert (latest.run, value(latest), latest.ratios) == (first.id, 0.5, [{"of": last.id, "ratio": 2.0}])
    named = load_side(last.id, folder)
    assert (named.run, value(named), named.ratios) == (last.id, 0.8, [{"of": last.id, "ratio": 2.0}])
    assert load_side(first.id, folder).ratios == []


def test_comparison_of_bench_runs_only(results, monkeypatch):
    import pandas as pd

    folder, (_, last) = results
    monkeypatch.setattr(changes, "bench_runs", lambda store: store.runs())
    monkeypatch.setattr(changes, "ratios", lambda store, bench: pd.DataFrame([{"of": bench.id}]))
    found = load_side("latest", folder)
    assert found.run == last.id and len(found.ratios) == 1


ROW = {"slot": {}, "metric": "drift", "value": 1.0}
TIME = {"slot": {}, "purpose": "p", "ratio": 2.0}


def written(tmp_path, *lines):
    path = tmp_path / "rows.jsonl"
    path.write_text("".join((line if isinstance(line, str) else json.dumps(line)) + "\n" for line in lines))
    return path


def test_side_from_a_file_of_rows_and_ratios(tmp_path):
    rows = [{**ROW, "run": "one"}, {**ROW, "run": "two"}, {**ROW, "run": "one"}]
    found = load_side(str(written(tmp_path, *rows, "", "  ", TIME)), tmp_path)
    assert (found.rows, found.ratios, found.run) == (rows, [TIME], "one, two")
    assert load_side(str(written(tmp_path, ROW)), tmp_path).run == "rows.jsonl"


@pytest.mark.parametrize("line", [{"slot": {}, "metric": "drift"}, {"slot": {}, "ratio": 1.0}, [1], "7", {}])
def test_a_file_that_holds_anything_else_is_refused(tmp_path, line):
    path = written(tmp_path, ROW, line)
    with pytest.raises(MissingError) as caught:
        load_side(str(path), tmp_path)
    assert str(caught.value) == f"run: {path} does not hold rows of this project"


def test_refusal_of_an_unreadable_file(tmp_path):
    for path in (tmp_path / "none.jsonl", written(tmp_path, "{")):
        with pytest.raises(MissingError) as caught:
            load_side(str(path), tmp_path)
        assert (
            str(caught.value).startswith(f"run: cannot read {path}: ") and len(str(caught.value)) > len(str(path)) + 20
        )


@pytest.mark.parametrize(
    ("argument", "said"),
    [
        ("", "run: a side is empty; `.` is the folder that you are in"),
        ("before/run", "run: there is no folder before/run; crosscheck compare --help says what a side may be"),
        ("before:latest", "run: there is no folder before; crosscheck compare --help says what a side may be"),
    ],
)
def test_wrong_run_id_refused_by_its_likely_meaning(tmp_path, argument, said):
    with pytest.raises(MissingError) as caught:
        load_side(argument, tmp_path)
    assert str(caught.value) == said


def test_special_files_not_waited_for(tmp_path):
    folder = tmp_path / "rows.jsonl"
    folder.mkdir()
    with pytest.raises(MissingError) as caught:
        load_side(str(folder), tmp_path)
    assert str(caught.value) == f"run: cannot read {folder}: it is not a regular file"


def test_missing_run_refused_without_creating_a_folder(tmp_path):
    with pytest.raises(MissingError):
        load_side("nothing", tmp_path / "not there")
    assert not (tmp_path / "not there").exists()


def test_comparison_of_last_run_with_last_bench(page_folder, monkeypatch):
    kept = Store.run
    monkeypatch.setattr(Store, "run", lambda self, name: replace(found := kept(self, name), commit=f"at {found.id}"))
    store = Store(page_folder, create=False)
    bench = bench_runs(store)[-1]
    run = [run for run in store.runs() if run.id != bench.id][-1]
    wanted = [row for table in [ratios(store, bench)] for row in table.to_dict("records")]
    store.close()
    found = changes._load_run(page_folder, "latest")
    assert (found.run, found.date, found.commit) == (run.id, run.date, f"at {run.id}") and found.rows
    assert list(found.ratios) == [{str(k): v for k, v in row.items()} for row in wanted] and wanted
