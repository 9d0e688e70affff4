"""Observed order and extrapolation: known sequences get their order, limit and verdict, and nothing else does."""

import math
from dataclasses import replace

import numpy as np
import pytest

from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot
from validation.questions import convergence as questions
from validation.questions.convergence import (
    Limit,
    convergence,
    declared_errors,
    extrapolations,
    limit_of,
    observed_order,
    richardson,
)
from validation.scenes.parts import PHASES

DTS = tuple(1.0 / rate for rate in (60.0, 120.0, 240.0, 480.0, 960.0))


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, 4.0])
def test_order_of_a_power_of_the_step(order):
    fit = observed_order(DTS, [0.3 * dt**order for dt in DTS])
    assert fit.order == pytest.approx(order, abs=1e-12)  # a line through exact powers: round-off of logarithms
    assert fit.standard_error < 1e-12
    assert limit_of(DTS, [0.3 * dt**order for dt in DTS])[1] is Limit.TRUTH


def test_standard_error_of_noisy_orders():
    """Least squares of log-normal scatter: the slope lies within two standard errors in about 95 % of tries."""
    rng, inside = np.random.default_rng(5), 0
    for _ in range(400):
        fit = observed_order(DTS, [dt * math.exp(rng.normal(0.0, 0.2)) for dt in DTS])
        inside += abs(fit.order - 1.0) <= 2.0 * fit.standard_error
    # Three degrees of freedom: Student's t gives 86 % within two standard errors; four sd of 400 tries are 7 %.
    assert 0.79 < inside / 400 < 0.93


@pytest.mark.parametrize(
    ("errors", "limit"),
    [
        ([1e-16] * 5, Limit.TRUTH),
        ([1e-3, 1e-6, 1e-9, 1e-13, 1e-15], Limit.TRUTH),
        ([0.2 + dt for dt in DTS], Limit.ELSEWHERE),
        ([0.72, 0.70, 0.68, 0.67, 0.66], Limit.ELSEWHERE),
        ([1e-3 / dt for dt in DTS], Limit.NOT),
        ([0.1, 0.9, 0.05, 0.8, 0.2], Limit.NOISY),
        ([0.1, 0.05], Limit.FEW),
        ([0.1, 1e-16], Limit.FEW),
        ([], Limit.FEW),
        # A lucky phase at the finest step, and errors that rise on the way, are no convergence.
        ([3.5e-5, 3.2e-4, 2.2e-14], Limit.NOISY),
        ([1e-3, 1e-3, 1e-15], Limit.NOISY),
        ([1e-3, 1e-15, 1e-3, 1e-15, 1e-15], Limit.NOISY),
        ([1e-3, 1e-15, 1e-15], Limit.TRUTH),
    ],
)
def test_each_kind_of_sequence_gets_its_verdict(errors, limit):
    assert limit_of(DTS[: len(errors)], errors)[1] is limit


def test_quarter_order_against_a_level():
    """Half-way order 1/4 over a factor of four in dt parts errors by 4^(1/4) = 1.41, beyond what counts as level."""
    assert limit_of(DTS, [dt**0.25 for dt in DTS])[1] is Limit.TRUTH


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("ratio", [2.0, 4.0])
def test_richardson_recovers_the_limit_of_a_single_power_exactly(order, ratio):
    dts = [0.01, 0.01 / ratio, 0.01 / ratio**2]
    found = richardson(dts, [2.5 - 3.0 * dt**order for dt in dts])
    # The order is a quotient of differences: round-off 2e-16 over differences of 3e-8 and larger (order 3).
    assert found[0] == pytest.approx(order, abs=1e-6)
    assert found[1] == pytest.approx(2.5, abs=1e-10)


def test_band_with_a_disturbing_second_power():
    for second in (-2.0, -0.5, 0.5, 2.0):
        dts = [0.1, 0.05, 0.025]
        _, limit, band = richardson(dts, [1.0 + dt + second * dt**2 for dt in dts])
        assert abs(limit - 1.0) <= band


@pytest.mark.parametrize("values", [[1.0, 2.0, 1.5], [1.0, 1.1, 1.4], [1.0, 1.0, 1.0], [1.0, 1.2]])
def test_no_extrapolation_of_oscillating_growing_or_short_sequences(values):
    assert richardson(DTS[: len(values)], values) is None


def test_steps_without_a_common_ratio_are_not_extrapolated():
    assert richardson([0.1, 0.05, 0.01], [1.3, 1.2, 1.15]) is None


def observed(slot, metrics, outcome=Outcome.OK):
    values = {name: (value, "") for name, value in metrics.items()}
    return Observation(slot, slot.key(), 1, "1", outcome, metrics=values)


def impact_slot(dt, k):
    return Slot("impact", (("delay", 0.0525 + (k + 0.5) / PHASES * dt),), 2, "toy", "default", dt)


def test_error_of_a_step_over_all_phases():
    cells = [
        observed(impact_slot(dt, k), {"rebound_ratio": 0.8 + dt * (1.0 if k == 3 else 0.1)})
        for dt in DTS[:3]
        for k in range(PHASES)
    ]
    (found,) = convergence(declared_errors(cells))
    assert found.errors == pytest.approx(DTS[:3], rel=1e-12)
    assert found.limit is Limit.TRUTH
    assert found.order.order == pytest.approx(1.0, abs=1e-9)


def test_step_with_a_missing_or_crashed_phase():
    cells = [observed(impact_slot(dt, k), {"rebound_ratio": 0.8 + dt}) for dt in DTS[:2] for k in range(PHASES)]
    crashed = replace(cells[0], outcome=Outcome.CRASHED, reason="it crashed")
    missing = cells[1:-1]
    assert convergence(declared_errors([crashed, *missing])) == []
    (whole,) = convergence(declared_errors(cells))
    assert whole.dts == DTS[:2]


def slide(dt, acceleration):
    slot = Slot("incline", (("ratio", 1.1),), 2, "toy", "default", dt)
    return observed(slot, {"acceleration": acceleration, "creep": 0.0})


def test_extrapolation_of_a_smooth_metric():
    theta = math.atan(1.1 * 0.5)
    truth = 9.81 * (math.sin(theta) - 0.5 * math.cos(theta))
    (near,) = extrapolations([slide(dt, truth - 0.4 * dt) for dt in DTS])
    assert near.limit is Limit.TRUTH and near.value == pytest.approx(truth, abs=1e-9)
    (off,) = extrapolations([slide(dt, truth - 0.1 - 0.4 * dt) for dt in DTS])
    assert off.limit is Limit.ELSEWHERE and off.value == pytest.approx(truth - 0.1, abs=1e-9)
    (same,) = extrapolations([slide(dt, truth) for dt in DTS])
    assert same.limit is Limit.TRUTH and same.order is None


# ---- every word and limit of a verdict -----------------------------------------------------------------------------


def said(errors, dts=None, **options):
    return limit_of(dts or DTS[: len(errors)], errors, **options)[1:]


def test_too_few_errors_told():
    assert limit_of(DTS[:1], [0.0]) == (None, Limit.FEW, "1 of 3")  # one step converges to nothing
    assert limit_of(DTS[:2], [1e-17, 0.0]) == (None, Limit.FEW, "2 of 3")
    assert limit_of([], []) == (None, Limit.FEW, "no step has a measured error")
    assert limit_of(DTS[:2], [0.1, 0.05]) == (None, Limit.FEW, "2 of 3")
    exact = (None, Limit.TRUTH, "exact to round-off at every step")
    assert limit_of(DTS[:3], [1e-12] * 3) == limit_of(DTS[:3], [0.25] * 3, 0.25) == exact


def test_plateau_of_errors_over_three_steps():
    assert said([9.0, 0.54, 0.45, 0.4]) == (Limit.ELSEWHERE, "levels off at an error of 0.4")
    assert said([9.0, 0.541, 0.45, 0.4])[0] is not Limit.ELSEWHERE
    assert said([0.1, 0.54, 0.45, 0.4])[0] is Limit.ELSEWHERE  # what came before the three is no part of the level
    assert said([0.5, 0.45, 0.4], [0.1, 0.05, 0.0251])[0] is not Limit.ELSEWHERE
    assert said([0.5, 0.45, 0.4], [0.1, 0.05, 0.025])[0] is Limit.ELSEWHERE
    assert said([9.0, 0.5, 0.45, 0.4], [0.2, 0.05, 0.04, 0.03])[0] is not Limit.ELSEWHERE  # .05 to .03 s


def test_order_with_its_error_and_verdict():
    truth = said([0.4, 0.1, 0.025])
    assert truth == (Limit.TRUTH, "order 2.00 +- 0.00 over 3 steps")
    assert said([0.025, 0.1, 0.4]) == (Limit.NOT, "the error grows as the step shrinks, order -2.00 +- 0.00")
    fit, limit, because = limit_of(DTS[:4], [0.1, 0.9, 0.05, 0.8])
    assert (limit, because) == (
        Limit.NOISY, f"order {fit.order:.2f} +- {fit.standard_error:.2f}: neither falling nor constant")  # fmt: skip


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("slope", "clear"), [(2.1, True), (1.9, False), (2.9, True)])
@pytest.mark.parametrize("a", [0.1, 0.5])
def test_an_order_counts_from_two_standard_errors_on(a, sign, slope, clear):
    """Four steps whose logarithms scatter so that the standard error is known: of + - - + it is sqrt(2/5)/log 2 a."""
    scatter = np.array([a, -a, -a, a])
    error = math.sqrt(float(scatter @ scatter) / 2.0 / (5.0 * math.log(2.0) ** 2))
    errors = np.exp(scatter + sign * slope * error * np.log(DTS[:4]))
    fit, limit, _ = limit_of(DTS[:4], list(errors))
    assert fit.standard_error == pytest.approx(error) and fit.order == pytest.approx(sign * slope * error)
    told = Limit.TRUTH if sign > 0.0 else Limit.NOT
    level = max(errors[-3:]) <= 1.35 * min(errors[-3:])
    assert limit is (Limit.ELSEWHERE if level else told if clear else Limit.NOISY)


def test_errors_at_the_floor_carry_no_order():
    fit, limit, because = limit_of(DTS[:5], [0.4, 1e-3, 0.1, 1e-3, 0.025], 1e-3)
    assert (limit, because) == (Limit.TRUTH, "order 1.00 +- 0.00 over 3 steps") and fit.order == pytest.approx(1.0)
    _, limit, because = limit_of(DTS[:4], [1e-3, 0.4, 1e-3, 0.1], 1e-3)
    assert (limit, because) == (Limit.FEW, "too few errors above round-off for an order")


def test_step_of_a_fall_to_round_off():
    assert said([1e-3, 1e-9, 1e-15]) == (
        Limit.NOISY, "round-off at dt = 0.00417 s only, from 1e-09 one step coarser")  # fmt: skip
    assert said([1e-3, 1e-11, 1e-15]) == (Limit.TRUTH, "falls to round-off at dt = 0.00417 s ")
    assert said([1e-3, 1e-2, 1e-15]) == (Limit.NOISY, "round-off at dt = 0.00417 s, but errors rise on the way")
    # 64 times the floor in one halving is the sixth order, which may be; and a rise within a level is none.
    assert said([1.0, 0.064, 0.001], floor=0.001)[0] is Limit.TRUTH
    assert said([1.0, 0.0641, 0.001], floor=0.001)[0] is Limit.NOISY
    assert said([0.001, 0.00135, 1e-15])[0] is Limit.NOISY  # from 1.35e-3 in one step: no method does that
    assert said([1e-11, 1.34e-11, 1e-15])[0] is Limit.TRUTH
    assert said([1e-11, 1.36e-11, 1e-15])[0] is Limit.NOISY
    assert said([1e-3, 1e-12, 1e-15])[0] is Limit.TRUTH  # at the floor is round-off, two steps before the end
    assert said([1e-3, 1e-15, 1e-12, 1e-15])[0] is Limit.TRUTH  # and a rise to it is none


def test_slope_of_two_positive_errors():
    assert observed_order(DTS[:1], [0.5]) is None
    fit = observed_order(DTS[:2], [0.5, 0.25])
    assert (fit.order, fit.standard_error) == (pytest.approx(1.0), math.inf)
    assert observed_order(DTS[:3], [0.5, 0.0, 0.25]) is None
    assert observed_order(DTS[:3], [0.5, 1e-290, 0.25]) is not None


def test_sequences_of_equal_differences_or_steps_in_proportion():
    assert richardson(DTS[:3], [3.0, 2.0, 1.0]) is None  # they do not shrink
    assert richardson([0.4, 0.2, 0.1 * (1.0 + 1e-7)], [1.4, 1.2, 1.1]) is not None
    assert richardson([0.4, 0.2, 0.1 * (1.0 + 1e-5)], [1.4, 1.2, 1.1]) is None
    # A part in a million of the ratio, however large that is.
    assert richardson([16.0 * (1.0 + 0.5e-6), 4.0, 1.0], [1.4, 1.2, 1.1]) is not None
    assert richardson([16.0 * (1.0 + 1.5e-6), 4.0, 1.0], [1.4, 1.2, 1.1]) is None
    order, limit, band = richardson([4.0, 2.0, 1.0], [9.0, 5.0, 3.0])
    assert (order, limit, band) == (1.0, 1.0, 2.5)  # the band is a quarter wider than the correction of 2
    assert richardson([4.0, 2.0, 1.0], [1e9, 1.0, 0.0])[0] == 6.0  # beyond, it is round-off's


# ---- what is extrapolated of cells ---------------------------------------------------------------------------------

TRUTH = 9.81 * (math.sin(math.atan(0.55)) - 0.5 * math.cos(math.atan(0.55)))


def extrapolated(*values, dts=None):
    (found,) = extrapolations([slide(dt, value) for dt, value in zip(dts or DTS, values, strict=False)])
    return found


def test_cell_and_number_of_an_extrapolation():
    found = extrapolated(TRUTH + 0.8, TRUTH + 0.4, TRUTH + 0.2)
    assert (found.scene, found.dimension, found.engine, found.profile) == ("incline", 2, "toy", "default")
    assert (found.metric, found.unit, found.params) == ("acceleration", "m/s^2", "ratio=1.1")
    assert found.truth == pytest.approx(TRUTH) and found.dts == DTS[:3]
    assert found.values == pytest.approx((TRUTH + 0.8, TRUTH + 0.4, TRUTH + 0.2))
    assert (found.order, found.value, found.band) == (
        pytest.approx(1.0), pytest.approx(TRUTH), pytest.approx(0.25))  # fmt: skip
    assert found.limit is Limit.TRUTH
    assert found.because == f"order 1.00, limit {TRUTH:.6g} +- 0.3, truth {TRUTH:.6g}"


@pytest.mark.parametrize(
    ("offsets", "limit", "because"),
    [
        ((0.5, 0.2, 0.2, 0.2), Limit.ELSEWHERE, f"the same value at every step, {TRUTH + 0.2:.6g}"),
        ((0.5, 0.0, 0.0, 0.0), Limit.TRUTH, "the same value at every step, the truth"),
        # Four kinds of differences that do not shrink: growing away from the truth, towards it, and to and fro.
        ((0.0, 0.1, 0.3), Limit.NOT, "differences grow"),
        ((0.0, 0.1, -0.2), Limit.NOT, "differences grow"),
        ((0.6, 0.5, 0.3), Limit.NOISY, "differences do not shrink with one sign"),
        ((0.1, 0.4, 0.3), Limit.NOISY, "differences do not shrink with one sign"),
        ((9.0, 0.0, 0.1, 0.3), Limit.NOT, "differences grow"),
        ((0.0, 0.3, -0.1), Limit.NOT, "differences grow"),  # further off than the first, though not than the second
        ((0.5, 0.4, 0.2, 0.2, 0.2), Limit.ELSEWHERE, f"the same value at every step, {TRUTH + 0.2:.6g}"),
    ],
)
def test_values_that_cannot_be_extrapolated_have_a_reason(offsets, limit, because):
    found = extrapolated(*(TRUTH + offset for offset in offsets))
    assert (found.limit, found.because) == (limit, because)
    if "same value" in because:
        assert found.value == pytest.approx(TRUTH + offsets[-1]) and found.order is None
        assert found.band == pytest.approx(1e-12 * (TRUTH + max(offsets)), rel=1e-3) or found.band == 1e-12
    else:
        assert (found.order, found.value, found.band) == (None, None, None)


def test_round_off_of_the_largest_value():
    for off, limit in ((1.9e-12, Limit.TRUTH), (2.1e-12, Limit.ELSEWHERE)):
        assert extrapolated(*[TRUTH + off] * 3).limit is limit  # the truth is below 1 m/s^2: one counts
    large = [TRUTH + 1e6, *[TRUTH + 1.9e-6] * 3]
    assert extrapolated(*large).limit is Limit.TRUTH
    assert extrapolated(*large).band == pytest.approx(1e-6, rel=1e-5)
    assert extrapolated(TRUTH + 1e6, *[TRUTH + 2.1e-6] * 3).limit is Limit.ELSEWHERE


def test_moved_starved_and_unanswered_cells_not_in_a_series():
    def cell(dt, **changes):
        own = slide(dt, 1.0 + dt)
        return replace(own, slot=replace(own.slot, **changes))

    assert extrapolations([cell(dt) for dt in DTS[:2]]) == []
    assert len(extrapolations([cell(dt) for dt in DTS[:3]])) == 1
    for changes in ({"ulp": 1}, {"iterations": 4}):
        assert extrapolations([cell(DTS[0]), cell(DTS[1]), cell(DTS[2], **changes)]) == []
    crashed = replace(cell(DTS[2]), outcome=Outcome.CRASHED)
    assert extrapolations([cell(DTS[0]), cell(DTS[1]), crashed]) == []
    two = [cell(dt, profile=profile) for dt in DTS[:3] for profile in ("default", "tuned")]
    two += [cell(dt, engine="other", dimension=3) for dt in DTS[:3]]
    assert [(e.engine, e.profile, e.dimension) for e in extrapolations(two)] == [
        ("toy", "default", 2), ("toy", "tuned", 2), ("other", "default", 3)]  # fmt: skip


def test_no_extrapolation_with_a_missing_value_or_truth():
    cells = [slide(dt, 1.0 + dt) for dt in DTS[:3]]
    assert extrapolations([*cells[:2], observed(cells[2].slot, {"creep": 0.0})]) == []
    assert extrapolations([*cells[:2], observed(cells[2].slot, {"acceleration": None})]) == []


def test_undeclared_and_moved_cells_not_in_an_error():
    cells = [observed(impact_slot(dt, k), {"rebound_ratio": 0.8 + dt}) for dt in DTS[:2] for k in range(PHASES)]
    other = observed(Slot("impact", (("e", 0.25),), 2, "toy", "default", DTS[0]), {"rebound_ratio": 9.0})
    moved = [replace(cell, slot=replace(cell.slot, ulp=1)) for cell in cells]
    wrong = [replace(cell, metrics={"rebound_ratio": (9.0, "")}) for cell in moved]
    (whole,) = convergence(declared_errors([*wrong, other, *cells]))
    assert whole.errors == pytest.approx(DTS[:2], rel=1e-9)


def test_zero_order_over_few_steps():
    """Errors of exactly one have the order 0 with no scatter; the steps are too near each other for a level."""
    assert said([1.0] * 3, [0.1, 0.06, 0.05]) == (Limit.NOISY, "order 0.00 +- 0.00: neither falling nor constant")


def test_differences_that_are_the_same_do_not_grow():
    found = extrapolated(0.25, 0.5, 0.75)  # away from the truth, which is .43
    assert (found.limit, found.because) == (Limit.NOISY, "differences do not shrink with one sign")


def test_values_equal_but_for_round_off():
    """Round-off of the values is 1e-12: the last one is within twice that of the truth, the one before it is not."""
    found = extrapolated(TRUTH + 2.6e-12, TRUTH + 2.4e-12, TRUTH + 1.8e-12)
    assert found.limit is Limit.TRUTH and found.value == TRUTH + 1.8e-12
    found = extrapolated(9.0, 8.0, 3e-13, 2e-13, 1e-13)
    assert (found.value, found.because) == (1e-13, "the same value at every step, 1e-13")


def test_round_off_of_small_values_with_a_large_truth():
    """A thousand times the gravity, a truth of some 40 m/s^2: values that differ by 3e-11 are the same."""

    def cell(dt, value):
        own = slide(dt, value)
        return replace(own, slot=replace(own.slot, params=(("g", 1e3), ("ratio", 1.1))))

    (found,) = extrapolations([cell(dt, value) for dt, value in zip(DTS, (0.0, 3e-11, 0.0), strict=False)])
    assert found.truth == pytest.approx(TRUTH / 9.81 * 1e3) and found.because.startswith("the same value at every step")


def test_truth_or_bound_alone_shown_without_extrapolation(monkeypatch):
    cells = [slide(dt, 1.0 + dt) for dt in DTS[:3]]
    whole = CATALOGUE["incline"]
    for changes in ({"truth": None}, {"bound": None}):

        def rule(scene, dt, truth, changes=changes):
            return [replace(check, **changes) for check in whole.rule(scene, dt, truth)]

        monkeypatch.setattr(questions, "resolve", lambda name, rule=rule: replace(whole, rule=rule))
        assert extrapolations(cells) == []
