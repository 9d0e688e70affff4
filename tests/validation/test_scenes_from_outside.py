"""A scene of another package: the file and one entry point of CONTRIBUTING's recipe, and nothing else."""

import re
import shlex
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from adapters.scene import SceneError
from reports.command import main
from reports.listing import doctor
from validation import catalogue, identity
from validation.catalogue import CATALOGUE, matching
from validation.posed import resolve

ROOT = Path(__file__).parents[2]


def recipe():
    """Python file, entry point and commands of the recipe."""
    text = (ROOT / "CONTRIBUTING.md").read_text().partition("## Add a scene\n")[2].partition("\n## ")[0]
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    entry = re.search(r'\[project\.entry-points\."([\w.]+)"\]\n\s+(\w+) = "([\w.]+):(\w+)"', text)
    return code, entry, re.findall(r"^       (crosscheck .*)$", text, re.MULTILINE)


def install(folder, group, entries, **files):
    info = folder / "mypackage-1.dist-info"
    (folder / "mypackage").mkdir()
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mypackage\nVersion: 1\n")
    (info / "entry_points.txt").write_text(f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in entries.items()))
    for name, code in {"__init__": "", **files}.items():
        (folder / "mypackage" / f"{name}.py").write_text(code)


def forget():
    catalogue.forget()
    resolve.cache_clear()
    identity.scene_code.cache_clear()
    for name in [name for name in sys.modules if name.partition(".")[0] == "mypackage"]:
        del sys.modules[name]


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder of installed packages."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    forget()
    yield folder
    forget()


@pytest.fixture
def drop(site):
    """The recipe's package, installed."""
    code, entry, _ = recipe()
    install(site, entry[1], {entry[2]: f"{entry[3]}:{entry[4]}"}, **{entry[3].rpartition(".")[2]: code})
    forget()


def test_recipe_scene_through_all_commands(drop, tmp_path):
    pytest.importorskip("pymunk")
    pytest.importorskip("altair")
    out, commands = str(tmp_path / "out"), recipe()[2]
    assert [command.split()[1] for command in commands] == ["describe", "run", "bench", "report"]
    few = ["--engine", "chipmunk", "--profile", "tuned", "--dim", "2", "--jobs", "1"]
    for command in commands:
        _, verb, *rest = shlex.split(command)
        options = {"describe": [], "report": ["--out", out]}.get(verb, [*few, "--out", out])
        done = CliRunner().invoke(main, [verb, *rest, *options])
        assert done.exit_code == 0, (verb, done.output)
        if verb == "describe":
            assert "where it lands" in done.output and "rest_height" in done.output
    rows = (tmp_path / "out" / "rows.csv").read_text()
    assert "drop/rest_height" in rows and "pass" in rows
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Ball that stays where it lands" in page and "height error" in page
    assert (tmp_path / "out" / "bench" / "work_points.csv").read_text().count("drop,") >= 3


def test_a_fault_fails_the_recipe_s_check(drop):
    from adapters import registry
    from adapters.conformance.planted_faults import Planted
    from validation.questions.detection import _watchers

    pytest.importorskip("pymunk")
    engine = registry.load("chipmunk")
    assert _watchers(engine, "tuned", "drop", {}, 2, 1 / 240)["rest_height"].holds
    assert not _watchers(Planted(engine, "extent", 0.1), "tuned", "drop", {}, 2, 1 / 240)["rest_height"].holds


def test_own_code_alone_in_the_identity_of_a_scene(drop, site):
    assert list(CATALOGUE)[-1] == "drop"
    before = {name: identity.scene_code(name) for name in CATALOGUE}
    with (site / "mypackage" / "drop.py").open("a") as file:
        file.write("# another line\n")
    forget()
    after = {name: identity.scene_code(name) for name in CATALOGUE}
    assert {name for name in before if before[name] != after[name]} == {"drop"}


def test_code_in_the_identity_of_a_cell(monkeypatch):
    """Else a cell that was stored stands for one that other code would run or measure."""
    hashed = set()
    monkeypatch.setattr(identity, "_hash_files", lambda paths: hashed.update(map(str, paths)) or "0" * 16)
    for cached in (identity.scene_code, identity.adapter_hash):
        cached.__wrapped__({identity.scene_code: "stack", identity.adapter_hash: "chipmunk"}[cached])
    ends = ("validation/running/execution.py", "validation/running/certification.py", "validation/scenes/stack.py",
            "validation/metrics.py", "validation/geometry.py", "validation/truths/columns.py", "adapters/stepping.py",
            "adapters/receipts/__init__.py", "adapters/receipts/probes.py",
            "adapters/chipmunk/simulation.py")  # fmt: skip
    assert [end for end in ends if not any(path.endswith(end) for path in hashed)] == []


@pytest.mark.parametrize(
    ("name", "code", "said"),
    [
        ("bad", "raise RuntimeError('this module is broken')", "cannot be loaded: RuntimeError: this module is broken"),
        ("bad", "raise SystemExit(3)", "cannot be loaded: SystemExit: 3"),
        ("bad", "SCENE = 7", "is not a CanonicalScene of that name"),
        ("Bad-Name", "SCENE = 7", "is not a name of small letters"),
    ],
)
def test_doctor_with_a_broken_scene(site, name, code, said):
    install(site, catalogue.GROUP, {name: "mypackage.bad:SCENE"}, bad=code)
    forget()
    assert name not in CATALOGUE and list(CATALOGUE) == list(catalogue.OURS)
    assert any(said in line for line in doctor()["problems"])
    with pytest.raises(SceneError, match=re.escape(said)):
        matching(name)


def test_names_of_our_scenes_protected(site):
    ours = CATALOGUE["impact"]
    install(site, catalogue.GROUP, {"impact": "mypackage.bad:SCENE"}, bad="SCENE = 7")
    forget()
    assert CATALOGUE["impact"] is ours
