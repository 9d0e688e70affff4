"""certify prints every gate beside its measurement, and fails with one that does not hold."""

import json

import pytest
from click.testing import CliRunner

from reference_solver.certification import Gate, event_driven
from reports.command import main


@pytest.mark.parametrize(("measured", "exit_code"), [(1e-13, 0), (1e-11, 1)])
def test_a_gate_that_does_not_hold_fails_the_command(monkeypatch, measured, exit_code):
    gate = Gate.at_most("rest time", "e = 0.8", measured, 1e-12, "oracle")
    monkeypatch.setattr(event_driven, "gates", lambda: iter([gate]))
    result = CliRunner().invoke(main, ["certify", "--json"])
    assert result.exit_code == exit_code
    (row,) = json.loads(result.stdout)
    assert row == {
        "quantity": "rest time", "case": "e = 0.8", "measured": measured, "gate": 1e-12,
        "made_by": "oracle", "holds": exit_code == 0,
    }  # fmt: skip
    assert ("holds" if exit_code == 0 else "FAILS") in result.stderr
