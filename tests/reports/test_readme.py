"""Every command that README and documentation name exists with its options; the Python snippet runs."""

import json
import re
import shlex
import shutil
import webbrowser
from dataclasses import replace
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner

from reports.command import benching, main, tuning
from validation.bench.lane import QUICK
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.records.store import Store
from validation.running.execution import execute

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
#: Pages that are written by hand; the others are made by ``docs/pages.py``.
DOCS = [ROOT / "docs" / name for name in ("index.md", "start.md", "method.md")]
DOCS += [path for folder in ("howto", "reference") for path in sorted((ROOT / "docs" / folder).glob("*.md"))]
TEXT = "\n".join([README, *(path.read_text(encoding="utf-8") for path in DOCS)])
COMMANDS = sorted({line.strip() for line in re.findall(r"^ *(?:\.venv/bin/)?(crosscheck [^#\n]+)", TEXT, re.M)}
                  - {"crosscheck --help"})  # fmt: skip


@pytest.mark.parametrize("line", COMMANDS)
def test_a_command_of_the_readme_exists_with_its_options(line):
    _, name, *words = shlex.split(line.replace("[", " ").replace("]", " ").replace("|", " "))
    command = main.get_command(None, name)
    known = {option for parameter in command.params for option in [*parameter.opts, *parameter.secondary_opts]}
    assert [word for word in words if word.startswith("--") and word not in known] == []
    assert CliRunner().invoke(main, [name, "--help"]).exit_code == 0


def test_length_and_scene_count_of_the_readme():
    assert len(README.split()) <= 600
    assert set(map(int, re.findall(r"(\d+) scenes", README))) == {len(CATALOGUE)}


def test_answer_in_the_readme_equal_to_a_run(tmp_path):
    """How wrong MuJoCo's rebound is and what cures it, in the words of the terminal."""
    pytest.importorskip("mujoco")
    shown = re.search(r"^    mujoco/default bounce: .*?(?=\n\n)", README, re.M | re.S)[0]
    result = CliRunner(env={"COLUMNS": "80"}).invoke(
        main, ["run", "bounce", "--engine", "mujoco", "--jobs", "1", "--out", str(tmp_path)]
    )
    assert result.exit_code == 0, result.stderr
    flat = " ".join(result.stdout.split())
    assert " ".join(shown.split()) in flat
    for line in re.findall(r"^      ((?:default|tuned) .*)$", README, re.M):
        assert " ".join(line.split()) in flat


def test_commands_of_the_readme_and_their_help():
    assert len(COMMANDS) >= 12
    assert all(main.get_command(None, name).help for name in main.list_commands(None))


#: The suite of an engine, on one scene.
STANDARD = "run impact --standard --engine chipmunk --profile tuned --out elsewhere"
#: Command of the README -> the calls that stand for it, placeholders filled in. They run one after the other, on one
#: folder of results.
RUN = {
    "crosscheck run bounce --engine mujoco": [
        "run bounce --param e=.8 --param height=1.03 --engine bullet --profile tuned --dt 1/240",
        "run bounce --param e=.8 --engine mujoco --profile default --dim 2",
    ],
    "crosscheck run my-scene.toml": ["run my-scene.toml --engine chipmunk --profile tuned --out elsewhere"],
    "crosscheck ask grip slips": ["ask grip slips mujoco"],
    "crosscheck show": ["show"],
    "crosscheck findings --engine mujoco": [
        "findings --engine mujoco", "findings --scene bounce --profile default", "findings --profile shipped",
        "findings --new", "findings --all",
    ],
    "crosscheck explain mujoco/default/bounce": ["explain mujoco/default/bounce", "explain 'mujoco/as shipped/bounce'"],
    "crosscheck compare A B": ["compare latest crosscheck-out", "compare crosscheck-out/rows.jsonl latest"],
    "crosscheck merge laptop-out": ["merge crosscheck-out --out both"],
    "crosscheck list scenes|suites|engines|checks|runs": [
        f"list {what}" for what in ("scenes", "suites", "engines", "checks", "runs")
    ],
    "crosscheck check-adapter myengine": ["check-adapter chipmunk"],
    "crosscheck run --standard --engine myengine": [STANDARD],
    "crosscheck tune myengine": ["tune chipmunk"],
    "crosscheck tune myengine --decisive": ["tune chipmunk --decisive"],
    "crosscheck describe bounce": ["describe bounce", "describe bullet"],
    # As they stand.
    **{f"crosscheck {call}": [call] for call in (
        "bench bounce --engine chipmunk --dim 2", "bench my-scene.toml --engine chipmunk", "bundle",
        "compile",
        "cure mujoco pinch --dim 3", "cure mujoco stack --param mu=10 --param n=2", "dashboard", "doctor",
        "export bounce --engine bullet --to python -o bug.py", "export --parquet tables", "field",
        "findings --prove stack-sweeps", "frontier thin_wall", "new-adapter myengine", "nulls impact",
        "prune --keep 50 --dry-run", "releases --environments", "report --open", "residuals pinch",
        "run bounce --engine chipmunk --invariance", "run model.xml", "run --standard --engine chipmunk",
        "run pinch --engine mujoco --set cone=elliptic --set impratio=10",
        "sweep bounce --grid e=0:1:5 --sobol height=.1:10:log --samples 8 --engine bullet",
    )},
}  # fmt: skip
#: What each of them must say of that folder.
SAID = {
    "run my-scene.toml --engine chipmunk --profile tuned --out elsewhere": "box.mass: 2 kg, its density times its area",
    "ask grip slips mujoco": 'cone="elliptic"',
    STANDARD: "Every check passes",
    "show": "default 2-D (as shipped)",
    "findings --engine mujoco": "mujoco/default bounce",
    "findings --scene bounce --profile default": "mujoco/default bounce",
    "findings --profile shipped": "mujoco/default bounce",
    "findings --new": "no unexpected result",
    "findings --all": "mujoco/default bounce",
    "explain mujoco/default/bounce": "crosscheck run bounce --param",
    "explain 'mujoco/as shipped/bounce'": "crosscheck run bounce --param",
    "compare latest crosscheck-out": "in both: none changed",
    "compare crosscheck-out/rows.jsonl latest": "in both: none changed",
    "releases --environments": "environments in",
    "dashboard": "dashboard.html",
    "export --parquet tables": "rows.parquet",
    "merge crosscheck-out --out both": "2 new runs",
    "prune --keep 50 --dry-run": "0 runs would be deleted",
    "list scenes": "incline",
    "list suites": "cases of quick",
    "list engines": "chipmunk",
    "list checks": "apex_growth",
    "list runs": "quick: bounce",
    "describe bounce": "coefficient of restitution",
    "describe bullet": "contactBreakingThreshold",
    "doctor": "no problem found",
    "nulls impact": "perfectly",
    "check-adapter chipmunk": "receipt turn: as declared",
    "export bounce --engine bullet --to python -o bug.py": "bug.py",
    "new-adapter myengine": "pip install -e myengine",
}
#: The same of calls that take seconds of CPU or more, in a folder of results of their own: `make test-all` runs them.
SLOW = {
    "bench bounce --engine chipmunk --dim 2": "chipmunk/tuned",
    "bench my-scene.toml --engine chipmunk": "my-scene.toml@",
    "bundle": ".zip",
    "compile": "",  # where all are compiled it says nothing
    "cure mujoco pinch --dim 3": "<default>",
    "cure mujoco stack --param mu=10 --param n=2": "<default>",
    "field": "mujoco#239",
    "findings --prove stack-sweeps": "PROVEN",
    "frontier thin_wall": "bullet/default",
    "report --open": "report.html",
    "residuals pinch": "mujoco/tuned",
    "run bounce --engine chipmunk --invariance": "mirrored",
    "run model.xml": "How far from our own solution",
    "run --standard --engine chipmunk": "Best engine per group",
    "run pinch --engine mujoco --set cone=elliptic --set impratio=10": "default+cone=elliptic",
    "sweep bounce --grid e=0:1:5 --sobol height=.1:10:log --samples 8 --engine bullet": "bullet/tuned",
    "tune chipmunk": "as shipped",
    "tune chipmunk --decisive": "chipmunk/default stack: fixed by",
}
#: Command of the README -> why no test runs it: it needs a network, or more than ten minutes.
NOT_RUN = {
    "crosscheck releases mujoco 3.2.7,3.12.0 stack": "network: it installs releases",
    "crosscheck bisect mujoco 3.4.0..3.12.0 stack --check drift": "network: it installs releases",
    "crosscheck accept --engine myengine": "writes into an engine's folder; test_accept_command.py runs it",
    "crosscheck bench --targets": "ten minutes of timing; tests/reports/test_targets_command.py runs it on one scene",
    "crosscheck run --full": "half an hour on two cores",
    "crosscheck run --full --cluster tcp://HOST:PORT": "network, and half an hour on two cores",
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A folder with the documentation's scene file, from which the commands are run in the order of the README."""
    for package in ("pymunk", "pybullet", "mujoco"):
        pytest.importorskip(package)
    folder = tmp_path_factory.mktemp("readme")
    own = (ROOT / "docs/howto/own-scene.md").read_text(encoding="utf-8")
    scene = next(block for block in re.findall(r"```toml\n(.*?)```", own, re.S) if "[[bodies]]" in block)
    (folder / "my-scene.toml").write_text(scene, encoding="utf-8")
    shutil.copy(ROOT / "tests" / "models" / "ball_on_floor.xml", folder / "model.xml")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for line in RUN[next(iter(RUN))]:
            result = CliRunner().invoke(main, shlex.split(line))
            assert result.exit_code == 0, result.output
    return folder


def test_commands_of_the_readme_that_run():
    assert set(COMMANDS) == set(RUN) | set(NOT_RUN)
    assert not set(RUN) & set(NOT_RUN) and len(NOT_RUN) <= 8
    assert {*SAID, *SLOW} == {line for calls in list(RUN.values())[1:] for line in calls}


@pytest.mark.few(4)
@pytest.mark.parametrize("line", SAID)
def test_a_command_of_the_readme_runs(results, monkeypatch, line):
    monkeypatch.chdir(results)
    result = CliRunner().invoke(main, shlex.split(line))
    assert result.exit_code == 0, result.output
    assert SAID[line] in result.output and "Traceback" not in result.output


@pytest.mark.long
@pytest.mark.parametrize("line", SLOW)
def test_a_command_of_the_readme_that_takes_seconds_runs(results, tmp_path, monkeypatch, line):
    shutil.copytree(results, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url) or True)
    monkeypatch.setattr(tuning, "write", lambda *_: None)  # an engine's folder stays as it is
    monkeypatch.setattr(benching, "QUICK", replace(QUICK, fewest=3, most=3, unit_seconds=0.05))  # three rounds are some
    result = CliRunner().invoke(main, shlex.split(line))
    assert result.exit_code == 0, result.output
    assert SLOW[line] in result.output and "Traceback" not in result.output
    assert bool(opened) == ("--open" in line)


@pytest.mark.parametrize("line", ["show", "findings --all", "explain mujoco/default/bounce", "compare latest latest",
                                  "list runs", "describe bounce", "doctor", "list suites", "nulls impact",
                                  "merge crosscheck-out --out again", "prune --keep 50 --dry-run", "dashboard",
                                  "export --parquet again"])  # fmt: skip
def test_json_output_parsed(results, monkeypatch, line):
    monkeypatch.chdir(results)
    result = CliRunner().invoke(main, [*shlex.split(line), "--json"])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)


def test_json_works_on_all_commands_as_the_documentation_says():
    assert "Most commands take `--json`" in TEXT
    named = {shlex.split(line)[1] for line in COMMANDS}
    without = {name for name in named if not any("--json" in p.opts for p in main.get_command(None, name).params)}
    assert without == set()


SNIPPETS = re.findall(r"```python\n(.*?)```", TEXT, re.S)


@pytest.mark.parametrize(
    "snippet", [pytest.param(each, marks=pytest.mark.long) if "bench" in each else each for each in SNIPPETS]
)
def test_a_python_snippet_runs(tmp_path, monkeypatch, capsys, snippet):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    slot = Slot("impact", (("e", 0.5),), 2, "chipmunk", "tuned", 1 / 240)
    store = Store(tmp_path / "crosscheck-out")
    run, _ = store.start("quick", [slot])
    store.add(run, execute(slot))
    store.finish(run)
    store.close()
    exec(snippet, {})
    assert "tolerance" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "incomplete", "offered"),
    [
        (["run"], "bou", "bounce"),
        (["run", "bounce", "--engine"], "chip", "chipmunk"),
        (["findings", "--scene"], "st", "stack"),
        (["describe"], "muj", "mujoco"),
    ],
)
def test_shell_completion_of_scenes_and_engines(words, incomplete, offered):
    completion = ShellComplete(main, {}, "crosscheck", "_CROSSCHECK_COMPLETE")
    assert offered in [item.value for item in completion.get_completions(words, incomplete)]


@pytest.mark.parametrize("words", [["run"], ["describe"]])
def test_shell_completion_with_the_title_of_a_scene(words):
    completion = ShellComplete(main, {}, "crosscheck", "_CROSSCHECK_COMPLETE")
    offered = {item.value: item.help for item in completion.get_completions(words, "bou")}
    assert offered["bounce"] == CATALOGUE["bounce"].title
