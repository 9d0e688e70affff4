"""The terminal answers first: matrix, best engines, what is wrong and what fixes it, then which commands lead on."""

import io
import json
import math
import re
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

from adapters.scene import SceneError
from reports import brief
from reports.answers import answers, choices
from reports.command import main, showing
from reports.exports import as_junit, as_markdown, load_rows
from reports.findings import families, finding_line, grouped
from reports.matrix import matrix_of, sweeps_of
from reports.summary import show
from reports.wording import measured, quantity, row_id
from validation.cells import Slot
from validation.files.stated import STATED
from validation.judging.rows import is_alarming
from validation.posed import pinned
from validation.records.store import Store
from validation.running.execution import execute

PROFILES = {"reference": ("classical", "reference"), "chipmunk": ("default", "tuned"),
            "bullet": ("default", "tuned", "one"), "mujoco": ("default", "tuned")}  # fmt: skip
SCENES = ("impact", "bounce", "stack", "incline")
METRIC = {"impact": "rebound_ratio", "bounce": "apex[1]", "stack": "settle_time", "incline": "creep"}


def row(scene, dimension, engine, profile, mark="pass", value=0.8, truth=0.8, iterations=None, reason="", **params):
    """A judged row as a run gives it; ``mark`` is pass, a standing of a FAIL, or unsupported."""
    params = params or {"e": 0.8, "height": 1.0}
    refused = mark == "unsupported"
    slot = {"scene": scene, "params": params, "dimension": dimension, "engine": engine, "profile": profile,
            "dt": 1 / 240, "iterations": iterations, "ulp": 0}  # fmt: skip
    return {
        "scene": scene, "dimension": dimension, "engine": engine, "profile": profile, "iterations": iterations,
        "engine_version": "1.0+abc", "metric": METRIC[scene], "unit": "1", "value": None if refused else value,
        "truth": truth, "error": None if refused else value - truth, "tolerance": 1e-3, "because": "so",
        "outcome": "unsupported" if refused else "ok", "reason": reason, "dt": 1 / 240, "source": "law",
        "physics": None if refused else "pass" if mark == "pass" else "fail",
        "standing": "known" if refused else None if mark == "pass" else mark, "params": params, "slot": slot,
    }  # fmt: skip


def quick_suite():
    """Rows of the shape of the quick suite, both dimensions telling different stories everywhere they can."""
    rows = []
    for scene, dimension, engine in product(SCENES, (2, 3), PROFILES):
        for profile in PROFILES[engine]:
            refused = engine == "chipmunk" and dimension == 3
            mark = "unsupported" if refused else "known" if profile == PROFILES[engine][0] else "pass"
            rows += [row(scene, dimension, engine, profile, mark, 0.5) for _ in range(140 + dimension)]
    return rows


def shown(rows, width, **more):
    stream = io.StringIO()
    show(rows, Console(file=stream, width=width), **more)
    return stream.getvalue().splitlines()


@pytest.mark.parametrize("width", [80, 100, 120])
def test_matrix_in_thirty_lines_of_the_quick_suite(width):
    lines = shown(quick_suite(), width)
    assert max(map(len, lines)) <= width
    head = lines[:30]
    assert head[0].split() == ["engine,", "profile", *SCENES]
    for engine, profiles in PROFILES.items():
        assert any(line.startswith(f"{engine} 1.0") and "abc" not in line for line in head)
        for profile in profiles:
            assert any(line.startswith(f"  {profile}") for line in head)
    assert any(line.startswith("  every profile 3-D") for line in head)  # chipmunk is planar, and it is said
    assert ("142 of 142 fail" in "\n".join(head)) == (width >= 100)
    assert "142/142 fail" in "\n".join(head) or width >= 100


def test_scenes_that_do_not_fit_make_a_further_table():
    lines = shown(quick_suite(), 60, every=True)
    heads = [line.split() for line in lines if line.startswith("engine, profile")]
    assert len(heads) > 1 and [name for head in heads for name in head[2:]] == list(SCENES)
    assert max(map(len, lines)) <= 60


def test_counts_of_a_sweep_over_iterations():
    rows = [row("stack", 2, "bullet", "tuned", "known" if k < 3 else "pass", n=k) for k in range(9)]
    rows += [row("stack", 2, "bullet", "tuned", "known", iterations=count, n=10) for count in (1, 4)]
    found = matrix_of(rows)
    own, swept = found.fields[("stack", 2), ("bullet", "tuned")], found.swept[("stack", 2), ("bullet", "tuned")]
    assert (own.missed, own.judged, swept.missed, swept.judged) == (3, 9, 2, 2)
    (line,) = sweeps_of(found)
    assert line == "stack at 1, 4 iterations instead of the profile's own, failed checks: bullet/tuned 2 of 2"
    assert "3 of 9 fail" in "\n".join(shown(rows, 80))


def test_constant_answer_in_one_clause_with_its_cure():
    rows = [row("impact", 3, "mujoco", "default", "explained", 0.1 + 0.001 * e, e, e=e, v=1.0) for e in (0.2, 0.5, 1.0)]
    rows += [row("impact", 3, "mujoco", "tuned", "pass", e, e, e=e, v=1.0) for e in (0.2, 0.5, 1.0)]
    (answer,) = answers(rows)
    assert answer.line == "mujoco/default impact: rebounds at 0.1 to 0.101, whatever e is; profile tuned fixes it"


@pytest.mark.parametrize(("shipped", "told"), [("pass", False), ("known", True)])
def test_cost_of_a_recommended_profile(shipped, told):
    """Beside "Every check passes" it read as a failure of the run."""
    rows = [row("impact", 2, "mujoco", "default", shipped, 0.5), row("impact", 2, "mujoco", "tuned")]
    rows += [row("impact", 2, "bullet", "default"), row("impact", 2, "bullet", "tuned")]
    text = " ".join(" ".join(shown(rows, 80)).split())
    assert ("mujoco/tuned, against the engine as shipped" in text) == told
    assert "bullet/tuned, against the engine as shipped" not in text


def test_parameter_named_only_if_the_truth_depends_on_it():
    """Numbers of one cell have truths of their own, whatever its parameters are."""
    rows = [row("impact", 2, "mujoco", "default", "known", 0.1, truth, e=e, v=1.0) | {"metric": f"restitution[{i}]"}
            for e in (0.5, 1.0) for i, truth in ((1, 0.3), (2, 0.9))]  # fmt: skip
    (answer,) = answers(rows)
    assert answer.wrong.endswith(", in every case")
    rows += [rows[0] | {"params": {"e": 0.5, "v": 2.0}, "truth": 0.4}]
    assert answers(rows)[0].wrong.endswith(", whatever v is")


def test_bounce_told_as_restitution():
    rows = [row("bounce", 2, "bullet", "default", "known", 0.25, 0.64, e=0.8, height=1.0)]
    (answer,) = answers(rows)
    assert answer.wrong == "rebounds at 0.5 instead of 0.8 (e=0.8 height=1)"
    assert answer.cure == "no other profile was run in this case; crosscheck cure bullet bounce searches for settings"


def test_numbers_of_scene_files_in_a_summary(tmp_path):
    """A file has no parameters that a truth could follow."""
    path = tmp_path / "a.toml"
    path.write_text(FALL)
    names = {"final[ball.y]": (3.78, 4.5), "final[ball.x]": (3.78, 9.0)}
    rows = [row("impact", 2, "bullet", "default", "new", value, truth) | {"scene": str(path), "metric": metric}
            for metric, (value, truth) in names.items()]  # fmt: skip
    (answer,) = answers([each | {"params": {}, "slot": each["slot"] | {"params": {}}} for each in rows])
    assert answer.wrong == "final[ball.x] is 3.78 instead of 9"
    assert answer.cure == (
        f"no other profile was run in this case; crosscheck cure bullet {path} searches for settings"
    )


def test_worst_kind_of_a_scene_file(tmp_path):
    """An overlap of 20 tolerances stands first, a lost rebound of 100 is what is wrong."""
    path = tmp_path / "a.toml"
    path.write_text(FALL)
    names = {"penetration": (0.02, 0.0), "final[ball.vy]": (0.9, 1.0)}
    rows = [row("impact", 2, "bullet", "default", "new", value, truth) | {"scene": str(path), "metric": metric}
            for metric, (value, truth) in names.items()]  # fmt: skip
    (answer,) = answers([each | {"params": {}, "slot": each["slot"] | {"params": {}}} for each in rows])
    assert answer.wrong == "final[ball.vy] is 0.9 instead of 1"


@pytest.mark.parametrize(
    ("scene", "metric", "value", "words"),
    [
        ("pinch", "creep", -0.003, "lets the box creep up at 0.003 instead of 0"),
        ("pinch", "creep", 0.003, "lets the box creep down at 0.003 instead of 0"),
        ("edge_drop", "rise", -0.004, "falls with 0.004; true: rises with 2"),
        ("edge_drop", "rise", -0.004, "falls with 0.004 instead of 3"),
        ("edge_drop", "rise", 0.5, "rises with 0.5 instead of 2"),
        ("incline", "creep", 0.5, "creeps at 0.5 where it should stick"),
        ("incline", "creep", -0.5, "creeps uphill at 0.5 where it should stick"),
        (
            "wedge",
            "acceleration",
            -0.5,
            "the block slides up the face with 0.5; true: the block slides along the face with 2",
        ),
        ("incline", "acceleration", -0.5, "slides uphill with 0.5; true: slides with 2"),
        ("thin_wall", "rebound_ratio", -0.5, "comes back at -0.5 of its speed (below 0: it has passed) instead of 2"),
        ("stacked_balls", "energy_lost", -0.5, "adds 0.5 of the energy; true: takes 2 of the energy"),
        ("conveyor", "pull", -0.5, "is held back by 0.5; true: is pulled by 2"),
    ],
)
def test_direction_in_words_without_a_sign(scene, metric, value, words):
    truth = 0.0 if metric == "creep" else -3.0 if words.endswith("instead of 3") else 2.0
    (answer,) = answers(
        [row("impact", 2, "bullet", "default", "new", value, truth) | {"scene": scene, "metric": metric}]
    )
    assert answer.wrong == f"{words} (e=0.8 height=1)"


#: A scene file in which a ball falls.
FALL = """
name = "fall"
dimension = 2
gravity = [0.0, -9.81]
duration = 1.0
[[bodies]]
name = "ball"
shape = { type = "disc", radius = 0.5 }
mass = 1.0
"""


def test_file_without_checks_of_its_own(tmp_path, monkeypatch):
    """Damping of a flight adds no energy and makes no overlap; a planar file in 3-D also has to stay in its plane."""
    monkeypatch.chdir(tmp_path)
    Path("a.toml").write_text(FALL)
    name = pinned("a.toml")
    laws = [row("impact", 2, "bullet", "tuned") | {"scene": name, "metric": metric}
            for metric in ("penetration", "energy_growth", "out_of_plane")]  # fmt: skip
    own = row("impact", 2, "bullet", "tuned") | {
        "scene": name,
        "metric": "final[ball.y]",
        "source": STATED,
    }
    only = "Only energy, overlaps and staying in plane are judged of a: no check of its own is stated"
    for some in (laws, [*laws, row("impact", 2, "bullet", "tuned")]):
        assert f"Every check passes. {only}" in " ".join(" ".join(shown(some, 100)).split())
    for others in ([*laws, own], [row("impact", 2, "bullet", "tuned") | {"metric": "penetration"}]):
        text = " ".join(" ".join(shown(others, 100)).split())
        assert "Every check passes" in text and "are judged" not in text


@pytest.mark.parametrize("dt", [1 / 240, 1 / 120])
def test_a_profile_that_ran_at_another_step_cures_nothing(dt):
    """A coarser step has wider tolerances: that a profile passes there says nothing of a finer one."""
    rows = [row("stack", 2, "mujoco", "default", "known", 0.01, 0.0, n=2.0) | {"dt": 1 / 500}]
    rows += [row("stack", 2, "mujoco", "tuned", "pass", 0.0, 0.0, n=2.0) | {"dt": dt}]
    (answer,) = answers(rows)
    search = "crosscheck cure mujoco stack --param n=2 --dt 1/500 --dim 2"
    assert answer.cure == f"other profiles ran in other cases or at other steps; {search} searches for settings"
    rows[1]["dt"] = 1 / 500
    assert answers(rows)[0].cure == "profile tuned fixes it"


def test_profile_that_ran_another_case_not_compared():
    rows = [row("incline", 2, "bullet", "default", "known", 0.1, 0.0, ratio=r) for r in (0.5, 0.9)]
    rows += [row("incline", 2, "bullet", "tuned", "pass", 0.0, 0.0, ratio=0.5)]
    (answer,) = answers(rows)
    assert answer.cure.startswith("other profiles ran in other cases or at other steps; ")


def test_nearer_profile_not_called_a_cure():
    rows = [row("incline", 2, "bullet", "default", "known", 0.1, 0.0, ratio=r) for r in (0.5, 0.9)]
    rows += [
        row("incline", 2, "bullet", "tuned", "known" if r > 0.8 else "pass", 0.01, 0.0, ratio=r) for r in (0.5, 0.9)
    ]
    (answer,) = answers(rows)
    assert answer.cure.startswith("profile tuned fails less (1 of 2): creeps at 0.01")


def test_time_cut_off_by_the_end_not_shown():
    cut = row("stack", 2, "bullet", "default", "known", 5.0, 0.0, n=10) | {
        "unit": "s", "reason": "never settled: still moving at the end of the run"}  # fmt: skip
    assert measured(cut) == "never settled"
    (answer,) = answers([cut])
    assert answer.wrong == "never settles (n=10)"


def test_units_of_ratios_and_other_values():
    assert quantity(0.102934, "1", 6) == "0.102934"
    assert quantity(5.4, "N s") == "5.4 N s"
    assert quantity(None, "m") == "-"


def test_passing_engines_by_cost_and_dimension():
    rows = [row("stack", d, e, "tuned") for d, e in ((2, "mujoco"), (3, "mujoco"), (2, "chipmunk"))]
    rows += [row("stack", 2, "bullet", "tuned", "known", 0.1)]
    costs = {("stack", 2, "mujoco", "tuned"): 2e-3, ("stack", 2, "chipmunk", "tuned"): 1e-3}
    (choice,) = choices(rows, costs)
    assert choice.line == "chipmunk/tuned (2-D only, 1 ms/s), mujoco/tuned (2 ms/s)"
    (choice,) = choices([row("stack", 2, "bullet", "tuned", "known", 0.1)])
    assert choice.line == "none passes every check; nearest: bullet/tuned (1 of 1 fail)"


def test_failures_of_later_apexes_alone():
    late = row("bounce", 2, "bullet", "one", "known", 0.5, 0.4) | {"metric": "apex[2]"}
    (answer,) = answers([row("bounce", 2, "bullet", "one"), late])
    assert "0.5" in answer.wrong and "0.4" in answer.wrong


def test_alarms_stand_before_the_answers():
    lines = shown([*quick_suite(), row("stack", 2, "mujoco", "tuned", "new", 0.1)], 80)
    alarm = next(k for k, line in enumerate(lines) if line.startswith("Needs attention: 1 unexpected result"))
    assert alarm < next(k for k, line in enumerate(lines) if line.startswith("Best engine"))
    assert "1/143 fail, 1 new" in "\n".join(lines[:30])


REFUSED = {"outcome": "unsupported", "reason": "chipmunk is planar", "value": None, "physics": None}


def test_run_without_supported_cells_with_its_reasons():
    rows = [row("impact", 3, "chipmunk", profile, "unsupported") | REFUSED for profile in ("default", "tuned")]
    text = " ".join(" ".join(shown(rows, 100)).split())
    assert "UNSUPPORTED: chipmunk impact: chipmunk is planar" in text
    assert "impact no verdict: no engine of this run can run it" in text
    assert "Nothing was judged" in text
    for wrong in ("nearest", "iteration counts", "Every check passes", "NAME", "outside its tolerance", "explain ID"):
        assert wrong not in text


def shown_only(rows):
    """The rows as a scene file gives them for numbers that it states nothing about."""
    return [each | {"truth": None, "tolerance": None, "error": None, "physics": None, "standing": None}
            for each in rows]  # fmt: skip


def test_numbers_without_a_truth_in_a_summary():
    judged, shown_beside = [row("impact", 2, "bullet", "tuned")], shown_only([row("impact", 2, "bullet", "tuned")])
    assert "Every check passes" in shown(judged + shown_beside, 100)
    text = "\n".join(shown(shown_beside, 100))
    assert "Nothing was judged: no check of this run has a finite tolerance" in text
    assert "impact  no verdict: no check of it has a tolerance" in text
    starved = [row("impact", 2, "bullet", "tuned", "known", 0.1, iterations=1)]
    assert any(line.startswith("Only checks at other iteration counts fail") for line in shown(judged + starved, 100))


def test_refusals_beside_answers_of_others():
    rows = [row("impact", 3, "chipmunk", "tuned", "unsupported") | REFUSED, row("impact", 3, "bullet", "tuned")]
    text = "\n".join(shown(rows, 100))
    assert "chipmunk is planar" not in text and "Nothing was judged" not in text


def test_reason_of_an_invalid_cell():
    why = "receipt size: measured 0.98, declared 1 +- 0.0035"
    lost = {"outcome": "invalid", "reason": why, "physics": None}
    whole = row("impact", 2, "bullet", "tuned", value=1.0, truth=1.0) | lost
    broken = [whole | {"metric": metric} for metric in ("a", "b[1]", "b[2]")]
    rows = [*broken, row("impact", 2, "bullet", "one")]
    text = " ".join(" ".join(shown(rows, 100)).split())
    assert f"INVALID: bullet/tuned impact 2-D e=0.8 height=1: {why} (3 checks)" in text
    assert (
        f"bullet/tuned impact: no result for 3 of 3 checks (INVALID: {why}); the measurement contradicts itself" in text
    )
    assert "truth 1" not in text and "tuned fixes it" not in text and "one fixes it" not in text
    assert finding_line(broken[0]).startswith(f"INVALID: bullet/tuned impact 2-D e=0.8 height=1: {why} | crosscheck")


NOT_CERTIFIED = {"outcome": "refused", "physics": None, "standing": None, "reason": "the normal is not unique: 9e-8"}


def refused(scene, **changes):
    whole = row("impact", 2, "reference", "reference", value=1.0, truth=1.0) | NOT_CERTIFIED | changes
    return [whole | {"scene": scene, "metric": metric} for metric in ("a", "b[1]")]


def test_refusal_of_a_file(tmp_path, monkeypatch):
    """It is told once, with its reason, and is neither a failure nor an alarm."""
    monkeypatch.chdir(tmp_path)
    Path("ball.toml").write_text(FALL)
    rows = [*refused("ball.toml"), row("impact", 2, "bullet", "tuned") | {"scene": "ball.toml"}]
    text = " ".join(" ".join(shown(rows, 100)).split())
    assert text.count("the normal is not unique: 9e-8") == 1 == as_markdown(rows).count("the normal is not unique: 9e")
    assert "REFUSED: reference/reference ball.toml: the normal is not unique: 9e-8" in text
    assert "Every check passes that was judged; 2 are REFUSED" in text
    assert "fail," not in text and "Needs attention" not in text
    assert not any(is_alarming(each) for each in rows) and families(rows) == []
    junit = as_junit(rows)
    assert "<failure" not in junit and junit.count("<skipped") == 2


def test_refusal_in_the_standard_suite():
    rows = [*refused("impact", standing="new"), row("impact", 2, "bullet", "tuned")]
    text = " ".join(" ".join(shown(rows, 100)).split())
    assert "Needs attention: 2 unexpected results (exit status 1)" in text
    assert "REFUSED: reference/reference impact 2-D e=0.8 height=1: the normal is not unique: 9e-8 (2 checks)" in text
    assert "2 of 2 fail, 2 REFUSED" in text and as_junit(rows).count("<failure") == 2


def test_tolerance_that_is_not_finite():
    said = {"tolerance": math.inf, "physics": None, "standing": None, "reason": "not judged: the tolerance is inf"}
    rows = [row("impact", 2, "bullet", "tuned"), row("impact", 2, "bullet", "tuned") | said]
    for text in ("\n".join(shown(rows, 100)), as_markdown(rows)):
        assert "1 of the checks is not judged: the tolerance is inf." in text
    assert "<skipped" in as_junit(rows)


# ---- a real run ----


@pytest.fixture(scope="module")
def two_engines(tmp_path_factory):
    """A store with real cells, and what the terminal shows of it."""
    pytest.importorskip("mujoco")
    pytest.importorskip("pymunk")
    out = tmp_path_factory.mktemp("two")
    who = [("mujoco", "default"), ("mujoco", "tuned"), ("chipmunk", "default"), ("chipmunk", "tuned")]
    cells = [("bounce", {"e": e}) for e in (0.5, 0.95)] + [("bounce", {}), ("stack", {"n": 2.0})]
    slots = [Slot(scene, tuple(p.items()), 2, *name, 1 / 240) for name in who for scene, p in cells]
    store = Store(out)
    run, _ = store.start("quick", slots)
    for slot in slots:
        store.add(run, execute(slot))
    store.finish(run)
    store.close()
    result = CliRunner(env={"COLUMNS": "80"}).invoke(main, ["show", "--out", str(out)])
    assert result.exit_code == 0, result.stderr
    return out, result.stdout


def test_run_advice_for_stacks_and_bounce_with_the_cure(two_engines):
    _, text = two_engines
    lines = text.splitlines()
    head, rest = lines[:30], " ".join(" ".join(lines).split())
    assert any(line.startswith("mujoco 4") for line in head) and any("bounce" in line for line in head)
    assert re.search(r"stack +.*mujoco/tuned", "\n".join(lines))
    assert re.search(r"mujoco/default bounce: [^;]*rebound[^;]*, whatever e is; profile tuned fixes it", rest)
    assert "crosscheck explain ID" in text


def test_show_speaks_json(two_engines):
    out, _ = two_engines
    plain = json.loads(CliRunner().invoke(main, ["show", "--json", "--out", str(out)]).stdout)
    assert {c["scene"] for c in plain["choices"]} == {"bounce", "stack"}
    assert [a for a in plain["answers"] if (a["engine"], a["scene"]) == ("mujoco", "bounce")]


@pytest.mark.parametrize("arguments", [("show",), ("show", "--json"), ("findings",)])
def test_a_store_is_opened_once(two_engines, monkeypatch, arguments):
    """What is counted is of the run that is shown: a run that begins in between is another latest one."""
    out, _ = two_engines
    opened = []

    class Counted(Store):
        def __init__(self, *given, **named):
            opened.append(given)
            super().__init__(*given, **named)

    monkeypatch.setattr(showing, "Store", Counted)
    assert call(*arguments, "--out", out).exit_code == 0
    assert len(opened) == 1


def test_output_ends_with_the_report_path(two_engines):
    out, text = two_engines
    assert "report:" not in text
    report = Path(out) / "report.html"
    report.write_text("<!doctype html>")
    try:
        assert call("show", "--out", out).stdout.splitlines()[-1] == f"  report: {report}"
    finally:
        report.unlink()


def changed(monkeypatch, change):
    """Commands read rows that ``change`` gives from those of the run."""
    judged = brief.judged

    def other(*asked):
        found = judged(*asked)
        return replace(found, rows=change(found.rows))

    monkeypatch.setattr(brief, "judged", other)


def call(*arguments):
    return CliRunner(env={"COLUMNS": "100"}).invoke(main, [str(a) for a in arguments])


def test_findings_of_every_failing_row_and_with_filters(two_engines):
    out, _ = two_engines
    rows = json.loads(call("findings", "--all", "--json", "--out", out).stdout)
    every = json.loads(call("findings", "--json", "--out", out).stdout)
    assert sum(family["count"] for family in every) == len(rows) > 0
    assert sorted(id for family in every for id in family["rows"]) == sorted(row["id"] for row in rows)
    some = json.loads(call("findings", "--engine", "mujoco", "--scene", "bounce", "--json", "--out", out).stdout)
    assert 0 < len(some) < len(every) and {(f["engine"], f["scene"]) for f in some} == {("mujoco", "bounce")}
    marks = ("crashed", "timed_out", "invalid", "new", "drifted")
    new = json.loads(call("findings", "--new", "--json", "--out", out).stdout)
    assert [f["mark"] for f in new] == [f["mark"] for f in every if f["mark"] in marks]
    text = call("findings", "--out", out).stdout
    assert every[0]["worst"]["metric"].partition("[")[0] in text and max(map(len, text.splitlines())) <= 100


def test_explain_with_truth_tolerance_reason_and_cure(two_engines):
    out, _ = two_engines
    text = call("explain", "mujoco/default/bounce/apex", "--out", out).stdout
    for word in (
        "measured",
        "truth",
        "tolerance",
        "cause",
        "fix",
        "profile tuned passes this check",
        "crosscheck run bounce",
    ):
        assert word in text
    assert "<option " in text and "solref=" in text
    assert "mujoco/tuned, against the engine as shipped, tried in" in text
    plain = json.loads(call("explain", "mujoco/default/bounce/apex", "--json", "--out", out).stdout)
    assert plain["cure"]["profile"] == "tuned" and {c["name"] for c in plain["cure"]["changes"]} >= {"solref"}
    again = json.loads(call("explain", plain["id"], "--json", "--out", out).stdout)
    assert again["id"] == plain["id"] and again["value"] == plain["value"]


@pytest.mark.few(1)
@pytest.mark.parametrize("e", [1.0, 0.7])
def test_explanation_without_a_profile_of_no_rank(e, tmp_path):
    """MuJoCo's `matched` rebounds by a loop around the solver, which no settings have: pasted without it, they do not.

    e = 0.7 is no standard case, of which nothing is listed.
    """
    pytest.importorskip("mujoco")
    profiles = ("--profile", "default", "--profile", "matched")
    call("run", "bounce", "--param", f"e={e}", "--dim", "2", "--engine", "mujoco", *profiles, "--out", tmp_path)
    rows = [json.loads(line) for line in (tmp_path / "rows.jsonl").read_text().splitlines()]
    assert {row["physics"] for row in rows if (row["profile"], row["metric"]) == ("matched", "apex[1]")} == {"pass"}
    told = json.loads(call("explain", "mujoco/default/bounce/apex", "--json", "--out", tmp_path).stdout)
    assert told["physics"] == "fail" and told["cure"]["profile"] == "" and told["cure"]["changes"] == []
    assert "matched" not in call("explain", "mujoco/default/bounce/apex", "--out", tmp_path).stdout


@pytest.mark.parametrize(("outcome", "physics"), [("invalid", None), ("ok", "pass")])
def test_explanation_of_a_row_without_failures(outcome, physics, two_engines, monkeypatch):
    """One that is not certified, or one that passes alone after it ended a process of others."""
    out, _ = two_engines
    why = "certificate: a contact pulls"
    ended = {"outcome": outcome, "physics": physics, "standing": None, "reason": why}
    changed(monkeypatch, lambda rows: [replace(row, **ended) for row in rows])
    lines = call("explain", "mujoco/default/bounce/apex", "--out", out).stdout.splitlines()
    assert [line.split(None, 1)[1].strip() for line in lines if line.startswith("reason")] == [why]


def test_explanation_of_a_departure_from_the_plane(two_engines, monkeypatch):
    out, _ = two_engines
    row = ("explain", "mujoco/default/bounce/apex", "--out", out)
    assert "off plane" not in call(*row).stdout

    def tipped(rows):
        beside = [replace(each, physics="fail", value=0.25) for each in rows if each.metric == "out_of_plane"]
        assert beside
        return [each for each in rows if each.metric != "out_of_plane"] + beside

    changed(monkeypatch, tipped)
    said = "off plane the scene leaves its plane by 0.25 m; this check sees only the motion in the plane"
    assert said in " ".join(call(*row).stdout.split())
    assert "off plane" not in call("explain", "mujoco/default/bounce/out_of_plane", "--out", out).stdout


def test_row_or_scene_alone_against_the_whole_run(two_engines):
    out, _ = two_engines
    store = Store(out, create=False)
    rows = showing.load(store, "latest").rows
    store.close()
    by_id = {row_id(row): row for row in rows}
    assert len(by_id) == len(rows)
    for engine, scene in dict.fromkeys((row["engine"], row["scene"]) for row in rows):
        alone = json.loads(
            call("findings", "--all", "--json", "--engine", engine, "--scene", scene, "--out", out).stdout
        )
        there = [row for row in rows if (row["engine"], row["scene"]) == (engine, scene)]
        shown = [row for _, group in grouped(there) for row in group]
        assert alone == json.loads(json.dumps([{**row, "id": row_id(row)} for row in shown]))
    for name, row in list(by_id.items())[:: max(1, len(by_id) // 9)]:
        told = json.loads(call("explain", name, "--json", "--out", out).stdout)
        own = json.loads(json.dumps({key: each for key, each in row.items() if key != "skill"}))  # is added there
        assert {key: told[key] for key in own} == own


def test_a_run_is_judged_once_for_all_commands(two_engines, monkeypatch):
    out, _ = two_engines
    rows = json.loads(json.dumps([row.as_dict() for row in load_rows(out)]))
    monkeypatch.setattr(brief, "rows_of", lambda *asked: pytest.fail("judged again"))
    assert call("show", "--out", out).exit_code == 0
    assert call("compare", "latest", "latest", "--out", out).exit_code == 0
    shown = json.loads(call("findings", "--all", "--json", "--out", out).stdout)
    by_id = {row_id(row): row for row in rows}
    assert shown and all(each == {**by_id[each["id"]], "id": each["id"]} for each in shown)
    assert call("explain", shown[0]["id"], "--out", out).exit_code == 0


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("toy/tuned", {}),
        ("toy/tuned/", {"scene": ""}),
        ("toy/tuned/bounce", {"scene": "bounce"}),
        ("toy/tuned/bounce/apex", {"scene": "bounce", "metric": "apex"}),
        ("toy/tuned/nowhere/apex/x", {"scene": "nowhere", "metric": "apex/x"}),
        ("toy/tuned//my/a b.toml@0123abcd", {"scene": "/my/a b.toml@0123abcd"}),
        ("toy/tuned//my/a b.toml", {"scene": "/my/a b.toml@0123abcd"}),
        ("toy/tuned//my/a b.toml/x[floor/box.fy]", {"scene": "/my/a b.toml@0123abcd", "metric": "x[floor/box.fy]"}),
        ("toy/tuned/drop.json/energy_growth", {"scene": "drop.json@89abcdef", "metric": "energy_growth"}),
        ("toy/tuned/drop/energy_growth", {"scene": "drop.json@89abcdef", "metric": "energy_growth"}),
        ("toy/tuned/a b", {"scene": "/my/a b.toml@0123abcd"}),
        ("toy/tuned/a b.toml/x[floor/box.fy]", {"scene": "/my/a b.toml@0123abcd", "metric": "x[floor/box.fy]"}),
        ("toy/tuned/bounce/bounce", {"scene": "bounce", "metric": "bounce"}),  # ours, not the file of that name
        ("toy/tuned/two.toml", {"scene": "two.toml@22222222"}),  # a path, and the name of another file
        ("toy/tuned/my/a b", {"scene": "my", "metric": "a b"}),
    ],
)  # fmt: skip
def test_row_by_path_or_name_of_its_file(name, found):
    """Paths have slashes, and a hash that nobody types."""
    scenes = {"bounce", "/my/a b.toml@0123abcd", "drop.json@89abcdef", "/my/bounce.toml@11111111",
              "two.toml@22222222", "/my/two.toml@33333333"}  # fmt: skip
    assert showing.named_by(name, scenes) == {"engine": "toy", "profile": "tuned", **found}


def test_ambiguous_scene_file_name_refused_with_paths():
    scenes = {"/my/ball.toml@0123abcd", "/your/ball.json@89abcdef"}
    with pytest.raises(SceneError, match=r"several files called 'ball': /my/ball\.toml, /your/ball\.json"):
        showing.named_by("toy/tuned/ball/energy_growth", scenes)


def test_rows_of_a_scene_file_by_path(tmp_path):
    pytest.importorskip("pymunk")
    path = tmp_path / "a b.toml"
    path.write_text(
        'name = "ball"\ndimension = 2\ngravity = [0.0, -9.81]\nduration = 0.1\n'
        '[[bodies]]\nname = "ball"\nshape = { type = "disc", radius = 0.5 }\n'
    )
    out = str(tmp_path / "out")
    assert call("run", str(path), "--engine", "chipmunk", "--profile", "tuned", "--out", out).exit_code == 0
    told = json.loads(call("explain", f"chipmunk/tuned/{path}/energy_growth", "--json", "--out", out).stdout)
    assert told["metric"] == "energy_growth" and told["scene"].startswith(f"{path}@")
    assert told["command"].endswith(f" --dt 1/240 --out {out}")
    shown = call("explain", "chipmunk/tuned/a b/energy_growth", "--out", out).stdout
    assert told["id"] in shown and "".join(f"--out {out}".split()) in "".join(shown.split())
    assert json.loads(call("explain", "chipmunk/tuned/a b", "--json", "--out", out).stdout)["scene"] == told["scene"]
    found = call("findings", "--scene", str(path), "--out", out)
    assert (found.exit_code, found.stdout) == (0, found.stdout)
    assert found.stdout.endswith("(1 case).\nno such check fails\n")
    matrix = call("show", "--out", out).stdout
    assert re.search(r"^engine, profile +a b *$", matrix, re.M) and re.search(
        r"^  a b  chipmunk/tuned *$", matrix, re.M
    )


def test_a_check_whose_name_is_not_quite_right():
    rows = [{"engine": "toy", "profile": "tuned", "scene": "bounce", "metric": f"apex[{n}]"} for n in (1, 2)]
    for asked, meant in (
        ("toy/tuned/bounc", "toy/tuned/bounce"),
        ("toy/tund/bounce/apex[1]", "toy/tuned/bounce/apex[1]"),
    ):
        with pytest.raises(SceneError, match=rf"did you mean '{re.escape(meant)}'\?"):
            showing.find_row(rows, asked)


@pytest.mark.parametrize("name", ["zzzz", "mujoco/default/nowhere", ""])
def test_refusal_of_a_missing_row(two_engines, name):
    out, _ = two_engines
    result = call("explain", name, "--out", out)
    assert result.exit_code == 2 and len(result.stderr.splitlines()) == 1 and "check: " in result.stderr


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0, "does not rebound"),
        (0.9e-6, "does not rebound"),
        (-0.9e-6, "does not rebound"),
        (1e-6, "rebounds at 1.0e-6 instead of 1"),
        (-1e-6, "moves on with 1.0e-6 of its speed; true: rebounds at 1"),
    ],
)
def test_values_below_a_millionth_of_the_truth(value, words):
    (answer,) = answers([row("impact", 2, "bullet", "default", "known", value, 1.0, e=1.0, v=1.0)])
    assert answer.wrong == f"{words} (e=1 v=1)"


@pytest.mark.parametrize(
    ("scene", "metric", "value", "truth", "words"),
    [
        ("impact", "rebound_ratio", 1.0 + 2e-10, 1.0, "rebounds at 2.0e-10 more than 1"),
        ("impact", "rebound_ratio", 0.8 - 3e-7, 0.8, "rebounds at 3.0e-7 less than 0.8"),
        ("impact", "rebound_ratio", 0.80012, 0.8, "rebounds at 0.8001 instead of 0.8"),
        ("edge_drop", "rise", -2.0 - 4e-9, -2.0, "falls with 4.0e-9 more than 2"),
        ("thin_wall", "rebound_ratio", -0.5 - 4e-9, -0.5,
         "comes back at 4.0e-9 less than -0.5 of its speed (below 0: it has passed)"),
    ],
)  # fmt: skip
def test_difference_told_for_nearly_equal_numbers(scene, metric, value, truth, words):
    known = row("impact", 2, "bullet", "default", "known", value, truth, e=1.0, v=1.0)
    (answer,) = answers([known | {"scene": scene, "metric": metric}])
    assert answer.wrong == f"{words} (e=1 v=1)"


def test_final_commands_find_the_shown_results(tmp_path):
    rows = [row("impact", 2, "bullet", "tuned", "new", 0.1)]
    for out, said in ((Path("crosscheck-out"), ""), (None, ""), (tmp_path / "a b", f" --out '{tmp_path}/a b'")):
        lines = shown(rows, 200, out=out)
        for command in ("crosscheck findings", "crosscheck explain ID", "crosscheck report --open"):
            assert any(line.startswith(f"  {command}{said} ") for line in lines)
        assert said or not any("--out" in line for line in lines)


def test_run_named_in_the_output_beside_a_larger_one(tmp_path):
    """A small run after a whole one is the latest, and is not taken for the whole one."""
    pytest.importorskip("pymunk")
    cells = [Slot("impact", (("e", e),), 2, "chipmunk", "tuned", 1 / 240) for e in (0.0, 0.5)]
    store, ids = Store(tmp_path), []
    for title, slots in (("quick: impact", cells), ("quick: impact --param e=0", cells[:1])):
        run, _ = store.start(title, slots)
        for slot in slots:
            store.add(run, execute(slot))
        store.finish(run)
        ids.append(run.id)
    store.close()
    whole, latest = ids
    for command in ("show", "findings"):
        said = " ".join(call(command, "--out", tmp_path).stdout.split())
        assert said.startswith(f"Run {latest}, the latest: quick: impact --param e=0 (1 case).")
        assert f"A larger run: crosscheck {command} {whole} --out {tmp_path}." in said
        assert f"All runs: crosscheck list runs --out {tmp_path}." in said
    named = " ".join(call("show", whole, "--out", tmp_path).stdout.split())
    assert named.startswith(f"Run {whole}: quick: impact (2 cases).") and "larger" not in named
    assert f"crosscheck report --open {whole} --out {tmp_path}" in named  # the next commands are about the same run
    alone = call("explain", "chipmunk/tuned/impact", whole, "--json", "--out", tmp_path)
    assert alone.exit_code == 0 and json.loads(alone.stdout)["run"] == whole


def test_profile_with_a_broken_measurement_not_compared():
    rows = [row("impact", 2, "mujoco", "default", "known", 0.1), row("impact", 2, "mujoco", "tuned", "known", 0.1)]
    assert answers(rows)[0].cure.startswith("no other profile does better")
    rows[1] |= {"outcome": "invalid", "physics": None, "standing": None, "reason": "receipt mass"}
    assert answers(rows)[0].cure.startswith("profile tuned gave no result")


@pytest.mark.parametrize(
    ("engine", "profile", "searched"),
    [("mujoco", "default", True), ("mujoco", "tuned", False), ("reference", "classical", False)],
)
def test_search_offered_only_from_the_failing_profile(engine, profile, searched):
    (answer,) = answers([row("impact", 2, engine, profile, "known", 0.1, e=0.77, v=1.0)])
    assert ("crosscheck cure" in answer.cure) == searched
