"""Gauss' rule that scenes share: as exact as the rule is, made once, and not to be changed by who uses it."""

import numpy as np
import pytest

from validation.truths.quadrature import gauss


@pytest.mark.parametrize("count", [1, 5, 64, 96])
def test_polynomials_of_twice_the_order_are_integrated_exactly(count):
    x, weight = gauss(count)
    for power in (0, 1, 2 * count - 2, 2 * count - 1):
        truth = 2.0 / (power + 1) if power % 2 == 0 else 0.0
        assert weight @ x**power == pytest.approx(truth, rel=1e-12, abs=1e-14)
    assert np.array_equal(gauss(count)[0], np.polynomial.legendre.leggauss(count)[0])


def test_read_only_quadrature_rule():
    assert gauss(7) is gauss(7)
    for values in gauss(7):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1.0
