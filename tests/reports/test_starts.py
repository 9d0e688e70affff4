"""Commands start at once: none imports what it does not need, and what takes long is done once a process."""

import json
import os
import subprocess
import sys

import pytest

from adapters import registry
from validation.scenes import OURS

#: Libraries that take a tenth of a second or more to import, and the engines with their packages.
LARGE = {"pandas", "pyarrow", "scipy", "numba", "altair", "distributed", "matplotlib", "jinja2"}
ENGINES = {
    "pymunk",
    "pybullet",
    "mujoco",
    "Box2D",
    "pyb2d3",
    "rapier3d",
    "robox3d",
    "dartpy",
    "pydrake",
    "sapien",
    "motrixsim",
    "newton",
    "warp",
}
#: Runs commands one after the other in one process; after each it writes which modules there are.
CALLS = """
import contextlib, io, json, sys
from contact_crosscheck import main

for words in json.loads(sys.argv[1]):
    sys.argv = ["crosscheck", *words]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        main()
    print(json.dumps([*sys.modules]))
"""


def imported(*calls):
    """Modules that there are after each of these commands."""
    command = [sys.executable, "-c", CALLS, json.dumps([call.split() for call in calls])]
    free = {name: value for name, value in os.environ.items() if name != registry.REQUIRED}  # these are loaded first
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=free)
    return dict(zip(calls, (set(json.loads(line)) for line in done.stdout.splitlines()), strict=True))


def test_help_and_unknown_command_without_imports():
    for found in imported("--help", "rnu", "--version").values():
        assert {name for name in found if name.startswith("reports.command.")} == {
            f"reports.command.{name}" for name in ("group", "files", "statuses")
        }
        assert not found & {"numpy", "adapters", "validation", "rich"}


def test_commands_without_runs_import_no_engine():
    calls = ["describe bounce", "describe bonce", "list scenes", "run --no-such-option", "list engines", "list suites",
             "ask my ball does not bounce", "ask mujoco grip slips", "describe bullet",
             "run bonce --engine mujoco",
             "show --no-such-option", "bench --no-such-option", "report --no-such-option"]  # fmt: skip
    found = imported(*calls)
    assert {call: sorted(modules & (LARGE | ENGINES)) for call, modules in found.items()} == {
        call: [] for call in calls
    }
    folders = {f"adapters.{name}" for name in registry.names()}
    assert not folders & found["describe bounce"]
    assert {f"validation.scenes.{name}" for name in OURS} & found["describe bounce"] == {"validation.scenes.bounce"}
    # What an engine is, and what it can be set to, does not need what it does by design.
    ends = (".laws", ".predictions", ".unset", ".experiments")
    assert [name for name in found["list engines"] if name.startswith(tuple(folders)) and name.endswith(ends)] == []


def test_a_run_imports_its_engine_and_its_scenes_alone():
    pytest.importorskip("pymunk")
    (found,) = imported("run bounce --engine chipmunk --dry-run").values()
    assert found & (LARGE | ENGINES) == {"pymunk"}
    assert {f"validation.scenes.{name}" for name in OURS} & found == {"validation.scenes.bounce"}


def test_imports_for_the_description_of_an_engine():
    pytest.importorskip("mujoco")
    assert imported("describe mujoco")["describe mujoco"] & (LARGE | ENGINES) == {"mujoco"}


def test_the_plugin_of_pytest_imports_nothing_without_its_option():
    code = "import sys; before = set(sys.modules); import contact_crosscheck; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numpy", "click", "adapters", "reports", "validation"} & set(done.stdout.split())
