"""What a long command says of its stages: how long each took, and what it waits for."""

import io
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

from adapters import stages as measured
from reports import stages
from reports.command import main
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
def test_durations_below_and_above_a_minute(seconds, text):
    assert stages.clock(seconds) == text


def test_line_without_breaks_or_markup(console):
    stages.say(console, "[red] " + "x" * 60)
    assert said(console) == "[red] " + "x" * 60 + "\n"


def test_stage_duration_by_a_monotonic_clock(console, monkeypatch):
    ticks = iter([100.0, 285.0])
    monkeypatch.setattr(stages.time, "monotonic", lambda: next(ticks))
    monkeypatch.setattr(stages.time, "time", lambda: 0.0)
    with stages.stage(console, "cells"):
        assert said(console) == ""
    assert said(console) == "cells: 3 min 05 s\n"


def test_failing_stage_without_a_time(console):
    with pytest.raises(ZeroDivisionError), stages.stage(console, "cells"):
        raise ZeroDivisionError
    assert said(console) == ""


PARTS = [Part(("toy", profile, 2), (), Path("mark")) for profile in ("tuned", "[red]")]


@pytest.mark.parametrize(("beside", "others"), [(False, ""), (True, "; other engines run meanwhile")])
def test_compilation_announced_with_time_and_parts(console, monkeypatch, beside, others):
    ticks = iter([100.0, 111.0, 185.0])
    monkeypatch.setattr(stages.time, "monotonic", lambda: next(ticks))
    done = stages.compiling(PARTS, console, beside)
    for part in PARTS:
        done(part)
    assert said(console).splitlines() == [
        f"compiling the kernels of toy, once: one to three minutes on idle cores{others}",
        "compiled toy/tuned 2-D after 11 s", "compiled toy/[red] 2-D after 1 min 25 s",
    ]  # fmt: skip


def test_no_message_without_kernels_to_compile(console):
    stages.compiling([], console)
    assert said(console) == ""


#: Stages of a process of cases that every case has.
OF_A_CASE = ("preparing cases", "building worlds", "steps of the engine", "reading states back", "property checks",
             "measuring", "sending answers")  # fmt: skip


def sections(text):
    """Stages by section of the table, each with its numbers."""
    found, title = {}, ""
    for line in text.partition("where the time went")[2].splitlines()[2:]:
        name, *numbers = re.split(r"\s{2,}", line.strip())
        if line.startswith("  "):
            found[title][name] = [float(number) for number in numbers]
        else:
            title = name
            found[title] = {"all": [float(number) for number in numbers]}
    return found


def test_stages_of_a_command_and_of_its_cases(tmp_path, monkeypatch):
    monkeypatch.setattr(stages, "LEAST", 0.0)
    call = ["run", "impact", "--engine", "chipmunk", "--dim", "2", "--jobs", "1", "--out", str(tmp_path)]
    done = CliRunner().invoke(main, ["--timings", *call])
    assert done.exit_code == 0, done.output
    own, cases, _ = (found := sections(done.stderr)).values()
    assert [*found] == ["this process", "processes of cases, together", "other processes, and starts of these"]
    assert {"judging", "storing results", "starting processes", "waiting for processes", "printing"} <= set(own)
    assert set(OF_A_CASE) <= set(cases)
    count = cases["measuring"][0]
    assert count > 1 and cases["property checks"][0] == cases["sending answers"][0] + 1 == count
    for section in (own, cases):  # up to two digits
        shown = [sum(numbers[k] for name, numbers in section.items() if name != "all") for k in (-2, -1)]
        assert shown == pytest.approx(section["all"], abs=0.1)
    # Nothing of it is left for the next command.
    assert "where the time went" not in CliRunner().invoke(main, ["list", "suites"]).stderr
    assert not measured.is_on()


def test_timings_are_told_of_a_command_that_fails():
    done = CliRunner().invoke(main, ["--timings", "describe", "bonce"])
    assert done.exit_code == 2 and "did you mean 'bounce'" in done.stderr
    assert "start and imports" in done.stderr
