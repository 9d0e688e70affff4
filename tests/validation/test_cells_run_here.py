"""Cells that questions run in their own process: what the engine is given, and what becomes of what it says."""

from types import SimpleNamespace

import numpy as np
import pytest

from adapters.engine import EngineError, Setting
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot
from validation.questions import frontier, invariance
from validation.questions.frontier import _looked, run_only
from validation.questions.invariance import measured

SLOT = Slot("head_on", (("e", 0.5),), 2, "toy", "tuned", 1 / 120)
SCENE = CATALOGUE["head_on"].scene(2, {"e": 0.5})


class Told:
    """An engine that takes settings and refuses what ``said`` says; what it was asked, and what ``run`` was given."""

    def __init__(self, monkeypatch, module, said=None, finish="completed", raised=None, version="1.5"):
        self.said, self.refused, self.runs = said, [], []

        def run(engine, scene, dt, settings, sampling):
            self.runs.append((engine, scene, dt, settings, sampling))
            if raised:
                raise raised
            pose, twist = (np.array([[getattr(body, name) for body in scene.bodies]]) for name in ("pose", "twist"))
            return Trajectory(np.zeros(1), pose, twist, None, dt, finish, "a speed is no number")

        def measure(scene, found):
            return {"impulse": (scene.params["e"], ""), "ahead": (float(found.pose[-1, -1, 0]), "")}

        monkeypatch.setattr(module, "load", lambda name: self if name == "toy" else None)
        monkeypatch.setattr(module, "find", lambda name: SimpleNamespace(version=f"{name} {version}"), raising=False)
        monkeypatch.setattr(module, "run", run)
        monkeypatch.setattr(module, "posed_for", lambda engine, scene: (engine, scene))
        settings = [Setting("sweeps", 3, "so"), Setting("slop", 0.1, "so")]
        monkeypatch.setattr(module, "settings_of", lambda engine, slot, scene: settings if slot == SLOT else [])
        own = CATALOGUE["head_on"]
        monkeypatch.setattr(module, "resolve", lambda name: SimpleNamespace(
            version=7, scene=own.scene, sampling=own.sampling, measure=measure
        ))  # fmt: skip

    def refusal(self, posed, profile, dt):
        self.refused.append((posed, profile, dt))
        return self.said


def test_measured_cell_of_a_frontier(monkeypatch):
    told = Told(monkeypatch, frontier)
    found = run_only(SLOT)
    assert (found.slot, found.cell, found.scene_version, found.engine_version) == (SLOT, "", 7, "toy 1.5")
    assert (found.outcome, found.reason, found.metrics["impulse"]) == (Outcome.OK, "", (0.5, ""))
    assert told.refused == [((told, SCENE), "tuned", 1 / 120)]
    sampling = CATALOGUE["head_on"].sampling(SCENE)
    assert told.runs == [(told, SCENE, 1 / 120, {"sweeps": 3, "slop": 0.1}, sampling)]


@pytest.mark.parametrize(
    ("given", "outcome", "reason"),
    [
        ({"said": "it knows no restitution"}, Outcome.UNSUPPORTED, "it knows no restitution"),
        ({"finish": "diverged"}, Outcome.DIVERGED, "a speed is no number"),
        ({"raised": EngineError("no room")}, Outcome.CRASHED, "EngineError: no room"),
        ({"raised": KeyboardInterrupt()}, Outcome.CRASHED, "KeyboardInterrupt"),
        ({"said": 3}, Outcome.CRASHED, None),
    ],
)
def test_frontier_cell_without_an_answer_and_its_reason(monkeypatch, given, outcome, reason):
    told = Told(monkeypatch, frontier, **given)
    found = run_only(SLOT)
    assert (found.outcome, dict(found.metrics), found.slot) == (outcome, {}, SLOT)
    assert (found.scene_version, found.engine_version) == (7, "toy 1.5")
    assert found.reason == reason if reason else found.reason
    assert bool(told.runs) == ("said" not in given)


@pytest.mark.parametrize(
    ("answer", "outcome"),
    [("no answer after 9 s", Outcome.TIMED_OUT), ("the process was killed by SIGSEGV", Outcome.CRASHED)],
)
def test_process_lost_over_a_cell_told_of_that_cell(answer, outcome):
    asked = []
    found = _looked(SLOT, SimpleNamespace(ask=lambda *given: asked.append(given) or answer))
    assert found == Observation(SLOT, "", 0, "", outcome, answer) and asked == [(run_only, SLOT)]
    sound = Observation(SLOT, "c", 1, "1", Outcome.OK)
    assert _looked(SLOT, SimpleNamespace(ask=lambda *given: sound)) is sound


def test_transformed_cell_keeps_the_original_settings(monkeypatch):
    """What a profile makes of another pose is no question to the engine; the motion is measured as if it were none."""
    told = Told(monkeypatch, invariance)
    found = measured(SLOT, "mirrored")
    assert found == {"impulse": (0.5, ""), "ahead": (SCENE.bodies[-1].pose[0], "")} and SCENE.bodies[-1].pose[0] != 0.0
    mirrored = next(each for each in invariance.RELATIONS if each.name == "mirrored").pose(SCENE).scene
    assert mirrored != SCENE and told.refused == [((told, mirrored), "tuned", 1 / 120)]
    sampling = CATALOGUE["head_on"].sampling(SCENE)
    assert told.runs == [(told, mirrored, 1 / 120, {"sweeps": 3, "slop": 0.1}, sampling)]


def test_cell_nudged_by_the_requested_amount(monkeypatch):
    for moves, turns in ((0.0, 0.0), (0.25, 0.0), (0.0, 0.5)):
        told = Told(monkeypatch, invariance)
        measured(SLOT, "again", moves, turns)
        (_, scene, *_), up = told.runs[0], 1.0
        for old, new in zip(SCENE.bodies, scene.bodies, strict=True):
            if old.motion != "free":
                assert new == old
                continue
            shift = (up * moves, up * moves, up * turns)
            assert new.pose == pytest.approx([a + b for a, b in zip(old.pose, shift, strict=True)])
            up = -up
        assert told.refused[0][0][1] == SCENE  # what is refused is the scene, not a billionth of it


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"said": "it knows no restitution"}, "it knows no restitution"),
        ({"finish": "diverged"}, "a speed is no number"),
        ({"raised": EngineError("no room")}, "EngineError: no room"),
        ({"raised": SystemExit(3)}, "SystemExit: 3"),
    ],
)
def test_transformed_cell_without_an_answer_and_its_reason(monkeypatch, given, reason):
    Told(monkeypatch, invariance, **given)
    assert measured(SLOT, "again") == reason


def test_scene_that_cannot_be_transformed_and_its_reason(monkeypatch):
    told = Told(monkeypatch, invariance)
    relation = SimpleNamespace(name="odd", pose=lambda scene: f"{scene.name} has nothing to turn")
    monkeypatch.setattr(invariance, "RELATIONS", (relation,))
    assert measured(SLOT, "odd") == "head_on has nothing to turn"
    assert not told.refused and not told.runs
