"""What a long command says of its stages: how long each took, and what it waits for."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from reports import stages
from validation.running.warming import Part


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


PARTS = [Part(("toy", profile, 2), (), Path("mark")) for profile in ("tuned", "[red]")]


@pytest.mark.parametrize(("beside", "others"), [(False, ""), (True, "; other engines run meanwhile")])
def test_compilation_is_announced_with_its_time_and_each_part_when_it_is_done(console, monkeypatch, beside, others):
    ticks = iter([100.0, 111.0, 185.0])
    monkeypatch.setattr(stages.time, "monotonic", lambda: next(ticks))
    done = stages.compiling(PARTS, console, beside)
    for part in PARTS:
        done(part)
    assert said(console).splitlines() == [
        f"compiling the kernels of toy, once: one to three minutes{others}",
        "compiled toy/tuned 2-D after 11 s", "compiled toy/[red] 2-D after 1 min 25 s",
    ]  # fmt: skip


def test_where_nothing_is_left_to_compile_nothing_is_said(console):
    stages.compiling([], console)
    assert said(console) == ""
