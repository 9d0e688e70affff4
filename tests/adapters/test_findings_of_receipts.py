"""Receipts of every profile as findings: the first that does not hold, what was measured nowhere, what cannot be."""

import math

import pytest
from listening import SWEEPS, Listening

from adapters.conformance import parameters, self_test
from adapters.conformance.finding import Finding
from adapters.conformance.parameters import STEPS, receipt_findings
from adapters.conformance.statements import all_needs
from adapters.engine import Expected
from adapters.receipts import QUANTITIES, Receipt


def slip(quantity, measured=1.0, holds=True, because="exact"):
    return Receipt(quantity, 1.0, 1.0, 1e-9, measured, holds, because)


@pytest.fixture
def measured(monkeypatch):
    """`measured(rule)`: receipts are what ``rule(profile, needs, dt)`` changes of those that hold, by quantity."""

    def made(rule):
        asked = []

        def receipts(engine, profile, needs, dt):
            asked.append((profile, needs, dt))
            changed = rule(profile, needs, dt)
            return tuple(changed.get(quantity, slip(quantity)) for quantity in QUANTITIES)

        monkeypatch.setattr(parameters, "receipts", receipts)
        return asked

    return made


def test_needs_and_steps_asked_of_every_profile(measured):
    asked = measured(lambda *of: {})
    engine = Listening()
    findings = receipt_findings(engine)
    assert [(each.check, each.status) for each in findings] == [
        (f"receipt {quantity}", "ok") for quantity in QUANTITIES
    ]
    assert {each.message for each in findings} == {"as declared in every profile"}
    needs = list(all_needs(engine))
    assert asked == [(profile, each, dt) for profile in SWEEPS for each in needs for dt in STEPS]
    assert len(needs) == 10 and {each.dimension for each in needs} == {2, 3}
    kinds = {(each.regime, each.restitution, each.friction, each.slide, each.rotation) for each in needs}
    assert kinds == {
        ("impact", 0.8, 0.0, False, False), ("impact", 0.0, 0.0, False, False), ("impact", 0.5, 0.5, True, False),
        ("rest", 0.0, 0.5, False, True), ("rest", 0.0, 0.5, True, True),
    }  # fmt: skip
    assert {(each.top_speed, each.gravity) for each in needs} == {(6.0, 9.81)}


def test_first_failed_receipt(measured):
    def rule(profile, needs, dt):
        wrong = profile == "second" and needs.dimension == 3 and needs.regime == "rest"
        return {"mass": slip("mass", 0.5, False, "told\nso")} if wrong else {}

    measured(rule)
    engine = Listening()
    told = {each.check: each for each in receipt_findings(engine)}
    said = "second, 3-D, rest, e 0, dt 0.01667: measured 0.5, declared 1 +- 1e-09 (told"
    assert told["receipt mass"] == Finding("receipt mass", "FAIL", said)
    assert {each.status for name, each in told.items() if name != "receipt mass"} == {"ok"}
    engine.expected = (Expected("receipt mass", "it is light", "its manual"), Expected("receipt turn", "no", "none"))
    told = {each.check: each for each in receipt_findings(engine)}
    assert told["receipt mass"] == Finding("receipt mass", "expected", f"it is light (its manual): {said}")
    assert told["receipt turn"].status == "unexpected pass"


def test_quantity_without_a_measurement(measured):
    def rule(profile, needs, dt):
        never = {"size": slip("size", math.nan, True, "no boxes")}
        if profile == "second" and dt == STEPS[1]:
            never["mass"] = slip("mass", math.nan, True, "too short")
        return never

    measured(rule)
    told = {each.check: each for each in receipt_findings(Listening())}
    where = "2-D, impact, e 0.8"
    assert told["receipt size"] == Finding("receipt size", "refused", f"first, {where}, dt 0.01667: no boxes")
    good = f"as declared wherever it was measured; not so at second, {where}, dt 0.00417: too short"
    assert told["receipt mass"] == Finding("receipt mass", "ok", good)


def test_failing_probe_as_a_finding_of_its_own(measured):
    def rule(profile, needs, dt):
        if profile == "second":
            raise ArithmeticError("no\nnumber")
        return {}

    measured(rule)
    first, *rest = receipt_findings(Listening())
    said = "second, 2-D, impact, e 0.8, dt 0.01667: ArithmeticError: no"
    assert first == Finding("receipt probes", "FAIL", said)
    assert len(rest) == len(QUANTITIES) and {each.status for each in rest} == {"ok"}

    def always(profile, needs, dt):
        raise ArithmeticError("none")

    measured(always)
    _, *rest = receipt_findings(Listening())
    assert {(each.status, each.message) for each in rest} == {("refused", "no probe was measured")}


def test_self_test_output_of_receipts_and_unnoticed_faults(monkeypatch):
    wrong = {"mass": slip("mass", 0.9, False)}
    monkeypatch.setattr(self_test, "receipts", lambda *asked: [*wrong.values(), slip("turn")])
    monkeypatch.setattr(self_test, "check_adapter", lambda engine: [Finding("spin", "refused", "not today")])
    few = {
        name: self_test.FAULTS[name] for name in ("mass too small", "torque with the wrong sign", "nothing read back")
    }
    monkeypatch.setattr(self_test, "FAULTS", few)
    healthy, *rows = self_test.self_test()
    assert (healthy.caught, healthy.message, healthy.check) == (False, "refused   spin: not today", "all")
    assert [(row.fault, row.check, row.size, row.unit, row.caught) for row in rows[:3]] == [
        ("mass too small", "receipt mass", size, "share", True) for size in (0.1, 0.01, 0.001)
    ]
    assert {row.message for row in rows[:3]} == {"measured 0.9, declared 1 +- 1e-09"}
    assert (rows[3].check, rows[3].caught, rows[3].message) == ("receipt turn", False, "nothing noticed")
    assert math.isnan(rows[3].size) and math.isnan(healthy.size)
    assert (rows[4].caught, rows[4].message) == (True, "default: nothing is read back")
    monkeypatch.setattr(self_test, "check_adapter", lambda engine: [Finding("spin", "ok", "it does")])
    healthy = next(self_test.self_test())
    assert (healthy.fault, healthy.caught, healthy.message) == ("none: the healthy toy", True, "every check holds")
