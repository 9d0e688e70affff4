"""Answers of a worker's process where nothing is run: what a cell does to it, and what it cannot write."""

import errno
from types import SimpleNamespace

import pytest

from validation.cells import Observation, Outcome, Slot
from validation.running import warming
from validation.workers import process

SLOT = Slot("impact", (("e", 0.5),), 2, "toy", "tuned", 1 / 240)
JOB = {
    "slot": SLOT.as_dict(),
    "scenes": {"a": "b"},
    "stated": {"c": "d"},
    "installed": True,
    "keep": "",
    "record": False,
}


@pytest.fixture
def answer(monkeypatch):
    """`answer(cell, engine, changes)`: what a process says of a cell, and how it looked before; what was done."""

    def run(cell=None, engine="an engine", changes="", before=None, **job):
        did = []
        monkeypatch.setattr(process.posed, "remember", lambda scenes: did.append(("remember", scenes)))
        monkeypatch.setattr(process.posed, "hand_over", lambda stated: did.append(("hand over", stated)))
        found = SimpleNamespace(engine=engine, reason="no wheel")
        monkeypatch.setattr(process.registry, "find", lambda name: did.append(name) or found)
        monkeypatch.setattr(process.state, "taken", lambda: did.append("taken") or "a first look")
        monkeypatch.setattr(process.state, "still", lambda seen: did.append(("still", seen)) or f"{seen}, again")
        monkeypatch.setattr(process.state, "changed", lambda seen: did.append(("changed", seen)) or changes)
        monkeypatch.setattr(process, "_flush", lambda: did.append("flush"))

        def made(slot, given):
            assert slot == SLOT and given == {**JOB, **job}
            if isinstance(cell, BaseException):
                raise cell
            return Observation(slot, "c", 1, "1", Outcome.OK), "a recording"

        monkeypatch.setattr(process, "_cell", made)
        told, looked = process._answer({**JOB, **job}, before)
        return told, looked, did

    return run


def test_answer_with_recording_and_next_process_state(answer):
    told, looked, did = answer()
    assert told == {
        "observation": Observation(SLOT, "c", 1, "1", Outcome.OK).as_dict(), "recording": "a recording", "changed": "",
        "unwritten": None,
    }  # fmt: skip
    assert looked == "a first look"
    assert did == [
        ("remember", {"a": "b"}),
        ("hand over", {"c": "d"}),
        "toy",
        "taken",
        "flush",
        ("changed", "a first look"),
    ]
    told, looked, did = answer(before="a look", changes="the rounding mode")
    assert looked == "a look, again" and told["changed"] == "the rounding mode"
    assert did[3:] == [("still", "a look"), "flush", ("changed", "a look, again")]


def test_engine_absent_in_the_worker_or_everywhere(answer):
    told, _, _ = answer(engine=None)
    assert told["observation"]["outcome"] == "crashed"
    assert told["observation"]["reason"] == "it can be loaded, but not in its worker process: no wheel"
    told, _, _ = answer(engine=None, installed=False)
    assert told["observation"]["outcome"] == "ok"


@pytest.mark.parametrize(
    ("error", "unwritten"),
    [
        (OSError(errno.ENOSPC, "No space left", "/x/a.npz"), [errno.ENOSPC, "No space left", "/x/a.npz"]),
        (OSError("odd"), [0, "OSError: odd", "/x/kept"]),
    ],
)
def test_unwritable_recording_apart_from_an_engine_exception(answer, error, unwritten):
    told, _, did = answer(error, keep="/x/kept")
    assert told["unwritten"] == unwritten and told["recording"] is None and told["changed"] == ""
    assert told["observation"] == Observation(SLOT, "", 0, "", Outcome.CRASHED, process.said_by(error)).as_dict()
    assert did[-2:] == ["flush", ("changed", "a first look")]


@pytest.mark.parametrize("error", [SystemExit(0), KeyboardInterrupt(), ValueError("no\nnever")])
def test_process_after_an_engine_s_exit(answer, error):
    told, _, _ = answer(error)
    assert told["observation"] == Observation(SLOT, "", 0, "", Outcome.CRASHED, process.said_by(error)).as_dict()
    assert (told["changed"], told["unwritten"], told["recording"]) == ("what was raised", None, None)
    assert answer(error, changes="open files")[0]["changed"] == "open files"


@pytest.mark.parametrize("works", [True, False])
def test_kernels_for_cells_of_scene_files(monkeypatch, works):
    did = []
    monkeypatch.setattr(process.posed, "remember", lambda scenes: did.append(("remember", scenes)))
    monkeypatch.setattr(process.posed, "hand_over", lambda stated: did.append(("hand over", stated)))
    monkeypatch.setattr(warming, "compile_one", lambda slots: did.append(slots) or works)
    job = {"compile": [SLOT.as_dict()], "scenes": {"a": "b"}, "stated": {"c": "d"}}
    assert process._compiled(job) == {"compiled": works}
    assert did == [("remember", {"a": "b"}), ("hand over", {"c": "d"}), [SLOT]]
