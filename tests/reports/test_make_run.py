"""``make run``: what it asks for, in which order, what it says last, whose status it ends with; nothing real runs."""

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from packaging.utils import canonicalize_name

pytestmark = pytest.mark.skipif(not shutil.which("make"), reason="there is no make on this system")
ROOT = Path(__file__).resolve().parents[2]
#: Stands in for the command: says what it was called with, and ends as it is told.
STAND_IN = """#!/bin/sh
echo "called: $*" >> "$CALLED"
case "$1" in report) echo "path on stdout";; *) echo "output of $1";; esac
case "$1" in run) exit ${RUN:-0};; bench) exit ${BENCH:-0};; report) exit ${REPORT:-0};; esac
"""
#: Stands in for Python: installs nothing.
NOTHING = "#!/bin/sh\n"


def make(*words, **environment):
    """Run make here; flags of a make around it would be those of this one."""
    own = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")}
    return subprocess.run(
        ["make", "--no-print-directory", *words], cwd=ROOT, env=own | environment, capture_output=True, text=True,
        timeout=60,
    )  # fmt: skip


@pytest.fixture
def make_run(tmp_path):
    """Runs it with a stand-in, whose calls end with the statuses that are given; its end, its lines, the calls."""
    folder = tmp_path / "venv"
    (folder / "bin").mkdir(parents=True)
    for name, text in (("crosscheck", STAND_IN), ("python", NOTHING)):
        (folder / "bin" / name).write_text(text)
        (folder / "bin" / name).chmod(0o755)
    (folder / ".installed-to-run").touch()  # newer than what it is made of: nothing is installed

    def run(*words, **statuses):
        called = tmp_path / "called"
        called.unlink(missing_ok=True)
        given = {name.upper(): str(status) for name, status in statuses.items()}
        done = make("run", f"VENV={folder}", f"OUT={tmp_path / 'out'}", *words, **given, CALLED=str(called))
        calls = [line.split()[1:] for line in called.read_text().splitlines()]
        return done.returncode, done.stdout.splitlines(), calls

    return run


def test_order_of_answer_bench_and_report(make_run):
    status, lines, calls = make_run()
    assert status == 0 and [call[0] for call in calls] == ["run", "bench", "report"]
    assert all(call[-2] == "--out" and call[-1] == calls[0][-1] for call in calls)
    assert {"--quick", "--for-bench"} < set(calls[0]) and "--standard" in make_run("SUITE=standard")[2][0]
    shown = [line for line in lines if line.startswith(("output of", "path"))]
    assert shown == ["output of run", "output of bench", "path on stdout"]
    assert lines[-3:-1] == ["report:", "path on stdout"]


def test_announcement_of_an_installation(make_run, tmp_path):
    assert not any("installing" in line for line in make_run()[1])
    (tmp_path / "venv" / ".installed-to-run").unlink()
    assert re.fullmatch(r"installing \S+ into \S+: one to five minutes at first", make_run()[1][0])


def test_seconds_until_verdicts_and_until_the_end(make_run):
    _, lines, _ = make_run()
    assert re.fullmatch(r"verdicts after \d+ s; now the benchmark and the report", lines[1])
    parts = re.match(r"done after (\d+) s: verdicts (\d+) s, benchmark (\d+) s, report (\d+) s;", lines[-1])
    total, *stages = map(int, parts.groups())
    assert total == sum(stages)


def test_status_of_bad_rows_with_time_and_report_made(make_run):
    status, _, calls = make_run(run=1)
    assert status != 0 and [call[0] for call in calls] == ["run", "bench", "report"]


@pytest.mark.parametrize("broken", [2, 3, 4, 130])
def test_run_without_verdicts_neither_timed_nor_reported(make_run, broken):
    status, _, calls = make_run(run=broken)
    assert status != 0 and [call[0] for call in calls] == ["run"]


@pytest.mark.parametrize("stage", ["bench", "report"])
def test_make_run_fails_with_a_failed_stage(make_run, stage):
    status, _, calls = make_run(**{stage: 1})
    assert status != 0 and calls[-1][0] == stage


#: What `make run` installs, and what all other targets install.
USED, ALL = "chipmunk,bullet,mujoco,report,shapes", "all,dev"


@pytest.mark.parametrize(
    ("stamps", "target", "installed"),
    [
        ((), "run", [USED]),
        ((), "test", [ALL]),
        ((".installed-to-run",), "run", []),
        ((".installed-to-run",), "test", [ALL]),
        ((".installed", ".installed-to-run"), "run", []),
        ((".installed", ".installed-to-run"), "test", []),
    ],
)
def test_extras_that_a_target_installs(tmp_path, stamps, target, installed):
    for stamp in stamps:
        (tmp_path / stamp).touch()

    def asked(*words):
        done = make("-n", target, f"VENV={tmp_path}", *words)
        return re.findall(r"pip install .*-e \"\.\[(.*)\]\"", done.stdout)

    assert asked() == installed
    assert asked("-W", "pyproject.toml") == asked("-W", "constraints.txt") == [USED if target == "run" else ALL]


def test_a_full_installation_serves_a_run_as_well(tmp_path):
    """As in CI, which sets up once: pip is a stand-in that does nothing."""
    (tmp_path / "bin").mkdir()
    python = tmp_path / "bin" / "python"
    python.write_text(NOTHING)
    python.chmod(0o755)
    assert make("setup", f"VENV={tmp_path}").returncode == 0
    for target in ("run", "setup", "lint", "extras"):
        assert f"[{USED}]" not in (done := make("-n", target, f"VENV={tmp_path}")).stdout
        assert f"[{ALL}]" not in done.stdout and done.returncode == 0


def test_extras_of_make_run_within_all():
    """So that a full installation serves a run as well."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    (whole,) = extras["all"]
    assert set(USED.split(",")) < set(re.fullmatch(r"contact-crosscheck\[(.*)\]", whole)[1].split(","))


def test_spelling_of_extras_that_pip_compares_by_letter():
    """As pip 23 does, which Python 3.11 brings: metadata have hyphens."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert [name for name in extras if name != canonicalize_name(name)] == []
    asked = re.findall(r"\.\[(.*?)\]", make("-n", "ports", "extras").stdout)
    assert len(asked) >= 2 and {name for names in asked for name in names.split(",")} <= set(extras)
