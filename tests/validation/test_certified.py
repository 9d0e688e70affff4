"""A run of ours that promises a solution and does not find it is never judged: its certificate makes it INVALID."""

from dataclasses import replace

import pytest

from reference_solver import Settings
from validation.cells import Outcome, Slot
from validation.execution import execute
from validation.rows import rows_of

COLUMN = Slot("stack", (("n", 10.0),), 2, "reference", "reference", 1 / 60)


def test_a_certified_run_is_judged():
    observation = execute(COLUMN)
    assert observation.outcome is Outcome.OK and observation.certificate["certified"] is True


@pytest.fixture
def starved(monkeypatch):
    """The profile as it is, but out of sweeps after three: a column of ten is then far from solved."""
    plain = Settings.reference

    def few(dt):
        return replace(plain(dt), max_sweeps=3, direct=False)

    monkeypatch.setattr(Settings, "reference", few)


def test_an_uncertified_run_has_no_verdict(starved):
    observation = execute(COLUMN)
    assert observation.outcome is Outcome.INVALID
    assert observation.reason.startswith("certificate: contact equations unsolved")
    assert observation.metrics  # what it did is kept, to be looked at
    rows = rows_of("run", [observation])
    assert rows and all(row.physics is None for row in rows)
