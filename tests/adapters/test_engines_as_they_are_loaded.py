"""Engines of others as they are loaded: whose facts are taken, how they are cleaned, what is said of a broken one."""

import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from types import ModuleType

import pytest

from adapters import extras, registry
from adapters.engine import Engine, EngineFacts, Scheme
from adapters.isolation.foreign import Found
from adapters.plain import NAME

FACTS = EngineFacts("odd", "Odd", "odd-package", frozenset({2}), Scheme("none", 0), 0.01)


class Bare(Engine):
    """An engine of which nothing is wrong; its facts belong to the class."""

    facts = FACTS
    profiles = {"default": lambda needs, dt: []}  # noqa: RUF012 (a fake for one test)

    def version(self):
        return "1.2\nand more"

    def refuses(self, scene, profile):
        return None

    def build(self, scene, dt, settings):
        raise NotImplementedError

    def declares(self, profile, needs, dt):
        return {}


class Late(Bare):
    """Its facts are known once it is made."""

    facts = property(lambda self: replace(FACTS, title="Odd\x07 one"))


class Wrong(Bare):
    facts = property(lambda self: {"name": "odd"})


class Lacking(Bare):
    facts = replace(FACTS, package="odd\x07package")

    def version(self):
        raise ImportError("no libodd.so")


class Unknown(Late):
    def __init__(self):
        raise ImportError("no libodd.so")


class NotOne:
    facts = FACTS


def loaded(monkeypatch, kind, name="odd", module="odd_engine", **more):
    made = ModuleType(module)
    made.Engine = kind
    monkeypatch.setitem(sys.modules, module, made)
    return registry.loaded(EntryPoint(name, f"{module}:Engine", registry.GROUP), **more)


def test_facts_and_version_of_a_sound_engine(monkeypatch):
    found = loaded(monkeypatch, Bare)
    assert isinstance(found.engine, Bare)
    assert found == Found("odd", found.engine, "1.2", "", FACTS) and found.trace == ""


def test_facts_computed_at_construction_are_taken_and_cleaned(monkeypatch):
    found = loaded(monkeypatch, Late)
    assert found.reason == "" and found.facts is not None
    assert found.facts.name == "odd" and "\x07" not in found.facts.title and found.facts.title.startswith("Odd")


@pytest.mark.parametrize(
    ("kind", "reason", "facts"),
    [
        (Wrong, "facts: a dict was given, EngineFacts are needed", None),
        (NotOne, "odd_engine:Engine is not an adapters.Engine", FACTS),
    ],
)
def test_object_that_is_no_engine_with_reason_and_traceback(monkeypatch, kind, reason, facts):
    found = loaded(monkeypatch, kind)
    assert (found.name, found.engine, found.version, found.facts) == ("odd", None, "", facts)
    assert reason in found.reason and found.trace


@pytest.mark.parametrize(
    ("profile", "good"),
    [("n" * NAME, True), ("n" * (NAME + 1), False), ("", False), ("a\nb", False), ("\u200b", False), (3, False)],
)
def test_visible_profile_name_of_limited_length(monkeypatch, profile, good):
    class Named(Bare):
        profiles = {profile: Bare.profiles["default"]}  # noqa: RUF012 (a fake for one test)

    found = loaded(monkeypatch, Named)
    assert (found.engine is not None) is good and found.facts == FACTS
    assert good or (found.reason.startswith("EngineError: profiles: ") or found.reason.startswith("profiles: "))
    assert good or found.reason.endswith(" is not the name of a profile")


def test_missing_package_of_an_outside_engine(monkeypatch):
    found = loaded(monkeypatch, Lacking)
    assert found.engine is None and found.facts is not None and found.trace
    assert found.reason.startswith("no libodd.so; pip install odd") and "\x07" not in found.reason
    assert "contact-crosscheck" not in found.reason
    for more, who in (({}, "another distribution"), ({"distribution": "odd-dist"}, "odd-dist")):
        found = loaded(monkeypatch, Unknown, **more)
        assert found.facts is None and found.trace
        assert found.reason == f"no libodd.so; it is an engine of {who}, which must be installed with all it needs"


def test_missing_packages_of_our_engine_by_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "adapters.odd", ModuleType("adapters.odd"))
    listed = [
        "click>=8",
        'odd<2,>=1.5; (python_version > "3") and extra == "odd"',
        'gone; os_name == "no" and extra == "odd"',
    ]
    monkeypatch.setattr(extras, "required", lambda: listed)
    found = loaded(monkeypatch, Lacking, module="adapters.odd")
    assert found.reason == "no libodd.so; pip install 'odd<2,>=1.5'"
    assert found.facts is Lacking.facts and found.trace == ""
    found = loaded(monkeypatch, Late, module="adapters.odd")
    assert found.engine is not None and isinstance(found.facts, property), "ours are taken as they stand"
