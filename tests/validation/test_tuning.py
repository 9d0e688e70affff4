"""The search finds a setting that is known to be better, keeps nothing that breaks, and names what is needless."""

import pytest

from validation.settings import tuning
from validation.settings.tuning import search

pytest.importorskip("pymunk", reason="pymunk is an optional engine")


@pytest.fixture
def small(monkeypatch):
    """Two touching boxes searched with, one held out."""
    cells = {False: (("stack", {"n": 2.0, "duration": 2.0}),), True: (("stack", {"n": 1.0, "duration": 2.0}),)}
    monkeypatch.setattr(tuning, "cells_of", lambda group, held_out=False: cells[held_out])


def test_scenes_say_what_is_searched_together():
    assert tuning.groups() == ["impact", "stand", "slide"]
    searched, held_out = tuning.cells_of("impact"), tuning.cells_of("impact", held_out=True)
    assert {scene for scene, _ in searched} == {"impact", "bounce"}
    assert searched and held_out and not [cell for cell in held_out if cell in searched]
    with pytest.raises(KeyError):
        tuning.cells_of("everything")


@pytest.mark.long
def test_sweeps_found_by_tuning(small, monkeypatch):
    candidates = {"iterations": (10, 1000), "collision_persistence": (1, 3)}
    monkeypatch.setattr(tuning, "candidates_of", lambda engine: candidates)
    found = search("chipmunk", "default", "stand", dimensions=(2,))
    assert found.changes["iterations"] == 1000
    assert found.after.failing < found.before.failing
    assert found.held_out[1].failing <= found.held_out[0].failing


@pytest.mark.long
def test_setting_that_also_harms_cells(small, monkeypatch):
    monkeypatch.setattr(tuning, "candidates_of", lambda engine: {"iterations": (10, 1000)})
    monkeypatch.setattr(tuning, "_holds", lambda before, after: False)
    assert search("chipmunk", "default", "stand", dimensions=(2,)).changes == {}


def test_tuned_value_no_better_than_shipped_named(small, monkeypatch):
    monkeypatch.setattr(tuning, "candidates_of", lambda engine: {"collision_persistence": (1, 3)})
    found = search("chipmunk", "tuned", "stand", dimensions=(2,))
    assert found.changes == {} and found.needless == {"collision_persistence": 3}
