"""Predictions asked side by side are those that are asked one after the other, whatever happens to the processes."""

import os

import pytest

from adapters.engine import EngineError
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot
from validation.judging import predicting, rows
from validation.judging.predicting import foretold, predictions
from validation.judging.rows import rows_of

METRICS = ("rebound_ratio", "rebound_speed", "velocity_change", "impulse")
#: Drops at several speeds, wrong by far in all that laws speak about.
SEEN = [
    Observation(
        Slot("impact", (("v", v),), 2, "mujoco", "default", 1 / 240), f"cell{k}", 1, "4.0.1", Outcome.OK, "",
        dict.fromkeys(METRICS, (1e9, "")), "5ta7e", 480, 0.25,
    )
    for k, v in enumerate((1.0, 2.0, 3.0))
]  # fmt: skip
ASKED = [(o.slot, o.engine_version, metric) for o in SEEN for metric in METRICS]


def scene_of(slot):
    return CATALOGUE[slot.scene].scene(slot.dimension, dict(slot.params))


def dies(asked):
    os._exit(3)


@pytest.fixture
def few(monkeypatch):
    """Every count of rows is worth its processes, and a task has five of them: one that all tasks but one fill."""
    monkeypatch.setattr(predicting, "MANY", 1)
    monkeypatch.setattr(predicting, "TOGETHER", 5)


def test_laws_in_parallel_processes_agree(few):
    found = foretold(ASKED, 2)
    assert list(found) == ASKED
    for (slot, *row), said in found.items():
        assert len(said) == 1 and said == predictions(slot, *row, scene_of(slot))
    assert len({said[0][1] for said in found.values()}) > len(METRICS)  # no two rows were taken for each other


def test_few_rows_predicted_on_demand():
    assert len(ASKED) < predicting.MANY and foretold(ASKED) == {}


def test_rows_judged_by_predictions_made_before(few, monkeypatch):
    alone = rows_of("run", SEEN)

    def not_here(*row):
        raise AssertionError("asked a second time")

    monkeypatch.setattr(rows, "predictions", not_here)
    assert rows_of("run", SEEN) == alone
    assert {row.standing for row in alone if row.metric in METRICS} == {"drifted"}


def test_rows_of_dead_processes_computed_here(few, monkeypatch):
    alone = rows_of("run", SEEN)
    monkeypatch.setattr(predicting, "_said", dies)
    assert foretold(ASKED, 2) == {}
    assert rows_of("run", SEEN) == alone


def test_unreadable_laws_told_where_they_are_missing(monkeypatch):
    def gone(*row):
        raise EngineError("mujoco: its laws cannot be loaded: no such file")

    monkeypatch.setattr(predicting, "covering", gone)
    assert predicting._said(ASKED[:2]) == [None, None]
