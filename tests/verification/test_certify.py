"""`make certify` prints every gate beside its measurement, and fails with one that does not hold."""

import json
import math
import re

import pytest
from click.testing import CliRunner

from tests.verification import certify as command
from tests.verification import piles, rotation
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


@pytest.mark.parametrize(
    ("seed", "fall", "broken"),
    [
        (2, piles.Fall((), 1e-5, 0.0), set()),
        (2, piles.Fall((), 1e-3, 0.0), {"pile: overlap, of a half width"}),
        (2, piles.Fall((), 1e-5, 1e-9), {"pile: energy gained, of all"}),
        # one pile of seventeen is more than the twentieth that may be refused
        (
            3,
            piles.Fall(("a gap is missed",), 1e-5, 0.0),
            {"pile: laws broken, overlap apart", "share of piles whose certificate does not hold"},
        ),
    ],
    ids=("all hold", "overlap", "energy", "law"),
)
def test_piles_are_measured_one_by_one_and_judged_by_kind(monkeypatch, seed, fall, broken):
    spoilt, asked = f"pile of 50 boxes, seed {seed}", []

    def at_once(measure, runs, console):
        asked.extend(runs)
        return {run: fall if run == spoilt else piles.Fall((), 1e-6, 0.0) for run in runs}

    monkeypatch.setattr(command, "PARTS", ("piles",))
    monkeypatch.setattr(command, "side_by_side", at_once)
    result = CliRunner().invoke(command.certify, ["--json"])
    rows = json.loads(result.stdout)
    assert sorted(asked) == sorted(piles.PILES)
    assert len(asked) == sum(len(kind.seeds) for kind in piles.KINDS.values())
    assert {row["quantity"] for row in rows if not row["holds"]} == broken
    assert all("50 boxes" in row["case"] or "17 piles" in row["case"] for row in rows if not row["holds"])
    assert result.exit_code == (1 if broken else 0)


def test_broken_pile_fails_its_promise(monkeypatch):
    def fall(model):
        raise RuntimeError("no answer")

    monkeypatch.setattr(piles, "fall", fall)
    monkeypatch.setattr(piles, "fall_of", piles.fall_of.__wrapped__)  # others keep what they have measured
    fallen = command.measured("pile of 50 boxes, seed 1")
    assert "no answer" in fallen.reasons[0]
    rows = list(piles.gates(lambda pile: fallen))
    told = {row.case for row in rows if "could not be measured" in row.quantity}
    assert told == {f"{pile}: RuntimeError('no answer')" for pile in piles.PILES}
    assert len(rows) == 3 * len(piles.KINDS) + 1 + len(piles.PILES)
    assert not any(row.holds for row in rows)


def test_parts_run_in_processes_and_come_back_by_name():
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
    assert f"2 of 2 noticed at size {JUDGED:g}, 95% required" in result.stderr and "missed:" not in result.stderr


def test_self_test_fails_below_the_detection_limit(monkeypatch):
    result = planted(monkeypatch, {("friction", JUDGED)}, [])
    assert result.exit_code == 1 and result.stdout == ""
    assert f"1 of 2 noticed at size {JUDGED:g}, 95% required" in result.stderr
    assert "missed: friction, block: no check asks for it" in result.stderr
