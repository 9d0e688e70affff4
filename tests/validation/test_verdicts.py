"""Verdicts: physics is blind to the engine, standing never changes physics, and nothing is whitewashed."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from validation.canonical import Check
from validation.deviation import Deviation
from validation.findings import Finding, Reason
from validation.verdicts import Physics, Standing, is_marginal, judge, judge_physics

CHECK = Check("m", "1", 1.0, 0.1, "because", "source")
REASON = Reason("r", "a reason", "source", "*", "*", "*", "*")
KNOWN, MARGINAL = Finding("known", REASON), Finding("marginal", REASON)
LAW = Deviation("e", ("p",), "s", "m", lambda scene, dt: (1.5, 0.01), "it does so by design", "its manual")


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_physics_is_the_tolerance_and_nothing_else(value):
    expected = Physics.PASS if math.isfinite(value) and abs(value - 1.0) <= 0.1 else Physics.FAIL
    assert judge_physics(value, CHECK) is expected


@pytest.mark.parametrize(
    ("value", "predictions", "finding", "has_list", "physics", "standing"),
    [
        (1.05, [], None, True, Physics.PASS, None),
        (1.05, [], KNOWN, True, Physics.PASS, Standing.DRIFTED),
        (1.05, [], MARGINAL, True, Physics.PASS, Standing.KNOWN),
        (1.2, [], None, True, Physics.FAIL, Standing.NEW),
        (1.2, [], None, False, Physics.FAIL, None),
        (1.2, [], KNOWN, True, Physics.FAIL, Standing.KNOWN),
        (1.2, [], MARGINAL, True, Physics.FAIL, Standing.KNOWN),
        (1.505, [(LAW, 1.5, 0.01)], None, True, Physics.FAIL, Standing.EXPLAINED),
        (1.505, [(LAW, 1.5, 0.01)], KNOWN, True, Physics.FAIL, Standing.EXPLAINED),
        (1.6, [(LAW, 1.5, 0.01)], None, True, Physics.FAIL, Standing.DRIFTED),
        (1.6, [(LAW, 1.5, 0.01)], KNOWN, True, Physics.FAIL, Standing.KNOWN),
        (math.nan, [(LAW, 1.5, 0.01)], None, True, Physics.FAIL, Standing.DRIFTED),
        (None, [], KNOWN, True, None, None),
    ],
)
def test_standing_of_a_row(value, predictions, finding, has_list, physics, standing):
    verdict = judge(value, CHECK, predictions, finding, has_list)
    assert (verdict.physics, verdict.standing) == (physics, standing)
    if standing is not None:
        assert verdict.reason


def test_a_law_never_turns_a_fail_into_a_pass():
    wide = [(LAW, 1.5, 1e9)]
    assert judge(2.0, CHECK, wide, None, True).physics is Physics.FAIL


def test_marginal_is_within_a_factor_of_two_of_the_tolerance():
    assert [is_marginal(1.0 + x, CHECK) for x in (0.04, 0.06, 0.19, 0.21)] == [False, True, True, False]


def test_what_has_no_truth_is_not_judged():
    assert judge(3.0, Check("m", "1", None, None, "shown only", ""), [], None, True).physics is None
