"""The core suite of an adapter in a test file, by the commands of the how-to, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

HOW_TO = Path(__file__).parents[2] / "docs" / "howto" / "ci.md"
FILE = "test_contacts.py"


@pytest.fixture
def called(tmp_path):
    """`called(words, old, new, status)`: what the how-to's commands print, with another text in the adapter."""

    def call(words, old="World", new="World", named=f"{FILE}:Myengine", status=0):
        *made, asked = re.findall(r"^(?:crosscheck|mv|rm|pytest) .*$", HOW_TO.read_text(), re.MULTILINE)[:4]
        assert asked == f"pytest --crosscheck {FILE}:Myengine --scenes core"
        environment = os.environ | {"PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))}
        subprocess.run("\n".join(made), cwd=tmp_path, env=environment, shell=True, check=True)
        assert [path.name for path in tmp_path.iterdir()] == [FILE]
        text = (tmp_path / FILE).read_text()
        assert old in text
        (tmp_path / FILE).write_text(text.replace(old, new) + "\n\ndef test_own():\n    pass\n")
        command = [*asked.replace(f"{FILE}:Myengine", named).split(), "-p", "no:cacheprovider", "-p", "no:randomly"]
        ran = subprocess.run([*command, "-k", words], cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert ran.returncode == status, ran.stdout + ran.stderr
        return ran.stdout + ran.stderr

    return call


def test_core_suite_of_an_adapter_in_a_test_file(called):
    said = called("impact or incline or own")
    assert "3 passed, 1 skipped" in said and "crosscheck: myengine 0.1, " in said
    table = said.partition("crosscheck: error over step [s]")[2].splitlines()[1:]
    assert table[0] in HOW_TO.read_text() and table[1] in HOW_TO.read_text()
    assert table[1].startswith("impact  ") and table[1].endswith("round-off ok   round-off")
    assert "incline       not run: box.shape: discs and half-spaces only" in table
    assert all(len(line) <= 80 for line in table[:4])


@pytest.mark.long
def test_order_of_the_core_suite(called):
    said = called("bounce or slide_to_roll or roll_incline")
    assert "3 passed" in said and " ok   at least 1" in said and " ok   at least 2" in said


def test_fault_in_the_core_suite(called):
    said = called("impact", "bounce = pair.restitution *", "bounce = 0.99 * pair.restitution *", status=1)
    assert "rebound_ratio: 0.792, truth 0.8 +- 1e-12 at dt = 1/" in said and " and 63 more" in said
    assert "order: levels off at an error of 0.008; round-off is expected at every step" in said
    assert " 8.0e-03 " in said and "FAIL round-off" in said and "Traceback" not in said


def test_adapter_that_refuses_every_scene(called):
    """Twelve skipped tests were a success."""
    said = called("impact", "not isinstance(body.shape, Disc | HalfSpace)", "body.shape", status=5)
    assert "1 skipped" in said and "nothing was judged, the engine runs none of it" in said


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("named", "said"),
    [("absent.py:Mine", "engine: absent.py cannot be loaded: FileNotFoundError"),
     (f"{FILE}:Absent", f"engine: {FILE} has no class 'Absent'"),
     (FILE, f"engine: {FILE}: name its class as well, {FILE}:CLASS"),
     (f"{FILE}:World", "engine: cannot be made: TypeError"),
     (f"{FILE}:Myengine --crosscheck-profile absent", "profile: no chosen engine has a profile 'absent'; known: plain"),
     ("mine", "engine: there is no engine called 'mine'")],
)  # fmt: skip
def test_wrong_name_of_an_adapter_in_one_line(called, named, said):
    output = called("own", named=named, status=4)
    assert said in output and "Traceback" not in output
