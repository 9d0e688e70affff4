"""certify prints every gate beside its measurement, and fails with one that does not hold."""

import json
import math

import pytest
from click.testing import CliRunner

from reference_solver.certification import Gate, rotation
from reference_solver.certification.orders import RATES, Order
from reports.command import certifying, main


def certify(monkeypatch, *gates, flags=("--json",)):
    """Run the command with these gates in the place of all parts."""
    monkeypatch.setattr(certifying, "PARTS", ("one",))
    monkeypatch.setattr(certifying, "side_by_side", lambda measure, parts, console: {"one": list(gates)})
    return CliRunner().invoke(main, ["certify", *flags])


@pytest.mark.parametrize(("measured", "exit_code"), [(1e-13, 0), (1e-11, 1)])
def test_a_gate_that_does_not_hold_fails_the_command(monkeypatch, measured, exit_code):
    result = certify(monkeypatch, Gate.at_most("rest time", "e = 0.8", measured, 1e-12, "oracle"))
    assert result.exit_code == exit_code
    (row,) = json.loads(result.stdout)
    assert row == {
        "quantity": "rest time", "case": "e = 0.8", "measured": measured, "gate": 1e-12,
        "made_by": "oracle", "holds": exit_code == 0,
    }  # fmt: skip
    assert ("holds" if exit_code == 0 else "FAILS") in result.stderr


def test_what_is_not_a_number_is_null_and_fails(monkeypatch):
    result = certify(monkeypatch, Gate.at_most("rest time", "", math.nan, 1e-12, "oracle"))
    assert result.exit_code == 1
    assert json.loads(result.stdout)[0]["measured"] is None


def test_a_part_that_breaks_is_a_gate_that_does_not_hold(monkeypatch):
    def gates():
        yield Gate.at_least("order", "", 2.0, 1.9, "classical")
        raise RuntimeError("no answer")

    monkeypatch.setattr(rotation, "gates", gates)
    kept, broken = certifying.measured("rotation")
    assert kept.holds and not broken.holds
    assert "no answer" in broken.case


def test_parts_run_in_processes_and_come_back_by_name():
    from rich.console import Console

    assert certifying.side_by_side(len, ("a", "bc", "def"), Console(stderr=True)) == {"a": 1, "bc": 2, "def": 3}


def test_orders_are_shown_beside_their_errors(monkeypatch):
    rows = [
        Order("bounce [m]", "classical, planar", RATES, (0.05, 0.025, 0.0125, 0.00625, 0.003125), 1.0),
        Order("flight", "reference, planar", RATES, (0.0,) * 5, None),
    ]
    monkeypatch.setattr(certifying, "orders", lambda: iter(rows))
    result = CliRunner().invoke(main, ["certify", "--order", "--json"])
    assert result.exit_code == 0
    assert [row["order"] for row in json.loads(result.stdout)] == [1.0, None]
    for shown in ("round-off", "bounce [m]", "0.05", "0.00313"):
        assert shown in result.stderr
