"""Stages of a command: what is counted for which, and that nothing is measured unless it is asked for."""

import pytest

from adapters import stages
from adapters.stages import OTHER, START, stage


@pytest.fixture
def spend(monkeypatch):
    """``spend(seconds)`` passes on both clocks; half of it is CPU time."""
    now = [100.0]
    monkeypatch.setattr(stages.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(stages.time, "process_time", lambda: 0.5 * now[0])
    yield lambda seconds: now.__setitem__(0, now[0] + seconds)
    stages.end()


def test_times_of_nested_stages(spend):
    stages.begin(7.0)
    spend(1.0)
    for whole in (False, True):
        with stage("outer", whole):
            spend(2.0)
            for _ in range(2):
                with stage("inner"):
                    spend(4.0)
        spend(8.0)
    assert {name: (count, wall, cpu) for name, count, wall, cpu in stages.taken()} == {
        START: (1, 7.0, 50.0), OTHER: (0, 17.0, 8.5), "outer": (2, 12.0, 6.0), "inner": (2, 8.0, 4.0),
    }  # fmt: skip
    spend(1.0)
    assert stages.taken() == [(OTHER, 0, 1.0, 0.5)]


def test_failing_stage_counted_and_left(spend):
    stages.begin()
    stages.taken()
    with pytest.raises(ZeroDivisionError), stage("outer", whole=True), stage("inner"):
        spend(1.0)
        raise ZeroDivisionError
    spend(2.0)
    assert stages.taken() == [(OTHER, 0, 2.0, 1.0), ("outer", 1, 1.0, 0.5)]


def test_sums_of_other_processes_are_added_by_stage(spend):
    stages.begin()
    for _ in range(2):
        stages.add([("steps", 3, 2.0, 1.0), ("reading", 1, 0.5, 0.25)])
    assert stages.sent() == [("steps", 6, 4.0, 2.0), ("reading", 2, 1.0, 0.5)]


def test_no_timing_unless_requested(monkeypatch):
    monkeypatch.setattr(stages, "time", None)
    with stage("outer", whole=True), stage("inner"):
        stages.add([("steps", 1, 1.0, 1.0)])
    assert not stages.is_on() and stages.taken() == stages.sent() == []
