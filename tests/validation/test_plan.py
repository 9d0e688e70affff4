"""Which slots a run has: profiles are chosen by what they are, not by how they are called."""

import pytest

from adapters import registry
from adapters.engine import NOT_KNOWN
from adapters.foreign import Found
from validation.running import plan
from validation.running.plan import FULL_DT, Request, slots


@pytest.mark.parametrize("engine", [name for name in registry.names() if registry.find(name).engine is not None])
def test_the_full_suite_runs_the_customary_step_of_the_profile_as_shipped_only(engine):
    facts, dts = registry.facts(engine), {}
    for slot in slots(Request(["impact"], [engine], suite="full", dimensions=[max(facts.dimensions)])):
        dts.setdefault(slot.profile, set()).add(slot.dt)
    assert set(dts) == set(registry.find(engine).engine.profiles)
    for profile, steps in dts.items():
        shipped = facts.roles.get(profile) == "shipped"
        assert steps == {*FULL_DT, *([facts.customary_dt] if shipped else [])}, profile


@pytest.mark.parametrize(("name", "profile"), [("chipmunk", "default"), ("reference", "classical")])
def test_an_engine_that_is_not_here_has_its_rows_under_a_profile_that_it_has(monkeypatch, name, profile):
    monkeypatch.setattr(plan, "find", lambda engine: Found(engine, None, "", "nothing is called that"))
    assert {slot.profile for slot in slots(Request(["impact"], [name]))} == {profile}


def test_an_engine_of_which_nothing_is_known_has_its_rows_too(monkeypatch):
    monkeypatch.setattr(plan, "find", lambda engine: Found(engine, None, "", "nothing is called that"))
    monkeypatch.setattr(plan, "facts", lambda engine: None)
    assert {slot.profile for slot in slots(Request(["impact"], ["anything"]))} == {NOT_KNOWN}
