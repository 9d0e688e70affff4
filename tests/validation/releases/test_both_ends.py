"""What goes over the line to an environment and back, without one between both ends."""

import io
import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from validation.cells import Observation, Outcome, Slot
from validation.releases import driven as other_end
from validation.releases import driving
from validation.releases.driving import Effort, drive

ONE = Effort(jobs=1)


def test_answers_and_leftovers_of_a_release_over_the_line(store, monkeypatch):
    """Both ends of the line, without an environment between them: one cell ran, one was left with a reason."""
    asked = [Slot("impact", (("e", e),), 2, "chipmunk", "default", 1 / 240) for e in (0.25, 0.5)]
    own = SimpleNamespace(name="chipmunk==1", engine="chipmunk", version="1", distribution="pymunk", unknown="")
    seen = Observation(asked[0], "c0de", 120, "9.9", Outcome.OK, "", state_hash="0a")

    def cells(wanted, jobs, timeout, leave):
        assert (list(wanted), jobs, timeout) == (asked, ONE.jobs, ONE.timeout)
        yield seen
        leave(wanted[1], "it ran out of time\nthree times")

    def talk(environment, path, question, patience):
        yield {"told": {"distribution_version": "1", "reason": ""}}
        said = io.StringIO()
        other_end._run(said, json.loads(json.dumps(question)))
        yield from map(json.loads, said.getvalue().splitlines())

    monkeypatch.setattr(other_end, "run_cells", cells)
    monkeypatch.setattr(driving, "build", lambda release, say: None)
    monkeypatch.setattr(driving, "code", lambda engine, scenes: "")
    monkeypatch.setattr(driving, "_talk", talk)
    ran, left = drive(store, own, asked, ONE)
    assert ran == replace(seen, engine_version="1")
    assert left == Observation(asked[1], "", 0, "1", Outcome.TIMED_OUT, "it ran out of time")


# ---- times ----

TIMED = [Slot("impact", (("e", e),), 2, "chipmunk", "default", 1 / 240) for e in (0.25, 0.5)]


def lap(slot, k, void=""):
    """What the far side says of the k-th round of a cell."""
    return {
        "timed": slot.as_dict(), "round": k, "order": 0, "yardstick": 0.005, "void": void, "seconds": 0.25,
        "wall_seconds": 0.5, "steps": 120, "bodies": 1, "state_hash": "0a",
    }  # fmt: skip


@pytest.fixture
def timed(store, monkeypatch):
    """`timed(cells, laps, effort)`: times a release that says these laps; what was asked of it, and what was said."""
    monkeypatch.setattr(driving, "timed_cells", lambda wanted: list(wanted))
    monkeypatch.setattr(driving, "adapter_hash", lambda engine: f"{engine} now")
    monkeypatch.setattr(driving, "scene_code", lambda scene: f"{scene} now")
    own = SimpleNamespace(name="chipmunk==1", engine="chipmunk", version="1", distribution="pymunk", unknown="")

    def run(cells, laps, effort=ONE):
        asked, said = [], []

        def answers(*given):
            asked.append(given)
            yield {"told": {"distribution_version": "1"}}
            for each in laps:
                if isinstance(each, Exception):
                    raise each
                yield each

        monkeypatch.setattr(driving, "_answers", answers)
        driving.time(store, own, cells, effort, said.append)
        return asked, said, own

    return run


def test_release_timed_again_after_a_changed_adapter(timed, store, monkeypatch):
    asked, said, own = timed(TIMED[:1], [lap(TIMED[0], k) for k in range(2)])
    assert asked == [(own, ONE, None, [], asked[0][4], TIMED[:1])] and said == []
    (run,) = store.release_runs("chipmunk", "1")
    assert run.title == "release chipmunk==1: times" and run.finished and run.plan == ()
    found = store.timings(run)
    assert [(each.slot.engine, each.round, each.seconds) for each in found] == [
        ("chipmunk", 0, 0.25), ("python", 0, 0.005), ("chipmunk", 1, 0.25), ("python", 1, 0.005),
    ]  # fmt: skip
    assert store.protocol(run) == {
        "release": {"engine": "chipmunk", "version": "1"}, "told": {"distribution_version": "1"},
        "code": {"adapter": "chipmunk now", "scenes": {"impact": "impact now"}},
    }  # fmt: skip
    assert timed(TIMED[:1], [])[0] == [] and timed([], [])[0] == []  # it is there; nothing is asked for
    assert len(timed(TIMED, [lap(slot, 0) for slot in TIMED])[0]) == 1
    assert timed(TIMED, [])[0] == [] and len(timed(TIMED, [], Effort(jobs=1, fresh=True))[0]) == 1
    monkeypatch.setattr(driving, "adapter_hash", lambda engine: "another")
    assert len(timed(TIMED[:1], [])[0]) == 1
    assert len(store.release_runs("chipmunk")) == 4


def test_timing_failure_with_its_reason_in_a_finished_run(timed, store):
    _, said, _ = timed(TIMED, [lap(TIMED[0], 0), lap(TIMED[1], 0, "it hung")])
    assert said == ["chipmunk==1: not timed: default impact 2-D: it hung"]
    _, said, _ = timed(TIMED, [driving.Unasked("cannot be driven: it ended\nat once")], Effort(fresh=True))
    assert said == ["chipmunk==1: not timed: cannot be driven: it ended"]
    assert [run.finished for run in store.release_runs("chipmunk", "1")] == [True, True]


@pytest.mark.parametrize(
    ("held", "asked", "same"),
    [("1.0", "1.0.0", True), ("1.0.post0", "1.0", False), ("2.0", "1.0", False), ("of today", "1.0", False)],
)
def test_version_with_trailing_zeros(held, asked, same):
    told = {"told": {"distribution_version": held}}
    assert driving._same(told, SimpleNamespace(version=asked)) is same


# ---- the far side as a process ----


@pytest.fixture
def far(monkeypatch):
    """`far(question)`: what `driven.main` writes to its answers where chipmunk has no module but a name."""
    closed = []

    class Answers(io.StringIO):
        def close(self):
            closed.append(self.getvalue())

    def run(question, engine="an engine"):
        ends = []
        monkeypatch.setattr(other_end.os, "dup", lambda end: 10 + end)
        monkeypatch.setattr(other_end.os, "dup2", lambda *both: ends.append(both))
        monkeypatch.setattr(other_end.os, "fdopen", lambda end, mode, encoding: ends.append((end, mode)) or Answers())
        monkeypatch.setattr(other_end.sys, "stdin", io.StringIO(json.dumps(question) + "\n"))
        monkeypatch.setattr(other_end, "_end_with_parent", lambda: None)
        monkeypatch.setattr(other_end.posed, "hand_over", ends.append)
        found = SimpleNamespace(version="7.3", reason="" if engine else "no module named so", engine=engine)
        monkeypatch.setattr(other_end.registry, "find", lambda name: ends.append(name) or found)
        monkeypatch.setattr(other_end, "slots", lambda request: ends.append(request) or TIMED)
        monkeypatch.setattr(other_end, "_run", lambda answers, asked: other_end._say(answers, {"ran": asked["jobs"]}))
        other_end.main()
        return [json.loads(line) for line in closed.pop().splitlines()], ends

    return run


def test_far_side_tells_its_version_before_its_results(far):
    """Its answers go where its output went, and what an engine prints to where errors go."""
    import platform
    from importlib.metadata import version

    question = {
        "engine": "chipmunk", "distribution": "numpy", "request": None, "slots": [], "timed": [], "stated": {"a": "b"},
        "jobs": 3, "timeout": 9.0,
    }  # fmt: skip
    said, ends = far(question)
    told = {
        "python": platform.python_version(), "engine_version": "7.3", "distribution_version": version("numpy"),
        "reason": "", "numpy": version("numpy"),
    }  # fmt: skip
    assert said == [{"told": told}, {"ran": 3}]
    assert ends == [(11, "w"), (2, 1), {"a": "b"}, "chipmunk"]
    request = {"suite": "quick", "scenes": ["impact"], "engines": ["chipmunk"]}
    said, ends = far({**question, "distribution": "no-such-package-here", "request": request})
    assert said[0]["told"]["distribution_version"] == ""
    assert said[0]["told"]["slots"] == [slot.as_dict() for slot in TIMED]
    assert (ends[-1].suite, ends[-1].scenes, ends[-1].engines) == ("quick", ["impact"], ["chipmunk"])
    said, _ = far({**question, "request": request}, engine=None)
    assert len(said) == 1 and said[0]["told"]["reason"] == "no module named so" and "slots" not in said[0]["told"]
