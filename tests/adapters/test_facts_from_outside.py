"""Facts, settings and refusals of other people's engines: what is read of them, and what is wrong in one line."""

import json
from dataclasses import replace
from typing import get_args

import pytest

from adapters import registry
from adapters.engine import Ability, EngineError, EngineFacts, Precision, Quirk, Role, Scheme, Setting
from adapters.isolation import IsolationError, Lost, foreign
from adapters.isolation.foreign import ForeignEngine
from adapters.needs import Needs, needs
from validation.catalogue import CATALOGUE

FACTS = EngineFacts(
    "toy", "Toy", "a-toy", frozenset({2, 3}), Scheme("symplectic", 0.5), 1 / 100,
    (Quirk("it hums", "a winter", "its manual"),), {"1.0": "it sinks"}, {"fine": Scheme("exact", 0.0)},
    {"fine": "tuned"}, "#a0B1c2", "single", True,
    frozenset(get_args(Ability)[:2]),
)  # fmt: skip


def test_facts_come_through_as_data_field_by_field():
    assert foreign.checked_facts(FACTS) == FACTS
    assert foreign.facts_from(json.loads(json.dumps(foreign.plain_facts(FACTS)))) == FACTS
    bare = replace(FACTS, colour="", quirks=(), roles={}, profile_schemes={}, apart=False, abilities=frozenset())
    assert foreign.checked_facts(bare) == bare


@pytest.mark.parametrize(
    ("field", "wrong", "said"),
    [
        ("dimensions", [], "dimensions are [], 2 and 3 are possible"),
        ("dimensions", [2, 4], "dimensions are [2, 4], 2 and 3 are possible"),
        ("customary_dt", 0.0, "customary_dt is 0.0, a positive number of seconds is needed"),
        ("customary_dt", float("inf"), "customary_dt is inf, a positive number of seconds is needed"),
        ("precision", "half\n", f"precision is 'half', possible are {', '.join(get_args(Precision))}"),
        ("abilities", ["to\tfly"], f"ability is 'to fly', possible are {', '.join(get_args(Ability))}"),
        ("roles", {"fine": "best"}, f"role is 'best', possible are {', '.join(get_args(Role))}"),
        ("colour", "red", "colour is 'red', #rrggbb is needed"),
        ("colour", "#12345g", "colour is '#12345g', #rrggbb is needed"),
        ("colour", "#1234567", "colour is '#1234567', #rrggbb is needed"),
    ],
)
def test_refusal_of_a_wrong_fact(field, wrong, said):
    with pytest.raises(ValueError) as error:
        foreign.facts_from(foreign.plain_facts(FACTS) | {field: wrong})
    assert str(error.value) == said
    with pytest.raises(EngineError) as error:
        foreign.checked_facts(replace(FACTS, **{field: wrong}))
    assert str(error.value) == f"facts: ValueError: {said}"


def test_wrong_facts_settings_and_refusals_by_their_type():
    needed = "given, a Setting with a name is needed"
    for asked, given, said in (
        (foreign.checked_facts, {"name": "toy"}, "facts: a dict was given, EngineFacts are needed"),
        (foreign.checked_settings, "slop", "settings: a str was given, a list is needed"),
        (foreign.checked_settings, [Setting("a", 1, "", ""), 3], f"settings: an int was {needed}"),
        (foreign.checked_settings, [Setting(7, 1, "", "")], f"settings: a Setting was {needed}"),
        (foreign.checked_settings, (Setting("slop\n", float("nan"), "", ""),),
         "settings: slop is nan, not a finite number"),
        (foreign.checked_refusal, 3, "refuses: an int was given, a sentence or None is needed"),
    ):  # fmt: skip
        with pytest.raises(EngineError) as error:
            asked(given)
        assert str(error.value) == said
    fine = (Setting("slop", 0.1, "why", "where"), Setting("mode", "fast", "why", ""))
    assert foreign.checked_settings(fine) == list(fine)
    assert foreign.checked_refusal(None) is None and foreign.checked_refusal("no\nboxes") == "no"


class Told:
    """A child that has been told what it answers."""

    def __init__(self, *answers):
        self.answers, self.sent, self.stopped, self.said = list(answers), [], 0, ""

    def send(self, data):
        self.sent.append(json.loads(data))

    def receive(self, patience):
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return json.dumps(answer).encode()

    def stop(self):
        self.stopped += 1

    def tail(self):
        return self.said


@pytest.fixture
def child(monkeypatch):
    """`child(*answers)`: what the next process answers; the processes that were started."""
    waiting, started = [], []

    def start(serve):
        assert serve is registry.serve_engine and waiting
        started.append(waiting.pop(0))
        if isinstance(started[-1], Exception):
            raise started[-1]
        return started[-1]

    monkeypatch.setattr(foreign, "Child", start)
    monkeypatch.setattr(registry, "brought_by", lambda entry: "a-package")

    def wait(*answers, said=""):
        told = answers[0] if isinstance(answers[0], IsolationError) else Told(*answers)
        if isinstance(told, Told):
            told.said = said
        waiting.append(told)
        return told

    return wait


ENTRY = registry.EntryPoint("toy", "toy_module:Toy", "contact_crosscheck.engines")
ANSWER = {
    "version": "1.2",
    "reason": "",
    "trace": "",
    "facts": foreign.plain_facts(FACTS),
    "profiles": ["fine", "fast"],
    "sources": [],
}


def test_facts_and_settings_of_an_engine_that_answers(child):
    setting = {"name": "slop", "value": 0.1, "because": "why", "source": "where"}
    own = child(ANSWER, {"settings": [setting]}, {"error": "ValueError: no such thing"}, Lost("it died"))
    found = registry.probed(ENTRY)
    assert own.sent == [["toy", "toy_module:Toy", "contact_crosscheck.engines", "a-package"]]
    assert (found.name, found.version, found.reason, found.facts, found.fatal, found.trace) == (
        "toy", "1.2", "", FACTS, False, "")  # fmt: skip
    engine = found.engine
    assert isinstance(engine, ForeignEngine) and engine.version() == "1.2" and list(engine.profiles) == ["fine", "fast"]
    asked = needs(CATALOGUE["stack"].scene(3))
    assert engine.settings("fast", asked, 0.01) == [Setting(**setting)]
    assert own.sent[1]["profile"] == "fast" and own.sent[1]["dt"] == 0.01 and Needs(**own.sent[1]["needs"]) == asked
    with pytest.raises(EngineError, match=r"^settings: toy/fine: ValueError: no such thing$"):
        engine.settings("fine", asked, 0.01)
    again = child(ANSWER, {"settings": []})
    with pytest.raises(EngineError, match=r"^settings: toy/fine: it died$"):
        engine.settings("fine", asked, 0.01)
    assert own.stopped == 1 and engine.settings("fine", asked, 0.02) == [] and again.sent[1]["dt"] == 0.02
    for ask in (engine.refuses, engine.build, engine.declares):
        with pytest.raises(EngineError, match=r"^engine: toy is loaded in worker processes only$"):
            ask(*[None] * (2 if ask == engine.refuses else 3))


def test_engine_without_an_answer_told_with_its_reason(child):
    own = child({"version": "", "reason": "ImportError: no", "trace": "line", "facts": None, "fatal": True})
    found = registry.probed(ENTRY)
    assert (found.engine, found.version, found.reason, found.facts, found.fatal, found.trace, own.stopped) == (
        None, "", "ImportError: no", None, True, "line", 1)  # fmt: skip
    own = child(Lost("it aborted"), said="loading\nno such\tlibrary")
    found = registry.probed(ENTRY)
    assert found.reason == "it aborted while it was imported: no such library" and found.fatal and own.stopped == 2
    assert found.trace == foreign.lines("loading\nno such\tlibrary", foreign.TRACE) and "loading" in found.trace
    child(Lost("it hung"))
    assert registry.probed(ENTRY).reason == "it hung while it was imported"
    child(IsolationError("process: cannot start one"))
    found = registry.probed(ENTRY)
    assert (found.engine, found.reason, found.fatal) == (None, "process: cannot start one", False)
    assert foreign.said_by(ValueError()) == "ValueError" and foreign.said_by(ValueError("a\nb")) == "ValueError: a"
