"""First contact times: stable where formulas from school cancel, and never a root too early or too late."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.verification.event_driven.prediction import first_fall, first_quartic_fall, first_touch


def first_root(coefficients):
    work = np.zeros((5, 7))
    work[0, :5] = coefficients
    return first_quartic_fall(work)


@given(st.floats(1e-12, 1e3), st.floats(-1e3, 1e3), st.floats(-100.0, -1e-3))
def test_root_of_a_falling_gap(gap, rate, pull):
    t = Fraction(first_fall(gap, rate, pull))
    value = Fraction(gap) + Fraction(rate) * t + Fraction(pull) * t * t / 2
    slope = abs(Fraction(rate) + Fraction(pull) * t)
    # backward stability: the time is off by a few units in the last place of itself
    assert abs(value) <= 8 * Fraction(2.0**-52) * slope * t + Fraction(2.0**-1060)


def test_return_to_a_contact_just_left():
    assert first_fall(0.0, 3.0, -10.0) == 0.6
    assert first_fall(0.0, 3.0, 0.0) == math.inf


def test_gap_braked_before_it_closes():
    assert first_fall(1.0, -1.0, 0.6) == math.inf
    assert first_fall(1.0, -1.0, 0.4) == pytest.approx((1 - math.sqrt(0.2)) / 0.4, rel=1e-15)


def test_an_exact_graze_is_a_miss():
    assert first_fall(1.0, -2.0, 2.0) == math.inf


@given(st.lists(st.integers(-240, 239), min_size=4, max_size=4, unique=True))
def test_first_fall_of_a_quartic(places):
    # Roots closer together than 1e-2 make each other ill-conditioned; what is left is accurate to 1e-9.
    roots = [0.021 * (place + 0.5) for place in places]
    coefficients = np.polynomial.polynomial.polyfromroots(roots)
    falls = sorted(r for r in roots if r > 1e-3 and np.polynomial.polynomial.polyval(r - 1e-9, coefficients) > 0)
    t = first_root(coefficients)
    assert t == pytest.approx(falls[0], abs=1e-9) if falls else t == math.inf


def test_quartic_that_touches_zero_from_above():
    assert first_root([4.0, 0.0, -4.0, 0.0, 1.0 + 1e-9]) == math.inf  # (t^2 - 2)^2, lifted


def test_root_of_a_turning_gap():
    # 1.1 - t - sin t, whose curvature is at most 1
    def gap(t):
        return 1.1 - t - math.sin(t)

    def step(t):
        return first_fall(gap(t), -1.0 - math.cos(t), -1.0)

    t = first_touch(gap, step, 0.0, 0.0, 10.0)
    assert gap(t) <= 0.0 < gap(math.nextafter(t, 0.0)) + 2e-16


def test_gap_open_until_the_horizon():
    assert first_touch(lambda t: 2.0 + math.sin(t), lambda t: 0.5, 1e-12, 0.0, 100.0) == math.inf
