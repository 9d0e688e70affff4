"""The checker of adapters: healthy ones pass, and what is wrong with another one is a finding, never an exception."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters import registry
from adapters.conformance import CHECKS, check_adapter, items, worlds
from adapters.conformance.faults import FAULTS
from adapters.conformance.finding import NotAsked
from adapters.conformance.mechanics import contacts
from adapters.conformance.spoilt import Spoilt
from adapters.conformance.toy import ToyEngine
from adapters.engine import Contacts, Expected
from adapters.receipts import QUANTITIES
from adapters.scene import Box


def failing(findings):
    return {finding.check for finding in findings if not finding.holds}


def test_the_healthy_toy_conforms_and_every_check_is_told(toy):
    findings = check_adapter(toy())
    assert [str(finding) for finding in findings if not finding.holds] == []
    assert [finding.check for finding in findings] == [*CHECKS, *(f"receipt {q}" for q in QUANTITIES)]


@pytest.fixture
def few_worlds(monkeypatch):
    """Memory is looked at over a tenth of the worlds, in tests of other checks: it takes the longest of all."""
    monkeypatch.setattr(worlds, "WARM", 20)
    monkeypatch.setattr(worlds, "BUILDS", 100)


@pytest.mark.usefixtures("few_worlds")
def test_findings_are_one_line_each(toy):
    for finding in check_adapter(toy("nothing read back")):
        assert len(str(finding).splitlines()) == 1
        assert finding.message


@pytest.mark.usefixtures("few_worlds")
def test_a_fault_that_no_receipt_sees_is_found(toy):
    found = failing(check_adapter(toy("world shared with another")))
    assert "fresh" in found
    assert not [name for name in found if name.startswith("receipt")]


@pytest.mark.usefixtures("few_worlds")
def test_an_impulse_on_the_wrong_body_is_found_by_check_and_receipts(toy):
    found = failing(check_adapter(toy("impulse of the wrong body")))
    assert "impulse" in found
    receipts = {name for name in found if name.startswith("receipt")}
    assert receipts == {"receipt impulse"}


@pytest.mark.usefixtures("few_worlds")
def test_an_engine_that_raises_is_a_finding_and_not_an_exception(toy_class):
    class Broken(toy_class):
        def build(self, scene, dt, settings):
            raise RuntimeError("no world today\nand none tomorrow")

    findings = check_adapter(Broken())
    told = {finding.check: finding.message for finding in findings if not finding.holds}
    assert {"states", "fresh", "contacts", "impulse", "readback", "receipt probes"} <= set(told)
    assert told["readback"] == "RuntimeError: no world today"


def test_an_engine_without_boxes_conforms_and_what_it_refuses_is_no_pass(toy_class):
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


@pytest.mark.parametrize(
    ("fault", "seen"),
    [("", []), ("impulse of the wrong body", ["impulse", "sampling"]), ("world shared with another", ["fresh"])],
)
def test_an_engine_without_restitution_is_asked_for_blows_without(fault, seen):
    class Dull:
        def refuses(self, scene, profile):
            rebounds = any(restitution > 0.0 for restitution, _ in scene.materials())
            return "pairs: no restitution" if rebounds else super().refuses(scene, profile)

    class Healthy(Dull, ToyEngine):
        pass

    class Broken(Dull, Spoilt):
        pass

    engine = Broken(fault, max(FAULTS[fault].sizes, default=math.nan)) if fault else Healthy()
    asked = ("momentum", "spin", "impulse", "sampling", "fresh")
    assert [name for name in asked if CHECKS[name](engine)] == seen


def test_memory_that_grows_once_is_asked_again_and_what_no_system_tells_is_not_asked(toy, monkeypatch):
    """An allocator takes a pool once; what leaks does so again."""

    def growth(grown):
        counts = iter(grown)
        return lambda build: (build(1), next(counts))[1]

    monkeypatch.setattr(worlds, "WARM", 1)
    monkeypatch.setattr(worlds, "resident", lambda: 1e6)
    for grown, leaks in (([0.0], False), ([2e9, 0.0], False), ([2e9, 1e9], True)):
        monkeypatch.setattr(worlds, "_growth", growth(grown))
        assert bool(CHECKS["memory"](toy())) == leaks
    monkeypatch.setattr(worlds, "resident", lambda: None)
    with pytest.raises(NotAsked, match="does not tell"):
        CHECKS["memory"](toy())


def test_impulses_are_asked_of_each_profile_for_what_that_one_takes():
    asked = set()

    class Listening(ToyEngine):
        def refuses(self, scene, profile):
            asked.add(profile)
            return super().refuses(scene, profile)

    engine = Listening()
    assert CHECKS["impulse"](engine) == ""
    assert asked - {""} == set(engine.profiles)  # of no profile: whether it takes the scene at all


def test_an_engine_that_refuses_every_scene_passes_nothing(toy_class):
    class Idle(toy_class):
        def refuses(self, scene, profile):
            return "not today"

    passed = {finding.check for finding in check_adapter(Idle()) if finding.status == "ok"}
    assert passed == {"packages", "facts", "profiles"}


@pytest.mark.usefixtures("few_worlds")
def test_expected_failures_are_told_and_an_unexpected_pass_is_a_failure(toy_class):
    class Known(Spoilt):
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


def test_items_are_one_per_check_and_fail_with_the_finding(toy):
    healthy, spoilt = items(toy()), items(toy("start displaced"))
    assert [str(item) for item in healthy] == [*CHECKS, "receipt probes", *(f"receipt {q}" for q in QUANTITIES)]
    by_name = {item.name: item for item in spoilt}
    with pytest.raises(AssertionError, match=r"FAIL .*states: "):
        by_name["states"].hold()
    assert by_name["profiles"].hold().status == "ok"
    assert {item.name: item for item in healthy}["receipt mass"].hold().status == "ok"


@pytest.mark.parametrize("name", registry.names())
def test_our_adapters_conform(name):
    found = registry.find(name)
    if found.engine is None:
        pytest.skip(found.reason)
    findings = check_adapter(found.engine)
    assert [str(finding) for finding in findings if not finding.holds] == []
    if found.facts.profile("solution"):
        assert {finding.status for finding in findings} == {"ok"} and not found.engine.expected


@pytest.mark.parametrize(("part", "wrong"), [("normal", "of length 1"), ("point", "not where bodies touch"),
                                             ("impulse", ""), ("gap", "")])  # fmt: skip
def test_normals_and_places_of_contacts_are_numbers_and_what_need_not_be_told_may_be_none(
    toy, monkeypatch, part, wrong
):
    """All comparisons with NaN are false: asked whether it is too large, it was not."""
    told = Contacts.from_rows

    def rows(*asked):
        found = told(*asked)
        return replace(found, **{part: np.full_like(getattr(found, part), math.nan)})

    monkeypatch.setattr(Contacts, "from_rows", rows)
    said = contacts(toy())
    assert wrong in said and bool(said) == bool(wrong)
