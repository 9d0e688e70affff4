"""The steps of the Action, run by its own script in a toy engine's repository with pip that knows local wheels only."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SCRIPT = ROOT / "reports" / "action" / "steps.sh"


def test_inputs_of_the_action_s_script():
    text = (ROOT / "action.yml").read_text()
    assert 'bash "$GITHUB_ACTION_PATH/reports/action/steps.sh"' in text
    given = set(re.findall(r"^        ([A-Z_]+): \$\{\{ inputs\.[a-z-]+ \}\}$", text, re.MULTILINE))
    read = set(re.findall(r"\$\{?([A-Z_]+)", SCRIPT.read_text()))
    assert given == read - {name for name in read if name.startswith("GITHUB_")}
    declared = set(re.findall(r"^  ([a-z-]+):$", text.partition("outputs:")[0].partition("inputs:")[2], re.MULTILINE))
    assert {name.lower().replace("_", "-") for name in given} == declared


@pytest.fixture
def job(toy, tmp_path):
    """`job(fastest, **environment)` runs the steps in a repository whose build of the engine has that top speed."""
    if shutil.which("bash") is None:
        pytest.skip("there is no bash")

    def run(fastest, status, **given):
        build = tmp_path / "build"
        build.mkdir()
        source = (
            (ROOT / "tests" / "validation" / "releases" / "toy_physics.py").read_text().replace("VERSION", "1.3.dev")
        )
        (build / "toyphysics.py").write_text(source.replace('float("inf")', fastest))
        home = tmp_path / "repository"
        home.mkdir()
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        python = f"{toy}{os.pathsep}{build}"
        own = {"ENGINE": "toy", "SCENES": "impact", "BASE": "1.0.0", "PATH": path, "PYTHONPATH": python, **given}
        own |= {"GITHUB_STEP_SUMMARY": str(home / "step.md"), "GITHUB_OUTPUT": str(home / "output")}
        own |= {"GITHUB_ACTION_PATH": str(ROOT)}
        done = subprocess.run(["bash", str(SCRIPT)], cwd=home, env=os.environ | own, capture_output=True, text=True)
        assert done.returncode == status, done.stdout + done.stderr
        return home

    return run


@pytest.mark.long
def test_outputs_of_a_sound_build(job):
    home = job('float("inf")', 0)
    out = home / "crosscheck-out"
    for name in ("junit.xml", "summary.md", "comment.md", "base.json", "results.sqlite", "report.html"):
        assert (out / name).stat().st_size > 0, name
    assert "toy 1.0.0 -> 1.3.dev" in (out / "comment.md").read_text()
    assert "in both: none changed" in (home / "step.md").read_text()
    assert (home / "output").read_text() == "comment=crosscheck-out/comment.md\n"


@pytest.mark.long
def test_comment_on_a_build_that_lost_a_verdict(job):
    home = job("3.0", 1)
    comment = (home / "crosscheck-out" / "comment.md").read_text()
    assert "newly failing" in comment and "`rebound_ratio`" in comment and "worse" in comment


@pytest.mark.long
def test_never_fails_for_no_change(job):
    """The toy has no findings, so what fails is new to nobody: only the comparison would fail the job."""
    home = job("3.0", 0, FAIL_ON="never")
    assert "newly failing" in (home / "crosscheck-out" / "comment.md").read_text()


@pytest.mark.long
def test_action_without_a_base(job):
    home = job("3.0", 0, BASE="")
    assert not (home / "crosscheck-out" / "base.json").exists()
    assert (home / "crosscheck-out" / "comment.md").read_text() == ""


@pytest.mark.long
def test_comparison_without_an_answer_from_the_base(job):
    """1.1.0 cannot be imported: its library is missing."""
    home = job('float("inf")', 4, BASE="1.1.0")
    assert "libtoy.so.1" in (home / "crosscheck-out" / "base.json").read_text()


def test_missing_engine_stops_the_job(job):
    job("3.0", 2, ENGINE="another")
