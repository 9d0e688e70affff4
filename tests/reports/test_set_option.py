"""`--set` on the command line: what is planned, run, stored, shown, explained, exported and asked of releases."""

import io
import json
import math
import shlex

import pytest
from click.testing import CliRunner
from rich.console import Console

from reports.command import main
from reports.command.releasing import _commands
from reports.command.running import run
from reports.command.selection import Cases, taken
from reports.matrix import matrix_of, tables_of
from reports.wording import reproduce
from validation.cells import slot_from_dict
from validation.records.store import Store
from validation.running.plan import slots

pytest.importorskip("pymunk", reason="pymunk is an optional engine")
SETS = ["--set", "damping=0.5", "--set", "collision_slop=0.01"]
PROFILE = "default+collision_slop=0.01+damping=0.5"
FALLING = """
name = "falling"
dimension = 2
gravity = [0.0, -10.0]
duration = 0.25
bodies = [{ name = "ball", shape = { type = "disc", radius = 0.5 }, inertia = 0.125, pose = [0.0, 5.0, 0.0] }]
[[checks]]
quantity = "ball.vy"
value = "-g * t"
tolerance = "g * dt"
"""


def call(*words, status=None):
    done = CliRunner().invoke(main, [str(word) for word in words])
    assert status is None or done.exit_code == status, done.output
    return done


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A folder with one run of a profile with settings of its own, in worker processes, and its rows."""
    out = tmp_path_factory.mktemp("own")
    done = call("run", "bounce", "--param", "e=0.5", "--dim", 2, *SETS, "--json", "--out", out, status=0)
    rows = json.loads(done.stdout[done.stdout.index("[") :])
    return out, rows


def test_profile_of_rows_with_own_settings(ran):
    _, rows = ran
    assert {(row["engine"], row["profile"]) for row in rows} == {("chipmunk", PROFILE)}
    assert {row["outcome"] for row in rows} == {"ok"} and {row["standing"] for row in rows} == {None}
    assert any(row["physics"] == "fail" for row in rows)
    assert all(row["slot"]["switched"] == {"collision_slop": 0.01, "damping": 0.5} for row in rows)


@pytest.mark.parametrize("width", [80, 120])
def test_row_with_own_settings_shown_at_any_width(ran, width, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    text = call("show", "--out", ran[0], status=0).output
    assert PROFILE in text and all(len(line.rstrip()) <= width for line in text.splitlines() if "/" not in line)


def test_lines_per_setting_under_a_long_scene_name():
    """A count that is cut would be another count."""
    name = "default+cone=elliptic+solimp=0.99,0.99,0.001,0.5,2+solref=0.004,1"
    rows = [
        {"scene": "pinch", "dimension": 3, "engine": "mujoco", "profile": name, "iterations": None, "outcome": "ok",
         "standing": None, "physics": physics}
        for physics in ("pass",) * 7 + ("fail",) * 5
    ]  # fmt: skip
    for width, lines in ((80, 3), (120, 1)):
        console = Console(width=width, record=True, file=io.StringIO())
        for table in tables_of(matrix_of(rows), {}, width):
            console.print(table)
        text = console.export_text()
        assert ("5/12 fail" in text or "5 of 12 fail" in text) and all(
            len(line.rstrip()) <= width for line in text.splitlines()
        )
        assert sum("=" in line for line in text.splitlines()) == lines
        assert "".join(text.split("mujoco")[1].split()).startswith(name.partition("+")[0])


def test_search_of_a_row_with_own_settings(ran):
    out, rows = ran
    (failing, *_) = [row for row in rows if row["physics"] == "fail"]
    found = json.loads(call("findings", "--profile", PROFILE, "--json", "--out", out, status=0).output)
    assert found and all(family["profile"] == PROFILE for family in found)
    where = f"bounce/{failing['metric']}"
    told = [
        json.loads(call("explain", *words, "--json", "--out", out, status=0).output)
        for words in (
            [f"chipmunk/{PROFILE}/{where}"],
            [f"chipmunk/default/{where}", *SETS],
            [f"chipmunk/default/{where}", "--set", "collision_slop=1e-2", "--set", "damping=.50"],
        )
    ]
    assert told[0] == told[1] == told[2] and told[0]["profile"] == PROFILE
    assert "not listed: with settings of your own" in told[0]["reason"]


def test_explain_of_an_unknown_row_in_one_line(ran):
    done = call("explain", "chipmunk/default/bounce", "--set", "damping=0.25", "--out", ran[0], status=2)
    assert "no check 'chipmunk/default+damping=0.25/bounce'" in done.output
    done = call("explain", "0123abcd", "--set", "damping=0.25", "--out", ran[0], status=2)
    assert "set: changes a profile; name the check as ENGINE/PROFILE/SCENE, not '0123abcd'" in done.output


@pytest.mark.parametrize(
    "asked, said",
    [
        ("dampng=0.5", "set: chipmunk has no setting 'dampng'; near it: damping"),
        ("damping=much", "set: damping=much: must be a number"),
    ],
)
def test_explain_of_an_unknown_setting_as_in_run(ran, asked, said):
    done = call("explain", "chipmunk/default/bounce/apex", "--set", asked, "--out", ran[0], status=2)
    assert said in done.output and len(done.output.splitlines()) == 1


def test_command_that_runs_a_row_again(ran):
    for row in ran[1]:
        words = shlex.split(reproduce(row["slot"]))
        assert words[:2] == ["crosscheck", "run"]
        (again,) = slots(taken(Cases, run.make_context("run", words[2:]).params).request())
        assert again == slot_from_dict(row["slot"])


def test_resumed_run_with_the_same_settings(ran, tmp_path):
    _, rows = ran
    call("run", "bounce", "--param", "e=0.5", "--dim", 2, "--set", "damping=0.25", "--out", tmp_path, status=0)
    store = Store(tmp_path)
    kept = store.observations(store.run("latest"))
    store.close()
    assert {o.slot.profile for o in kept} == {"default+damping=0.25"}
    assert {o.state_hash for o in kept}.isdisjoint({row["state_hash"] for row in rows})


def test_a_setting_given_as_a_formula(tmp_path):
    """`describe` and fixes write 3*g*dt^2, which `--set` refused."""
    path = tmp_path / "falling.toml"
    path.write_text(FALLING)
    asked = ["run", path, "--engine", "chipmunk", "--dt", "1/200", "--json", "--out", tmp_path / "out"]
    rows = json.loads(call(*asked, "--set", "collision_slop=3*g*dt^2", status=0).stdout)
    assert {row["profile"] for row in rows} == {"default+collision_slop=0.00075"}  # 3 * 10 / 200^2
    refused = call(*asked, "--set", "collision_slop=3*f*dt^2", status=2)
    assert "set: collision_slop=3*f*dt^2: must be a number" in refused.output


def test_a_scene_file_runs_with_settings(tmp_path):
    path = tmp_path / "falling.toml"
    path.write_text(FALLING)
    # The file states a number, which the setting makes wrong: an alarm, and the row says what the setting realises.
    done = call("run", path, "--set", "damping=0.5", "--json", "--out", tmp_path / "out", status=1)
    rows = json.loads(done.stdout[done.stdout.index("[") :])
    assert {(row["engine"], row["profile"]) for row in rows} == {("chipmunk", "default+damping=0.5")}
    # Half of the speed is lost in a second: v = -g (1 - 2^-t)/ln 2.
    (stated,) = [row for row in rows if "ball.vy" in row["check"]]
    assert (stated["physics"], stated["standing"]) == ("fail", "new")
    assert "realised linear_damping = 0.5 of 0" in stated["reason"]
    speed = stated["value"]
    assert speed == pytest.approx(-10.0 * (1.0 - 0.5**0.25) / math.log(2.0), abs=10.0 / 240.0)
    # Without the number nothing is listed that could be new: shown, and no alarm.
    path.write_text(FALLING.partition("[[checks]]")[0])
    call("run", path, "--set", "damping=0.5", "--out", tmp_path / "out", status=0)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "bounce", "--set", "dampin=0.5"],
         "set: no installed engine has a setting 'dampin'; near it: damping"),
        (["run", "bounce", "--engine", "chipmunk", "--set", "dampin=0.5"], "set: chipmunk has no setting 'dampin'"),
        (["bench", "bounce", "--engine", "chipmunk", "--set", "damping=7"],
         "set: damping=7: must be a number from 0 to 1"),
        (["export", "bounce", "--to", "python", "--engine", "chipmunk", "--set", "x=7"],
         "set: chipmunk has no setting 'x'"),
        (["run", "bounce", "--engine", "reference", "--set", "damping=0.5"], "set: reference has no setting 'damping'"),
        (["bisect", "chipmunk", "7.0.0..7.3.1", "bounce", "--check", "apex", "--set", "damp=1"],
         "set: chipmunk has no setting 'damp'; near it: damping"),
        (["export", "--parquet", "folder", "--set", "damping=0.5"], "set: chooses a case to write, which needs --to"),
    ],
)  # fmt: skip
def test_wrong_setting_in_one_line_without_a_run(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = call(*words, status=2)
    assert done.output.startswith(f"crosscheck: {said}") and done.output.count("\n") == 1
    assert not (tmp_path / "crosscheck-out" / "results.sqlite").exists()


def test_commands_below_a_bisection_ask_with_the_settings(ran, tmp_path):
    slot = slot_from_dict(ran[1][0]["slot"])
    again, _ = _commands("chipmunk", "7.0.0", "7.3.1", slot, tmp_path)
    words = shlex.split(again)
    assert words[words.index("--profile") + 1] == "default"
    assert [words[k + 1] for k, word in enumerate(words) if word == "--set"] == ["collision_slop=0.01", "damping=0.5"]
