"""What a long command says of its stages: how long each took, and what it waits for."""

import io
import os

import pytest
from rich.console import Console

from reports import stages


@pytest.fixture
def console():
    return Console(file=io.StringIO(), width=40, force_terminal=False)


def said(console):
    return console.file.getvalue()


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "0 s"), (8.4, "8 s"), (59.4, "59 s"), (59.6, "1 min 00 s"), (185.0, "3 min 05 s"), (3599.0, "59 min 59 s")],
)
def test_a_duration_is_said_in_seconds_until_there_is_a_whole_minute(seconds, text):
    assert stages.clock(seconds) == text


def test_a_line_is_never_broken_nor_read_as_markup(console):
    stages.say(console, "[red] " + "x" * 60)
    assert said(console) == "[red] " + "x" * 60 + "\n"


def test_a_stage_says_what_it_took_by_a_clock_that_nobody_sets_back(console, monkeypatch):
    ticks = iter([100.0, 285.0])
    monkeypatch.setattr(stages.time, "monotonic", lambda: next(ticks))
    monkeypatch.setattr(stages.time, "time", lambda: 0.0)
    with stages.stage(console, "cells"):
        assert said(console) == ""
    assert said(console) == "cells: 3 min 05 s\n"


def test_a_stage_that_fails_says_no_time(console):
    with pytest.raises(ZeroDivisionError), stages.stage(console, "cells"):
        raise ZeroDivisionError
    assert said(console) == ""


class Warming:
    """What is left to compile: two parts, of a minute each."""

    parts = ("reference 2-D", "reference 3-D")
    begun = False

    def __init__(self, slots):
        assert slots == ["slots"]

    def __len__(self):
        return len(self.parts)

    def estimate(self, jobs):
        return 60.0 * len(self.parts) / jobs

    def run(self, jobs):
        assert jobs in (2, 3)
        return iter(self.parts)


@pytest.mark.parametrize(
    ("load", "busy"), [(0.0, ""), (2.0, ""), (2.4, "; longer now, the machine is busy (load 2 on 4 cores)"),
                       (9.6, "; longer now, the machine is busy (load 10 on 4 cores)")],
)  # fmt: skip
def test_who_waits_for_a_compilation_is_told_for_how_long_and_that_a_busy_machine_takes_longer(
    console, monkeypatch, load, busy
):
    monkeypatch.setattr(stages, "Warming", Warming)
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    monkeypatch.setattr(os, "getloadavg", lambda: (load, 0.0, 0.0))
    assert stages.warm_up(["slots"], 2, console) == ["reference 2-D", "reference 3-D"]
    first, last = said(console).splitlines()
    assert first == f"compiling the solver's kernels (once): about 1 min 00 s on idle cores{busy}"
    assert last == "compiled: 0 s"


def test_without_a_number_of_jobs_every_core_compiles(console, monkeypatch):
    monkeypatch.setattr(stages, "Warming", Warming)
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    asked = []
    monkeypatch.setattr(Warming, "run", lambda self, jobs: asked.append(jobs) or iter(()))
    stages.warm_up(["slots"], 0, console)
    assert asked == [3] and "about 40 s" in said(console)


def test_who_waits_for_little_is_not_told_of_a_minute(console, monkeypatch):
    monkeypatch.setattr(stages, "Warming", Warming)
    monkeypatch.setattr(Warming, "begun", True)
    stages.warm_up(["slots"], 2, console)
    first = "kernels are compiled; checking what else these cases need"
    assert said(console).splitlines() == [first, "compiled: 0 s"]


def test_a_terminal_sees_each_part_as_it_is_done(monkeypatch):
    monkeypatch.setattr(stages, "Warming", Warming)
    shown = Console(file=io.StringIO(), width=120, force_terminal=True, color_system=None)
    stages.warm_up(["slots"], 2, shown)
    assert "compiled reference 3-D; about 1 min 00 s in all" in said(shown)


def test_where_nothing_is_left_to_compile_nothing_is_said(console, monkeypatch):
    monkeypatch.setattr(stages, "Warming", Warming)
    monkeypatch.setattr(Warming, "parts", ())
    assert stages.warm_up(["slots"], 2, console) == [] and said(console) == ""
