"""Commands from the call to the whole answer where what they ask is made up: what is asked, said, written, returned."""

import json
import math
from dataclasses import asdict, replace
from types import SimpleNamespace

import pandas as pd
import pytest
from click.testing import CliRunner

from adapters import registry
from adapters.scene import SceneError
from reports import speed
from reports.command import accepting, benching, curing, driving, fielding, main, selection, statuses, weighing
from reports.fixes import cure_paste
from reports.spread import spread_lines
from reports.wording import reproduce
from validation import field
from validation.canonical import Check
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.findings import Family, Finding
from validation.fixes.kept import cures_of, read
from validation.fixes.search import Unsearched
from validation.judging.acceptance import Change, Proposal
from validation.questions import frontier
from validation.questions.residuals import LAWS, Residuals
from validation.questions.spread import Spread
from validation.records.store import Store
from validation.running.plan import Request
from validation.settings.switching import Reading

for package in ("pymunk", "mujoco"):
    pytest.importorskip(package)

#: What is kept of an engine of ours: cures as they are told.
KEPT = dict(list(cures_of("chipmunk").items())[:6])


def said(*arguments, **given):
    """Status, and what went to each stream, line by line."""
    found = CliRunner().invoke(main, list(arguments), env={"COLUMNS": "120", "NO_COLOR": "1", "TERM": "dumb"}, **given)
    return found.exit_code, found.stdout, found.stderr.splitlines()


# ---- cures -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def searched(monkeypatch):
    """Searches that were asked for; they find what is kept, and nothing in space."""
    asked = []

    def search(engine, scene, dimension, jobs, params, dt):
        assert params is None and dt is None
        asked.append((engine, scene, dimension, jobs))
        return KEPT.get((scene, dimension)) or Unsearched(asked=True, reason="nothing of it fails")

    monkeypatch.setattr(curing, "search", search)
    return asked


def test_cures_searched_by_scene_and_dimension_as_data(searched):
    names = list(dict.fromkeys(scene for scene, _ in KEPT))
    status, out, err = said("cure", "chipmunk", *names, "--json", "--jobs", "3")
    wanted = [("chipmunk", scene, d, 3) for scene in names for d in curing.resolve(scene).dimensions]
    assert (status, searched) == (0, wanted)
    assert err == [f"{engine} {scene} {dimension}-D" for engine, scene, dimension, _ in wanted]
    own = [KEPT[scene, d] for _, scene, d, _ in wanted if (scene, d) in KEPT]
    plain = [{**asdict(cure), "paste": cure_paste(cure)} for cure in own]
    assert len(own) == len(KEPT) and json.loads(out) == json.loads(json.dumps(plain, default=str))


def test_cures_of_one_dimension_without_repeated_scenes(searched):
    names = list(dict.fromkeys(scene for scene, _ in KEPT))
    status, out, err = said("cure", "chipmunk", names[0], names[0], "--dim", "2")
    assert (status, searched, err) == (0, [("chipmunk", names[0], 2, 1)], [f"chipmunk {names[0]} 2-D"])
    assert out.startswith(f"chipmunk {names[0]} 2-D: ")


def test_cures_kept_after_every_scene_for_this_release(searched, monkeypatch, tmp_path):
    """What is listed of other scenes stays; what a new search does not find any more is gone."""
    first, second, other = list(KEPT)[:3]
    version = registry.load("chipmunk").version()
    listed = {
        key: replace(KEPT[key], version=of)
        for key, of in ((first, version), (second, version), (other, "0.1"), (list(KEPT)[3], version))
    }
    monkeypatch.setattr(curing, "cures_of", lambda engine: listed)
    monkeypatch.setattr(curing, "folder_of", lambda engine: tmp_path)
    monkeypatch.delitem(KEPT, second)
    written = []
    kept = curing.write
    monkeypatch.setattr(curing, "write", lambda cures, path: (written.append(path), kept(cures, path))[1])
    names = dict.fromkeys(scene for scene, _ in (first, second))
    assert said("cure", "chipmunk", *names, "--keep")[0] == 0
    assert written == [tmp_path / curing.CURES] * len(searched)
    assert {(cure.scene, cure.dimension) for cure in read(written[0])} == {
        *(key for key in KEPT if key[0] in names), list(KEPT)[2]
    }  # fmt: skip
    monkeypatch.setattr(curing, "folder_of", lambda engine: None)
    status, _, err = said("cure", "chipmunk", *names, "--keep")
    assert status == 2 and err[-1].endswith(f"cure: chipmunk has no folder of its own to keep {curing.CURES} in")


def test_no_cures_of_an_engine_without_a_shipped_profile(searched, monkeypatch):
    monkeypatch.setattr(curing, "profile_of", lambda engine, role: None if role == "shipped" else "tuned")
    status, out, err = said("cure", "chipmunk")
    assert (status, out, searched) == (2, "", [])
    assert err == ["crosscheck: cure: chipmunk has no profile as shipped that could be fixed"]
    assert "nobody" in "".join(said("cure", "nobody")[2])


# ---- residuals -------------------------------------------------------------------------------------------------------


def test_residuals_per_cell_as_data_with_commands(monkeypatch):
    asked = []

    def ask(slot, apart):
        asked.append(slot)
        if slot.profile == "default":
            return Residuals(slot, dict.fromkeys(LAWS, (None, "no contact")), 0, "it reports none")
        return Residuals(slot, {name: (10.0**-k, "") for k, name in enumerate(LAWS)}, 7)

    monkeypatch.setattr(weighing, "ask", ask)
    status, out, err = said("residuals", "stack", "--engine", "chipmunk", "--dim", "2", "--json")
    assert status == 0 and len(asked) > 1 and {slot.iterations for slot in asked} == {None}
    assert err == [f"chipmunk/{slot.profile} stack 2-D" for slot in asked]
    numbers = {name: [10.0**-k, ""] for k, name in enumerate(LAWS)}
    assert json.loads(out) == [
        {
            "slot": slot.as_dict(), "command": reproduce(slot.as_dict()), "contacts": 0 if none else 7,
            "refused": "it reports none" if none else "",
            "residuals": {name: [None, "no contact"] for name in LAWS} if none else numbers,
        } for slot in asked for none in (slot.profile == "default",)
    ]  # fmt: skip
    few = list(asked)
    asked.clear()
    for option, name, value in (
        (("--param", "n=2"), "params", (("n", 2.0),)), (("--iterations", "4"), "iterations", 4),
        (("--dt", "1/60"), "dt", 1 / 60),
    ):  # fmt: skip
        said("residuals", "stack", "--engine", "chipmunk", "--dim", "2", *option)
        assert {getattr(slot, name) for slot in asked} == {value}
        asked.clear()
    assert said("residuals", "stack", "--engine", "chipmunk", "--dim", "2")[1].count("stack 2-D") == 1
    assert asked == few


# ---- frontiers -------------------------------------------------------------------------------------------------------


def test_frontiers_to_the_requested_ratio_as_data(monkeypatch):
    asked = []

    def search(found, ratio, jobs):
        asked.append((len(found), ratio, jobs))
        for bracket in found:
            bracket.survives = frontier.End(bracket.frontier.easy, frontier.slot_at(bracket, bracket.frontier.easy), "")
        yield from ((len(found), None), (0, None))

    monkeypatch.setattr(driving, "search", search)
    names = list(dict.fromkeys(name for name, _ in driving.axes()))
    call = ("frontier", names[0], names[0], "--engine", "chipmunk", "--profile", "tuned", "--dim", "2")
    status, out, err = said(*call, "--json", "--jobs", "2")
    found = json.loads(out)
    count = len(found)
    assert status == 0 and count and err == [f"{count} of {count} searches left", f"0 of {count} searches left"]
    assert {(each["scene"], each["engine"], each["profile"], each["dimension"]) for each in found} == {
        (names[0], "chipmunk", "tuned", 2)
    }
    assert all(each["fails"] is None and each["survives"]["command"] for each in found)
    said(*call, "--full")
    assert asked == [(count, driving.QUICK_RATIO, 2), (count, driving.FULL_RATIO, 1)]
    plain, told = said(*call)[1], said(*call, "--commands")[1]
    assert plain == told and plain.count("crosscheck run") == count <= driving.FEW
    monkeypatch.setattr(driving, "FEW", count - 1)
    assert "--commands prints the commands of both ends" in said(*call)[1] and said(*call, "--commands")[1] == told
    status, out, err = said("frontier", "seam" if "seam" not in names else "slide", "--engine", "chipmunk")
    assert (
        status == 2
        and out == ""
        and f"has no breaking point to search; {', '.join(names)} have" in " ".join(" ".join(err).split())
    )


def test_status_of_a_named_missing_engine(monkeypatch):
    monkeypatch.setattr(driving, "search", lambda found, ratio, jobs: iter(()))
    monkeypatch.setattr(driving, "missing", lambda named, engines: [f"{named} of {engines} is not here"])
    name, _ = driving.axes()[0]
    status, _, err = said("frontier", name, "--engine", "chipmunk")
    assert (status, err) == (statuses.INCOMPLETE, ["('chipmunk',) of ['chipmunk'] is not here"])


# ---- public questions ------------------------------------------------------------------------------------------------


def test_public_questions_and_an_alarm_for_a_changed_one(monkeypatch):
    check = Check("m", "m/s", 0.8, 0.1, "because", "source")
    asked = []

    def ask(chosen, jobs, true=True):
        asked.append((len(chosen), jobs))
        return [field.Finding(note, note.said if true else "not seen", Reading(note.slot, check, 0.5, ""), None)
                for note in chosen]  # fmt: skip

    monkeypatch.setattr(fielding, "ask", ask)
    count = len(field.matching(["chipmunk"]))
    status, out, _ = said("field", "chipmunk", "--json", "--jobs", "2")
    assert (status, asked) == (0, [(count, 2)])
    assert [each["now"] == each["said"] and each["as_said"] for each in json.loads(out)] == [True] * count
    assert "--commands prints" in said("field", "chipmunk")[1]
    assert said("field", "chipmunk", "--commands")[1].count("crosscheck run") >= count
    monkeypatch.setattr(fielding, "ask", lambda chosen, jobs: ask(chosen, jobs, true=len(chosen) == 0))
    assert said("field", "chipmunk")[0] == 1
    status, out, err = said("field", "bulet", "at-all")
    assert status == 2 and "no known report has 'bulet' or 'at-all'; did you mean 'bullet'?" in " ".join(err)
    assert said("field", "")[0] == 2


# ---- findings that are accepted --------------------------------------------------------------------------------------


def test_accepted_refused_and_omitted_rows_counted(monkeypatch, tmp_path):
    family = Family("f-1", ("default",), "stack", ("creep",), "four sweeps", "its manual", ">=1")
    draft = replace(family, id="f-2", reason="", source="")
    keys = [("default", "stack", "2", "", f"n={n}", "", "creep") for n in range(3)]
    new = {key: Finding(family, 0.125 * (k + 1), 1e-3) for k, key in enumerate(keys)}
    slot = Slot("stack", (("n", 2.0),), 3, "chipmunk", "default", 1 / 240)
    row = SimpleNamespace(engine="chipmunk", profile="default", scene="stack", dimension=3, slot=slot.as_dict(),
                          metric="creep", value=0.12345678)  # fmt: skip
    refused = ((row, "a law covers it"),) * 14
    changes = (
        Change(family, new=new),
        Change(draft, new={("x", "stack", "2", "", "", "", "y"): Finding(draft, 1.0, 0.1)}),
    )
    proposal = Proposal("chipmunk", changes, {}, refused, (row,) * 2)
    asked = []

    def rows(out, run, engine, jobs, console, about):
        asked.append((out, run, engine, jobs))
        return [row], {}

    monkeypatch.setattr(accepting, "_rows_with_scatter", rows)
    monkeypatch.setattr(accepting, "findings_of", lambda engine: None)
    monkeypatch.setattr(accepting, "propose", lambda *given: proposal)
    monkeypatch.setattr(accepting.files, "findings_folder", lambda engine: tmp_path)
    monkeypatch.setattr(accepting, "write_members", lambda folder, members: asked.append((folder, members)))
    call = ("accept", "a-run", "--engine", "chipmunk", "--family", "f-1", "--jobs", "3", "--out", str(tmp_path))
    status, out, err = said(*call, "--json")
    assert status == 1, err
    assert asked == [(tmp_path, "a-run", "chipmunk", 3), (tmp_path, new)]
    assert json.loads(out) == {
        "engine": "chipmunk", "rows": 3, "families": ["f-1"], "file": str(tmp_path / accepting.MEMBERS),
        "refused": 14, "left_out": 2, "not_accepted": ["f-2"],
    }  # fmt: skip
    fields = "a [[family]] with id, profiles, scene, metrics, reason and source for each"
    reasons = f"write into {tmp_path / accepting.FAMILIES} {fields}; then name them by --family"
    told = [
        "refused: 14 checks: a law covers it",
        *["  chipmunk/default stack 3-D n=2 creep 0.123457"] * accepting.SHOWN,
        "  and 2 more", f"not accepted: f-2 (without a terminal: {reasons})",
        "not named by --family: 2 checks new or changed",
    ]  # fmt: skip
    assert err[-len(told) :] == told
    status, out, err = said(*call)
    assert out.startswith(f"chipmunk: 3 checks with 1 cause listed in {tmp_path / accepting.MEMBERS};") and status == 1
    assert out.endswith("; from now on every other failure is new, and run exits with 1\n")
    quiet = Proposal("chipmunk", changes[:1], {}, ())
    monkeypatch.setattr(accepting, "propose", lambda *given: quiet)
    assert said(*call)[0] == 0
    monkeypatch.setattr(accepting.files, "findings_folder", lambda engine: None)
    status, _, err = said(*call)
    assert (status, err[-1]) == (
        2, "crosscheck: accept: chipmunk is a plain module and has no folder to list findings in"
    )  # fmt: skip


# ---- cells as scripts, benches ---------------------------------------------------------------------------------------


def test_written_cell_on_request_as_data(monkeypatch, tmp_path):
    asked = []

    def written(slot, form):
        asked.append((slot, form))
        return "import pymunk\nprint(1)\n"

    monkeypatch.setattr("reports.scripts.written", written)
    cell = ("export", "stack", "--to", "python", "--engine", "chipmunk")
    assert said(*cell) == (0, "import pymunk\nprint(1)\n", [])
    path = tmp_path / "deep" / "cell.py"
    assert said(*cell, "-o", str(path)) == (0, f"{path}\n", []) and path.read_text() == "import pymunk\nprint(1)\n"
    status, out, _ = said(*cell, "--json", "-o", str(path), "--param", "n=3", "--dim", "2", "--dt", "1/60",
                          "--iterations", "4", "--profile", "tuned")  # fmt: skip
    slot = Slot("stack", (("n", 3.0),), 2, "chipmunk", "tuned", 1 / 60, 4)
    assert (status, json.loads(out)) == (
        0, {"slot": slot.as_dict(), "path": str(path), "text": "import pymunk\nprint(1)\n"}
    )  # fmt: skip
    assert json.loads(said(*cell, "--json")[1])["path"] is None
    plain = Slot("stack", (), 2, "chipmunk", "default", 1 / 240)
    assert asked == [(each, "python") for each in (plain, plain, slot, plain)]
    status, _, err = said(*cell, "-o", str(tmp_path / "pymunk.py"))
    assert (status, err) == (2, [
        "crosscheck: output: pymunk.py would be imported in the place of pymunk itself, name it otherwise"
    ])  # fmt: skip
    for arguments, why in (
        (("export",), "export: needs --parquet FOLDER for results, or --to FORMAT for a case"),
        (("export", "stack", "--to", "python"), "export: --to writes one case: name its scene and its --engine"),
        ((*cell, "--all"), "all: chooses runs, which needs --parquet"),
        *(
            (("export", "--parquet", str(tmp_path / "p"), f"--{name}", value),
             f"{name}: chooses a case to write, which needs --to")
            for name, value in (("output", str(path)), ("engine", "chipmunk"), ("profile", "x"), ("param", "n=1"),
                                ("dim", "2"), ("dt", "1/60"), ("iterations", "3"))
        ),
    ):  # fmt: skip
        assert said(*arguments) == (2, "", [f"crosscheck: {why}"])


def test_bench_options_refused_before_the_run(tmp_path):
    call = ("bench", "impact", "--engine", "chipmunk", "--out", str(tmp_path / "out"))
    for more, why in (
        (("--ulp", "1"), "ulp: moves the start of a run; it has no meaning for a benchmark"),
        (("--standard",), "standard: is a suite of judged cases; a benchmark is --quick or --full"),
    ):
        assert said(*call, *more) == (2, "", [f"crosscheck: {why}"])
    cells = json.loads(said(*call, "--dry-run", "--json")[1])["cells"]
    assert cells > 1 and said(*call, "--dry-run") == (0, f"{cells} cases\n", [])
    assert benching.plural(1, "case") == "1 case" and not (tmp_path / "out").exists()


# ---- cells that are chosen -------------------------------------------------------------------------------------------


def test_request_and_its_words_of_each_option():
    options = selection.Cases(
        scenes=("stack", "imp*", "stack"), engine=("chipmunk",), profile=("tuned", "default"), dim=(3, 2),
        dt=("1/60", "0.01"), iterations=(4, 7), param=("n=2",), full=True, set=("damping=0.5",),
    )  # fmt: skip
    found = options.request()
    assert found == Request(
        scenes=["stack", "impact"], engines=["chipmunk"], profiles=["tuned", "default"], dimensions=[3, 2],
        dts=[1 / 60, 0.01], iterations=[4, 7], params={"n": 2.0}, suite="full", ulps=(0,), floors=True,
        sets=(("damping", 0.5),),
    )  # fmt: skip
    assert options.words(found.scenes) == (
        "stack impact --param n=2 --engine chipmunk --profile tuned --profile default --set damping=0.5 --dim 3 "
        "--dim 2 --dt 1/60 --dt 0.01 --iterations 4 --iterations 7"
    )
    moved = replace(options, ulp=(1, -2), engine=(), param=(), set=(), scenes=()).request()
    assert (moved.ulps, moved.floors, moved.engines, moved.params) == ((0, 1, -2), False, registry.usual(), None)
    assert moved.scenes == list(CATALOGUE)
    assert not replace(options, full=False, quick=True).request().floors
    for wrong, why in (
        ({"quick": True}, "--quick and --full: a run is of one suite"),
        ({"param": ("n=2", "n=3")}, "param: n is given twice; crosscheck sweep --grid runs several values"),
        ({"param": ("n",)}, "param: 'n' is not of the form NAME=VALUE"),
        ({"param": ("=2",)}, "param: '=2' is not of the form NAME=VALUE"),
        ({"param": ("n=two",)}, "param: n='two' is not a number"),
    ):
        with pytest.raises(SceneError) as error:
            replace(options, **wrong).request()
        assert str(error.value) == why


def test_lines_for_named_engines_that_are_absent(monkeypatch):
    """Of engines that nobody named a run says nothing, as long as another answers."""

    def find(name):
        return SimpleNamespace(name=name, engine=None if name.startswith("no") else object(), reason=f"no {name}")

    monkeypatch.setattr(selection.registry, "find", find)
    named = "engine: {0} did not run: no {0}".format
    none = "engine: none of nobody, noone is installed here; crosscheck doctor says why"
    for asked, chosen, told in (
        ((), ["a", "b"], []), ((), ["a", "nobody"], []), (("a",), ["a"], []), ((), ["nobody", "noone"], [none]),
        (("nobody", "a"), ["a", "nobody"], [named("nobody")]), (("noone",), ["nobody", "noone"], [named("noone")]),
        (("noone", "nobody"), ["nobody", "noone"], [named("nobody"), named("noone")]),
    ):  # fmt: skip
        assert selection.missing(asked, chosen) == told


# ---- what is told beside the rows ------------------------------------------------------------------------------------


def test_distances_of_engines_line_by_line():
    found = [
        Spread("b", 2, "near", "p", 2.0, "ball", 1e-6, True),
        Spread("b", 2, "far", "tuned", 2.0, "a box", 0.5, True),
        Spread("a", 3, "other", "p", 1.53456, "ball", 0.254, False),
        Spread("a", 2, "one", "p", 1e-3, "ball", 12.3, True),
    ]
    assert list(spread_lines(found)) == [
        "", "How far from our own solution: a 2-D, after 0.001 s", "  one/p       12 m  (ball)",
        "", "How far from our own solution: a 3-D, after 1.53 s; that run is not certified",
        "  other/p     0.25 m  (ball)",
        "", "How far from our own solution: b 2-D, after 2 s",
        "  far/tuned      0.5 m  (a box)", "  near/p      1.0e-6 m  (ball)",
    ]  # fmt: skip


def test_bench_as_data(tmp_path):
    store = Store(tmp_path / "results")
    run, _ = store.start("bench quick: impact", [])
    store.close()
    table = pd.DataFrame([{"scene": "impact", "cost": 2.5e-3, "slot": {"scene": "impact"}, "rank": math.nan}])
    tables = {"work_points": table, "overhead": table[:0]}
    text = speed.as_json(run, {"rounds": 3, "clock": "CPU"}, tables)
    found = json.loads(text)
    head = found.pop("run")
    assert (head["id"], head["title"]) == (run.id, "bench quick: impact")
    assert found == {
        "protocol": {"rounds": 3, "clock": "CPU"}, "overhead": [],
        "work_points": [{"scene": "impact", "cost": 2.5e-3, "slot": {"scene": "impact"}, "rank": None}],
    }  # fmt: skip
    written = speed.write_all(
        tmp_path, run, {"rounds": 3, "clock": "CPU"}, {"work_points": table, "overhead": table[:0]}, table
    )
    assert json.loads(written[0].read_text()) == {**found, "run": head}


def test_level_setting_with_iterations_and_tie():
    row = {"cost": 2.5e-3, "dt": 1 / 240, "iterations": None, "tied": True, "rank": 1}
    for changed, ranked, told in (
        ({}, False, "2.5 ms 1/240"), ({"iterations": math.nan}, False, "2.5 ms 1/240"),
        ({"iterations": 30.0}, False, "2.5 ms 1/240 x30"), ({"iterations": 0}, False, "2.5 ms 1/240 x0"),
        ({}, True, "* 2.5 ms 1/240"), ({"rank": 2}, True, "= 2.5 ms 1/240"), ({"tied": False}, True, "2.5 ms 1/240"),
        ({"cost": math.nan}, True, "-"), ({"cost": math.inf}, True, "-"),
    ):  # fmt: skip
        found = speed._level_cell(row | changed, ranked)
        assert " ".join(found.plain.split()) == told and (found.style == "bold") == (told[0] in "*=")
