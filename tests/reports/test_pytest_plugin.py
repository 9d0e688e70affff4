"""`pytest --crosscheck` in the repository of an engine: ten lines of a toy engine, gated by contact scenes."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from adapters import registry
from validation.findings import files

TOY = Path(__file__).parents[1] / "validation" / "releases"
FAMILY = """
[[family]]
id = "slow"
profiles = ["default"]
scene = "impact"
metrics = ["rebound_speed", "rebound_ratio", "velocity_change"]
reason = "the toy moves no faster than 3 m/s"
source = "its one file"
releases = "RELEASES"
"""


@pytest.fixture
def repository(tmp_path):
    """`repository(fastest, listed, releases)` runs pytest in a new repository of the toy, and gives its output."""

    def run(fastest="float('inf')", listed=(), releases="<=1.0", options=(), status=0):
        site = tmp_path / "site"
        adapter = site / "toycheck"
        (adapter / "findings").mkdir(parents=True)
        shutil.copy(TOY / "toy_plugin.py", adapter / "__init__.py")
        engine = (TOY / "toy_physics.py").read_text().replace("VERSION", "1.0")
        (site / "toyphysics.py").write_text(engine.replace('FASTEST = float("inf")', f"FASTEST = {fastest}"))
        (adapter / "findings" / files.FAMILIES).write_text(FAMILY.replace("RELEASES", releases))
        lines = [",".join(files.COLUMNS), *(f"slow,default,2,{params},1/240,,{rest}" for params, rest in listed)]
        (adapter / "findings" / files.MEMBERS).write_text("\n".join(lines) + "\n")
        info = site / "toycheck-1.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toycheck\nVersion: 1\n")
        (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\ntoy = toycheck:ToyEngine\n")
        own = tmp_path / "repository"
        own.mkdir()
        (own / "test_own.py").write_text("def test_own():\n    assert True\n")
        command = [sys.executable, "-m", "pytest", "-p", "no:randomly", "-p", "no:cacheprovider", "-rA", *options]
        env = os.environ | {"PYTHONPATH": str(site), "COLUMNS": "200"}
        env.pop("CROSSCHECK_REQUIRE_ENGINES", None)
        done = subprocess.run(command, cwd=own, env=env, capture_output=True, text=True)
        assert done.returncode == status, done.stdout + done.stderr
        return done.stdout + done.stderr

    return run


ASK = ("--crosscheck", "toy", "--scenes", "impact")
#: What is found of a ball that comes in with 6 m/s and e = 0.8 (the defaults), if it leaves no faster than 3 m/s.
SLOW = [("", "rebound_ratio,0.5,1e-9"), ("", "rebound_speed,3,1e-9"), ("", "velocity_change,9,1e-9")]


def counts(output):
    line = output.strip().splitlines()[-1]
    return {word: int(number) for number, word in re.findall(r"(\d+) (passed|failed|xfailed|skipped|error)", line)}


def test_pytest_without_the_option_unchanged(repository):
    assert counts(repository()) == {"passed": 1}
    code = "import contact_crosscheck, sys; print([m for m in ('numpy', 'reports', 'adapters') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_sound_engine_passed_and_unsupported_checks_skipped(repository):
    output = repository(options=ASK)
    found = counts(output)
    assert found["passed"] > 20 and found["skipped"] >= 5 and "failed" not in found
    assert ("crosscheck: toy 1.0" in output and "the toy" in output) or "dimension" in output


def test_known_finding_as_xfail_and_new_one_as_failure(repository):
    output = repository("3.0", SLOW, options=(*ASK, "-k", "rebound_ratio and default"), status=1)
    assert "XFAIL" in output and "the toy moves no faster than 3 m/s" in output
    assert counts(output)["xfailed"] == 1 and counts(output)["failed"] >= 1  # the other cells are not listed
    assert "measured   " in output and "truth      " in output and "crosscheck run impact" in output


@pytest.mark.long
def test_finding_of_this_release_that_passes_as_a_failure(repository):
    output = repository(listed=SLOW, releases="<=1.0", options=ASK, status=1)
    assert counts(output)["failed"] == 3 and "passes, but on record with 0.5" in output


@pytest.mark.long
def test_finding_of_other_releases_that_passes_as_mended(repository):
    output = repository(listed=SLOW, releases="<1.0", options=ASK)
    assert "failed" not in counts(output)
    assert "crosscheck: fixed" in output and "rebound_ratio" in output.partition("crosscheck: fixed")[2]


@pytest.mark.long
def test_finding_of_other_releases_as_non_strict_xfail(repository):
    output = repository("3.0", SLOW, releases="<1.0", options=(*ASK, "-k", "rebound_ratio"), status=1)
    assert "as listed for <1.0" in output


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("options", "said"),
    [(("--crosscheck", "toi"), "did you mean 'toy'"),
     (("--crosscheck", "toy", "--scenes", "impct"), "did you mean 'impact'"),
     (("--crosscheck", "toy", "--crosscheck-profile", "fast"), "no chosen engine has a profile")],
)  # fmt: skip
def test_wrong_call_in_one_line(repository, options, said):
    output = repository(options=options, status=4)
    assert said in output and "Traceback" not in output
