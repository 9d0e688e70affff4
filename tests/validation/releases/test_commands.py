"""`releases`, `bisect` and `compare` as a user calls them, on three releases of which one cannot be imported."""

import json
import re
import shlex

import pytest
from click.testing import CliRunner

from adapters import registry
from reports.command import main
from validation.releases import environments
from validation.releases.choosing import chosen

CELL = ["--dim", "2", "--param", "e=0.5", "--param", "v=10", "--jobs", "1"]


@pytest.fixture
def call(toy, tmp_path):
    def run(*words, status=0):
        registry.forget()
        done = CliRunner().invoke(main, [*words, "--out", str(tmp_path / "out")])
        assert done.exit_code == status, done.output + repr(done.exception)
        return done

    return run


def test_bisection_of_a_planted_change_in_two_questions(call, tmp_path):
    done = call("bisect", "toy", "1.0.0..1.2.0", "impact", "--check", "rebound_ratio", *CELL, "--json")
    found = json.loads(done.stdout)
    assert (found["before"], found["after"]) == ("1.0.0", "1.2.0")
    assert found["change"]["kind"] == "verdict flipped" and found["change"]["metric"] == "rebound_ratio"
    assert "libtoy.so.1" in found["silent"]["1.1.0"] and found["not_asked_between"] == ["1.1.0"]
    answered = [version for version in found["asked"] if version not in found["silent"]]
    assert answered == ["1.0.0", "1.2.0"]  # two questions
    assert found["others"] is None
    text = call("bisect", "toy", "1.0.0..1.2.0", "impact", "--check", "rebound_ratio", *CELL).stdout
    assert "newly failing since toy 1.2.0" in text and "1.1.0 lies between and cannot run" in text
    assert "1.0.0: 0.5" in text and "--all runs every release" in text


@pytest.mark.long
def test_the_commands_that_it_prints_reproduce_the_two_cells(call):
    done = call("bisect", "toy", "1.0.0..1.2.0", "impact", "--check", "rebound_ratio", *CELL, "--json")
    again, compare = (shlex.split(command)[1:] for command in json.loads(done.stdout)["commands"])
    assert CliRunner().invoke(main, again).exit_code == 0
    compared = CliRunner().invoke(main, compare)
    assert compared.exit_code == 1  # a verdict flipped to the worse
    assert "rebound_ratio: 0.5 (pass) -> 0.3" in compared.stdout and "toy 1.0.0 -> 1.2.0" in compared.stdout


@pytest.mark.long
def test_releases_asked_before_the_only_change(call):
    done = call("bisect", "toy", "1.0.0,1.1.0,1.2.0", "impact", "--check", "rebound_ratio", *CELL, "--all")
    assert "the only change of this check: every release ran" in done.stdout


@pytest.mark.long
def test_unchanged_result_without_an_alarm(call):
    slow = ["--dim", "2", "--param", "e=0.5", "--param", "v=2", "--jobs", "1"]
    done = call("bisect", "toy", "1.0.0,1.2.0", "impact", "--check", "rebound_ratio", *slow)
    assert "is the same in 1.0.0 and 1.2.0" in done.stdout


@pytest.mark.long
def test_end_without_an_answer_as_incomplete(call):
    done = call("bisect", "toy", "1.0.0,1.1.0", "impact", "--check", "rebound_ratio", *CELL, status=4)
    assert "1.1.0 cannot run: cannot be imported" in done.stdout


@pytest.mark.long
def test_output_for_a_silent_release(call):
    done = call("releases", "toy", "1.0.0..1.2.0", "impact", *CELL, status=4)
    assert re.search(r"1\.1\.0 +- +- +- +- +- +cannot be imported", done.stdout)
    assert "changed in 1.2.0, after 1.0.0" in done.stdout and "rebound_ratio" in done.stdout
    told = json.loads(call("releases", "toy", "1.0.0..1.2.0", "impact", *CELL, "--json", status=4).stdout)
    assert [each["release"] for each in told["releases"]] == ["toy==1.0.0", "toy==1.1.0", "toy==1.2.0"]
    assert told["releases"][0]["fails"] == 0 and told["releases"][2]["fails"] > 0
    assert {step["after"] for step in told["steps"]} == {"1.2.0"}
    table = call("releases", "toy", "1.0.0..1.2.0", "impact", *CELL, "--markdown", status=4).stdout
    assert "| 1.2.0 | 1.0.0 |" in table


def test_compare_names_the_releases_that_there_are(call):
    call("releases", "toy", "1.0.0", "impact", *CELL)
    done = call("compare", "toy==1.0.0", "toy==9", status=2)
    assert "has no release toy==9; it has 1.0.0" in done.output


def test_environments_are_listed_checked_and_removed(call, copied):
    made = copied(chosen("toy", "1.0.0")[0])
    (row,) = json.loads(call("releases", "--environments", "--json").stdout)
    assert row["packages"]["toyphysics"] == "1.0.0" and row["wrong"] == "" and row["bytes"] > 1e6
    next(made.path.glob("lib/python*/site-packages/toyphysics.py")).write_text("")
    assert "have changed since it was installed" in call("releases", "--environments", status=1).stdout
    assert "there is no environment" in call("releases", "--remove", "another", status=2).output
    call("releases", "--environments", "--remove", row["name"])
    assert environments.found() == []


@pytest.mark.parametrize(
    "words", [["releases"], ["releases", "toy"], ["releases", "toy", "one"], ["releases", "nothing", "1.0.0"],
              ["releases", "reference", "latest"], ["bisect", "toy", "1.0.0", "impact", "--check", "x"],
              ["releases", "toy", "1.0.0", "no_such_scene"], ["releases", "toy", "1.0.0", "--param", "e=a"]]
)  # fmt: skip
def test_a_wrong_call_is_one_line_and_installs_nothing(call, own_cache, words):
    done = call(*words, status=2)
    assert done.stderr.count("\n") == 1 and done.stderr.startswith("crosscheck: ")
    assert environments.found() == []
