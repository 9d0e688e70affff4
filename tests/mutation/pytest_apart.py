"""Run pytest in a copy of the checkout, in a process that is forked: what all tests import is imported once, before.

Two seconds of CPU are what an interpreter takes to import numpy, scipy, numba and the like; most tests of a mutant take
less. Nothing of the three packages is imported before the fork, since that is what differs from copy to copy.
"""

from __future__ import annotations

import importlib
import os
import resource
import signal
import sys
import time
import types
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

#: What tests import beside the three packages; what is not installed is left out.
COMMON = ("numpy", "pytest", "_pytest.skipping", "hypothesis.strategies", "scipy.optimize", "scipy.integrate",
          "scipy.stats", "numba", "click", "rich.console", "rich.table", "pydantic", "jinja2", "pandas", "ruptures",
          "coal", "mujoco", "pymunk", "pybullet")  # fmt: skip
#: How pytest runs: in one process, in order, with the same random examples every time.
OPTIONS = ("-p", "no:randomly", "-p", "no:xdist", "-p", "no:cacheprovider", "-q", "-x", "--hypothesis-profile=ci")
#: Seconds of wall time after which a run is given up, however busy the machine is.
PATIENCE = 1800.0
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
    """Pytest's exit status in ``copy``; `OUT_OF_TIME` where it took more CPU than that, or all ``patience`` [s]."""
    child = start(copy, arguments, environment, cpu_seconds)
    begun = time.monotonic()
    while True:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            code = os.waitstatus_to_exitcode(status)
            return OUT_OF_TIME if code == -signal.SIGKILL else code
        if time.monotonic() - begun > patience:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return OUT_OF_TIME
        time.sleep(0.02)


def start(copy: Path, arguments: Sequence[str], environment: Mapping[str, str], cpu_seconds: float) -> int:
    """Fork a process that runs pytest in ``copy``, the leader of a group of its own; its id."""
    sys.stdout.flush()
    child = os.fork()
    if child:
        return child
    code = 3
    try:
        os.setsid()
        with silence():
            soft = int(cpu_seconds) + 1
            resource.setrlimit(resource.RLIMIT_CPU, (soft, soft + 5))
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
