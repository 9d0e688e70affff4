"""Memory that worlds leave behind: what the system tells of it, and that a leak is seen among free blocks."""

import gc
import os
from pathlib import Path

import numpy as np
import pytest
from listening import Listening

from adapters.conformance import CHECKS, self_test, worlds
from adapters.conformance.faults import FaultyToy
from adapters.conformance.finding import NotAsked

MEGABYTE = 2**20


def test_memory_that_grows_in_four_rounds(toy, monkeypatch):
    """Pools come and go; what leaks does so each time."""

    def growth(grown):
        counts = iter(grown)
        return lambda build: (build(1), next(counts))[1]

    monkeypatch.setattr(worlds, "WARM", 1)
    monkeypatch.setattr(worlds, "resident", lambda: 1e6)
    for grown, leaks in (([0.0], False), ([2e9, 3e9, 1e9, 0.0], False), ([2e9, 3e9, 1e9, 2e9], True)):
        monkeypatch.setattr(worlds, "_growth", growth(grown))
        assert bool(CHECKS["memory"](toy())) == leaks
    monkeypatch.setattr(worlds, "resident", lambda: None)
    with pytest.raises(NotAsked, match="does not report"):
        CHECKS["memory"](toy())


def test_worlds_of_the_memory_check_after_warm_up(monkeypatch):
    told = []
    monkeypatch.setattr(worlds, "WARM", 2)
    monkeypatch.setattr(worlds, "BUILDS", 3)
    engine = Listening()
    monkeypatch.setattr(worlds, "_settled", lambda: (told.append(len(engine.built)), (0.0, 0.0))[1])
    assert CHECKS["memory"](engine) == ""
    assert told == [2, 5]
    assert engine.worlds("first") == {"resting floor box 2": [1] * 5} and not engine.worlds("second")
    assert all(world.closed == 1 for world in engine.built)


def test_memory_growth_per_world_by_pages_or_heap(monkeypatch):
    """Memory that an engine maps for itself shows in the pages alone, small blocks among others in the heap alone."""
    for before, after, grown in (((5.0, 7.0), (8.0, 8.0), 3.0), ((5.0, 7.0), (6.0, 12.0), 5.0)):
        states, asked = iter((before, after)), []
        monkeypatch.setattr(worlds, "_settled", lambda states=states: next(states))
        assert worlds._growth(asked.append) == grown
        assert asked == [worlds.BUILDS]
    monkeypatch.setattr(worlds, "WARM", 1)
    for grown, said in (
        (worlds.STEADY, ""),
        (worlds.STEADY + worlds.BUILDS, "first: 1000 worlds leave 1050 bytes each"),
    ):
        monkeypatch.setattr(worlds, "_growth", lambda build, grown=grown: grown)
        assert CHECKS["memory"](Listening()) == said


@pytest.fixture
def told():
    """Where a system tells neither pages nor heap there is nothing to compare."""
    pytest.importorskip("resource")
    if worlds.resident() is None or worlds.taken() is None:
        pytest.skip("this system tells neither pages in memory nor what the heap holds")


@pytest.mark.usefixtures("told")
def test_memory_of_a_hundred_megabytes_told_and_freed():
    """Of the system and of the heap alike: both are bytes, and count what this process holds."""
    before = worlds._settled()
    held = np.ones(100 * MEGABYTE // 8)
    during = worlds._settled()
    assert held[-1] == 1.0
    del held
    after = worlds._settled()
    for k in (0, 1):
        assert during[k] - before[k] == pytest.approx(100 * MEGABYTE, abs=20 * MEGABYTE)
        assert during[k] - after[k] == pytest.approx(100 * MEGABYTE, abs=20 * MEGABYTE)
    address_space = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    assert MEGABYTE < worlds.resident() < address_space


@pytest.mark.usefixtures("told")
def test_cyclic_garbage_freed_before_memory_is_measured():
    class Link:
        pass

    gc.collect()
    gc.disable()
    try:
        one, other = Link(), Link()
        one.other, other.one, one.load = other, one, np.ones(50 * MEGABYTE // 8)
        del one, other
        before = worlds.taken()
        after = worlds._settled()[1]
    finally:
        gc.enable()
    assert before - after > 40 * MEGABYTE


def test_memory_check_without_system_information(monkeypatch):
    def missing(*asked):
        raise OSError("no such file")

    monkeypatch.setattr(worlds.Path, "read_text", missing)
    assert worlds.resident() is None
    monkeypatch.setattr(worlds.ctypes, "CDLL", missing)
    assert worlds.taken() is None and worlds._settled() == (0.0, 0.0)


def test_leaked_worlds_seen_in_a_fragmented_heap(monkeypatch):
    """Blocks of 3 kB fit between blocks that stay: twice a hundred worlds then take no page more."""
    for name, value in {"WARM": 20, "BUILDS": 100, "STEADY": worlds.STEADY / 10}.items():
        monkeypatch.setattr(worlds, name, value)
    blocks = [bytes(3_100) for _ in range(8_000)]
    del blocks[::2]
    assert self_test.broken(FaultyToy("worlds are never freed", 3e3), "memory")
    assert len(blocks) == 4_000
