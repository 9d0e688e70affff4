"""Verdicts: physics is blind to the engine, standing never changes physics, and nothing is whitewashed."""

import math
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.law import Deviation
from validation.canonical import Check
from validation.findings import Family, Finding, Known
from validation.judging.verdicts import (
    Physics,
    Standing,
    is_marginal,
    judge,
    judge_divergence,
    judge_physics,
    predicted,
)

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
def test_physics_verdict_by_the_tolerance_alone(value):
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
def test_verdict_of_a_divergence(known, standing):
    verdict = judge_divergence(known, "the state is not finite")
    assert (verdict.physics, verdict.standing) == (Physics.FAIL, standing)
    assert "the state is not finite" in verdict.reason


def test_reason_of_a_missing_value():
    assert "there is no apex" in judge(None, CHECK, (), NEW, "there is no apex").reason


def test_fail_explained_by_a_law():
    wide = [(LAW, 1.5, 1e9)]
    assert judge(2.0, CHECK, wide, NEW).physics is Physics.FAIL


def test_range_of_marginal():
    assert [is_marginal(1.0 + x, CHECK) for x in (0.04, 0.06, 0.19, 0.21)] == [False, True, True, False]


@pytest.mark.parametrize("check", [Check("m", "1", None, 1.0, "shown", ""), Check("m", "1", 1.0, None, "shown", "")])
@pytest.mark.parametrize("value", [3.0, None])
def test_rows_without_truth_or_bound_shown_and_not_judged(check, value):
    verdict = judge(value, check, (), NEW)
    assert (verdict.physics, verdict.standing) == (None, None)


@pytest.mark.parametrize("check", [Check("m", "1", None, 1.0, "shown", ""), Check("m", "1", 1.0, None, "shown", "")])
def test_row_without_truth_or_bound_not_judged(check):
    assert judge_physics(1.0, check) is None
    assert is_marginal(1.5, check) is False


# ---- edges: numbers that are exact in binary, so that equality is meant --------------------------------------------

EDGE = Check("m", "1", 1.0, 0.125, "because", "source")


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_tolerance_itself_passes(side):
    assert judge_physics(1.0 + side * 0.125, EDGE) is Physics.PASS
    assert judge_physics(1.0 + side * math.nextafter(0.125, 1.0) * (1 + 2**-40), EDGE) is Physics.FAIL


@pytest.mark.parametrize(("off", "marginal"), [(0.0625, True), (0.25, True), (0.0624, False), (0.2501, False)])
def test_edges_of_marginal(off, marginal):
    assert is_marginal(1.0 + off, EDGE) is marginal
    assert is_marginal(1.0 - off, EDGE) is marginal


@pytest.mark.parametrize(("value", "standing"), [(1.75, Standing.EXPLAINED), (1.7501, Standing.DRIFTED)])
def test_edge_of_a_law_s_band(value, standing):
    assert judge(value, EDGE, [(LAW, 1.5, 0.25)], NEW).standing is standing


@pytest.mark.parametrize(("value", "standing"), [(1.3125, Standing.KNOWN), (1.3126, Standing.DRIFTED)])
def test_edge_of_a_finding_s_band(value, standing):
    assert judge(value, EDGE, [], Known(Finding(FAMILY, 1.25, 0.0625), True)).standing is standing


# ---- what a reader is told -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "predictions", "known", "said"),
    [
        (1.505, LAWFUL, NEW, "it does so by design (predicted 1.5 +- 0.01)"),
        (1.6, LAWFUL, NEW, "outside the band of its contact law, 1.5 +- 0.01: it does so by design"),
        (1.2, [], NEW, "not on record, and no contact law predicts it"),
        (
            1.2,
            [],
            Known(None, True, "another release"),
            "not on record, and no contact law predicts it; another release",
        ),
        (1.2, [], UNLISTED, "the engine has no list"),
        (1.21, [], FAILS, "a reason"),
        (1.23, [], FAILS, "on record with 1.2 +- 0.02: a reason"),
        (1.05, [], FAILS, "passes, but on record with 1.2 +- 0.02: a reason"),
        (1.09, [], MARGINAL, "passes within the band of the known failure: a reason"),
        (1.12, [], MARGINAL, "a reason"),
        (1.2, [], NO_VALUE, "on record as having no value: a reason"),
        (1.2, [], EXPLODES, "on record as diverging: a reason"),
        (1.05, [], NO_VALUE, "passes, but on record as having no value: a reason"),
        (1.05, [], NEW, ""),
        (None, [], NEW, "has no value; not on record"),
        (None, [], UNLISTED, "the engine has no list"),
        (None, [], NO_VALUE, "a reason"),
        (None, [], FAILS, "has no value now; on record with 1.2 +- 0.02: a reason"),
        (None, [], EXPLODES, "has no value now; on record as diverging: a reason"),
    ],
)
def test_the_reason_of_a_standing_in_full(value, predictions, known, said):
    assert judge(value, CHECK, predictions, known).reason == said


def test_reasons_of_a_missing_value_in_order():
    verdict = judge(None, CHECK, (), NEW, "there is no apex")
    assert verdict.reason == "has no value; not on record; there is no apex"


@pytest.mark.parametrize(
    ("known", "said"),
    [
        (NEW, "it blew up"),
        (UNLISTED, "it blew up; the engine has no list"),
        (EXPLODES, "it blew up; a reason"),
        (FAILS, "it blew up; on record with 1.2 +- 0.02: a reason"),
        (NO_VALUE, "it blew up; on record as having no value: a reason"),
    ],
)
def test_the_reason_of_a_divergence_in_full(known, said):
    assert judge_divergence(known, "it blew up").reason == said


def test_row_explained_by_any_of_several_laws():
    other = Deviation("e", ("p",), "s", "m", lambda scene, dt, measure: (2.0, 0.1), "another mechanism", "its manual")
    both = [*LAWFUL, (other, 2.0, 0.1)]
    assert judge(2.05, CHECK, both, NEW).reason == "another mechanism (predicted 2 +- 0.1)"
    said = judge(3.0, CHECK, both, NEW).reason
    assert said == "outside the band of its contact law, 1.5 +- 0.01: it does so by design"


def test_laws_asked_with_scene_and_step():
    asked = []

    def law(scene, dt, measure):
        asked.append((scene, dt, measure))
        return (dt, 0.5)

    speaks = Deviation("e", ("p",), "s", "m", law, "because", "source")
    silent = Deviation("e", ("p",), "s", "m", lambda scene, dt, measure: None, "because", "source")
    assert predicted([silent, speaks], "the scene", SimpleNamespace(dt=0.25, iterations=None), "its measure") == [
        (speaks, 0.25, 0.5)
    ]
    assert asked == [("the scene", 0.25, "its measure")]


def test_law_prediction_at_requested_iterations():
    def asked(scene, dt, measure, iterations):
        return float(iterations), 0.1

    law = Deviation("e", ("p",), "s", "m", lambda scene, dt, measure: (1.0, 0.1), "because", "source", (), asked)
    assert predicted([law], "the scene", SimpleNamespace(dt=0.25, iterations=7), "its measure") == [(law, 7.0, 0.1)]
    assert predicted([law], "the scene", SimpleNamespace(dt=0.25, iterations=None), "its measure") == [(law, 1.0, 0.1)]
