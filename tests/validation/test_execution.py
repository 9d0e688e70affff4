"""Cells whose engine realises something else, whose record contradicts itself, or whose answer is not certified."""

import math
from dataclasses import replace

import pytest

from adapters.conformance.planted_faults import Planted
from adapters.engine import EngineError
from adapters.receipts import Receipt
from adapters.registry import find
from validation.cells import Outcome, Slot
from validation.findings import Findings
from validation.judging import rows as rows_module
from validation.judging.rows import rows_of
from validation.posed import resolve
from validation.running import execution
from validation.running.execution import execute

pytest.importorskip("pymunk")
SLOT = Slot("impact", (), 2, "chipmunk", "tuned", 1 / 240)
HOLDS = Receipt("mass", 1.0, 1.0, 1e-12, 1.0, True, "exact")
BROKEN = Receipt("friction", 0.5, 0.5, 1e-6, 0.49, False, "exact")


def observed(monkeypatch, *slips, certificate=None):
    monkeypatch.setattr(execution, "receipts", lambda *arguments: slips)
    if certificate is not None:
        run = execution.run
        monkeypatch.setattr(execution, "run", lambda *a: replace(run(*a), certificate=certificate))
    found = execute(SLOT)
    return found[0] if isinstance(found, tuple) else found


def test_refusal_of_steps_too_long_for_a_scene(monkeypatch):
    """Chipmunk's ground has a depth: what is faster than half of it a step is refused, at shorter steps it is asked."""
    monkeypatch.setattr("adapters.chipmunk.translation.GROUND_DEPTH", 4.0)
    slot = Slot("bounce", (), 2, "chipmunk", "tuned", 1 / 20)  # 2.3 m a step
    observation = execute(slot)
    assert observation.outcome is Outcome.UNSUPPORTED
    assert observation.reason == "dt: at 46.3 m/s a body passes 2 m of ground in one step, undetected"
    engine, scene = find("chipmunk").engine, resolve("bounce").scene(2, {})
    assert engine.refusal(scene, "tuned", 1 / 60) is None


def test_receipts_that_hold_leave_the_cell_its_verdicts(monkeypatch):
    observation = observed(monkeypatch, HOLDS)
    assert observation.outcome is Outcome.OK
    assert [slip["quantity"] for slip in observation.receipts] == ["mass"]
    assert {row.physics for row in rows_of("run", [observation])} == {"pass"}


def test_friction_that_is_not_realised(monkeypatch):
    """It is a failure of the engine, beside the checks of the scene, which are judged."""
    observation = observed(monkeypatch, HOLDS, BROKEN)
    assert observation.outcome is Outcome.OK
    rows = {row.metric: row for row in rows_of("run", [observation])}
    own = rows.pop("realised_friction")
    assert (own.physics, own.standing, own.alarming) == ("fail", "new", True)
    assert (own.value, own.truth, own.tolerance) == (0.49, 0.5, 1e-6)
    assert own.reason.endswith("; realised mu = 0.49 of 0.5")
    assert rows and {row.physics for row in rows.values()} == {"pass"}


@pytest.mark.parametrize("listed", [True, False])
def test_restitution_a_tenth_too_small(monkeypatch, listed):
    """A regression of the engine: its checks fail and say why; where failures are listed, each is an alarm."""
    found = find("chipmunk")
    planted = replace(found, engine=Planted(found.engine, "restitution", 0.1))
    monkeypatch.setattr(execution, "find", lambda name: planted)
    observation = execute(replace(SLOT, params=(("e", 0.8),)))
    empty = Findings("chipmunk", {}, (), {}) if listed else None
    monkeypatch.setattr(rows_module, "findings_of", lambda engine: empty)
    failing = [row for row in rows_of("run", [observation]) if row.physics == "fail"]
    assert {"rebound_ratio", "realised_restitution"} <= {row.metric for row in failing}
    assert all("realised e = 0.72 of 0.8" in row.reason for row in failing)
    assert {row.alarming for row in failing} == {listed}


@pytest.mark.parametrize("settings", [(), (("damping", 0.5),)])
def test_own_settings_without_a_receipt(monkeypatch, settings):
    slot = replace(SLOT, params=(("e", 0.5),)).with_own(settings) if settings else SLOT
    monkeypatch.setattr(execution, "receipts", lambda *arguments: (BROKEN,))
    found = {row.metric for row in rows_of("run", [execute(slot)])}
    assert ("realised_friction" in found) == (not settings)


def test_a_record_that_contradicts_itself(monkeypatch):
    late = Receipt("sampling", 0.0, 0.0, 1e-12, 1.0, False, "exact")
    observation = observed(monkeypatch, HOLDS, late)
    assert observation.outcome is Outcome.INVALID
    assert observation.reason == "states are not those of their times: sampling is 1, declared 0 +- 1e-12"
    rows = rows_of("run", [observation])
    assert rows and all(row.alarming and row.physics is None for row in rows)


def test_a_solver_that_raises_with_a_reason(monkeypatch):
    """An exact profile refuses; the same of any other profile is a crash."""

    def gives_up(*arguments):
        raise EngineError("no contact problem of this size")

    monkeypatch.setattr(execution, "run", gives_up)
    refused = execute(Slot("impact", (), 2, "reference", "reference", 1 / 240))
    assert (refused.outcome, refused.reason) == (Outcome.REFUSED, "no contact problem of this size")
    assert execute(Slot("impact", (), 2, "reference", "classical", 1 / 240)).outcome is Outcome.CRASHED


def test_measure_that_is_not_finite_as_a_missing_value(monkeypatch):
    """It could be neither judged nor stored: one of them made a whole run unreadable."""
    prepared = execution.prepare(SLOT)
    found = {"momentum_defect": (math.inf, ""), "impulse": (math.nan, "late"), "rebound_ratio": (0.8, "")}
    canonical = replace(prepared.canonical, measure=lambda scene, trajectory: found)
    monkeypatch.setattr(execution, "prepare", lambda slot: replace(prepared, canonical=canonical))
    observation = observed(monkeypatch, HOLDS)
    assert observation.outcome is Outcome.OK
    stated = {check.metric for check in prepared.canonical.checks(prepared.scene, SLOT.dt)}
    assert set(observation.metrics) == stated
    assert {name: observation.metrics[name] for name in stated - set(found)} == {
        name: (None, execution.UNMEASURED) for name in stated - set(found)
    }
    assert {name: observation.metrics[name] for name in found} == {
        "momentum_defect": (None, "the value is inf, not a finite number"),
        "impulse": (None, "late; the value is nan, not a finite number"),
        "rebound_ratio": (0.8, ""),
    }
    assert {row.metric for row in rows_of("run", [observation]) if row.standing == "new"} >= {"momentum_defect"}


def test_unmeasured_receipt_counts_as_broken(monkeypatch):
    silent = replace(BROKEN, measured=math.nan, because="probe slide diverged")
    assert observed(monkeypatch, silent).outcome is Outcome.INVALID


@pytest.mark.parametrize(
    ("certificate", "outcome"),
    [({"certified": False, "reasons": ["gap"]}, Outcome.REFUSED), ({"certified": True}, Outcome.OK), ({}, Outcome.OK)],
)
def test_a_certificate_that_does_not_hold(monkeypatch, certificate, outcome):
    observation = observed(monkeypatch, HOLDS, certificate=certificate)
    assert observation.outcome is outcome
    assert observation.reason == ("gap" if outcome is Outcome.REFUSED else "")
    assert {row.alarming for row in rows_of("run", [observation])} == {outcome is Outcome.REFUSED}
