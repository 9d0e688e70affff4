"""Scores that are kept: what was not killed is listed, so that a number entered by hand does not go unseen."""

import importlib
import sys
from pathlib import Path

import pytest


@pytest.fixture
def lists(monkeypatch):
    """What reads and writes the scores."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    kept = set(sys.modules)
    yield importlib.import_module("lists")
    for name in set(sys.modules) - kept:
        if name in ("lists", "drawn", "subjects"):
            del sys.modules[name]


def test_of_every_module_as_many_survivors_are_listed_as_its_mutants_were_not_killed(lists):
    """What only a time limit ended is listed as well, and counts as killed."""
    living = [lists.module_of(function) for (function, _), why in lists.listed().items() if why != lists.TIMED]
    scores = lists.stored()
    assert scores and set(living) <= set(scores)
    # What is asked of the harness: nine of ten mutants of all that are run are noticed.
    assert sum(score.killed for score in scores.values()) >= 0.9 * sum(score.mutants for score in scores.values())
    told = {module: score.mutants - score.killed for module, score in scores.items()}
    assert told == {module: living.count(module) for module in scores}
