"""`make certify` prints every gate beside its measurement, and fails with one that does not hold."""

import json
import math
import re

import pytest
from click.testing import CliRunner

from tests.verification import certify as command
from tests.verification import rotation
from tests.verification.gate import Gate
from tests.verification.orders import RATES, Order
from tests.verification.self_test import JUDGED, SIZES, Corruption, Trial


def certify(monkeypatch, *gates, flags=("--json",)):
    """Run the command with these gates in the place of all parts."""
    monkeypatch.setattr(command, "PARTS", ("one",))
    monkeypatch.setattr(command, "side_by_side", lambda measure, parts, console: {"one": list(gates)})
    return CliRunner().invoke(command.certify, flags)


@pytest.mark.parametrize(("measured", "exit_code"), [(1e-13, 0), (1e-11, 1)])
def test_command_fails_with_a_failed_gate(monkeypatch, measured, exit_code):
    result = certify(monkeypatch, Gate.at_most("rest time", "e = 0.8", measured, 1e-12, "oracle"))
    assert result.exit_code == exit_code
    (row,) = json.loads(result.stdout)
    assert row == {
        "quantity": "rest time", "case": "e = 0.8", "measured": measured, "gate": 1e-12,
        "made_by": "oracle", "holds": exit_code == 0,
    }  # fmt: skip
    assert ("holds" if exit_code == 0 else "FAILS") in result.stderr


def test_nan_as_null_and_a_failure(monkeypatch):
    result = certify(monkeypatch, Gate.at_most("rest time", "", math.nan, 1e-12, "oracle"))
    assert result.exit_code == 1
    assert json.loads(result.stdout)[0]["measured"] is None


def test_exception_in_a_part_as_a_failed_gate(monkeypatch):
    def gates():
        yield Gate.at_least("order", "", 2.0, 1.9, "classical")
        raise RuntimeError("no answer")

    monkeypatch.setattr(rotation, "gates", gates)
    kept, broken = command.measured("rotation")
    assert kept.holds and not broken.holds
    assert "no answer" in broken.case


def test_parts_of_two_processes_by_name():
    from rich.console import Console

    assert command.side_by_side(len, ("a", "bc", "def"), Console(stderr=True)) == {"a": 1, "bc": 2, "def": 3}


def test_orders_are_shown_beside_their_errors(monkeypatch):
    rows = [
        Order("bounce [m]", "classical, planar", RATES, (0.05, 0.025, 0.0125, 0.00625, 0.003125), 1.0),
        Order("flight", "reference, planar", RATES, (0.0,) * 5, None),
    ]
    monkeypatch.setattr(command, "orders", lambda: iter(rows))
    result = CliRunner().invoke(command.certify, ["--order", "--json"])
    assert result.exit_code == 0
    assert [row["order"] for row in json.loads(result.stdout)] == [1.0, None]
    title, *lines = result.stderr.splitlines()
    assert title.strip() == f"Orders, largest error of {command.PHASES} phases"
    told = [[word.strip() for word in re.split("[\u2502\u2503]", line)[1:-1]] for line in lines]
    assert [row for row in told if row] == [
        ["case", "made by", "order", f"at 1/{RATES[0]} s", f"at 1/{RATES[-1]} s"],
        ["bounce [m]", "classical, planar", "1.00", "0.05", "0.00313"],
        ["flight", "reference, planar", "round-off", "0", "0"],
    ]
    assert CliRunner().invoke(command.certify, ["--order"]).stdout == ""  # no data where none is asked for


def planted(monkeypatch, missed, flags):
    """Run the self-test with two corruptions of twenty sizes each; ``missed`` are those that nothing sees."""
    law = Corruption("law", "friction", "block", lambda *given: given, "no check asks for it")
    motion = Corruption("motion", "a place", "ball", lambda *given: given)
    made = [Trial(law, size, () if ("friction", size) in missed else ("coulomb", "energy")) for size in SIZES]
    made += [Trial(motion, size, () if ("a place", size) in missed else ("gap",)) for size in SIZES]
    monkeypatch.setattr(command, "trials", lambda: iter(made))
    return CliRunner().invoke(command.certify, ["--self-test", *flags])


def test_self_test_detections_by_corruption_and_size(monkeypatch):
    result = planted(monkeypatch, {("friction", SIZES[0])}, ["--json"])
    rows = json.loads(result.stdout)
    assert result.exit_code == 0 and len(rows) == 2 * len(SIZES)
    assert rows[0] == {
        "family": "law", "corruption": "friction", "scene": "block", "size": SIZES[0], "caught": False, "by": [],
    }  # fmt: skip
    assert [row["caught"] for row in rows] == [False] + [True] * (2 * len(SIZES) - 1)
    assert rows[1]["by"] == ["coulomb", "energy"] and rows[-1]["size"] == SIZES[-1]
    cells = [[cell.strip() for cell in re.split("[│┃|]", line)[1:-1]] for line in result.stderr.splitlines()]
    (first,), (second,) = ([row for row in cells if row and row[0] == name] for name in ("law", "motion"))
    assert first == ["law", "friction", "block", "MISSED", *["coulomb"] * (len(SIZES) - 1), "no check asks for it"]
    assert second == ["motion", "a place", "ball", *["gap"] * len(SIZES), ""]
    assert f"2 of 2 noticed at size {JUDGED:g}, 100% required" in result.stderr and "missed:" not in result.stderr


def test_failed_self_test_below_its_share(monkeypatch):
    result = planted(monkeypatch, {("friction", JUDGED)}, [])
    assert result.exit_code == 1 and result.stdout == ""
    assert f"1 of 2 noticed at size {JUDGED:g}, 100% required" in result.stderr
    assert "missed: friction, block: no check asks for it" in result.stderr
