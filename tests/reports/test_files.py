"""Calls that name files: what cannot be written is refused before anything runs."""

import json
import os

import pytest
from click.testing import CliRunner

from reports.command import main

ONE = ["run", "impact", "--param", "v=6", "--engine", "chipmunk", "--profile", "tuned", "--dim", "2", "--jobs", "1"]


def call(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--junit", "{}/nowhere/a.xml"], "junit: there is no folder"),
        (["--junit", "{}/"], "junit: {}/ is a folder"),
        (["--markdown", "{}"], "markdown: {} is a folder"),
        (["--markdown", "{}/nowhere/"], "is a folder, not a file"),
        (["--out", "{}/a.txt"], "out: {}/a.txt is a file, not a folder"),
        (["--out", "{}/a.txt/b"], "out: "),
    ],
)
def test_unwritable_output_refused_before_the_run(tmp_path, arguments, said):
    (tmp_path / "a.txt").write_text("mine")
    filled = [text.replace("{}", str(tmp_path)) for text in arguments]
    out = [] if "--out" in filled else ["--out", tmp_path / "out"]
    result = call(*ONE, *out, *filled)
    assert result.exit_code == 2
    assert said.replace("{}", str(tmp_path)) in result.stderr and len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists() and (tmp_path / "a.txt").read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    assert call(*ONE, "--out", tmp_path / "out").exit_code == 2


def test_folder_with_a_dot_in_its_name(tmp_path):
    result = call(*ONE, "--out", tmp_path / "name.with.dot", "--json")
    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "name.with.dot").is_dir() and json.loads(result.stdout)
    assert (tmp_path / "name.with.dot" / "rows.csv").is_file()


@pytest.mark.parametrize("command", main.list_commands(None))
def test_every_command_speaks_json(command):
    options = [name for p in main.get_command(None, command).params for name in p.opts]
    # What run-cell reads and writes is JSON in any case, and so is a schema.
    assert "--json" in options or command in ("run-cell", "schema")
