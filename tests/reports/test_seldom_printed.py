"""What takes minutes, releases or a quiet machine to find, and is printed once it is: made up here, line by line."""

import io
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from click.testing import CliRunner
from rich.console import Console

from reports import page, speed, starved, tables
from reports import releases as told_releases
from reports.command import accepting, benching, inspecting, main, posing, releasing
from reports.palette import PAPER
from reports.starved import Starved
from validation.bench import agreement
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.findings import Family, Finding
from validation.judging.acceptance import Change as Proposed
from validation.judging.comparison import Change, Kind
from validation.judging.comparison import Family as Moved
from validation.questions import detection, invariance
from validation.questions.detection import BlindSpot, Detected
from validation.records.store import Run
from validation.releases import history
from validation.releases.bisection import Found, Unchanged
from validation.releases.environments import Environment

SLOT = Slot("stack", (("n", 2.0), ("mu", 0.1)), 3, "chipmunk", "tuned", 1 / 240, 7)


def printed(show: Callable[[Console], object], width: int = 120) -> list[str]:
    """Lines that are printed to a console of its own, without what lies right of them."""
    console = Console(file=io.StringIO(), width=width)
    show(console)
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


def call(*words, status=0):
    done = CliRunner().invoke(main, list(words))
    assert done.exit_code == status, done.output
    return done


# ---- what checks see -------------------------------------------------------------------------------------------------

BLIND = [
    BlindSpot("incline", "angle", "g", 0.001, 0.05, ("speed", "drift"), 1 / 1920),
    BlindSpot("stack", "creep", "mass", 0.2, 0.3, ()),
]


def test_two_tables_of_seen_faults_and_blind_spots():
    entries = [{"name": "stack/creep", "e": "", "mu": "1 %", "g": "0.1 %"}, {"name": "receipt damping", "e": ""}]
    said = printed(lambda console: tables.sensitivity(entries, {"spin": ["inertia", "spin"]}, BLIND, console))
    assert [line.split("   ")[0] for line in said[2:4]] == ["stack/creep", "receipt damping"]
    assert said[2].endswith("   mu 1 %, g 0.1 %") and said[3].endswith("   none of these faults")
    assert said[0].split("   ") == ["check or property check", "smallest fault that it notices"]
    assert said[4] == "spin: no check of these scenes notices it; the property checks inertia, spin do"
    angle, creep = ([cell for cell in line.split("  ") if cell] for line in said[-2:])
    assert [cell.strip() for cell in angle] == [
        "incline/angle", "g", "0.001", "0.05", "50.0 %", "1/1920 s", "speed, drift",
    ]  # fmt: skip
    assert [cell.strip() for cell in creep] == [
        "stack/creep",
        "mass",
        "0.2",
        "0.3",
        "1.5 %",
        "no step",
        "property checks only",
    ]


def test_sensitivity_of_checks_alone(monkeypatch):
    monkeypatch.setattr(detection, "detection", lambda *asked, **named: Detected([], BLIND))
    assert "incline/angle" in call("list", "checks", "--sensitivity").stdout
    assert json.loads(call("list", "checks", "--sensitivity", "--json").stdout) == []
    assert "belongs to checks, not to scenes" in call("list", "scenes", "--sensitivity", status=2).stderr
    assert "engine: belongs to --sensitivity" in call("list", "scenes", "--engine", "bulet", status=2).stderr


# ---- times -----------------------------------------------------------------------------------------------------------


NAMES = {"purpose": "bodies", "scene": "pyramid", "dimension": 2, "engine": "bullet", "profile": "tuned"}


def test_pile_cost_of_the_largest_size_that_ran():
    sizes = [{**NAMES, "x": x, "per_step": 1e-6 * x * x, "void": ""} for x in (40.0, 10.0, 20.0)]
    lost = [{**NAMES, "x": x, "per_step": math.nan, "void": f"too slow at {x:g}"} for x in (160.0, 80.0)]
    other = [{**row, "engine": "chipmunk"} for row in sizes]
    fitted = {**NAMES, "exponent": 2.0, "standard_error": 0.02}
    fits = pd.DataFrame([fitted, {**fitted, "engine": "chipmunk", "exponent": math.nan}])
    for rows in ([*sizes, *lost, *other], [*other, *lost[::-1], *sizes[::-1]]):
        said = printed(lambda console, rows=rows: console.print(speed.scaling_table(pd.DataFrame(rows), fits)))
        assert said[-2:] == [
            "pyramid 2-D, bodies   chipmunk/tuned   40   1.6 ms     -",
            "pyramid 2-D, bodies   bullet/tuned     40   1.6 ms     2.00 +- 0.02   x >= 80: too slow at 80",
        ]
    said = printed(lambda console: console.print(speed.scaling_table(pd.DataFrame([*sizes, *other]), fits)))
    assert said[-1].endswith("2.00 +- 0.02") and "left out" not in said[1]


def test_binding_cost_per_engine_in_table_order():
    rows = [
        {"dimension": 2, "engine": engine, "profile": "tuned", "scene": scene, "sampled": sampled,
         "per_step": 1e-6 * (1 + sampled), "void": "it hung" if scene == "free" and engine == "bullet" else ""}
        for engine in ("bullet", "chipmunk") for scene in ("empty", "free") for sampled in (False, True)
    ]  # fmt: skip
    table = pd.DataFrame(rows)
    said = printed(lambda console: console.print(speed.overhead_table(table)))
    assert [line.split() for line in said[-2:]] == [
        ["chipmunk/tuned", "2-D", "1", "us", "2", "us", "1", "us", "2", "us"],
        ["bullet/tuned", "2-D", "1", "us", "2", "us", "-", "-"],
    ]
    assert list(speed.in_order(table[::-1], ["dimension"])["engine"]) == ["chipmunk"] * 4 + ["bullet"] * 4
    assert len(speed.in_order(table[:0], ["dimension"])) == 0


@pytest.mark.parametrize(
    ("count", "enough", "said"),
    [
        (20, True, "95.0% of 20 time ratios agree"),
        (3, False, "66.7% of 3 time ratios agree"),
        (0, False, "no case of the same"),
    ],
)
def test_agreement_of_two_benches(monkeypatch, count, enough, said):
    both = pd.DataFrame(
        {**NAMES, "dt": 1 / 240, "iterations": 10, "params_text": f"n={k}", "ratio_1": 1.0 + k, "ratio_low_1": 0.9 + k,
         "ratio_high_1": 1.125 + k, "ratio_2": 1.25 + k, "ratio_low_2": 1.2 + k, "ratio_high_2": 1.4 + k,
         "agrees": k != 1} for k in range(count)
    )  # fmt: skip
    monkeypatch.setattr(agreement, "ratios", lambda store, run: None)
    monkeypatch.setattr(agreement, "agreement", lambda a, b: both)
    run, agrees = SimpleNamespace(id="20260101-000000"), []
    lines = printed(lambda console: agrees.append(benching._compare(None, run, run, console)), 200)
    assert agrees == [enough] and lines[-1].startswith("against 20260101-000000: ") and said in lines[-1]
    told = "  bodies pyramid 2-D bullet/tuned dt 0.00417 n=1 x10: 2 [1.9, 2.12], now 2.25 [2.2, 2.4]"
    assert lines[:-1] == [told] * (count > 0)


# ---- releases --------------------------------------------------------------------------------------------------------

VERSIONS = ["1.0", "1.1", "1.2", "2.0"]


def changed(kind=Kind.FLIP, worse=True):
    return Change(kind, worse, "toy", "default", "stack", 3, "n=2", "creep", "pass", "fail", 3.25, SLOT.as_dict())


@pytest.mark.parametrize(
    ("others", "said"),
    [(None, "whether it is the only change: --all runs every release"),
     (((0, 1), (2, 3)), "not the only change of this check: also 1.0 -> 1.1, 1.2 -> 2.0"),
     ((), "the only change of this check: every release ran")],
)  # fmt: skip
def test_bisection_output_with_change_silent_releases_and_command(others, said):
    found = Found(1, 3, (0, 3, 1), {2: "it cannot be imported"}, changed(), others)
    again = releasing._commands("toy", "1.1", "2.0", SLOT, Path("else where"))
    lines = told_releases.found_as_text(told_releases.found_as_plain(found, "toy", VERSIONS, again)).splitlines()
    assert lines == [
        "newly failing since toy 2.0: default stack 3-D n=2 at 7 iterations creep",
        "  toy 1.1: pass",
        "  toy 2.0: fail",
        "  1.2 lies between and cannot run: it cannot be imported",
        "ran 3 releases: 1.0, 2.0, 1.1",
        said,
        "to run it again:",
        "  crosscheck releases toy 1.1,2.0 stack --profile tuned --dim 3 --dt 1/240 --iterations 7 --param n=2.0 "
        "--param mu=0.1 --fresh --out 'else where'",
        "  crosscheck compare toy==1.1 toy==2.0 --out 'else where'",
    ]
    assert "--out" not in " ".join(releasing._commands("toy", "1.1", "2.0", SLOT, Path("crosscheck-out")))
    own = Slot("my scene@abc", (), 2, "toy", "default", 1 / 60)
    assert "releases toy 1,2 'my scene' --profile default --dim 2 --dt 1/60 --fresh" in releasing._commands(
        "toy", "1", "2", own, Path("crosscheck-out")
    )[0]  # fmt: skip


@pytest.mark.parametrize(
    ("reason", "said", "status"),
    [("", "creep of stack is the same in 1.0 and 2.0", 0),
     ("release 0 has no answer", "1.0 has no answer", 4), ("release 3 has no answer", "2.0 has no answer", 4)],
)  # fmt: skip
def test_bisection_output_without_a_change(capsys, reason, said, status):
    for as_json in (False, True):
        with pytest.raises(SystemExit) as left:
            releasing._say_unchanged(Unchanged(reason), VERSIONS, "creep", "stack", as_json)
        out = capsys.readouterr().out
        assert left.value.code == status
        assert json.loads(out) == {"found": None, "reason": said} if as_json else out == f"{said}\n"


def test_environments_listed_with_faults_and_removed(monkeypatch):
    receipt = {"python": "3.11.4", "packages": {"numpy": "2.0"}, "files": "abc"}
    own = [Environment(Path("/x/toy-1.0"), receipt), Environment(Path("/x/toy-2.0"), {}),
           Environment(Path("/x/toy-3.0"), {})]  # fmt: skip
    wrong = {"toy-1.0": "numpy is 1.0, not 2.0"}
    for name, told in {
        "found": lambda: list(own), "size": lambda each: 3 * 2**20, "check": lambda each: wrong.get(each.name, ""),
        "folder": lambda: Path("/x"), "remove": own.remove,
    }.items():  # fmt: skip
        monkeypatch.setattr(releasing.environments, name, told)
    listed = ("releases", "--environments")
    assert call(*listed, status=1).stdout.splitlines() == [
        "toy-1.0  Python 3.11.4  3 MiB  numpy is 1.0, not 2.0", "toy-2.0  Python   3 MiB  as installed",
        "toy-3.0  Python   3 MiB  as installed", "3 environments in /x",
    ]  # fmt: skip
    first = json.loads(call(*listed, "--json", status=1).stdout)[0]
    assert first == {"name": "toy-1.0", "bytes": 3 * 2**20, "wrong": wrong["toy-1.0"], **receipt}
    assert "there is no environment 'toy-9'" in call(*listed, "--remove", "toy-9", status=2).stderr
    done = call(*listed, "--remove", "toy-1.0")
    assert done.stderr == "removed toy-1.0\n" and done.stdout.endswith("2 environments in /x\n")
    done = call(*listed, "--remove", "all")
    assert done.stderr == "removed toy-2.0\nremoved toy-3.0\n" and done.stdout == "0 environments in /x\n" and not own
    assert call(*listed, "--remove", "all").stdout == "0 environments in /x\n"


def test_moved_rows_between_releases_counted_by_outcome():
    def step(*kinds):
        return history.Step("1.0", "1.1", Moved(tuple(changed(*kind) for kind in kinds)))

    ends = "; first `creep` (3-D n=2 at 7 iterations) pass -> fail"
    every = [(kind, worse) for kind in (Kind.FLIP, Kind.OUTCOME, Kind.ERROR) for worse in (True, False)]
    assert [told_releases._moved([step(kind)]) for kind in every] == [
        f"1 check {what}{ends}" for what in ("begins to fail", "ceases to fail", "ends without a result",
                                             "has a result again", "changes its value", "changes its value")
    ]  # fmt: skip
    assert told_releases._moved([step(*every), step(*every[::-1])]) == (
        "2 checks begin to fail, 2 checks cease to fail, 2 checks end without a result, 2 checks have a result again, "
        f"4 checks change their value{ends}"
    )


# ---- cells posed otherwise -------------------------------------------------------------------------------------------


def test_one_transformed_cell_per_profile():
    slots = [Slot("stack", (("n", n),), 2, "chipmunk", profile, dt, iterations, ulp)
             for n, profile, dt, iterations, ulp in (
                 (3.0, "tuned", 1 / 240, None, 0), (2.0, "tuned", 1 / 240, None, 0), (2.0, "default", 1 / 240, 4, 0),
                 (2.0, "default", 1 / 60, None, 0), (2.0, "default", 1 / 240, None, 1),
                 (5.0, "default", 1 / 240, None, 0))]  # fmt: skip
    assert posing.cells_of(slots, True) == [slots[0], slots[2]]
    plain = Slot("stack", (("n", 10.0),), 2, "chipmunk", "tuned", 1 / 240)
    assert posing.cells_of(slots, False) == [plain, replace(plain, profile="default")]


def test_cause_of_a_changed_answer_as_text_and_data(monkeypatch, capsys):
    slot = Slot("stack", (("n", 2.0),), 2, "chipmunk", "tuned", 1 / 240)
    changes = [invariance.Change("again"), invariance.Change("mirrored", "drift", 1e-3, 1e-6)]
    monkeypatch.setattr(posing, "compare", lambda slot: changes)
    assert not posing.compare_and_show([slot], True)
    (cell,) = json.loads(capsys.readouterr().out)
    assert cell["slot"] == slot.as_dict()
    assert [(each["relation"], each["holds"], each["physics"]) for each in cell["changes"]] == [
        ("again", True, "pass"), ("mirrored", False, "fail"),
    ]  # fmt: skip
    assert not posing.compare_and_show([slot], False)
    said = " ".join(capsys.readouterr().out.split())
    assert "stack 2-D n=2" in said and "mirrored (drift by 0.001; allowed: 1.0e-6)" in said
    assert "crosscheck run stack --param n=2 --dim 2 --engine chipmunk --profile tuned" in said
    changes.pop()
    assert posing.compare_and_show([slot], False)


# ---- health, findings, pictures, citing ------------------------------------------------------------------------------


def test_doctor_lines_of_engines_and_packages(monkeypatch):
    data = {
        "machine": {"cpu": "a [fast] one", "cores": 4}, "commit": "", "executable": "/x/python",
        "engines": [{"name": "toy", "version": "1.2", "status": "installed", "reason": ""},
                    {"name": "brittle", "version": "", "status": "broken", "reason": "ImportError: [no] such symbol"}],
        "packages": {"reports": "/y/[old]/reports"}, "kernel_cache": {"folder": None},
        "problems": ["reports is not ours: /y/[old]"], "traces": {"brittle": ["File one, line 3"]},
    }  # fmt: skip
    monkeypatch.setattr(inspecting.listing, "doctor", lambda: data)
    assert json.loads(call("doctor", "--json", status=1).stdout) == data
    said = [" ".join(line.split()) for line in printed(lambda console: tables.health(data, console))]
    for line in (
        "cpu a [fast] one", "commit -", "toy 1.2 installed", "brittle - ImportError: [no] such symbol",
        "reports /y/[old]/reports", "compiled kernels no folder is writable, so every process compiles them",
        "1 problem(s)", "reports is not ours: /y/[old]", "traceback of brittle", "File one, line 3",
    ):  # fmt: skip
        assert line in said
    sound = data | {"commit": "abc", "problems": [], "traces": {}, "kernel_cache": {"folder": "/z"}}
    said = [" ".join(line.split()) for line in printed(lambda console: tables.health(sound, console))]
    assert said[-1] == "no problem found" and "commit abc" in said and "compiled kernels /z" in said


def test_rows_counted_before_a_family_is_accepted():
    family = Family("f-1", ("default", "tuned"), "stack", ("creep",), "", "", ">=1")
    keys = [("default", "stack", "2", "", f"n={n}", "", f"creep[{n}]") for n in range(5)]
    keys += [("tuned", "stack", "3", "4", "", "", "drift")]
    values = {key: Finding(family, 0.25 * (k + 1), 1e-3) for k, key in enumerate(keys)}
    moved = {key: (own, replace(own, value=2.0 * own.value)) for key, own in values.items()}
    assert accepting._details(Proposed(family, new=values, gone=values)).splitlines() == [
        "cause f-1: default, tuned on stack", "  new: 5 x default creep", "  new: 1 x tuned drift",
        "  gone: 5 x default creep", "  gone: 1 x tuned drift", "  default stack 2 n=0 creep[0]: 0.25",
        "  default stack 2 n=1 creep[1]: 0.5", "  default stack 2 n=2 creep[2]: 0.75",
    ]  # fmt: skip
    assert accepting._details(Proposed(family, drifted=moved, bands=moved)).splitlines()[1:] == [
        "  changed: 5 x default creep", "  changed: 1 x tuned drift", "  with another band: 5 x default creep",
        "  with another band: 1 x tuned drift", "  default stack 2 n=0 creep[0]: 0.25 -> 0.5",
        "  default stack 2 n=1 creep[1]: 0.5 -> 1", "  default stack 2 n=2 creep[2]: 0.75 -> 1.5",
    ]  # fmt: skip
    assert accepting._details(Proposed(family, same=values)) == "cause f-1: default, tuned on stack"


def test_tile_of_a_sinking_stack_with_its_depth():
    rows = [Starved(10, 1, 9.0, 1.6, 1.0, False), Starved(10, 20, 0.0077, 0.002, 0.15, True),
            Starved(10, 40, 0.021, 0.002, 0.15, True), Starved(1, 100, 0.0, 0.0, 0.0, True)]  # fmt: skip
    tiles = starved.table(rows)
    assert list(tiles["word"]) == ["falls", "0.8 %", "2 %", "stands"]
    assert list(tiles["depth"]) == [0.2, 0.0077, 0.021, 1e-3] and list(tiles["deep"]) == [True, False, True, False]
    for scheme, paper in PAPER.items():
        spec = starved.chart(rows, scheme)
        (points,) = spec["datasets"].values()
        for layer in spec["layer"]:
            named = [channel["field"] for channel in layer["encoding"].values() if "field" in channel]
            assert {"sweeps", "height"} <= set(named) <= set(points[0])
        assert spec["config"]["background"] == paper


@pytest.mark.parametrize(
    ("title", "again"),
    [("quick: impact bounce", "impact bounce --quick"), ("odd", "--quick"),
     (f"full: {' '.join(CATALOGUE)} --dim 3 --engine bullet", "--dim 3 --engine bullet --full"),
     (f"standard: {' '.join(CATALOGUE)}", "--standard")],
)  # fmt: skip
def test_citation_and_command_on_a_page(monkeypatch, title, again):
    monkeypatch.setattr(page, "package_version", lambda: "1.2.3")
    bench = SimpleNamespace(run=SimpleNamespace(title="bench quick: impact --dim 2"))

    def told(commit, bench=None):
        run = Run("20260101-000000", "2026-01-01T10:00:00", commit, {}, title, (), True)
        return page.cite(SimpleNamespace(run=run, observations=[1, 2], rows=[1], bench=bench))

    found = told("abc123+", bench)
    assert found["text"].startswith(
        "contact-crosscheck 1.2.3, commit abc123+, run 20260101-000000 of 2026-01-01 (2 cases, 1 values)."
    )
    lines = [
        'pip install -e ".[all]" -c constraints.txt', f"crosscheck run {again} --out again",
        "crosscheck report --out again", "crosscheck compare FOLDER again   # FOLDER: that of this run",
    ]  # fmt: skip
    assert told("")["commands"].splitlines() == lines
    assert told("abc")["commands"].splitlines() == ["git checkout abc", *lines]
    lines.insert(2, "crosscheck bench impact --dim 2 --quick --out again")
    changed_since = "git checkout abc123   # plus changes that were not committed"
    assert found["commands"].splitlines() == [changed_since, *lines]


def test_listings_in_a_narrow_window():
    """Columns of three letters could not be read."""
    entry = {"name": "bounce", "title": "Dropped ball, from the first bounce to rest", "dimensions": [2, 3], "law": ""}
    printed = io.StringIO()
    tables.listed("scenes", [entry], Console(file=printed, width=40))
    told = printed.getvalue().splitlines()
    assert [line.rstrip() for line in told] == [
        "bounce", "  what: Dropped ball, from the first", "  bounce to rest; dim.: 2, 3"
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["bounce", "chipmunk"])
def test_words_of_a_description_in_a_narrow_window(name):
    """None is broken but those that are longer than a line."""
    runners = [CliRunner(env={"COLUMNS": width}) for width in ("40", "400")]
    narrow, wide = ([w.strip(";:") for w in run.invoke(main, ["describe", name]).output.split()] for run in runners)
    long = [word for word in wide if len(word) > 36]
    broken = [word for word in narrow if word not in wide and not any(word in each for each in long)]
    assert len(narrow) > 200 and broken == []
