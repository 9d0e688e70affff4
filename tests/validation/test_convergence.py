"""Observed order and extrapolation: known sequences get their order, limit and verdict, and nothing else does."""

import math
from dataclasses import replace

import numpy as np
import pytest

from validation.cells import Observation, Outcome, Slot
from validation.convergence import Limit, convergence, extrapolations, limit_of, observed_order, richardson
from validation.scenes.parts import PHASES

DTS = tuple(1.0 / rate for rate in (60.0, 120.0, 240.0, 480.0, 960.0))


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, 4.0])
def test_a_power_of_the_step_has_its_exponent_as_order_without_error(order):
    fit = observed_order(DTS, [0.3 * dt**order for dt in DTS])
    assert fit.order == pytest.approx(order, abs=1e-12)  # a line through exact powers: round-off of logarithms
    assert fit.standard_error < 1e-12
    assert limit_of(DTS, [0.3 * dt**order for dt in DTS])[1] is Limit.TRUTH


def test_the_standard_error_covers_the_order_of_noisy_errors():
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
        ([0.1, 0.05], Limit.NOISY),
        ([0.1, 1e-16], Limit.NOISY),
        ([], Limit.NOISY),
        # A lucky phase at the finest step, and errors that rise on the way, are no convergence.
        ([3.5e-5, 3.2e-4, 2.2e-14], Limit.NOISY),
        ([1e-3, 1e-3, 1e-15], Limit.NOISY),
        ([1e-3, 1e-15, 1e-3, 1e-15, 1e-15], Limit.NOISY),
        ([1e-3, 1e-15, 1e-15], Limit.TRUTH),
    ],
)
def test_each_kind_of_sequence_gets_its_verdict(errors, limit):
    assert limit_of(DTS[: len(errors)], errors)[1] is limit


def test_a_quarter_order_is_still_told_from_a_level():
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


def test_the_band_covers_the_limit_when_a_second_power_disturbs_the_first():
    for second in (-2.0, -0.5, 0.5, 2.0):
        dts = [0.1, 0.05, 0.025]
        _, limit, band = richardson(dts, [1.0 + dt + second * dt**2 for dt in dts])
        assert abs(limit - 1.0) <= band


@pytest.mark.parametrize("values", [[1.0, 2.0, 1.5], [1.0, 1.1, 1.4], [1.0, 1.0, 1.0], [1.0, 1.2]])
def test_an_oscillating_growing_constant_or_short_sequence_is_not_extrapolated(values):
    assert richardson(DTS[: len(values)], values) is None


def test_steps_without_a_common_ratio_are_not_extrapolated():
    assert richardson([0.1, 0.05, 0.01], [1.3, 1.2, 1.15]) is None


def observed(slot, metrics, outcome=Outcome.OK):
    values = {name: (value, "") for name, value in metrics.items()}
    return Observation(slot, slot.key(), 1, "1", outcome, metrics=values)


def impact_slot(dt, k):
    return Slot("impact", (("delay", 0.0525 + (k + 0.5) / PHASES * dt),), 2, "toy", "default", dt)


def test_the_error_of_a_step_is_the_supremum_over_all_phases():
    cells = [
        observed(impact_slot(dt, k), {"rebound_ratio": 0.8 + dt * (1.0 if k == 3 else 0.1)})
        for dt in DTS[:3]
        for k in range(PHASES)
    ]
    (found,) = convergence(cells)
    assert found.errors == pytest.approx(DTS[:3], rel=1e-12)
    assert found.limit is Limit.TRUTH
    assert found.order.order == pytest.approx(1.0, abs=1e-9)


def test_a_step_with_a_missing_or_crashed_phase_has_no_error():
    cells = [observed(impact_slot(dt, k), {"rebound_ratio": 0.8 + dt}) for dt in DTS[:2] for k in range(PHASES)]
    crashed = replace(cells[0], outcome=Outcome.CRASHED, reason="it crashed")
    missing = cells[1:-1]
    assert convergence([crashed, *missing]) == []
    (whole,) = convergence(cells)
    assert whole.dts == DTS[:2]


def slide(dt, acceleration):
    slot = Slot("incline", (("ratio", 1.1),), 2, "toy", "default", dt)
    return observed(slot, {"acceleration": acceleration, "creep": 0.0})


def test_a_smooth_metric_is_extrapolated_and_compared_with_its_truth():
    theta = math.atan(1.1 * 0.5)
    truth = 9.81 * (math.sin(theta) - 0.5 * math.cos(theta))
    (near,) = extrapolations([slide(dt, truth - 0.4 * dt) for dt in DTS])
    assert near.limit is Limit.TRUTH and near.value == pytest.approx(truth, abs=1e-9)
    (off,) = extrapolations([slide(dt, truth - 0.1 - 0.4 * dt) for dt in DTS])
    assert off.limit is Limit.ELSEWHERE and off.value == pytest.approx(truth - 0.1, abs=1e-9)
    (same,) = extrapolations([slide(dt, truth) for dt in DTS])
    assert same.limit is Limit.TRUTH and same.order is None
