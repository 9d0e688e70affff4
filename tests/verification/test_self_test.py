"""How many planted corruptions must be caught: all."""

import io

import pytest
from rich.console import Console

from tests.verification import certify as command
from tests.verification.self_test import JUDGED, SIZES, Corruption, Trial


@pytest.mark.parametrize(("missed", "status"), [(0, 0), (1, 1), (20, 1)])
def test_share_of_exactly_the_promised_amount(monkeypatch, missed, status):
    planted = [Corruption("law", f"c{k}", "block", lambda *given: given) for k in range(20)]
    made = [Trial(each, size, ("gap",) if k >= missed else ()) for k, each in enumerate(planted) for size in SIZES]
    monkeypatch.setattr(command, "trials", lambda: iter(made))
    out = io.StringIO()
    assert command.show_self_test(Console(file=out, width=160), False) == status
    assert f"{20 - missed} of 20 noticed at size {JUDGED:g}, 100% required" in out.getvalue()
