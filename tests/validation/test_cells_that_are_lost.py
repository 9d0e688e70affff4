"""The observation of a cell that gave none: all that is known of it without running it, and what was said."""

import pytest

from adapters import registry
from validation.cells import Observation, Outcome, Slot, prepare
from validation.workers import pool

pytest.importorskip("pymunk")

SLOT = Slot("stack", (("n", 2.0),), 2, "chipmunk", "tuned", 1 / 240, 7)


def test_key_versions_and_output_of_a_lost_cell():
    prepared = prepare(SLOT)
    assert pool._lost(SLOT, Outcome.TIMED_OUT, "no answer", "last words") == Observation(
        SLOT, prepared.cell.key(), prepared.scene.version, prepared.cell.engine_version, Outcome.TIMED_OUT, "no answer",
        log="last words",
    )  # fmt: skip
    assert len(prepared.cell.key()) > 8 and prepared.scene.version >= 1


def test_lost_cell_that_cannot_be_prepared(monkeypatch):
    def broken(slot):
        raise RuntimeError("its settings are broken")

    monkeypatch.setattr(pool, "prepare", broken)
    version = registry.find("chipmunk").version
    told = pool._lost(SLOT, Outcome.CRASHED, "it died", "")
    assert version and told == Observation(SLOT, "", 0, version, Outcome.CRASHED, "it died", log="")
