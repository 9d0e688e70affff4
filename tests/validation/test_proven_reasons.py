"""Reasons that were shown false by switching one setting, and settings that do better than others: measured again."""

import pytest

from adapters.engine_folder import experiments_of
from validation.cells import Slot
from validation.running.plan import QUICK_DT
from validation.settings.proofs import prove
from validation.settings.switching import reading, side_by_side

#: Engine, family and what is asked of it: Chipmunk's slop is proven idle in `tests/reports/test_proving_command.py`.
REASONS = {
    "creep of Bullet near the edge: its residual and too few sweeps, neither alone": (
        "bullet", "incline-residual-creep", {"params": {"ratio": 0.999}, "dimension": 3}, 2
    ),
    "a fast slide of Bullet: points that are dropped, and drag": (
        "bullet", "incline-contact-switching", {"dimension": 3}, 2
    ),
    "a box of MuJoCo that lets go late: the pyramid in the place of the cone": (
        "mujoco", "incline-pyramid-threshold", {"dimension": 3}, 1
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REASONS)
def test_what_a_reason_blames_makes_the_row_fail_and_what_was_blamed_before_does_not(name):
    engine, family, asked, count = REASONS[name]
    pytest.importorskip({"bullet": "pybullet"}.get(engine, engine))
    own = [
        e
        for e in experiments_of(engine)
        if e.family == family
        and all((dict(e.params) if key == "params" else getattr(e, key)) == value for key, value in asked.items())
    ]
    assert len(own) == count
    for proof in prove(engine, own):
        assert proof.holds and proof.idle, proof.why_not


def test_a_wide_margin_mends_the_slide_of_bullet_tuned_and_leaves_its_stack_as_it_is():
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
