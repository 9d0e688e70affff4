"""What an engine tells of an impulse by its part along the normal, and what stays unknown."""

import numpy as np
import pytest

from adapters.copied import along_normal


def test_smooth_contact_from_its_normal_part():
    normal = np.array([0.6, 0.0, -0.8])
    told = along_normal(2.5, normal.tolist(), rough=False)
    assert told == pytest.approx([1.5, 0.0, -2.0])
    assert told @ normal == pytest.approx(2.5)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rough_contact_known_only_along_an_axis(side):
    told = along_normal(2.5, [0.0, side, 1e-6], rough=True)
    assert told[1] == pytest.approx(2.5 * side) and np.isnan(told[::2]).all()
    assert np.isnan(along_normal(2.5, [0.6, 0.0, -0.8], rough=True)).all()
