"""Run pytest in a copy of the checkout, in a process that is forked: what all tests import is imported once, before.

Two seconds of CPU are what an interpreter takes to import numpy, scipy, numba and the like; most tests of a mutant take
less. Nothing of the three packages is imported before the fork, since that is what differs from copy to copy.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
import time
import types
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

#: What tests import beside the three packages; what is not installed is left out.
COMMON = ("numpy", "pytest", "_pytest.skipping", "hypothesis.strategies", "scipy.optimize", "scipy.integrate",
          "scipy.stats", "numba", "click", "rich.console", "rich.table", "pydantic", "jinja2", "pandas", "ruptures",
          "coal", "mujoco", "pymunk", "pybullet")  # fmt: skip
#: How pytest runs: in one process, in order, with the same random examples every time.
OPTIONS = ("-p", "no:randomly", "-p", "no:xdist", "-p", "no:cacheprovider", "-q", "-x", "--hypothesis-profile=ci")
#: Seconds of wall time after which a run is given up, however busy the machine is.
PATIENCE = 1800.0
#: Seconds between two looks at what a run has taken.
LOOK = 0.3
#: What `run` returns where time ended it.
OUT_OF_TIME = -signal.SIGXCPU


def import_common() -> None:
    """Import what all tests do."""
    for name in COMMON:
        try:
            importlib.import_module(name)
        except ImportError:
            continue


def run(
    copy: Path, arguments: Sequence[str], environment: Mapping[str, str], cpu_seconds: float, patience: float = PATIENCE
) -> int:
    """Pytest's exit status in ``copy``; `OUT_OF_TIME` where it took more CPU than that, or all ``patience`` [s].

    What it starts counts with it. The kernel's own limit is no way to say so: under one the clock of a process has
    steps of a hundredth of a second, in which a test that clocks something finds no time.
    """
    child = start(copy, arguments, environment)
    begun = looked = time.monotonic()
    while True:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            code = os.waitstatus_to_exitcode(status)
            return OUT_OF_TIME if code == -signal.SIGKILL else code
        now = time.monotonic()
        over = now - begun > patience
        if now - looked > LOOK:
            looked, over = now, over or sum(family(child).values()) > cpu_seconds
        if over:
            end(child)
            return OUT_OF_TIME
        time.sleep(0.02)


def family(root: int) -> dict[int, float]:
    """Seconds of CPU of a process and of each that lives below it, with those of the children that it waited for."""
    parents, spent = dict[int, int](), dict[int, float]()
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended since
            fields = path.read_text(errors="replace").rpartition(")")[2].split()
            own = int(path.parent.name)
            parents[own] = int(fields[1])
            spent[own] = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")

    def is_below(pid: int) -> bool:
        while pid not in (root, 0):
            pid = parents.get(pid, 0)
        return pid == root

    return {pid: seconds for pid, seconds in spent.items() if is_below(pid)}


def end(child: int) -> None:
    """Kill a process, its group, and what lives below it in groups of its own."""
    for pid in family(child):
        with suppress(OSError):
            os.kill(pid, signal.SIGKILL)
    with suppress(OSError):
        os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)


def start(copy: Path, arguments: Sequence[str], environment: Mapping[str, str]) -> int:
    """Fork a process that runs pytest in ``copy``, the leader of a group of its own; its id."""
    sys.stdout.flush()
    child = os.fork()
    if child:
        return child
    code = 3
    try:
        os.setsid()
        with silence():
            os.environ.clear()
            os.environ.update(environment)
            os.chdir(copy)
            # As `python -m pytest` has it; and no process that is spawned imports the runner as its main module.
            sys.path[0] = str(copy)
            sys.modules["__main__"] = types.ModuleType("__main__")
            import pytest

            code = int(pytest.main([*OPTIONS, *arguments]))
    finally:
        os._exit(code)


@contextmanager
def silence() -> Iterator[None]:
    """Send what is written to the terminal nowhere."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    yield
