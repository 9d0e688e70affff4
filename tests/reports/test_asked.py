"""Public reports of a survey: the commands that show them run, and their numbers are as told.

`asked/reports.csv` has for each report the scenes or topics that are right, its words, and the arguments of ``run``
that show it: the right value, the tolerance of a measured one, and how the engine does (`OUTCOMES`).
"""

import csv
import shlex
from itertools import groupby
from pathlib import Path

import click
import pytest

import contact_crosscheck as cc
from adapters.settings.own import given
from reports.command import main
from reports.command.selection import parameter

FOLDER = Path(__file__).with_name("asked")
ROWS = list(csv.DictReader((FOLDER / "reports.csv").open(encoding="utf-8")))
REPORTS = [next(rows) for _, rows in groupby(ROWS, lambda row: row["report"])]
#: What a command shows: the engine is right, or wrong, or right with a fix, or does what its soft contact has to do;
#: ``not covered`` has no command.
OUTCOMES = ("right", "wrong", "fixed", "soft", "not covered")
UNFIXED = "no setting fixes it"
RUN = main.get_command(click.Context(main), "run")


def engine_of(row):
    return row["run"].partition("--engine ")[2].partition(" ")[0]


RUNS = [
    pytest.param(row, id=f"{row['report']}: {row['run']}", marks=pytest.mark.optional(engine_of(row)))
    for row in ROWS
    if row["run"]
]


def ran(command, folder=FOLDER):
    """Result of the arguments of ``run``, read by the command itself; those of a file name one of ``folder``."""
    told = RUN.make_context("run", shlex.split(command)).params
    (scene,), (engine,) = told["scenes"], told["engine"]
    return cc.run(
        str(folder / scene) if "." in scene else scene,
        engine=engine,
        profile=next(iter(told["profile"]), None),
        dimension=next(iter(told["dim"]), None),
        dt=next(iter(told["dt"]), None),
        settings=dict(given(told["set"])),
        **dict(map(parameter, told["param"])),
    )


@pytest.mark.parametrize("report", [pytest.param(each["report"], id=each["report"]) for each in REPORTS])
def test_answer_of_a_public_report(report):
    """Each has a command or is not covered; where an engine is wrong, a fix follows or there is none."""
    rows = [row for row in ROWS if row["report"] == report]
    assert rows[0]["sentence"] and not any(row["sentence"] for row in rows[1:])
    for k, row in enumerate(rows):
        assert row["outcome"] in OUTCOMES and bool(row["run"]) == (row["outcome"] != "not covered")
        if row["outcome"] == "wrong":
            fixed = any(engine_of(each) == engine_of(row) and each["outcome"] == "fixed" for each in rows[k:])
            assert fixed or row["says"].startswith(UNFIXED), row["run"]
        if row["outcome"] == "not covered":
            assert row["says"]


@pytest.mark.few(8)
@pytest.mark.parametrize("row", RUNS)
def test_number_of_a_public_report(row):
    found = ran(row["run"])
    (told,) = found.frame().query("metric == @row['metric']").to_dict("records")
    expected, within = float(row["expected"]), float(row["within"])
    assert (abs(told["value"] - expected) <= within) == (row["outcome"] != "wrong"), told["value"]
    if row["outcome"] != "soft" and told["truth"] == told["truth"]:  # where the scene has one, it is the report's
        assert abs(told["truth"] - expected) <= within
