"""Text from files and plugins is shown as it is: nothing in it is a style, a picture or an error of the terminal's."""

import ast
import json
import re
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import CliRunner

import reports
from reports import exports, listing
from reports.command import main
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.posed import pinned
from validation.records.store import Store
from validation.running.execution import execute

NAME = "[bold]x[/bold] [red"
FILE_NAME = "[bold]x[bold] [red.toml"
BODY = "[blue]b :smile:"
BECAUSE = "[red]wrong on purpose[/red] :boom:"
SCENE = f"""
name = "{NAME}"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.1
[[bodies]]
name = "[/floor]"
shape = {{ type = "half_space", normal = [0.0, 1.0] }}
motion = "fixed"
[[bodies]]
name = "{BODY}"
shape = {{ type = "disc", radius = 0.5 }}
mass = 1.0
pose = [0.0, 2.0, 0.0]
[[pairs]]
restitution = 0.5
[[checks]]
quantity = "{BODY}.vy"
value = 7.0
tolerance = 0.1
because = "{BECAUSE}"
"""


def call(*arguments):
    return CliRunner(env={"COLUMNS": "300"}).invoke(main, [str(a) for a in arguments])


def flat(text):
    return " ".join(text.split())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of a scene file that is named like markup, and whose own check fails."""
    pytest.importorskip("pymunk")
    out = tmp_path_factory.mktemp("out")
    file = out / FILE_NAME
    file.write_text(SCENE)
    slot = Slot(pinned(str(file)), (), 2, "chipmunk", "tuned", 1 / 240)
    store = Store(out)
    run, _ = store.start(f"quick: {NAME}", [slot])
    store.add(run, execute(slot))
    store.finish(run)
    store.close()
    return out


@pytest.mark.parametrize(
    ("arguments", "texts"),
    [
        (("list", "runs"), [NAME]),
        (("show",), [FILE_NAME]),
        (("findings",), [FILE_NAME.removesuffix(".toml"), f"{BODY}.vy"]),
        (("findings", "--all"), [FILE_NAME.removesuffix(".toml"), f"{BODY}.vy"]),
        (("explain", "ROW"), [FILE_NAME, f"{BODY}.vy", BECAUSE]),
    ],
)
def test_text_shown_literally_by_commands_about_a_run(folder, arguments, texts):
    if "ROW" in arguments:
        rows = json.loads(call("findings", "--all", "--json", "--out", folder).stdout)
        arguments = ("explain", next(row["id"] for row in rows if BODY in row["metric"]))
    result = call(*arguments, "--out", folder)
    assert result.exit_code == 0, result.output
    for text in texts:
        assert text in flat(result.stdout)


def test_names_and_reasons_of_a_scene_file(folder):
    result = call("describe", folder / FILE_NAME)
    assert result.exit_code == 0, result.output
    for text in (NAME, FILE_NAME, f"{BODY}.vy", BECAUSE):
        assert text in flat(result.stdout)


def test_plugin_texts_in_lists_and_doctor(monkeypatch):
    said = "[bold]no[/bold] [/] [red :smile:"
    engine = {"name": f"[i]{said}", "version": said, "status": "not installed", "profiles": [said], "reason": said}
    found = listing.doctor()
    found |= {"engines": [engine], "problems": [said], "packages": {said: said}, "commit": said}
    monkeypatch.setattr(listing, "engines", lambda: [engine])
    monkeypatch.setattr(listing, "doctor", lambda: found)
    for command in (("list", "engines"), ("doctor",)):
        result = call(*command)
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        assert result.stdout.count(said) >= 3, result.stdout


def test_settings_and_habits_of_a_plugin(monkeypatch):
    said = "[bold]so[/bold] [/] [red :smile:"
    data = listing.describe("chipmunk")
    if data["status"] != "installed":
        pytest.skip(f"chipmunk: {data['reason']}")
    data["profiles"] = {said: {"impact": [{"name": said, "value": said, "because": said, "source": said}]}}
    data["quirks"] = [{"what": said, "what_we_do": said, "source": said}]
    monkeypatch.setattr(listing, "describe", lambda name, measure: data)
    result = call("describe", "chipmunk")
    assert result.exit_code == 0, result.output
    assert flat(result.stdout).count(said) >= 6


def test_room_for_reasons_beside_many_scenes(monkeypatch):
    """Four settings of forty of fifty scenes: named once, as all but ten, and a reason of 30 letters stays whole."""
    data = listing.describe("chipmunk")
    if data["status"] != "installed":
        pytest.skip(f"chipmunk: {data['reason']}")
    because = "thirty letters give the reason"
    scenes = [f"scene_number_{k}" for k in range(50)]
    data["profiles"] = {"tuned": {
        name: [{"name": f"aSettingOfTwentyNineLetters{n}", "value": 1 + k // 40, "because": because, "source": ""}
               for n in range(4)]
        for k, name in enumerate(scenes)
    }}  # fmt: skip
    monkeypatch.setattr(listing, "describe", lambda name, measure: data)
    said = call("describe", "chipmunk").stdout
    assert sum(because in line for line in said.splitlines()) == 8
    assert flat(said).count("(1) all but (2)") == 1 and said.count("scene_number_40") == 1
    assert "scene_number_1," not in said
    assert flat(said).count("(2) scene_number_40, scene_number_41") == 1


def test_markdown_without_html_or_open_outside_text(folder):
    evil = "<img src=x onerror=alert(1)> & a|b"
    (row, *_) = [row.as_dict() for row in exports.load_rows(folder) if row.physics == "fail"]
    row |= {"scene": f"{evil}.toml@0a1b2c3d", "reason": evil, "because": evil, "engine": "toy<b>", "profile": evil}
    text = exports.as_markdown([row])
    ours = text.replace("<br>", "")
    assert "<" not in ours and ">" not in ours and "alert(1)" in text and " &amp; " in text
    table = [re.findall(r"(?<!\\)\|", line) for line in text.splitlines() if line.startswith("|")]
    assert len(table) == 3 and {len(bars) for bars in table} == {3}


def test_every_command_has_the_console_that_reads_no_markup():
    made, names = [], ("Console", "_Terminal")
    for path in Path(reports.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) in names:
                made.append(path.name)
    assert made == ["terminal.py"]


def test_a_reason_that_checks_share_is_listed_once(monkeypatch):
    """Each told it again, seven lines of two words at 80 columns."""
    monkeypatch.setenv("COLUMNS", "80")
    plain = json.loads(call("list", "checks", "--json").stdout)
    lines = {line.partition(" ")[0]: line for line in call("list", "checks", "--reasons").stdout.splitlines()}
    shared = [after["because"] == before["because"] for before, after in pairwise(plain)]
    assert any(shared)
    assert ["as above" in lines[check["name"]] for check in plain[1:]] == shared


def test_line_of_a_check_with_its_reason():
    """At 80 columns the reasons made 1801 lines of some 300."""
    plain = json.loads(call("list", "checks", "--json").stdout)
    told = CliRunner(env={"COLUMNS": "80"}).invoke(main, ["list", "checks"]).stdout.splitlines()
    body, last = told[2:-1], told[-1]
    assert [line.partition(" ")[0] for line in body] == [check["name"] for check in plain] and len(plain) > 200
    assert max(map(len, told)) <= 80 and "--reasons" in last and "describe SCENE" in last
    refused = call("list", "scenes", "--reasons")
    assert refused.exit_code == 2 and "reasons: belongs to checks, not to scenes" in refused.stderr


WIDE = [
    *(("list", what) for what in ("scenes", "suites", "engines", "checks")), ("list", "checks", "--reasons"),
    *(("describe", name) for name in ("bounce", "v_groove", "chipmunk")), ("doctor",), ("nulls", "impact"),
]  # fmt: skip


@pytest.mark.parametrize("words", WIDE, ids=" ".join)
def test_list_and_describe_at_every_width_uncut(words):
    sizes = []
    for width in (80, 100, 120):
        told = CliRunner(env={"COLUMNS": str(width)}).invoke(main, list(words)).stdout.splitlines()
        assert told and max(len(line.rstrip()) for line in told) <= width
        assert not any("…" in line for line in told)
        sizes.append(len(told))
    assert sizes == sorted(sizes, reverse=True)  # room that is there is used


def test_titles_of_scenes_are_listed_whole():
    """One with a colon was cut as the title of a run that names many scenes."""
    told = " ".join(CliRunner(env={"COLUMNS": "400"}).invoke(main, ["list", "scenes"]).stdout.split())
    assert all(" ".join(scene.title.split()) in told for scene in CATALOGUE.values())


def test_roles_of_profiles_in_list_and_describe():
    assert "Profiles: classical: textbook; reference: exact; default: as shipped" in call("list", "engines").stdout
    told = call("describe", "chipmunk").stdout.splitlines()
    assert "Profile default (as shipped)" in told and "Profile tuned" in told


def test_listing_of_a_run_of_many_scenes(tmp_path):
    """The title of a quick suite names forty-six scenes: a screen for every run."""
    store = Store(tmp_path)
    names = [f"scene{k}" for k in range(46)]
    for scenes in ([*names, "--dim", "2"], names[:4]):
        store.start(f"quick: {' '.join(scenes)}", [Slot("impact", (("e", float(len(scenes))),), 2, "x", "y", 1 / 240)])
    store.close()
    result = call("list", "runs", "--out", tmp_path)
    many, few = (line for line in result.stdout.splitlines() if "quick:" in line)
    assert "quick: scene0, scene1, scene2, scene3 and 42 more --dim 2" in many and "scene4" not in many
    assert "quick: scene0 scene1 scene2 scene3 " in few and "more" not in few
    plain = json.loads(call("list", "runs", "--json", "--out", tmp_path).stdout)
    assert plain[0]["title"].split()[1:-2] == names and plain[0]["date"][:16].replace("T", " ") in many
