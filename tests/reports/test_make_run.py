"""``make run``: what it asks for, in which order, what it says last, whose status it ends with; nothing real runs."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not shutil.which("make"), reason="there is no make on this system")
ROOT = Path(__file__).resolve().parents[2]
#: Stands in for the command: says what it was called with, and ends as it is told.
STAND_IN = """#!/bin/sh
echo "called: $*" >> "$CALLED"
case "$1" in report) echo "path on stdout";; *) echo "output of $1";; esac
case "$1" in run) exit ${RUN:-0};; bench) exit ${BENCH:-0};; report) exit ${REPORT:-0};; esac
"""


@pytest.fixture
def make_run(tmp_path):
    """Runs it with a stand-in, whose calls end with the statuses that are given; its end, its lines, the calls."""
    folder = tmp_path / "venv"
    (folder / "bin").mkdir(parents=True)
    command = folder / "bin" / "crosscheck"
    command.write_text(STAND_IN)
    command.chmod(0o755)
    (folder / ".installed").touch()  # newer than what it is made of: nothing is installed

    def run(*words, **statuses):
        called = tmp_path / "called"
        called.unlink(missing_ok=True)
        given = {name.upper(): str(status) for name, status in statuses.items()}
        # Flags of a make around it would be those of this one.
        environment = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")}
        done = subprocess.run(
            ["make", "--no-print-directory", "run", f"VENV={folder}", f"OUT={tmp_path / 'out'}", *words],
            cwd=ROOT, env=environment | given | {"CALLED": str(called)}, capture_output=True, text=True, timeout=60,
        )  # fmt: skip
        calls = [line.split()[1:] for line in called.read_text().splitlines()]
        return done.returncode, done.stdout.splitlines(), calls

    return run


def test_the_answer_is_printed_once_then_come_bench_and_report_with_its_path(make_run):
    status, lines, calls = make_run()
    assert status == 0 and [call[0] for call in calls] == ["run", "bench", "report"]
    assert all(call[-2] == "--out" and call[-1] == calls[0][-1] for call in calls)
    assert "--quick" in calls[0] and "--standard" in make_run("SUITE=standard")[2][0]
    shown = [line for line in lines if line.startswith(("output of", "path"))]
    assert shown == ["output of run", "output of bench", "path on stdout"]
    assert lines[-3:-1] == ["report:", "path on stdout"]


def test_it_says_after_how_many_seconds_the_verdicts_stood_and_all_was_done(make_run):
    _, lines, _ = make_run()
    assert re.fullmatch(r"verdicts after \d+ s; now the benchmark and the report", lines[1])
    assert re.fullmatch(r"done after \d+ s", lines[-1])


def test_bad_rows_decide_the_status_and_leave_time_and_report_to_be_made(make_run):
    status, _, calls = make_run(run=1)
    assert status != 0 and [call[0] for call in calls] == ["run", "bench", "report"]


@pytest.mark.parametrize("broken", [2, 3, 4, 130])
def test_a_run_that_is_no_verdict_has_nothing_to_be_timed_or_reported(make_run, broken):
    status, _, calls = make_run(run=broken)
    assert status != 0 and [call[0] for call in calls] == ["run"]


@pytest.mark.parametrize("stage", ["bench", "report"])
def test_a_stage_that_fails_fails_it(make_run, stage):
    status, _, calls = make_run(**{stage: 1})
    assert status != 0 and calls[-1][0] == stage
