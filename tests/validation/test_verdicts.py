"""Verdicts: physics is blind to the engine, standing never changes physics, and nothing is whitewashed."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from validation.canonical import Check
from validation.deviation import Deviation
from validation.findings import Family, Finding, Known
from validation.verdicts import Physics, Standing, is_marginal, judge, judge_divergence, judge_physics

CHECK = Check("m", "1", 1.0, 0.1, "because", "source")
FAMILY = Family("f", ("p",), "s", ("m",), "a reason", "source", ">=0")
LAW = Deviation("e", ("p",), "s", "m", lambda scene, dt: (1.5, 0.01), "it does so by design", "its manual")
LAWFUL = [(LAW, 1.5, 0.01)]
#: What may be known of a row: nothing (listed engine or not), a failing value, one whose band reaches into the
#: tolerance, no value, no finite numbers.
NEW, UNLISTED = Known(None, True), Known(None, False, "the engine has no list")
FAILS = Known(Finding(FAMILY, 1.2, 0.02), True)
MARGINAL = Known(Finding(FAMILY, 1.11, 0.03), True)
NO_VALUE = Known(Finding(FAMILY, None), True)
EXPLODES = Known(Finding(FAMILY, None, diverged=True), True)


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_physics_is_the_tolerance_and_nothing_else(value):
    expected = Physics.PASS if math.isfinite(value) and abs(value - 1.0) <= 0.1 else Physics.FAIL
    assert judge_physics(value, CHECK) is expected


@pytest.mark.parametrize(
    ("value", "predictions", "known", "physics", "standing"),
    [
        (1.05, [], NEW, Physics.PASS, None),
        (1.05, LAWFUL, NEW, Physics.PASS, None),
        (1.05, [], FAILS, Physics.PASS, Standing.DRIFTED),
        (1.09, [], MARGINAL, Physics.PASS, Standing.KNOWN),
        (1.05, [], MARGINAL, Physics.PASS, Standing.DRIFTED),
        (1.2, [], NEW, Physics.FAIL, Standing.NEW),
        (1.2, [], UNLISTED, Physics.FAIL, None),
        (1.21, [], FAILS, Physics.FAIL, Standing.KNOWN),
        (1.23, [], FAILS, Physics.FAIL, Standing.DRIFTED),
        (1.17, [], FAILS, Physics.FAIL, Standing.DRIFTED),
        (1.12, [], MARGINAL, Physics.FAIL, Standing.KNOWN),
        (1.505, LAWFUL, NEW, Physics.FAIL, Standing.EXPLAINED),
        (1.505, LAWFUL, FAILS, Physics.FAIL, Standing.EXPLAINED),
        (1.6, LAWFUL, NEW, Physics.FAIL, Standing.DRIFTED),
        (1.2, LAWFUL, FAILS, Physics.FAIL, Standing.DRIFTED),  # a law is not excused by a list
        (math.nan, LAWFUL, NEW, Physics.FAIL, Standing.DRIFTED),
        (math.nan, [], FAILS, Physics.FAIL, Standing.DRIFTED),
        (None, [], NEW, None, Standing.NEW),
        (None, [], UNLISTED, None, None),
        (None, [], NO_VALUE, None, Standing.KNOWN),
        (None, [], FAILS, None, Standing.DRIFTED),
        (None, [], EXPLODES, None, Standing.DRIFTED),
        (1.05, [], NO_VALUE, Physics.PASS, Standing.DRIFTED),
        (1.2, [], NO_VALUE, Physics.FAIL, Standing.DRIFTED),
    ],
)
def test_standing_of_a_row(value, predictions, known, physics, standing):
    verdict = judge(value, CHECK, predictions, known)
    assert (verdict.physics, verdict.standing) == (physics, standing)
    if standing is not None:
        assert verdict.reason


@pytest.mark.parametrize(
    ("known", "standing"),
    [(NEW, Standing.NEW), (UNLISTED, None), (EXPLODES, Standing.KNOWN), (FAILS, Standing.DRIFTED),
     (NO_VALUE, Standing.DRIFTED)],
)  # fmt: skip
def test_a_divergence_is_a_fail_and_known_only_if_listed_as_one(known, standing):
    verdict = judge_divergence(known, "the state is not finite")
    assert (verdict.physics, verdict.standing) == (Physics.FAIL, standing)
    assert "the state is not finite" in verdict.reason


def test_why_there_is_no_value_is_said():
    assert "there is no apex" in judge(None, CHECK, (), NEW, "there is no apex").reason


def test_a_law_never_turns_a_fail_into_a_pass():
    wide = [(LAW, 1.5, 1e9)]
    assert judge(2.0, CHECK, wide, NEW).physics is Physics.FAIL


def test_marginal_is_within_a_factor_of_two_of_the_tolerance():
    assert [is_marginal(1.0 + x, CHECK) for x in (0.04, 0.06, 0.19, 0.21)] == [False, True, True, False]


@pytest.mark.parametrize("check", [Check("m", "1", None, 1.0, "shown", ""), Check("m", "1", 1.0, None, "shown", "")])
@pytest.mark.parametrize("value", [3.0, None])
def test_what_has_no_truth_or_no_bound_is_shown_and_not_judged(check, value):
    verdict = judge(value, check, (), NEW)
    assert (verdict.physics, verdict.standing) == (None, None)
