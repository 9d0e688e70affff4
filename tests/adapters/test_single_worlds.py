"""Single checks of worlds: starts, what is read back, records, another process; and what a check says as a finding."""

import json
import math
import pickle
from dataclasses import replace
from types import SimpleNamespace

import pytest
from listening import Listening

from adapters.conformance import CHECKS, worlds
from adapters.conformance.finding import Finding, NotAsked, found, judged
from adapters.conformance.toy import ToyEngine
from adapters.engine import Contacts, Expected
from adapters.isolation import IsolationError, Lost

# ---- worlds --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "told", "same"),
    [
        ("elliptic", "mjCONE_ELLIPTIC", True), ("elliptic", "pyramidal", False), (True, True, True), (True, 1, True),
        (True, False, False), (None, None, True), (None, 3, False), (0.5, 0.5, True), (0.5, 0.501, False),
        (2.0, 2.0 + 1e-9, True), (2.0, 2.0 + 3e-9, False), (0.0, 0.9e-12, True), (0.0, 1.1e-12, False),
        ((1.0, 2.0), [1.0, 2.0], True), ((1.0, 2.0), [1.0, 2.1], False), ((1.0, 2.0), 1.0, True),
        (1.0, "its own word", True), (1.0, {"a": 1}, True), (1.0, math.nan, False),
    ],
)  # fmt: skip
def test_readback_against_the_declared_scene(asked, told, same):
    assert worlds._same(asked, told, 1e-9) is same


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({}, ""),
        ({"iterations": 5}, "settings.iterations was declared 4, the engine holds 5"),
        ({"dt": 0.5}, "dt was declared 0.00416"),
        ({"gravity": [0.0, 9.81]}, "gravity was declared (0.0, -9.81), the engine holds [0.0, 9.81]"),
        ({"bodies": {"ball": {"mass": 2.1}}}, "ball.mass was declared 2.0, the engine holds 2.1"),
        ({"bodies": {"box": {"inertia": 0.3}}}, "box.inertia was declared 0.4, the engine holds 0.3"),
        ({"bodies": {"floor": {"mass": 7.0}}}, ""),  # what is fixed has whatever mass an engine likes
        ({"bodies": {}}, ""),
        ({"pairs": {"floor-ball": {"friction": 0.4}}}, "floor-ball.friction was declared 0.5, the engine holds 0.4"),
        ({"pairs": {"floor-box": {"restitution": 0.1}}}, "floor-box.restitution was declared 0.0, "),
        ({"pairs": {"floor-ball": {"friction": 0.5, "restitution": 0.0}}}, ""),
        ({"pairs": {"ball-floor": {"friction": 0.4}}}, ""),  # no name that the contract knows
    ],
)  # fmt: skip
def test_readback_compared_field_by_field(change, said):
    class Telling(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "second":
                held = world.readback()
                world.readback = lambda: held | change
            return world

    told = CHECKS["readback"](Telling())
    assert told.startswith(f"second: {said}") if said else told == ""


def test_declared_change_of_a_start_is_no_fault():
    class Lifted(Listening):
        said = ("raised by a margin",)

        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            pose = world.pose
            world.pose, world.initial_change = (lambda: pose() + 1e-3), self.said
            return world

    assert CHECKS["states"](Lifted()) == ""
    Lifted.said = ()
    assert CHECKS["states"](Lifted()).startswith("first: bodies start in another pose")

    class Short(Listening):
        wrong = "pose"

        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            whole = getattr(world, self.wrong)
            setattr(world, self.wrong, lambda: whole()[:, :2])
            return world

    assert CHECKS["states"](Short()) == "first: shapes are (3, 2) and (3, 3)"
    Short.wrong = "twist"
    assert CHECKS["states"](Short()) == "first: shapes are (3, 3) and (3, 2)"


def record_with(**changed):
    """An engine of which the second profile's records are changed in one part."""

    class Recording(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "second":
                world.record = lambda samples, stride, contacts: _changed(
                    worlds.one_by_one(world, samples, stride), world, changed
                )
            return world

    return Recording()


def _changed(told, world, changed):
    world.steps += changed.get("steps", 0)
    if changed.get("contacts", 0) is None:
        return replace(told, contacts=None)
    if more := changed.get("more"):
        world.inner.advance(more)
    for name in ("pose", "twist"):
        if name in changed:
            value = getattr(told, name).copy()
            value[-1, -1, -1] += changed[name]
            told = replace(told, **{name: value})
    if "counts" in changed:
        told = replace(told, counts=told.counts[::-1] + changed["counts"])
    if "of" in changed:
        rows = {name: getattr(told.contacts, name).copy() for name in worlds.CONTACT_FIELDS}
        rows[changed["of"]][-1] += 1
        told = replace(told, contacts=Contacts(**rows))
    return told


@pytest.mark.parametrize(
    ("changed", "said"),
    [({}, ""), ({"pose": 1e-12}, "poses"), ({"twist": 1e-12}, "twists"), ({"counts": 1}, "counts"),
     ({"contacts": None}, "contacts"), ({"more": 1}, "ends"),
     *(({"of": name}, f"contacts' {name}") for name in worlds.CONTACT_FIELDS)],
)  # fmt: skip
def test_record_compared_part_by_part_with_single_steps(changed, said):
    engine = record_with(**changed)
    told = CHECKS["stride"](engine)
    where = f"second: {said} recorded at once (24 of 1 steps) differ from those of single steps"
    assert told == (where if said else "")
    assert all(world.closed == 1 for world in engine.built)
    if not said:
        assert engine.worlds("second") == {"sliding floor box 2": [24, 24, 24, 25, 25, 25, 25]}
        assert engine.worlds("first") == {"sliding floor box 2": [24, 24, 24, 1, 1, 1, 1]}


class Line:
    """The end of a connection at which a child sits, and what it sent."""

    def __init__(self, asked=b""):
        self.asked, self.sent = asked, []

    def recv_bytes(self):
        return self.asked

    def send_bytes(self, told):
        self.sent.append(json.loads(told))


def test_scene_in_a_child_process_or_the_reason_without_engine():
    line = Line(pickle.dumps(ToyEngine()))
    worlds.serve_hashes(line)
    assert line.sent == [worlds._hashes(ToyEngine())] and set(line.sent[0]) == {"default"}
    line = Line(b"no engine")
    worlds.serve_hashes(line)
    assert len(line.sent) == 1 and line.sent[0]["not there"].startswith("UnpicklingError: ")


@pytest.fixture
def child(monkeypatch):
    """`child(answer)`: another process that answers so, or does not."""

    def made(answer):
        heard = SimpleNamespace(sent=[], stopped=0, serve=None, patience=None)

        class Child:
            def __init__(self, serve):
                if isinstance(answer, IsolationError):
                    raise answer
                heard.serve = serve

            def send(self, message):
                heard.sent.append(pickle.loads(message))

            def receive(self, timeout):
                heard.patience = timeout
                if isinstance(answer, Lost):
                    raise answer
                return json.dumps(answer).encode()

            def tail(self):
                return "Segmentation fault\nin the engine"

            def stop(self):
                heard.stopped += 1

        monkeypatch.setattr(worlds, "Child", Child)
        return heard

    return made


def test_bits_of_another_process_by_profile(child, monkeypatch):
    here = worlds._hashes(ToyEngine())["default"]
    monkeypatch.setattr(worlds, "_hashes", lambda engine: {"first": here, "second": here})
    for there, said in (
        ({"first": here, "second": here}, ""),
        ({"first": here, "second": "ff"}, "second: the result differs in a new process"),
        ({"second": here}, "first: the result differs in a new process"),
        ({}, "first, second: the result differs in a new process"),
    ):
        heard = child(there)
        assert CHECKS["process"](ToyEngine()) == said
        assert heard.stopped == 1 and heard.serve is worlds.serve_hashes and heard.patience == worlds.PATIENCE
        assert [type(engine) for engine in heard.sent] == [ToyEngine]


def test_process_that_exits_and_process_that_cannot_start(child, monkeypatch):
    monkeypatch.setattr(worlds, "_hashes", lambda engine: {"default": "00"})
    heard = child(Lost("it ended with signal 11"))
    assert CHECKS["process"](ToyEngine()) == "it ended with signal 11: Segmentation fault"
    assert heard.stopped == 1
    child(IsolationError("process: cannot start one: no memory"))
    with pytest.raises(NotAsked, match=r"^process: cannot start one: no memory$"):
        CHECKS["process"](ToyEngine())
    child({"not there": "ImportError: no toy"})
    with pytest.raises(NotAsked, match=r"^the engine cannot be loaded in another process: ImportError: no toy$"):
        CHECKS["process"](ToyEngine())

    class Local(ToyEngine):
        pass

    with pytest.raises(NotAsked, match=r"^the engine cannot be sent to another process: "):
        CHECKS["process"](Local())


# ---- what is found -------------------------------------------------------------------------------------------------


def test_message_of_a_check_as_a_finding_of_its_name():
    def check(engine):
        """All is well.

        And more of it.
        """
        return engine.said

    toy = SimpleNamespace(said="", expected=())
    assert found("name", check, toy) == Finding("name", "ok", "All is well")
    toy.said = "wrong"
    assert found("name", check, toy) == Finding("name", "FAIL", "wrong")
    toy.expected = (Expected("other", "no", "none"), Expected("name", "it is old", "its manual"))
    assert found("name", check, toy) == Finding("name", "expected", "it is old (its manual): wrong")
    toy.said = ""
    assert found("name", check, toy) == Finding(
        "name", "unexpected pass", "it passes, but is listed as failing: it is old"
    )

    def refusing(engine):
        raise NotAsked("no scene\nfor it")

    def raising(engine):
        raise ArithmeticError("no\nnumber")

    assert found("name", refusing, toy).status == "refused" and found("name", refusing, toy).message == "no scene"
    toy.expected = ()
    assert found("name", raising, toy) == Finding("name", "FAIL", "ArithmeticError: no")
    assert found("name", lambda engine: "", toy) == Finding("name", "ok", "name")


@pytest.mark.parametrize(
    ("status", "holds"),
    [("ok", True), ("FAIL", False), ("refused", True), ("expected", True), ("unexpected pass", False)],
)
def test_passed_checks_and_their_output(status, holds):
    finding = Finding("states", status, "as it is")
    assert finding.holds is holds
    assert str(finding) == f"{status:8s}  states: as it is"
    assert judged("x", "", "good", None) == Finding("x", "ok", "good")
