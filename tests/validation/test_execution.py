"""A cell whose receipts or certificate do not hold is INVALID: its numbers are no answer of that profile."""

import math
from dataclasses import replace

import pytest

from adapters.receipts import Receipt
from adapters.registry import find
from validation.cells import Outcome, Slot
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


def test_steps_that_are_too_long_for_a_scene_are_a_refusal_and_no_crash(monkeypatch):
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


def test_one_broken_receipt_makes_the_cell_invalid_and_every_row_an_alarm(monkeypatch):
    observation = observed(monkeypatch, HOLDS, BROKEN)
    assert observation.outcome is Outcome.INVALID
    assert observation.reason == "receipt friction: measured 0.49, declared 0.5 +- 1e-06"
    rows = rows_of("run", [observation])
    assert rows and all(row.alarming and row.physics is None for row in rows)


def test_a_measure_that_is_not_finite_is_a_missing_value_with_its_reason(monkeypatch):
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


def test_a_receipt_that_could_not_be_measured_and_does_not_hold_is_broken_too(monkeypatch):
    silent = replace(BROKEN, measured=math.nan, because="probe slide diverged")
    assert observed(monkeypatch, silent).outcome is Outcome.INVALID


@pytest.mark.parametrize(
    ("certificate", "outcome"),
    [({"certified": False, "reasons": ["gap"]}, Outcome.INVALID), ({"certified": True}, Outcome.OK), ({}, Outcome.OK)],
)
def test_a_certificate_that_does_not_hold_makes_the_cell_invalid(monkeypatch, certificate, outcome):
    observation = observed(monkeypatch, HOLDS, certificate=certificate)
    assert observation.outcome is outcome
    assert ("certificate: gap" in observation.reason) == (outcome is Outcome.INVALID)
