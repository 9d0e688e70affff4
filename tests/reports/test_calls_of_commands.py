"""What commands hand on, word by word, to what runs cells, and what they make of its answers; nothing runs here."""

import json
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from click.testing import CliRunner

from adapters.conformance.finding import Finding
from reports import listing, starved
from reports.command import inspecting, main, running, statuses, sweeping, tuning
from reports.palette import PAPER
from validation import posed
from validation.cells import Observation, Outcome, Slot
from validation.running.warming import Part
from validation.settings.tuning import Score, Search

pytest.importorskip("pymunk")

SLOT = Slot("impact", (("e", 0.5),), 2, "chipmunk", "tuned", 1 / 240)


def said(*arguments, **given):
    """Status, and what went to each stream, line by line."""
    found = CliRunner().invoke(main, list(arguments), env={"COLUMNS": "120", "NO_COLOR": "1", "TERM": "dumb"}, **given)
    return found.exit_code, found.stdout, found.stderr.splitlines()


# ---- run -------------------------------------------------------------------------------------------------------------


@pytest.fixture
def ran(monkeypatch):
    """Calls of what runs a plan, and what it leaves: a finished run, and rows as `ran.rows` has them."""
    found = SimpleNamespace(calls=[], rows=[], finished=True, kept=[], apart=[], absent=[])

    def run_plan(store, title, chosen, console, jobs, timeout, keep=None, fresh=False, finish=True, **more):
        assert not finish  # not before its files are written
        found.calls.append((title, len(chosen), jobs, timeout, keep and keep.name, fresh, more.get("cluster", "")))
        return SimpleNamespace(id="a-run")

    for module in (running, sweeping):
        monkeypatch.setattr(module, "run_plan", run_plan)
        monkeypatch.setattr(module, "missing", lambda named, engines: found.absent)
    monkeypatch.setattr(sweeping, "rows_of", lambda run, seen, chosen: found.rows)
    monkeypatch.setattr(running.Verdicts, "rows", lambda verdicts, run: found.rows)
    monkeypatch.setattr(running.Store, "observations", lambda store, run: ["seen"])
    monkeypatch.setattr(running.Store, "missing", lambda store, run: 0 if found.finished else 1)
    monkeypatch.setattr(running.Store, "finish", lambda store, run: None)
    monkeypatch.setattr(running.Store, "recordings", lambda store, run: ["recorded"])
    judged = staticmethod(lambda rows: SimpleNamespace(rows=rows, nulls=[]))
    monkeypatch.setattr(running.brief.Judged, "of", judged)
    monkeypatch.setattr(
        running.brief, "keep", lambda store, run, seen, all: found.kept.append((run.id, seen, all.rows))
    )
    monkeypatch.setattr(running, "spreads", lambda *given: found.apart.append(given) or [])
    monkeypatch.setattr(
        running, "show", lambda rows, console, files, out: console.print(f"{len(rows)} rows, {len(files)}")
    )
    return found


def row(alarming=False, **more):
    return SimpleNamespace(alarming=alarming, outcome="ok", as_dict=lambda: {"scene": "impact", **more})


def test_run_arguments_and_status_of_its_rows(ran, monkeypatch, tmp_path):
    monkeypatch.setattr(running.exports, "write_all", lambda out, plain, nulls: {"rows": out / "rows.csv"})
    monkeypatch.setattr(running.exports, "as_junit", lambda plain: f"<junit of {len(plain)}/>")
    monkeypatch.setattr(running.exports, "as_markdown", lambda plain: f"# {len(plain)} rows – so")
    monkeypatch.setattr(running.exports, "as_json", lambda plain: json.dumps(plain, indent=1))
    ran.rows = [row(), row()]
    cells = ("run", "impact", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2", "--out", str(tmp_path / "o"))
    assert said(*cells) == (statuses.FINE, "2 rows, 1\n", [])
    count = json.loads(said(*cells, "--dry-run", "--json")[1])["cells"]
    assert said(*cells, "--dry-run") == (0, f"{count} cases\n", [])
    told = "impact --engine chipmunk --profile tuned --dim 2"
    assert ran.calls == [(f"quick: {told}", count, 0, running.TIMEOUT, None, False, "")] and ran.apart == []
    assert ran.kept == [("a-run", ["seen"], ran.rows)]
    status, out, err = said(
        *cells, "--json", "--jobs", "3", "--timeout", "7", "--fresh", "--keep-trajectories", "--standard",
        "--junit", str(tmp_path / "j.xml"), "--markdown", str(tmp_path / "m.md"),
    )  # fmt: skip
    assert (status, json.loads(out), err) == (0, [{"scene": "impact"}] * 2, ["2 rows, 1"])
    assert (ran.calls[1][0], *ran.calls[1][2:]) == (f"standard: {told}", 3, 7.0, "trajectories", True, "")
    assert (tmp_path / "j.xml").read_text(encoding="utf-8") == "<junit of 2/>"
    assert (tmp_path / "m.md").read_text(encoding="utf-8") == "# 2 rows – so"
    ran.rows = [row(), row(alarming=True)]
    assert said(*cells)[0] == 1
    ran.rows, ran.absent = [row()], ["engine: [b] was named"]
    assert said(*cells) == (statuses.INCOMPLETE, "1 rows, 1\n", ["engine: [b] was named"])
    ran.absent, ran.finished, before = [], False, len(ran.kept)
    assert said(*cells)[0] == statuses.INCOMPLETE and len(ran.kept) == before


def test_scene_file_defaults_and_spread_of_engines(ran, monkeypatch, tmp_path):
    monkeypatch.setattr(running.exports, "write_all", lambda out, plain, nulls: {})
    monkeypatch.setattr(running, "spread_lines", lambda apart: [f"apart: {len(apart)} [x]"])
    file = tmp_path / "drop.toml"
    file.write_text(
        'name = "drop"\ndimension = 2\ngravity = [0.0, -9.81]\nduration = 0.1\nbodies = [{ name = "ball", '
        'shape = { type = "disc", radius = 0.5 }, mass = 1.0, pose = [0.0, 2.0, 0.0] }]\n'
    )
    status, out, err = said("run", str(file), "--engine", "chipmunk", "--out", str(tmp_path / "out"))
    assert (status, out) == (0, "0 rows, 0\napart: 0 [x]\n") and ran.apart == [(["seen"], ["recorded"])]
    assert len(err) == 1 and err[0].endswith("ball.inertia: 0.125 kg m^2, of a uniform disc; none was given")


def test_invariance_breaks_kept_for_the_requested_cells(monkeypatch, tmp_path):
    asked = []

    def compare(cells, as_json, keep):
        asked.append((len(cells), {slot.params for slot in cells}, as_json, keep))
        return not keep

    monkeypatch.setattr(running, "compare_and_show", compare)
    cells = ("run", "stack", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2", "--out", str(tmp_path / "out"))
    assert said(*cells, "--invariance") == (0, "", []) and said(*cells, "--invariance", "--keep", "--json")[0] == 1
    assert said(*cells, "--invariance", "--param", "n=3")[0] == 0
    (own,) = asked[0][1]
    assert asked == [(1, {own}, False, False), (1, {own}, True, True), (1, {(("n", 3.0),)}, False, False)]
    assert said(*cells, "--keep") == (
        2, "", ["crosscheck: keep: lists violations of metamorphic tests, and needs --invariance"]
    )  # fmt: skip
    assert said(*cells, "--keep-trajectories", "--cluster", "local:2") == (
        2, "", ["crosscheck: keep_trajectories: a cluster sends back no trajectories; run those cases here"]
    )  # fmt: skip
    assert not (tmp_path / "out").exists()


def test_cells_as_lines_with_an_answer_each(monkeypatch):
    asked = []

    def run_cells(cells, jobs, timeout, leave):
        asked.append((cells, jobs, timeout))
        for slot in cells:
            if slot.iterations == 9:
                leave(slot, "nobody has the time")
            else:
                yield Observation(slot, "c", 0, "1.0", Outcome.OK, "")

    monkeypatch.setattr(running, "run_cells", run_cells)
    monkeypatch.setattr(running, "prepare", lambda slot: None)
    remembered = []
    monkeypatch.setattr(posed, "remember", remembered.append)
    left = Slot(*[getattr(SLOT, name) for name in ("scene", "params", "dimension", "engine", "profile", "dt")], 9)
    first, other = json.dumps(SLOT.as_dict()), json.dumps(left.as_dict())
    lines = ['{"scenes": {"a@1": "name"}}', first, "", "no json", other, first, "[1]", '{"scenes": 3}']
    status, out, err = said("run-cell", "--batch", "--jobs", "2", "--timeout", "5", input="\n".join(lines))
    answers = [json.loads(line) for line in out.splitlines()]
    assert (status, err, remembered) == (statuses.WRONG_CALL, [], [{"a@1": "name"}])
    assert asked == [([SLOT, left], 2, 5.0)]
    assert [each.get("line") for each in answers] == [4, 7, 8, None, 5]
    assert (
        answers[0]["error"].startswith("slot: is not JSON: ") and answers[1]["error"] == "slot: must be a JSON object"
    )
    assert answers[2]["error"].startswith("scenes: are not a table of texts: ")
    assert answers[3] == json.loads(json.dumps(Observation(SLOT, "c", 0, "1.0", Outcome.OK, "").as_dict()))
    assert answers[4]["error"] == "left: nobody has the time"
    assert said("run-cell", input=other)[0] == statuses.INCOMPLETE and said("run-cell", input=first)[0] == 0
    assert asked[-1] == ([SLOT], 1, running.TIMEOUT)
    for text, why in (("", "slot: nothing on stdin"), ("[1]", "slot: must be a JSON object")):
        assert said("run-cell", input=text) == (2, "", [f"crosscheck: {why}"])


def test_kernels_compiled_for_the_named_cells(monkeypatch, tmp_path):
    asked = []
    part = Part(("toy", "tuned", 2), (SLOT,), tmp_path / "mark")

    def run_cells(cells, jobs, parts, compiled):
        assert list(cells) == [] and jobs == 0
        for each in parts:
            compiled(each)
        return iter(())

    monkeypatch.setattr(running, "run_cells", run_cells)
    monkeypatch.setattr(running, "kernels_missing", lambda cells: asked.append(len(cells)) or [part])
    call = ("compile", "impact", "--engine", "chipmunk", "--dim", "2")
    status, out, err = said(*call)
    assert (status, out) == (0, "") and err[-1].startswith("compiled toy/tuned 2-D after ")
    assert said(*call, "--json")[:2] == (0, '{"compiled": ["toy/tuned 2-D"]}\n')
    assert asked[0] == asked[1] > 1


# ---- studies ---------------------------------------------------------------------------------------------------------


def test_cells_and_table_of_a_study(ran, monkeypatch, tmp_path):
    table = pd.DataFrame([{"e": 0.5, "off": 0.1234567890123456, "outcome": "ok"}, {"e": 0.7, "outcome": "unsupported"}])
    monkeypatch.setattr(sweeping, "table", lambda rows: table)
    monkeypatch.setattr(sweeping, "counted", lambda found: f"{len(found)} lines")
    ran.rows = [row()]
    out = tmp_path / "out"
    call = ("sweep", "impact", "--grid", "e=0:1:3", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2",
            "--out", str(out))  # fmt: skip
    status, told, err = said(*call, "--jobs", "2", "--timeout", "9")
    assert (status, told) == (0, "") and err == [
        "2 lines", "unsupported: 1 case, which the engine cannot run", f"table: {out / 'sweep.csv'}",
        f"what fails and why: crosscheck findings --out {out}",
    ]  # fmt: skip
    assert ran.calls == [("sweep: impact", 3, 2, 9.0, None, False, "")]
    assert pd.read_csv(out / "sweep.csv").equals(table)
    status, told, _ = said(*call, "--json", "--fresh", "--csv", str(tmp_path / "t.csv"))
    plain = [{"e": 0.5, "off": 0.123456789012346, "outcome": "ok"}, {"e": 0.7, "off": None, "outcome": "unsupported"}]
    assert (status, json.loads(told)) == (0, plain) and ran.calls[-1][5] and told.count("\n") > 4
    assert pd.read_csv(tmp_path / "t.csv").equals(table)
    assert (
        said(*call, "--dry-run") == (0, "3 cases\n", []) and said(*call, "--dry-run", "--json")[1] == '{"cells": 3}\n'
    )
    for outcome in ("invalid", "crashed", "timed_out", "missing"):
        ran.rows = [row(), SimpleNamespace(alarming=False, outcome=outcome)]
        assert said(*call)[0] == 1
    ran.rows, ran.absent = [row()], ["engine: [b] is not here"]
    status, _, err = said(*call)
    assert (status, err[-1]) == (statuses.INCOMPLETE, "engine: [b] is not here")
    ran.absent, ran.finished = [], False
    assert said(*call)[0] == statuses.INCOMPLETE
    for more, why in (
        (("--list", "e=0.1,0.2"), "sweep: e is varied twice"), (("--random", "e=0:1"), "sweep: e is varied twice"),
        (("--random", "v=1:2", "--sobol", "v=1:2"), "sweep: v is varied twice"),
    ):  # fmt: skip
        assert said(*call, *more) == (2, "", [f"crosscheck: {why}"])
    assert said("sweep", "--grid", "e=0:1:3") == (
        2, "", ["crosscheck: scenes: a sweep needs the name of a scene"]
    )  # fmt: skip


def test_study_points_by_count_and_seed(ran, monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(sweeping, "study_slots", lambda request, study: asked.append(study) or [SLOT])
    call = ("sweep", "impact", "--dry-run", "--out", str(tmp_path / "out"))
    said(*call, "--grid", "e=0:1:3", "--list", "v=1,2", "--random", "r=0:1", "--sobol", "s=1:100:log", "--samples", "4",
         "--seed", "7")  # fmt: skip
    said(*call, "--random", "r=0:1", "--samples", "4", "--seed", "8")
    said(*call, "--random", "r=0:1")
    first, second, _ = asked
    assert first.crossed == {"e": [0.0, 0.5, 1.0], "v": [1.0, 2.0]} and second.crossed == {}
    assert [len(each.drawn) for each in asked] == [4, 4, 256]
    assert all(set(point) == {"r", "s"} and 1.0 <= point["s"] <= 100.0 for point in first.drawn)
    assert [point["r"] for point in first.drawn] != [point["r"] for point in second.drawn]


# ---- engines and machines --------------------------------------------------------------------------------------------


def test_doctor_output_of_packages_and_bad_releases(monkeypatch):
    found = listing.doctor()
    parts = ["machine", "commit", "executable", "packages", "engines", "kernel_cache", "problems", "traces"]
    assert list(found) == parts
    assert list(found["packages"]) == ["reference_solver", "adapters", "validation", "reports"]
    home = Path(listing.__file__).parent.parent
    assert found["packages"] == {name: str(home / name) for name in found["packages"]}
    facts = SimpleNamespace(known_bad_versions={"1.0": "it sinks"})
    engines = {
        "toy": SimpleNamespace(engine=SimpleNamespace(facts=facts), trace=""),
        "broken": SimpleNamespace(engine=None, trace="File one\nImportError: no"),
    }
    told = [{"name": "toy", "version": "1.0", "reason": ""}, {"name": "broken", "version": "", "reason": "ImportError"},
            {"name": "apart", "version": "", "reason": "not installed"}]  # fmt: skip
    monkeypatch.setattr(listing, "engines", lambda imported: told)
    absent = SimpleNamespace(engine=None, trace="")
    monkeypatch.setattr(listing.registry, "find", lambda name: engines.get(name, absent))
    monkeypatch.setattr(listing.registry, "usual", lambda: ["toy", "broken"])
    monkeypatch.setattr(listing, "broken", lambda: ["a scene is broken"])
    monkeypatch.setattr(listing.engine_folder, "problems", lambda: ["a folder is"])
    spoilt = listing.doctor()
    assert spoilt["problems"] == [
        "a scene is broken", "a folder is", "toy 1.0 is known to be bad: it sinks", "broken: ImportError",
    ]  # fmt: skip
    assert (spoilt["engines"], spoilt["traces"]) == (told, {"broken": ["File one", "ImportError: no"]})
    for jit, compiled in (("", True), ("0", True), ("1", False)):
        monkeypatch.setenv("NUMBA_DISABLE_JIT", jit)
        assert listing.doctor()["kernel_cache"]["compiled"] is compiled


def test_adapter_with_failed_checks_status_and_findings(monkeypatch):
    good, bad = Finding("momentum", "ok", ""), Finding("spin", "FAIL", "it turns")
    for findings, status in (([good], 0), ([good, bad], 1)):
        monkeypatch.setattr("adapters.conformance.check_adapter", lambda engine, found=findings: found)
        assert said("check-adapter", "chipmunk") == (status, "".join(f"{each}\n" for each in findings), [])
        found = said("check-adapter", "chipmunk", "--json")
        assert found[0] == status
        assert json.loads(found[1]) == [{**asdict(each), "holds": each.holds} for each in findings]
    assert inspecting.registry.load("chipmunk").facts.name == "chipmunk"


def test_search_progress_and_status_of_a_better_setting(monkeypatch):
    asked, better = [], {}

    def search(engine, profile, name, jobs, dimensions, said):
        said({"slop": 0.1, "iterations": 20}, Score(2, 1.25))
        asked.append((engine, profile, name, jobs, tuple(dimensions)))
        before, after, held_out = Score(3, 2.0), Score(1, 0.5), (Score(4, 1.0), Score(2, 0.25))
        trials = (({}, before),) * 5
        return Search(engine, profile, name, before, after, dict(better), held_out, trials, {"bias": 1})

    monkeypatch.setattr(tuning, "search", search)
    names = list(tuning.groups())
    head = "3 fail, 2.0 decades; 5 tried"
    status, out, err = said("tune", "chipmunk", "--jobs", "2")
    told = [line for name in names for line in (
        f"chipmunk/tuned on {name}", "  slop = 0.1, iterations = 20: 2 fail, 1.2 decades",
        f"chipmunk/tuned {name}: {head}; none is better", "  as shipped does as well: bias = 1",
    )]  # fmt: skip
    assert (status, out, err) == (0, "", told)
    assert asked == [("chipmunk", "tuned", name, 2, (2, 3)[: len(asked[0][4])]) for name in names]
    better["slop"] = 0.2
    status, out, err = said("tune", "chipmunk", "--profile", "default", "--group", names[0], "--dim", "2", "--json")
    assert (status, asked[-1]) == (1, ("chipmunk", "default", names[0], 1, (2,)))
    assert err[2] == (
        f"chipmunk/default {names[0]}: {head}; better: slop = 0.2 -> 1 fail, 0.5 decades "
        "(held out 4 fail, 1.0 decades -> 2 fail, 0.2 decades)"
    )
    assert json.loads(out)[0]["changes"] == {"slop": 0.2} and json.loads(out)[0]["group"] == names[0]
    assert "'nothing' is not one of" in "".join(said("tune", "chipmunk", "--group", "nothing")[2])
    monkeypatch.setattr(tuning, "profile_of", lambda engine, role: None)
    assert said("tune", "chipmunk")[2] == ["crosscheck: profile: chipmunk has no tuned one; name one with --profile"]
    monkeypatch.setattr(tuning, "candidates_of", lambda engine: ())
    assert said("tune", "chipmunk")[2] == [
        "crosscheck: tune: no stock settings of chipmunk to try are listed (tuning.toml in its folder)"
    ]


# ---- files that are written ------------------------------------------------------------------------------------------


def test_schema_on_the_terminal_and_in_a_file(tmp_path):
    from validation.files.scene_files import json_schema

    status, out, _ = said("schema")
    assert status == 0 and out == json.dumps(json_schema(), indent=2, sort_keys=True) + "\n"
    assert said("schema", "-o", str(tmp_path / "s.json")) == (0, "", []) and (tmp_path / "s.json").read_text() == out


def test_starved_stack_picture_in_both_schemes(monkeypatch, tmp_path):
    monkeypatch.setattr(starved, "starved", lambda: iter(["a", "row"]))
    monkeypatch.setattr(starved, "chart", lambda rows, scheme: (tuple(rows), scheme))
    monkeypatch.setattr(starved.vl_convert, "vegalite_to_png", lambda spec, scale: f"{spec} {scale}".encode())
    monkeypatch.setattr(starved, "labelled", lambda picture, said: picture + f" | {said}".encode())
    for _ in range(2):  # into a folder that is there as well
        starved.main(str(tmp_path / "deep" / "down"))
    found = {path.name: path.read_bytes().decode() for path in (tmp_path / "deep" / "down").iterdir()}
    assert found == {
        f"starved-{scheme}.png": f"{(('a', 'row'), scheme)} 1.5 | "
        "classical profile at 60 Hz, unit boxes, mu = 0.5: python -m reports.starved"
        for scheme in PAPER
    }
