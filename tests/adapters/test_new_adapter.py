"""`crosscheck new-adapter`: what it writes is a package that works, and that is short enough to be read."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from reports.command import main

ROOT = Path(__file__).parents[2]


def make(tmp_path, name):
    return CliRunner().invoke(main, ["new-adapter", name, "--into", str(tmp_path)])


def test_missing_parent_folder_created(tmp_path):
    done = CliRunner().invoke(main, ["new-adapter", "mine", "--into", str(tmp_path / "far" / "away")])
    assert done.exit_code == 0 and (tmp_path / "far/away/mine/tests/test_conformance.py").is_file()


def test_json_names_the_files_that_were_written(tmp_path):
    done = CliRunner().invoke(main, ["new-adapter", "mine", "--into", str(tmp_path), "--json"])
    told = json.loads(done.output)
    assert told["name"] == "mine" and [Path(file).is_file() for file in told["files"]] == [True] * 3


@pytest.mark.parametrize("name", ["", "My Engine", "../out", "class", "7up", "chipmunk", "nan", "json", "a" * 200])
def test_invalid_name_of_an_adapter_refused(tmp_path, name):
    done = make(tmp_path, name)
    assert done.exit_code == 2 and ("name: " if name else "NAME: is empty") in done.output
    assert not list(tmp_path.iterdir())


def test_word_of_python_as_a_name(tmp_path):
    """It said that 'class' must be made of letters."""
    assert "name: 'class' is a word, module or number of Python" in make(tmp_path, "class").output


def test_name_of_a_package_that_is_installed(tmp_path, monkeypatch):
    (tmp_path / "crosscheck_mine.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    assert "name: there is a package 'crosscheck_mine' already" in make(tmp_path, "mine").output


def test_existing_folder_of_an_adapter_unchanged(tmp_path):
    (tmp_path / "mine").mkdir()
    done = make(tmp_path, "mine")
    assert done.exit_code == 2 and "is there already" in done.output and not list((tmp_path / "mine").iterdir())


def test_written_adapter_conforms_and_is_short(tmp_path):
    """Its own test runs the kit; then the command finds the engine by the entry point of its pyproject."""
    done = make(tmp_path, "my_discs")
    folder = tmp_path / "my_discs"
    assert done.exit_code == 0 and "check-adapter my_discs" in done.output
    adapter = folder / "crosscheck_my_discs" / "__init__.py"
    assert len(adapter.read_text().splitlines()) < 100
    written = "".join(path.read_text() for path in folder.rglob("*.*"))
    assert not {word for word in ("NAME", "CLASS", "PACKAGE", "DISTRIBUTION") if word in written}
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    (entry,) = project["entry-points"]["contact_crosscheck.engines"].items()
    assert entry == ("my_discs", "crosscheck_my_discs:MyDiscs")
    # What an installer makes of pyproject.toml: metadata and entry points beside the package.
    info = folder / "crosscheck_my_discs-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: crosscheck-my-discs\nVersion: 0.1\n")
    (info / "entry_points.txt").write_text(f"[contact_crosscheck.engines]\n{entry[0]} = {entry[1]}\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(folder), str(ROOT)))}
    tests = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", "tests"]
    ran = subprocess.run(tests, cwd=folder, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0 and " passed" in ran.stdout, ran.stdout
    asked = ["run", "impact", "--engine", "my_discs", "--dim", "2", "--quick", "--jobs", "1"]
    command = [sys.executable, "-m", "reports.command", *asked]
    ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0 and "my_discs 0.1" in ran.stdout and "Every check passes" in ran.stdout, ran.stderr
