"""What cells of a process share: each thing that one may change is seen and named, and nothing is where nothing is."""

import ctypes
import gc
import json
import os
import platform
import signal
import sys
import threading
import types

import numpy as np
import pytest

from validation.running import state

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="what a process shares is asked of Linux here")


def seen(do, undo):
    """What is said to have changed after ``do``; afterwards nothing is."""
    before = state.taken()
    do()
    try:
        return state.changed(before)
    finally:
        undo()
        assert state.changed(before) == ""


def setting(thing, name, value):
    """Two calls: one that sets, one that sets back."""
    old = getattr(thing, name)
    return (lambda: setattr(thing, name, value)), (lambda: setattr(thing, name, old))


def test_unchanged_state_not_named():
    assert state.changed(state.taken()) == ""


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("interpreter", lambda: (gc.disable, gc.enable)),
        ("interpreter", lambda: (lambda: sys.path.append("/nowhere"), sys.path.pop)),
        ("interpreter, sys.excepthook", lambda: setting(sys, "excepthook", print)),
        ("environment", lambda: (lambda: os.environ.update(CROSSCHECK_X="1"), lambda: os.environ.pop("CROSSCHECK_X"))),
        ("streams", lambda: setting(sys, "stdin", None)),
        ("json.dumps", lambda: setting(json, "dumps", lambda thing: "")),
        ("validation.running.state.State.__eq__", lambda: setting(state.State, "__eq__", len)),
    ],
)
def test_allowed_changes_by_a_cell(name, change):
    assert seen(*change()) == name


def test_changed_recursion_limit_umask_handler_and_signal_named():
    limit, mask = sys.getrecursionlimit(), os.umask(0o022)
    os.umask(mask)
    assert seen(lambda: sys.setrecursionlimit(limit + 7), lambda: sys.setrecursionlimit(limit)) == "interpreter"
    assert seen(lambda: os.umask(mask ^ 0o011), lambda: os.umask(mask)) == "file mode mask"
    old = signal.getsignal(signal.SIGUSR1)
    ours = lambda *given: None  # noqa: E731
    assert seen(lambda: signal.signal(signal.SIGUSR1, ours), lambda: signal.signal(signal.SIGUSR1, old)) == (
        "signal handlers"
    )
    one = {signal.SIGUSR2}
    assert seen(lambda: signal.pthread_sigmask(signal.SIG_BLOCK, one),
                lambda: signal.pthread_sigmask(signal.SIG_UNBLOCK, one)) == "signal handlers"  # fmt: skip


def test_lasting_thread_and_missing_module_named(monkeypatch):
    ended = threading.Event()
    thread = threading.Thread(target=ended.wait)
    assert seen(thread.start, lambda: (ended.set(), thread.join())) == "threads"
    monkeypatch.setitem(sys.modules, "crosscheck_that_goes", types.ModuleType("crosscheck_that_goes"))
    before = state.taken()
    del sys.modules["crosscheck_that_goes"]
    assert state.changed(before) == "modules"


def test_a_folder_and_traps_of_numbers_are_named(tmp_path):
    here, errors = os.getcwd(), np.geterr()
    assert seen(lambda: os.chdir(tmp_path), lambda: os.chdir(here)) == "folder"
    assert seen(lambda: np.seterr(under="raise"), lambda: np.seterr(**errors)) == "floating point"


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="the mode's number is this processor's")
def test_rounding_mode_detected_by_sums():
    to_nearest, upward = 0, 0x800
    known = state._rounding()
    assert state._C.fegetround() == to_nearest
    state._C.fesetround(upward)
    try:
        other = state._rounding()
    finally:
        state._C.fesetround(to_nearest)
    assert other != known and state._rounding() == known
    unit = 2.0**-52
    assert known[:4] == (1.0 + unit, -1.0 + unit, 1.0 - unit, -1.0 - unit)
    assert known[4] is True, "half of the smallest normal number is a number"
    assert len(other) == len(known) and other[-5:] == known[-5:]


def test_open_files_beyond_the_spare_ones():
    before = state.taken()
    files = [os.dup(0) for _ in range(state.SPARE_FILES)]
    try:
        assert state.changed(before) == ""
        files.append(os.dup(0))
        assert state.changed(before) == state.OPEN_FILES
        now = state.still(before)
        assert now.facts[state.OPEN_FILES] == before.facts[state.OPEN_FILES]
    finally:
        for each in files:
            os.close(each)
    assert state.changed(before) == ""


def test_process_state_cached_until_a_new_name(monkeypatch):
    before = state.taken()
    assert state.still(before) is before
    monkeypatch.setitem(sys.modules, "crosscheck_that_came", types.ModuleType("crosscheck_that_came"))
    known = state.State({**before.facts, state.OPEN_FILES: -3}, before.names, before.sizes, before.modules)
    after = state.still(known)
    assert after is not before and after.modules == before.modules + 1
    assert after.facts == {**before.facts, state.OPEN_FILES: -3}
    monkeypatch.delitem(sys.modules, "crosscheck_that_came")
    assert state.still(before) is before
    monkeypatch.setattr(json, "a_name_that_came", 1, raising=False)
    assert state.still(before).sizes["json"] == before.sizes["json"] + 1


def test_limit_of_named_changes_by_place_and_in_all():
    before = state.taken()
    names = {f"f{k}": len for k in range(5)}
    places = {f"place{k}": ({}, names) for k in range(4)} | {"whole": (names, names)}
    told = state.changed(state.State(before.facts, places, {}, 0))
    assert told == ", ".join([f"place{k}.f{m}" for k in range(3) for m in range(3)][:8])
    assert state.changed(state.State(before.facts, {"here": ({"f0": max, "f1": len}, names)}, {}, 0)) == (
        "here.f0, here.f2, here.f3"
    )


def test_numerical_library_asked_by_its_name(monkeypatch):
    asked, tell = [], {"wrong": None}

    def library(name):
        asked.append(name)
        if tell["wrong"]:
            raise tell["wrong"]("no such library")
        return "the library"

    monkeypatch.setattr(ctypes, "CDLL", library)
    for system, name in (("linux", "libm.so.6"), ("darwin", None), ("win32", None)):
        monkeypatch.setattr(sys, "platform", system)
        assert state._libm() == "the library" and asked.pop() == name and not asked
    for error in (OSError, TypeError):
        tell["wrong"] = error
        assert state._libm() is None


def test_absent_system_facts_as_nothing(monkeypatch):
    reading, writing = os.pipe()
    os.close(writing)
    there = os.fstat(reading)
    assert state._file(reading) == (there.st_dev, there.st_ino, there.st_mode)
    os.close(reading)
    assert state._file(reading) is None
    import resource

    assert len(state._limits()) == len([name for name in dir(resource) if name.startswith("RLIMIT_")])
    assert resource.getrlimit(resource.RLIMIT_NOFILE) in state._limits()
    monkeypatch.setattr(sys, "platform", "win32")
    assert state._limits() == ()

    def gone(*given):
        raise OSError

    monkeypatch.setattr(os, "listdir", gone)
    monkeypatch.setattr(os, "getcwd", gone)
    assert state._open_files() == 0 and state._folder() is None


def test_names_watched_in_a_process():
    found = state._names()
    assert {"json", "numpy.linalg", "math", "validation.running.state", "validation.running.state.State"} <= set(found)
    assert "types" not in found and not any(name.startswith(("pytest", "reports")) for name in found)
    live, fixed = found["json"]
    assert live is vars(json) and fixed["dumps"] is json.dumps and fixed["decoder"] is json.decoder
    assert "__name__" not in fixed and "json.JSONDecoder" not in found
    assert found["validation.running.state"][1].keys() >= {"taken", "State", "ctypes"}
    assert "SPARE_FILES" not in found["validation.running.state"][1]
    assert "validation.running.state.Path" not in found
