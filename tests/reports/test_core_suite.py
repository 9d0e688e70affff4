"""The core suite of an adapter in a test file, called in an empty folder as someone new would."""

import subprocess
import sys

import pytest
from click.testing import CliRunner

from reports.command import main

FILE = "test_contacts.py"


@pytest.fixture
def called(tmp_path):
    """`called(old, new, options, status)`: output of pytest on the adapter that is written for one, changed."""

    def call(*options, old="", new="", named=f"{FILE}:Mine", status=0):
        done = CliRunner().invoke(main, ["new-adapter", "mine", "--into", str(tmp_path / "written")])
        text = (tmp_path / "written" / "mine" / "crosscheck_mine" / "__init__.py").read_text()
        assert done.exit_code == 0 and old in text
        (tmp_path / FILE).write_text(text.replace(old, new) + "\n\ndef test_own():\n    pass\n")
        command = [sys.executable, "-m", "pytest", "--crosscheck", named, "--scenes", "core", "-p", "no:cacheprovider"]
        command += ["-p", "no:randomly", "-rs", *options, FILE]
        ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == status, ran.stdout + ran.stderr
        return ran.stdout + ran.stderr

    return call


def test_core_suite_of_an_adapter_in_a_test_file(called):
    said = called("-k", "impact or incline or own")
    assert "3 passed, 1 skipped" in said and "crosscheck: mine 0.1, " in said
    table = said.partition("crosscheck: error over step [s]")[2].splitlines()[1:]
    assert table[0].split() == ["plain", "1/60", "1/120", "1/240", "1/480", "order", "expected"]
    assert table[1].startswith("impact  ") and table[1].endswith("round-off ok   round-off")
    assert "incline       not run: box.shape: discs and half-spaces only" in table
    assert all(len(line) <= 80 for line in table[:4])


@pytest.mark.long
def test_order_of_the_core_suite(called):
    said = called("-k", "bounce or slide_to_roll or roll_incline")
    assert "3 passed" in said and " ok   at least 1" in said and " ok   at least 2" in said


def test_fault_in_the_core_suite(called):
    said = called("-k", "impact", old="bounce = pair.restitution *", new="bounce = 0.99 * pair.restitution *", status=1)
    assert "rebound_ratio: 0.792, truth 0.8 +- 1e-12 at dt = 1/" in said and " and 63 more" in said
    assert "order: levels off at an error of 0.008; round-off is expected at every step" in said
    assert " 8.0e-03 " in said and "FAIL round-off" in said and "Traceback" not in said


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("named", "said"),
    [("absent.py:Mine", "engine: absent.py cannot be loaded: FileNotFoundError"),
     (f"{FILE}:Absent", f"engine: {FILE} has no class 'Absent'"),
     (f"{FILE}:World", "engine: cannot be made: TypeError"),
     ("mine", "engine: there is no engine called 'mine'")],
)  # fmt: skip
def test_wrong_name_of_an_adapter_in_one_line(called, named, said):
    output = called(named=named, status=4)
    assert said in output and "Traceback" not in output
