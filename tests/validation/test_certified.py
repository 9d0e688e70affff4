"""A run of ours that promises a solution and does not find it is never judged: its certificate makes it INVALID."""

from dataclasses import replace

import pytest

from reference_solver import Settings
from validation.catalogue import CATALOGUE
from validation.cells import Outcome, Slot
from validation.judging.rows import rows_of
from validation.running.execution import execute

COLUMN = Slot("stack", (("n", 10.0),), 2, "reference", "reference", 1 / 60)


def test_a_certified_run_is_judged():
    observation = execute(COLUMN)
    assert observation.outcome is Outcome.OK and observation.certificate["certified"] is True


def profile_with(monkeypatch, **changes):
    """The profile `reference` with other settings than its own."""
    plain = Settings.reference
    monkeypatch.setattr(Settings, "reference", lambda dt: replace(plain(dt), **changes))


def test_an_uncertified_run_has_no_verdict(monkeypatch):
    """Impacts a step late, said to be located."""
    profile_with(monkeypatch, scheme="fixed")
    observation = execute(Slot("bounce", (("e", 0.5),), 2, "reference", "reference", 1 / 60))
    assert observation.outcome is Outcome.INVALID
    assert observation.reason.startswith("certificate: a body's way is not that of its velocity")
    assert observation.metrics  # what it did is kept, to be looked at
    rows = rows_of("run", [observation])
    assert rows and all(row.physics is None for row in rows)


def test_a_run_that_cannot_be_solved_ends_and_says_where(monkeypatch):
    """Out of sweeps after three, a column of ten is far from solved."""
    profile_with(monkeypatch, max_sweeps=3, direct=False)
    observation = execute(COLUMN)
    assert observation.outcome is Outcome.DIVERGED
    assert "no impulses keep bodies 0 and 1 apart" in observation.reason


@pytest.mark.parametrize(("dimension", "refused"), [(2, {"cone"}), (3, set())])
def test_a_box_on_one_1e5_times_lighter_is_right_and_in_the_plane_not_certified(dimension, refused):
    """README lists it: what the certificate refuses there, how far off, and that every check would pass."""
    canonical = CATALOGUE["heavy_on_light"]
    asked = {"ratio": 1e5}
    found = execute(Slot("heavy_on_light", canonical.minimal(asked), dimension, "reference", "reference", 1 / 240))
    assert found.outcome is (Outcome.INVALID if refused else Outcome.OK)
    told = {reason.split(": ")[-1].split()[0] for reason in found.certificate["reasons"] if ": " in reason}
    assert told == refused
    assert all(found.certificate["full"]["findings"][name] < 1e-8 for name in refused)
    checks = canonical.checks(canonical.scene(dimension, asked), 1 / 240)
    assert all(abs(found.metrics[check.metric][0] - check.truth) <= check.bound for check in checks)
