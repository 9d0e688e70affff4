"""What workers are given of a machine, and how arithmetic is looked at, on machines that are made up."""

import ctypes
import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from validation.running import state
from validation.workers import limits
from validation.workers.limits import GIB, LimitError


def machine(monkeypatch, cores=4, memory=16 * GIB, groups=(), hard=None):
    """A machine of so many cores and bytes, with limits of control groups (texts of their files) and of the shell."""
    texts = dict(
        zip(("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"), groups, strict=False)
    )

    class Path:
        def __init__(self, name):
            self.name = name

        def read_text(self):
            if texts.get(self.name) is None:
                raise OSError(self.name)
            return texts[self.name]

    monkeypatch.setattr(limits, "Path", Path)
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(cores)) if pid == 0 else set(), raising=False)
    monkeypatch.setattr(os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": memory // 4096}.__getitem__)
    monkeypatch.setattr(limits, "_hard_limit", lambda: hard)


def test_memory_by_machine_or_control_group(monkeypatch):
    for groups, most in (
        ((), 16 * GIB), (("max\n",), 16 * GIB), ((f"{3 * GIB}\n",), 3 * GIB), ((None, f"{5 * GIB}"), 5 * GIB),
        ((f"{6 * GIB}", f"{4 * GIB}"), 4 * GIB), (("max", f"{2**62}"), 16 * GIB),
    ):  # fmt: skip
        machine(monkeypatch, groups=groups)
        assert limits.installed_memory() == most
    for error in (AttributeError, ValueError, OSError):

        def unknown(name, error=error):
            raise error(name)

        monkeypatch.setattr(os, "sysconf", unknown)
        assert limits.installed_memory() == limits.PLENTY


def test_requested_workers_within_the_machine(monkeypatch):
    machine(monkeypatch, cores=4, memory=64 * GIB)
    for asked, cells, count in ((0, 100, 4), (0, 3, 3), (1, 100, 1), (9, 100, 9), (99, 100, 16), (9, 5, 5), (3, 0, 1)):
        assert limits.workers(asked, cells) == count
    machine(monkeypatch, cores=4, memory=3 * GIB)
    assert [limits.workers(asked, 100) for asked in (0, 2, 9)] == [3, 2, 3]
    machine(monkeypatch, cores=0, memory=GIB // 2)
    assert limits.cores() == 1 and limits.workers(0, 100) == 1


def test_number_of_cores(monkeypatch):
    machine(monkeypatch, cores=3)
    assert limits.cores() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 7)
    assert limits.cores() == 7
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert limits.cores() == 1


def test_memory_share_of_a_worker_within_limits(monkeypatch):
    for memory, count, hard, share in (
        (64, 2, None, 8), (16, 4, None, 4), (16, 16, None, 2), (64, 2, 6, 6), (64, 2, 9, 8), (16, 16, 2, 2),
    ):  # fmt: skip
        machine(monkeypatch, memory=memory * GIB, hard=None if hard is None else hard * GIB)
        assert limits.memory(count) == share * GIB
    machine(monkeypatch, hard=2 * GIB - 1)
    with pytest.raises(LimitError) as error:
        limits.memory(1)
    assert str(error.value) == "memory: this shell allows 2 GiB of address space (ulimit -v), a worker needs 2 GiB"


def test_lower_of_both_memory_limits_of_the_shell(monkeypatch):
    resource = pytest.importorskip("resource")
    for found, least in (((-1, -1), None), ((5, -1), 5), ((-1, 7), 7), ((5, 7), 5), ((7, 5), 5)):
        own = SimpleNamespace(RLIMIT_AS="as", RLIM_INFINITY=-1, getrlimit={"as": found}.__getitem__)
        monkeypatch.setitem(sys.modules, "resource", own)
        assert limits._hard_limit() == least
    monkeypatch.setitem(sys.modules, "resource", resource)
    monkeypatch.setattr(sys, "platform", "win32")
    assert limits._hard_limit() is None


def test_rounding_mode_from_the_platform_s_library(monkeypatch):
    asked = []
    monkeypatch.setattr(ctypes, "CDLL", lambda name: (asked.append(name), "library")[1])
    for platform, name in (("linux", "libm.so.6"), ("darwin", None)):
        monkeypatch.setattr(sys, "platform", platform)
        assert state._libm() == "library" and asked.pop() == name
    for error in (OSError, TypeError):

        def missing(name, error=error):
            raise error("no such library")

        monkeypatch.setattr(ctypes, "CDLL", missing)
        assert state._libm() is None


def test_floating_point_state_with_a_trap_or_rounding_mode(monkeypatch):
    before, unit = state._rounding(), 2.0**-52
    nearest = (1.0 + unit, -1.0 + unit, 1.0 - unit, -1.0 - unit)
    assert before == state._rounding() and before[:4] == nearest and before[4] is True
    with np.errstate(divide="ignore" if np.geterr()["divide"] != "ignore" else "warn"):
        assert state._rounding() != before
    numbers = before[:6]
    monkeypatch.setattr(state, "_C", SimpleNamespace(fegetround=lambda: 3072, fegetexcept=lambda: 7))
    errors = tuple(sorted(np.geterr().items()))
    assert state._rounding() == (*numbers, 3072, 7, *errors)
    monkeypatch.setattr(state, "_C", SimpleNamespace(fegetround=lambda: 1024))
    assert state._rounding() == (*numbers, 1024, *errors)
    monkeypatch.setattr(state, "_C", None)
    assert state._rounding() == (*numbers, *errors)


def test_a_file_that_is_closed_has_no_identity(tmp_path):
    path = tmp_path / "one"
    path.write_text("x", encoding="utf-8")
    with path.open() as stream:
        told = path.stat()
        assert state._file(stream.fileno()) == (told.st_dev, told.st_ino, told.st_mode)
        number = stream.fileno()
    assert state._file(number) is None
