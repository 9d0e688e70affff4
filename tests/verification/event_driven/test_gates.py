"""Every gate that the oracle answers for holds; the rod gas is the longest of them."""

import pytest

from tests.verification.event_driven import gates
from tests.verification.gate import Gate

PARTS = (
    "bounce",
    "elastic_bounces",
    "galperin",
    "closing_wall",
    "billiard",
    "two_bodies",
    "ball_on_ball",
    "chain",
    "cradle",
    "collapse",
    "painleve",
    "kane",
    "slide_to_roll",
    pytest.param("rod_gas", marks=pytest.mark.long),  # half a minute of CPU; `make certify` measures it
)


@pytest.mark.few(4)
@pytest.mark.parametrize("part", PARTS)
def test_gate_holds(part):
    rows = list(getattr(gates, part)())
    assert rows
    assert [row for row in rows if not row.holds] == []


def test_gates_of_no_number():
    assert not Gate.at_most("", "", float("nan"), 1.0, "").holds
    assert not Gate.at_most("", "", -2.0, 1.0, "").holds
    assert not Gate.exactly("", "", 3140, 3141, "").holds
