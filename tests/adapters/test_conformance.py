"""The checker of adapters: healthy ones pass, and what is wrong with another one is a finding, never an exception."""

import os
from dataclasses import replace

import pytest

from adapters import registry
from adapters.conformance import CHECKS, check_adapter, items, worlds
from adapters.conformance.faults import FaultyToy
from adapters.conformance.finding import judged
from adapters.engine import Expected
from adapters.receipts import QUANTITIES
from adapters.scene import Box, Capsule, Hull


def failing(findings):
    return {finding.check for finding in findings if not finding.holds}


@pytest.fixture
def few_worlds(monkeypatch):
    """Memory is looked at over a tenth of the worlds, in tests of other checks: it takes the longest of all."""
    monkeypatch.setattr(worlds, "WARM", 20)
    monkeypatch.setattr(worlds, "BUILDS", 100)


@pytest.fixture
def worlds_in_time(request):
    """Memory is looked at over all worlds where all tests run."""
    if not os.environ.get("CROSSCHECK_ALL"):
        request.getfixturevalue("few_worlds")


def test_conformance_of_an_engine_that_refuses_every_scene(toy_class):
    class Idle(toy_class):
        def refuses(self, scene, profile):
            return "not today"

    passed = {finding.check for finding in check_adapter(Idle()) if finding.status == "ok"}
    assert passed == {"packages", "facts", "profiles"}


def test_items_of_checks_with_their_findings(toy):
    healthy, spoilt = items(toy()), items(toy("start displaced"))
    assert [str(item) for item in healthy] == [*CHECKS, "receipt probes", *(f"receipt {q}" for q in QUANTITIES)]
    by_name = {item.name: item for item in spoilt}
    with pytest.raises(AssertionError, match=r"FAIL .*states: "):
        by_name["states"].hold()
    assert by_name["profiles"].hold().status == "ok"
    assert {item.name: item for item in healthy}["receipt mass"].hold().status == "ok"


@pytest.mark.long
@pytest.mark.usefixtures("few_worlds")
def test_findings_are_one_line_each(toy):
    for finding in check_adapter(toy("nothing read back")):
        assert len(str(finding).splitlines()) == 1
        assert finding.message


@pytest.mark.usefixtures("few_worlds")
def test_exception_of_an_engine_as_a_finding(toy_class):
    class Broken(toy_class):
        def build(self, scene, dt, settings):
            raise RuntimeError("no world today\nand none tomorrow")

    findings = check_adapter(Broken())
    told = {finding.check: finding.message for finding in findings if not finding.holds}
    assert {"states", "fresh", "contacts", "impulse", "readback", "receipt probes"} <= set(told)
    assert told["readback"] == "RuntimeError: no world today"


@pytest.mark.long
@pytest.mark.usefixtures("few_worlds")
def test_expected_failures_told_and_unexpected_pass_as_failure(toy_class):
    class Known(FaultyToy):
        expected = (Expected("states", "it starts late", "its manual"), Expected("contacts", "no", "nowhere"))

    told = {finding.check: finding for finding in check_adapter(Known("start displaced", 1e-6))}
    assert told["states"].status == "expected" and told["states"].holds
    assert "it starts late (its manual): " in told["states"].message
    assert told["contacts"].status == "unexpected pass" and not told["contacts"].holds

    class Mistaken(toy_class):
        expected = (Expected("stats", "a slip of the pen", "none"), Expected("receipt mass", "no", "none"))

    told = {finding.check: finding for finding in check_adapter(Mistaken())}
    assert told["stats"].status == "FAIL" and not told["stats"].holds and "no such check" in told["stats"].message
    assert told["receipt mass"].status == "unexpected pass"


def test_failure_expected_in_one_profile_only():
    one = Expected("states", "it starts late", "its manual", "late")
    assert judged("states", "late: off by 1", "", one).status == "expected"
    assert judged("states", "plain: off by 1", "", one).status == "FAIL"
    assert judged("states", "", "", one).status == "unexpected pass"


@pytest.mark.usefixtures("worlds_in_time")
def test_conforming_toy_with_every_check(toy):
    findings = check_adapter(toy())
    assert [str(finding) for finding in findings if not finding.holds] == []
    assert [finding.check for finding in findings] == [*CHECKS, *(f"receipt {q}" for q in QUANTITIES)]


@pytest.mark.usefixtures("few_worlds")
def test_conformance_of_an_engine_without_boxes(toy_class):
    class Discs(toy_class):
        def refuses(self, scene, profile):
            boxes = any(isinstance(body.shape, Box) for body in scene.bodies)
            return "shape: balls only" if boxes else super().refuses(scene, profile)

    findings = check_adapter(Discs())
    assert [str(finding) for finding in findings if not finding.holds] == []
    told = {finding.check: finding for finding in findings}
    assert {name for name, finding in told.items() if finding.status == "refused"} == {
        "process",  # a class of a function cannot be named to another process
        "receipt friction", "receipt friction_impulse", "receipt size", "receipt impulse", "receipt mass",
        "receipt inertia", "receipt turn", "receipt linear_damping", "receipt angular_damping",
    }  # fmt: skip
    assert "balls only" in str(told["receipt friction"])
    assert told["receipt gravity"].status == told["states"].status == told["contacts"].status == "ok"


@pytest.mark.few(4)
@pytest.mark.usefixtures("worlds_in_time")
@pytest.mark.parametrize("name", registry.names())
def test_our_adapters_conform(name):
    found = registry.find(name)
    if found.engine is None:
        pytest.skip(found.reason)
    findings = check_adapter(found.engine)
    assert [str(finding) for finding in findings if not finding.holds] == []
    if found.facts.profile("solution"):
        assert {finding.status for finding in findings} == {"ok"} and not found.engine.expected


@pytest.mark.parametrize(
    ("name", "shape", "change"),
    [
        ("bullet", Capsule, lambda shape: Capsule(1.02 * shape.half_length, shape.radius)),
        ("mujoco", Hull, lambda shape: Hull(tuple((x, 0.98 * y, z) for x, y, z in shape.vertices))),
    ],
)
def test_shape_of_another_size_in_an_adapter(name, shape, change, monkeypatch):
    """By 2 %: too long, and too small along one axis."""
    engine = registry.find(name).engine
    if engine is None:
        pytest.skip(f"{name} is not installed")
    build = engine.build

    def changed(scene, dt, settings):
        bodies = (replace(b, shape=change(b.shape)) if isinstance(b.shape, shape) else b for b in scene.bodies)
        return build(replace(scene, bodies=tuple(bodies)), dt, settings)

    monkeypatch.setattr(engine, "build", changed)
    assert f"{shape.__name__} 3-D" in CHECKS["sizes"](engine) and not CHECKS["moments"](engine)


@pytest.mark.long
@pytest.mark.usefixtures("few_worlds")
def test_fault_seen_by_no_receipt_found_by_a_check(toy):
    found = failing(check_adapter(toy("state shared with another world")))
    assert "fresh" in found
    assert not [name for name in found if name.startswith("receipt")]


@pytest.mark.long
@pytest.mark.usefixtures("few_worlds")
def test_impulse_on_the_wrong_body_found(toy):
    found = failing(check_adapter(toy("impulse of the wrong body")))
    assert "impulse" in found
    receipts = {name for name in found if name.startswith("receipt")}
    assert receipts == {"receipt impulse"}
