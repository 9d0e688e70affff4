"""Commands on a store with damaged rows: one line each for what is left out, and the rest is shown."""

import shutil
import sqlite3

import pytest
from click.testing import CliRunner

from adapters.plain import is_visible
from reports.command import main
from validation.records.store import FILE

#: A row of each kind, as after a disk's fault or somebody's edit.
DAMAGE = (
    "UPDATE recordings SET body = substr(body, 1, 200) WHERE rowid = (SELECT min(rowid) FROM recordings)",
    "UPDATE observations SET body = x'00ff' WHERE rowid = (SELECT min(rowid) FROM observations)",
    "UPDATE timings SET body = 'null' WHERE rowid = (SELECT min(rowid) FROM timings)",
    "INSERT INTO runs SELECT '../../x', date, commit_hash, '[1', title, '{', '', 1 FROM runs LIMIT 1",
)


@pytest.fixture
def damaged(page_folder, tmp_path):
    folder = tmp_path / "damaged"
    shutil.copytree(page_folder, folder)
    with sqlite3.connect(folder / FILE) as database:
        for statement in DAMAGE:
            database.execute(statement)
    database.close()
    return folder


@pytest.mark.parametrize(
    "command", ["show", "findings", "list runs", "report", "bundle", "dashboard", "prune --keep 9"]
)
def test_a_command_on_a_damaged_store(damaged, command):
    done = CliRunner().invoke(main, [*command.split(), "--out", str(damaged)])
    assert done.exit_code in (0, 1), done.stderr
    assert done.exception is None or isinstance(done.exception, SystemExit)
    said = [line for line in done.stderr.splitlines() if " damaged" in line]
    assert said and all(is_visible(line) and line.startswith("crosscheck: out: ") for line in said)
    assert len(set(said)) == len(said) and done.stdout


def test_damaged_run_deleted(damaged):
    done = CliRunner().invoke(main, ["prune", "--unfinished", "--out", str(damaged)])
    assert done.exit_code == 0 and "'../../x' is damaged" in done.stdout, done.output
    listed = CliRunner().invoke(main, ["list", "runs", "--out", str(damaged)])
    assert listed.exit_code == 0 and "x" not in listed.stderr
