"""Reasons that were shown false by switching one setting, and settings that do better than others: measured again."""

import pytest

from validation.cells import Slot
from validation.running.plan import QUICK_DT
from validation.settings.proofs import experiments_on, prove
from validation.settings.switching import reading, side_by_side


def test_causes_of_a_fast_bullet_slide():
    """The others of these reasons are proven by the command (`tests/reports/test_proving_command.py`)."""
    pytest.importorskip("pybullet")
    own = [e for e in experiments_on("bullet") if e.family == "incline-contact-switching"]
    assert len(own) == 2
    for proof in prove("bullet", own):
        assert proof.holds and proof.idle, proof.why_not


def test_wide_margin_for_bullet_slide_and_stack_tuned():
    """g (sin - mu cos) at 45 degrees and mu = 1/2; of a stack, whose points do not drift, no bit is another."""
    pytest.importorskip("pybullet")
    slide = Slot("incline", (("ratio", 2.0),), 3, "bullet", "tuned", QUICK_DT)
    own, narrow, shipped = side_by_side(
        slide, [{"contactBreakingThreshold": 0.001}, {"contactBreakingThreshold": 0.02}]
    )
    for found in (own, narrow):
        assert reading(found, "acceleration").value == pytest.approx(9.81 / 2.0**1.5, rel=1e-6)
        assert reading(found, "acceleration").badness <= 1.0
    assert reading(shipped, "acceleration").value == pytest.approx(3.46526, abs=1e-5)
    assert reading(shipped, "acceleration").badness > 1.0
    stack = Slot("stack", (("n", 10.0),), 3, "bullet", "tuned", QUICK_DT)
    own, *others = side_by_side(stack, [{"contactBreakingThreshold": x} for x in (0.001, 0.02)])
    assert own.state_hash and {found.state_hash for found in others} == {own.state_hash}
