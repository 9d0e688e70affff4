"""Cells of the quick suite that are posed to the loop pass their checks, with a certificate."""

import pytest
from suites import cells, pose

from validation.judging.rows import rows_of
from validation.running.execution import execute


@pytest.mark.parametrize("only", ["impact 2-D e=0.5  1/", "hilltop 2-D  ", "slide 3-D  ", "wedge 2-D  "])
def test_cell_posed_to_the_loop(only, monkeypatch):
    pose(monkeypatch.setattr)
    ((_, slot),) = cells("quick", only)
    found = execute(slot)
    assert found.certificate["certified"], found.certificate["reasons"]
    rows = rows_of("", [found])
    assert rows and all(row.physics == "pass" for row in rows)


def test_overlap_posed_to_the_loop(monkeypatch):
    """It is refused in a sentence, as an engine refuses."""
    pose(monkeypatch.setattr)
    for _, slot in cells("quick", "position_correction 2-D"):
        found = execute(slot)
        assert found.outcome.name in ("REFUSED", "UNSUPPORTED") and "overlap" in found.reason
