"""Statistics of timings against what is known of them by construction or by brute force."""

import numpy as np
import pytest

from validation.bench.statistics import drift, lower_envelope, power_law, spread


def test_the_interval_covers_the_true_median_as_often_as_it_says():
    rng = np.random.default_rng(1)
    # Times: a floor, and a long tail of disturbances. The true median of exp(N(0, s)) is 1.
    found = [spread(np.exp(rng.normal(0.0, 0.3, 25))) for _ in range(400)]
    covered = sum(s.low <= 1.0 <= s.high for s in found)
    # 95 % of 400 is 380 with a standard deviation of 4.4; the percentile bootstrap of a median of 25 is a little
    # narrow (order statistics), 92 % is what four standard deviations and that leave.
    assert 0.92 * 400 <= covered <= 400


def test_more_rounds_narrow_the_interval():
    rng = np.random.default_rng(2)
    samples = np.exp(rng.normal(0.0, 0.2, 40))
    assert spread(samples).width < 0.6 * spread(samples[:10]).width


def test_one_disturbed_round_does_not_move_the_median():
    assert spread([1.0] * 9 + [50.0]).median == 1.0


def test_a_slow_down_during_the_lane_is_drift_and_noise_is_not():
    rng = np.random.default_rng(3)
    noise = 1.0 + 0.01 * rng.standard_normal(20)
    slower = np.where(np.arange(20) < 10, 1.0, 1.1) * noise
    assert drift(slower) == pytest.approx(0.1, abs=0.02)
    assert abs(drift(noise)) < 0.02


def test_the_lower_envelope_is_what_nothing_beats():
    rng = np.random.default_rng(4)
    for _ in range(50):
        # Few distinct values, so that ties occur.
        cost, error = rng.integers(1, 6, 12).astype(float), rng.integers(1, 6, 12).astype(float)
        on = lower_envelope(cost, error)
        for k in range(12):
            beaten = ((cost <= cost[k]) & (error <= error[k]) & ((cost < cost[k]) | (error < error[k]))).any()
            if on[k]:
                assert not beaten
            elif not beaten:  # an equal twin of a point that is on it
                assert ((cost == cost[k]) & (error == error[k]) & on).any()


def test_what_has_no_error_or_no_cost_is_on_no_envelope():
    assert lower_envelope([1.0, np.nan, 2.0], [np.nan, 1.0, 3.0]).tolist() == [False, False, True]


def test_a_planted_exponent_is_found_within_its_standard_error():
    rng = np.random.default_rng(5)
    x = np.array([10.0, 28.0, 91.0, 300.0, 990.0])
    hits = 0
    for _ in range(200):
        fit = power_law(x, 3e-7 * x**1.4 * np.exp(rng.normal(0.0, 0.1, 5)))
        hits += abs(fit.exponent - 1.4) < 3.18 * fit.standard_error  # t of 3 degrees of freedom, 95 %
    assert hits >= 0.9 * 200  # 95 % of 200 is 190, standard deviation 3.1: three of them
    exact = power_law(x, 3e-7 * x**1.4)
    assert exact.exponent == pytest.approx(1.4, abs=1e-12) and exact.factor == pytest.approx(3e-7, rel=1e-10)
    assert exact.standard_error < 1e-12


def test_two_points_give_no_exponent():
    assert power_law([1.0, 2.0], [1.0, 2.0]) is None
    assert power_law([3.0, 3.0, 3.0], [1.0, 2.0, 3.0]) is None
