"""``findings --prove``: experiments run and are shown; a reason that nobody has written is one line."""

import json

import pytest
from click.testing import CliRunner

from reports.command import main, proving, statuses
from reports.command.proving import chosen, proof_of
from validation.canonical import Check
from validation.cells import Slot, parse_dt
from validation.findings.files import findings_of
from validation.settings.proofs import Proof, experiments_on
from validation.settings.switching import Reading


def run(*arguments):
    return CliRunner().invoke(main, ["findings", *arguments])


@pytest.mark.parametrize(
    ("asked", "hint"),
    [
        ("stack-touching", "you mean 'stack-touching-start'"),
        ("phlogiston", "crosscheck explain names that of a known failure"),
    ],
)
def test_unknown_reason_with_the_nearest_names(asked, hint):
    """Hundreds of names are no hint."""
    result = run("--prove", asked)
    assert result.exit_code == 2
    (said,) = (line for line in result.output.splitlines() if asked in line)
    assert f"causes is called {asked!r}" in said and hint in said
    assert len(said) < 240


def test_experiment_command_of_a_known_failure():
    """Else nothing printed would say by which name `--prove` knows a cause."""
    known, tested = findings_of("bullet"), {each.family for each in experiments_on("bullet")}
    found = {}
    for (profile, scene, dimension, params, dt, iterations, metric), finding in known.members.items():
        values = tuple((name, float(value)) for name, _, value in (each.partition("=") for each in params.split()))
        count = int(iterations) if iterations else None
        slot = Slot(scene, values, int(dimension), "bullet", profile, parse_dt(dt), count)
        found[finding.family.id] = proof_of({"engine": "bullet", "slot": slot.as_dict(), "metric": metric})
    assert {name for name, command in found.items() if command} == tested & set(found) != set()
    assert all(command == f"crosscheck findings --prove {name}" for name, command in found.items() if command)
    assert proof_of({"engine": "bullet", "slot": slot.as_dict(), "metric": "none"}) == ""


def test_all_means_every_experiment_of_the_chosen_engines():
    assert chosen("all", ["mujoco"]) == {"mujoco": experiments_on("mujoco")}
    assert set(chosen("stack-sweeps", [])) == {"bullet"}


#: Reasons that took the place of false ones: what was blamed before is switched off alone, in vain, in these cells.
BLAMED_IN_VAIN = {
    ("chipmunk", "stack-touching-start"): ("pymunk", {"collision_slop": 1e-5}, ({"n": 2.0}, {"n": 10.0})),
    ("bullet", "incline-residual-creep"): (
        "pybullet", {"solverResidualThreshold": 0.0}, ({"ratio": 0.99},)
    ),
    ("mujoco", "incline-pyramid-threshold"): ("mujoco", {"tolerance": 0.0}, ({},)),
}  # fmt: skip


@pytest.mark.few(1)
@pytest.mark.parametrize(("engine", "reason"), BLAMED_IN_VAIN)
def test_reason_proven_on_its_engine(engine, reason):
    package, blamed, cells = BLAMED_IN_VAIN[engine, reason]
    pytest.importorskip(package)
    result = run("--prove", reason, "--engine", engine, "--json")
    assert result.exit_code == 0, result.output
    proofs = json.loads(result.stdout)
    asked = chosen(reason, [engine])[engine]
    assert len(proofs) == len(asked)
    assert all(proof["holds"] and proof["why_not"] == "" for proof in proofs)
    in_vain = [dict(each.params) for each in asked if blamed in [dict(idle) for idle in each.idle]]
    assert all(cell in in_vain for cell in cells)


def test_refuted_reason_with_its_status(monkeypatch):
    (experiment, *_) = experiments_on("chipmunk")
    slot = Slot(experiment.scene, tuple(dict(experiment.params).items()), 2, "chipmunk", experiment.profile, 1 / 240)
    check = Check(experiment.metric, "m", 0.0, 1e-3, "because", "a law")
    value = {True: 1.0, False: 0.0}

    def prove(engine, experiments):
        return [Proof(engine, each, Reading(slot, check, value[True], ""), Reading(slot, check, value[mended], ""),
                      tuple(Reading(slot, check, value[True], "") for _ in each.idle))
                for each, mended in ((experiment, False), (experiment, True))]  # fmt: skip

    monkeypatch.setattr(proving, "prove", prove)
    result = run("--prove", experiment.family, "--engine", "chipmunk")
    assert result.exit_code == statuses.ALARM
    said = [line.split()[0] for line in result.stdout.splitlines() if "PROVEN" in line]
    assert said == ["PROVEN", "NOT"] and "1 of 2 experiments confirm their cause" in result.stdout


def test_misspelt_name_with_the_nearest_names(page_folder):
    said = run("--out", str(page_folder), "--scene", "bounc").stderr
    assert said.endswith("this run has no check of 'bounc', did you mean 'bounce'?\n")


def test_ratio_without_a_unit():
    pytest.importorskip("pybullet", reason="pybullet is an optional engine")
    said = run("--prove", "bounce-interval-blurred").output
    assert "FAIL apex_interval_ratio 0 of 0.8" in said and " 1 of 0.8" not in said


@pytest.mark.parametrize(("option", "name"), [("--engine", "mujoco"), ("--scene", "slide"), ("--profile", "soft")])
def test_engine_absent_from_the_run_told(page_folder, option, name):
    result = run("--out", str(page_folder), option, name)
    assert result.exit_code == 2 and result.stdout == ""
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"crosscheck: {option}: this run has no check of '{name}', but of ")
