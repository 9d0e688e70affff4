"""Statistics of timings against what is known of them by construction or by brute force."""

import numpy as np
import pytest

from validation.bench.statistics import drift, lower_envelope, power_law, spread


def test_coverage_of_the_median_s_interval():
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


def test_drift_and_noise_of_a_lane():
    rng = np.random.default_rng(3)
    noise = 1.0 + 0.01 * rng.standard_normal(20)
    slower = np.where(np.arange(20) < 10, 1.0, 1.1) * noise
    assert drift(slower) == pytest.approx(0.1, abs=0.02)
    assert abs(drift(noise)) < 0.02


def test_lower_envelope_of_undominated_points():
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


def test_no_envelope_without_error_or_cost():
    assert lower_envelope([1.0, np.nan, 2.0], [np.nan, 1.0, 3.0]).tolist() == [False, False, True]


def test_planted_exponent_within_its_standard_error():
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


def test_three_points_give_an_exponent_with_its_error():
    """log2 of (1, 2, 4) and of (1, 2, 8): slope 3/2, residuals (1, -2, 1)/6, of which 1/6 is left to one degree."""
    fit = power_law([1, 2, 4], [1, 2, 8])
    assert (fit.exponent, fit.points) == (pytest.approx(1.5), 3)
    assert fit.factor == pytest.approx(2.0 ** (-1 / 6))
    assert fit.standard_error == pytest.approx(np.sqrt(1 / 6 / 2))
    five = power_law([1, 2, 4, 8, 16], [1, 2, 4, 8, 32])
    away = np.array([0.0, 1.0, 2.0, 3.0, 5.0]) - 2.2 - 1.2 * (np.arange(5) - 2)
    assert (five.exponent, five.standard_error) == (pytest.approx(1.2), pytest.approx(np.sqrt(away @ away / 3 / 10)))
    assert power_law(["1", "2", "4"], ["1", "2", "8"]) == fit  # what a CSV holds


def test_a_spread_holds_the_numbers_of_its_samples():
    found = spread(["3", "1", "2", "5"])
    assert (found.n, found.minimum, found.median) == (4, 1.0, 2.5)
    assert 1.0 <= found.low < found.median < found.high <= 5.0
    # The interval leaves as many resampled medians below it as above.
    evenly = spread(np.concatenate([-np.arange(1.0, 41.0), np.arange(1.0, 41.0)]))
    assert evenly.low == pytest.approx(-evenly.high, abs=3.0)


def test_drift_needs_four_samples_and_halves_them():
    assert drift([1.0, 1.0, 2.0]) == 0.0
    assert drift(["1", "1", "2", "2"]) == pytest.approx(1.0)
    assert drift([2.0, 2.0, 2.0, 4.0, 4.0, 4.0, 4.0]) == pytest.approx(1.0)
    assert drift([2.0, 2.0, 2.0, 2.0, 6.0, 6.0, 6.0, 6.0]) == pytest.approx(2.0)


def test_envelope_of_numbers_as_text():
    assert lower_envelope(["9", "10"], ["2", "1"]).tolist() == [True, True]
    assert lower_envelope(["9", "10"], ["10", "9"]).tolist() == [True, True]


def test_two_points_give_no_exponent():
    assert power_law([1.0, 2.0], [1.0, 2.0]) is None
    assert power_law([3.0, 3.0, 3.0], [1.0, 2.0, 3.0]) is None


def test_drift_between_halves():
    """Medians of 2 and 6."""
    assert drift([1.0, 3.0, 4.0, 8.0]) == 2.0
    assert drift([1.0, 3.0, 9.0, 4.0, 8.0]) == 3.0  # the middle one belongs to the second half: 8 over 2


def test_share_left_out_of_an_interval():
    """Ten of 400 resampled medians lie below it and ten above."""
    samples = np.random.default_rng(6).random(2000)
    found = spread(samples)
    medians = np.sort(np.median(samples[np.random.default_rng(2000).integers(0, 2000, (400, 2000))], axis=1))
    assert medians[9] < found.low < medians[10] < medians[389] < found.high < medians[390]
