"""Observed orders are those of the schemes: first through events and forces, second in rotation."""

import math

import pytest

from tests.verification import orders
from tests.verification.orders import CASES, RATES, fitted, observed
from tests.verification.space import SPACES


@pytest.mark.parametrize("power", [1.0, 2.0, 1.5])
def test_fit_of_a_power_law(power):
    assert fitted(tuple(0.3 * rate**-power for rate in RATES)) == pytest.approx(power, abs=1e-12)


def test_order_in_round_off():
    assert fitted((1e-13, 3e-14, 0.0, 2e-13, 1e-14)) is None
    errors = tuple(1e-7 * (60 / rate) ** 4 for rate in RATES)  # the last is 1.5e-12
    assert fitted((*errors[:4], 1e-13)) == pytest.approx(4.0, abs=1e-12)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
@pytest.mark.parametrize("case", CASES)
def test_order_of_classical(case, space):
    """Semi-implicit Euler (E17) and events found up to a step late."""
    row = observed(case, CASES[case], space, "classical")
    # the largest of 16 phases scatters by up to one in 16 about its supremum at each step
    assert row.order == pytest.approx(1.0, abs=0.12)


def test_order_of_free_rotation_in_fixed_steps():
    row = observed("", orders.rotation, SPACES[1], "classical")
    assert row.order == pytest.approx(2.0, abs=0.05)


def test_free_rotation_of_the_loop_at_other_steps():
    row = observed("", orders.rotation, SPACES[1], "reference")
    assert max(row.errors) <= 1e-11
    assert max(row.errors) - min(row.errors) <= orders.ROUND_OFF


def test_error_of_a_flight():
    """Semi-implicit Euler falls g t dt / 2 too far, whatever the start."""
    row = observed("", orders.flight, SPACES[0], "classical")
    for rate, error in zip(row.rates, row.errors, strict=True):
        assert error == pytest.approx(0.5 * orders.GRAVITY / rate, rel=1e-10)


def test_place_of_a_bouncing_ball_by_its_flights():
    """A flight that lasts exactly until t: on the floor at the end of each bounce, at the apex between."""
    fall = math.sqrt(2.0 / orders.GRAVITY)
    assert orders.bounced(1.0, 0.8, 0.5 * fall) == pytest.approx(0.75, abs=1e-15)
    assert orders.bounced(1.0, 0.8, fall * (1.0 + 0.8)) == pytest.approx(0.64, abs=1e-15)
    assert orders.bounced(1.0, 0.8, fall * (1.0 + 1.6 + 0.64)) == pytest.approx(0.8**4, abs=1e-14)


def test_energy_of_the_angle_on_the_hill():
    """Rolling from rest: (1 + k) v^2 / 2 = g (R + r)(cos x0 - cos x); the time integral of dx/v returns the time."""
    end = orders.hill_angle(2, 0.2)
    rate = orders.GRAVITY / (1.5 * 2.5)
    assert end == pytest.approx(orders.hill_angle(2, 0.2, 6000), abs=1e-13)
    # substituting x = x0 cosh y takes the root singularity of the start out of the integral
    count, top = 4000, math.acosh(end / 0.2)
    total = 0.0
    for i in range(count):
        y = (i + 0.5) * top / count
        x = 0.2 * math.cosh(y)
        spin = math.sqrt(2.0 * rate * (math.cos(0.2) - math.cos(x)))
        total += 0.2 * math.sinh(y) / spin * top / count
    assert total == pytest.approx(orders.ROLLED, abs=1e-6)  # midpoint rule: (top / count)^2 / 24
