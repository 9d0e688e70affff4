"""When a series of rebounds counts as over (E22): by what it leaves out, summed up rebound by rebound."""

import math

import pytest

from reference_solver.stepping.impacts import DRIFT_STEPS, drifts_aside, is_lowest, turns_aside

G, NOISE = 9.81, 1e-12


@pytest.mark.parametrize("e", [0.2, 0.5, 0.8, 0.95])
def test_a_series_is_over_at_twice_the_speed_that_the_noise_of_its_gap_keeps_up(e):
    """Each fall is deeper by the noise that lifted the rebound: ``u <- e sqrt(u^2 + 2 g noise)`` stands still."""
    kept = 1.0
    for _ in range(2000):
        kept = e * math.sqrt(kept * kept + 2.0 * G * NOISE)
    assert kept == pytest.approx(math.sqrt(2.0 * G * NOISE / (1.0 - e * e)) * e, rel=1e-9)
    assert is_lowest(1.99 * kept, G, NOISE, e) and not is_lowest(2.01 * kept, G, NOISE, e)
    assert is_lowest(kept, G, NOISE, e)
    u, bounces = 0.1, 0
    while not is_lowest(u, G, NOISE, e):
        u, bounces = e * math.sqrt(u * u + 2.0 * G * NOISE), bounces + 1
    assert bounces < math.log(0.1 / kept) / -math.log(e) + 1.0  # it ends, and no sooner than without noise at twice it
    assert bounces > math.log(0.1 / (2.0 * kept)) / -math.log(e) - 1.0


@pytest.mark.parametrize("e", [0.2, 0.5, 0.8])
def test_flights_without_friction_leave_out_what_their_times_add_up_to(e):
    acceleration, returns = 3.0, 1e-3
    flights = sum(0.5 * acceleration * (returns * e**k) ** 2 for k in range(400))
    assert drifts_aside(1.0, acceleration, 0.1, G, returns, e) == pytest.approx(flights, rel=1e-12)
    assert drifts_aside(1.0, 0.2, 0.1, G, returns, e) == pytest.approx(flights * 0.1 * G / acceleration, rel=1e-12)
    assert drifts_aside(0.0, acceleration, 0.0, G, returns, e) == 0.0  # no friction takes part


def test_what_turns_counts_over_ten_thousand_steps_or_until_it_has_turned():
    """1e-6 m/s for 1e-4 s on rows that turn at .02 rad/s: of 1e-10 m what they turn in 1e4 steps of 1e-3 s, .2 rad."""
    assert DRIFT_STEPS == 1e4
    assert turns_aside(1e-6, 1e-4, 0.02, 1e-3) == pytest.approx(0.2 * 1e-10, rel=1e-12)
    assert turns_aside(1e-6, 1e-4, 3.0, 1e-3) == pytest.approx(1e-10, rel=1e-12)
    assert turns_aside(1e-6, 1e-4, 0.0, 1e-3) == 0.0
