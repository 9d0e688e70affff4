"""An abort, a segfault, an exit, a hang or a leak costs that one cell; workers die with their parent."""

import _multiprocessing
import ctypes
import errno
import gc
import os
import platform
import signal
import subprocess
import sys
import tempfile
import time

import pytest

from validation.cells import Outcome, Slot
from validation.running import state
from validation.workers import limits, run_cells

DT = 1 / 240


def evil(profile):
    return Slot("impact", (), 2, "evil", profile, DT)


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("profile", "outcome", "reason"),
    [
        ("abort", Outcome.CRASHED, "SIGABRT"),
        ("segfault", Outcome.CRASHED, "SIGSEGV"),
        ("exit", Outcome.CRASHED, "exit code 7"),
        ("leak", Outcome.CRASHED, "MemoryError"),
        ("raise", Outcome.CRASHED, "RuntimeError: building failed"),
        ("refuse", Outcome.UNSUPPORTED, "it does not want to"),
    ],
)
def test_changes_of_a_process_cost_only_their_cell(plugins, profile, outcome, reason):
    healthy = [Slot("impact", (("v", v),), 2, "chipmunk", "tuned", DT) for v in (1.0, 2.0)]
    found = {o.slot: o for o in run_cells([healthy[0], evil(profile), healthy[1]], jobs=1, memory=4 * 2**30)}
    assert len(found) == 3
    bad = found[evil(profile)]
    assert bad.outcome is outcome
    assert reason in bad.reason
    assert "\n" not in bad.reason
    if outcome is Outcome.CRASHED:
        assert f"about to {profile}" in bad.log
    for slot in healthy:
        assert found[slot].outcome is Outcome.OK


def test_cell_after_a_hanging_one(plugins):
    slots = [evil("hang"), evil("refuse")]
    found = {o.slot: o for o in run_cells(slots, jobs=1, timeout=8.0)}
    assert found[slots[0]].outcome is Outcome.TIMED_OUT
    assert "8 s" in found[slots[0]].reason
    assert found[slots[1]].outcome is Outcome.UNSUPPORTED


def test_row_of_a_broken_plugin(plugins):
    slot = Slot("impact", (), 2, "broken", "default", DT)
    (observation,) = run_cells([slot])
    assert observation.outcome is Outcome.NOT_INSTALLED
    assert "this plugin is broken" in observation.reason


def test_run_without_temporary_files_or_semaphores(monkeypatch):
    """A full temporary folder, and a system without /dev/shm."""

    def full(*arguments, **options):
        raise OSError(errno.ENOSPC, "No space left on device")

    def missing(*arguments, **options):
        raise FileNotFoundError(errno.ENOENT, "No such file or directory: /dev/shm")

    monkeypatch.setattr(tempfile, "mkdtemp", full)
    monkeypatch.setattr(tempfile, "_mkstemp_inner", full)
    monkeypatch.setattr(_multiprocessing, "SemLock", missing)
    (observation,) = run_cells([Slot("impact", (), 2, "chipmunk", "tuned", DT)])
    assert observation.outcome is Outcome.OK


def test_limits_by_machine_and_workers(monkeypatch):
    gib = limits.GIB
    monkeypatch.setattr(limits, "_hard_limit", lambda: None)
    monkeypatch.setattr(limits, "cores", lambda: 4)
    for installed, asked, cells, count, each in [
        (64 * gib, 0, 100, 4, limits.PLENTY),
        (64 * gib, 1000, 100, 4 * limits.PER_CORE, 4 * gib),
        (64 * gib, 0, 2, 2, limits.PLENTY),
        (2 * gib, 0, 100, 2, limits.NEEDED),
        (gib // 2, 8, 100, 1, limits.NEEDED),
        (12 * gib, 3, 100, 3, 4 * gib),
    ]:
        monkeypatch.setattr(limits, "installed_memory", lambda installed=installed: installed)
        assert limits.workers(asked, cells) == count
        assert limits.memory(count) == each
    monkeypatch.setattr(limits, "_hard_limit", lambda: 3 * gib)
    assert limits.memory(1) == 3 * gib
    monkeypatch.setattr(limits, "_hard_limit", lambda: gib)
    with pytest.raises(limits.LimitError, match="ulimit -v"):
        limits.memory(1)


PARENT = """
import sys
from validation.cells import Slot
from validation.workers import run_cells
if __name__ == "__main__":
    sys.path.insert(0, sys.argv[1])
    for observation in run_cells([Slot("impact", (), 2, "evil", "hang", 1 / 240)]):
        print(observation)
"""


POOL = """
import multiprocessing, os, time
from concurrent.futures import ProcessPoolExecutor
from adapters.isolation import end_with
if __name__ == "__main__":
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, context, end_with, (os.getpid(),)) as pool:
        pool.submit(time.sleep, 600.0).result()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the death signal of a parent is a Linux facility")
@pytest.mark.parametrize("source", [PARENT, POOL], ids=["workers", "pool"])
def test_workers_die_with_a_parent_that_is_killed(plugins, tmp_path, source):
    script = tmp_path / "parent.py"
    script.write_text(source)
    parent = subprocess.Popen([sys.executable, str(script), str(plugins)])
    workers = []
    deadline = time.monotonic() + 60.0
    while not workers and time.monotonic() < deadline:
        time.sleep(0.2)
        workers = [pid for pid in children(parent.pid) if "spawn_main" in command_line(pid)]
    assert workers
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait()
    while any(alive(pid) for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(alive(pid) for pid in workers)


def children(pid):
    found = []
    for task in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{task}/children") as stream:
            found += [int(word) for word in stream.read().split()]
    return found


def command_line(pid):
    try:
        with open(f"/proc/{pid}/cmdline") as stream:
            return stream.read()
    except OSError:
        return ""


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as stream:
            return stream.read().rsplit(")", 1)[1].split()[0] not in ("Z", "X")
    except OSError:
        return False


def test_process_state_cached_until_new_names_or_modules(monkeypatch):
    """What a cell has replaced is seen against an old look as well as against a new one."""
    before = state.taken()
    assert state.still(before) is before and state.changed(state.still(before)) == ""
    monkeypatch.setattr(limits, "come_since", len, raising=False)
    later = state.still(before)
    assert later is not before
    monkeypatch.setattr(limits, "come_since", max)
    assert "limits.come_since" in state.changed(later) and state.changed(before) == ""
    monkeypatch.setattr(limits, "workers", max)
    assert "limits.workers" in state.changed(before)
    monkeypatch.setitem(sys.modules, "a_module_that_came", sys)
    assert state.still(later) is not later


@pytest.mark.skipif(platform.machine() != "x86_64" or sys.platform != "linux", reason="layout of glibc's fenv_t")
@pytest.mark.parametrize("bit", [0x0040, 0x8000, 0x2000, 0x4000, 0x6000])
def test_changed_denormal_or_rounding_mode_noticed(bit):
    """MXCSR: denormals are zeros, or flushed to it; rounding down, up, to zero (Intel's manual, volume 1, 10.2.3)."""
    libm, kept, spoilt = ctypes.CDLL("libm.so.6"), (ctypes.c_uint32 * 8)(), (ctypes.c_uint32 * 8)()
    before = state.taken()
    assert libm.fegetenv(kept) == libm.fegetenv(spoilt) == 0
    spoilt[7] |= bit  # 28 bytes of the x87 unit stand before it
    try:
        libm.fesetenv(spoilt)
        told = state._rounding()
    finally:
        libm.fesetenv(kept)
    assert told != before.facts["floating point"] == state._rounding()


def test_next_cell_of_a_worker_before_its_answer():
    """It does not wait for what is kept of that: of three cells two have been handed out with the first answer."""
    slots = [Slot("impact", (("v", v),), 2, "chipmunk", "tuned", DT) for v in (1.0, 2.0, 3.0)]
    handed = []
    cells = run_cells(slots, jobs=1, keep=lambda slot: handed.append(slot))
    assert next(cells).slot == slots[0] and handed == slots[:2]
    assert [found.slot for found in cells] == slots[1:] and handed == slots


def test_first_count_of_open_files(monkeypatch):
    """A leak of one a cell ends the process after as many cells as it may keep files, also where each cell imports.

    Files that tests before this one have left to the collector must not be closed while these are counted.
    """
    gc.collect()
    collects = gc.isenabled()
    gc.disable()
    before = first = state.taken()
    assert first.facts[state.OPEN_FILES] > 0
    opened = []
    try:
        while not (told := state.changed(before)) and len(opened) <= 2 * state.SPARE_FILES:
            monkeypatch.setattr(limits, f"come_with_{len(opened)}", len, raising=False)
            before = state.still(before)
            opened.append(os.open(os.devnull, os.O_RDONLY))
        # Not by how many were opened here: what earlier tests left open may be closed meanwhile.
        assert told == state.OPEN_FILES
        assert state.taken().facts[state.OPEN_FILES] == first.facts[state.OPEN_FILES] + state.SPARE_FILES + 1
        os.close(opened.pop())
        assert state.changed(before) == "" == state.changed(first)
    finally:
        for number in opened:
            os.close(number)
        if collects:
            gc.enable()
