"""The checker of adapters: healthy ones pass, and what is wrong with another one is a finding, never an exception."""

import pytest

from adapters import registry
from adapters.conformance import CHECKS, check_adapter
from adapters.receipts import QUANTITIES


def failing(findings):
    return {finding.check for finding in findings if not finding.holds}


def test_the_healthy_toy_conforms_and_every_check_is_told(toy):
    findings = check_adapter(toy())
    assert [str(finding) for finding in findings if not finding.holds] == []
    assert [finding.check for finding in findings] == [*CHECKS, *(f"receipt {q}" for q in QUANTITIES)]


def test_findings_are_one_line_each(toy):
    for finding in check_adapter(toy("nothing read back")):
        assert len(str(finding).splitlines()) == 1
        assert finding.message


def test_a_fault_that_no_receipt_sees_is_found(toy):
    found = failing(check_adapter(toy("world shared between builds")))
    assert "fresh" in found
    assert not [name for name in found if name.startswith("receipt")]


def test_an_impulse_on_the_wrong_body_is_found_by_check_and_receipts(toy):
    found = failing(check_adapter(toy("impulse of the wrong body")))
    assert "impulse" in found
    receipts = {name for name in found if name.startswith("receipt")}
    assert receipts == {"receipt impulse"}


def test_an_engine_that_raises_is_a_finding_and_not_an_exception(toy_class):
    class Broken(toy_class):
        def build(self, scene, dt, settings):
            raise RuntimeError("no world today\nand none tomorrow")

    findings = check_adapter(Broken())
    told = {finding.check: finding.message for finding in findings if not finding.holds}
    assert {"states", "fresh", "contacts", "impulse", "readback", "receipt probes"} <= set(told)
    assert told["readback"] == "RuntimeError: no world today"


@pytest.mark.parametrize("name", registry.names())
def test_our_adapters_conform(name):
    found = registry.find(name)
    if found.engine is None:
        pytest.skip(found.reason)
    assert [str(finding) for finding in check_adapter(found.engine) if not finding.holds] == []
