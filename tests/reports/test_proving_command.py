"""``findings --prove``: experiments run and are shown; a reason that nobody has written is one line."""

import json

import pytest
from click.testing import CliRunner

from adapters.engine_folder import experiments_of
from reports.command import main
from reports.command.proving import chosen


def run(*arguments):
    return CliRunner().invoke(main, ["findings", *arguments])


@pytest.mark.parametrize(
    ("asked", "hint"),
    [("stack-touching", "you mean 'stack-touching-start'"), ("phlogiston", "`crosscheck findings` has the reasons")],
)
def test_an_unknown_reason_is_refused_in_one_line_with_the_nearest_names(asked, hint):
    """Hundreds of names are no hint."""
    result = run("--prove", asked)
    assert result.exit_code == 2
    (said,) = (line for line in result.output.splitlines() if asked in line)
    assert f"there is no reason called {asked!r}" in said and hint in said
    assert len(said) < 240


def test_all_means_every_experiment_of_the_chosen_engines():
    assert chosen("all", ["mujoco"]) == {"mujoco": list(experiments_of("mujoco"))}
    assert set(chosen("stack-sweeps", [])) == {"bullet"}


def test_a_reason_is_proven_on_its_engine():
    pytest.importorskip("pymunk", reason="pymunk is an optional engine")
    result = run("--prove", "stack-touching-start", "--engine", "chipmunk", "--json")
    assert result.exit_code == 0, result.output
    proofs = json.loads(result.stdout)
    assert len(proofs) == len(chosen("stack-touching-start", ["chipmunk"])["chipmunk"])
    assert all(proof["holds"] and proof["why_not"] == "" for proof in proofs)


def test_a_ratio_is_told_without_its_unit_of_one():
    pytest.importorskip("pybullet", reason="pybullet is an optional engine")
    said = run("--prove", "bounce-interval-blurred").output
    assert "FAIL apex_interval_ratio 0 of 0.8" in said and " 1 of 0.8" not in said


@pytest.mark.parametrize(("option", "name"), [("--engine", "mujoco"), ("--scene", "slide"), ("--profile", "soft")])
def test_who_is_not_in_the_run_is_said_and_not_that_nothing_fails(page_folder, option, name):
    result = run("--out", str(page_folder), option, name)
    assert result.exit_code == 2 and result.stdout == ""
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"crosscheck: {option}: this run has no rows of '{name}', but of ")
