"""How far Bullet's law of thin walls has a plate push out."""

import pytest

from adapters.bullet.laws import _split_push
from validation.catalogue import CATALOGUE

DT = 1 / 2000


def test_push_out_speed_of_a_plate_deeper_than_the_slop():
    """Profile one: contactERP of the overlap less the slop, in a step; up to 4 cm by speeds, which the ball has."""
    scene = CATALOGUE["thin_wall"].scene(3, {})
    assert _split_push(scene, 1 / 240, 0.04) == 0.0 == _split_push(scene, 1 / 240, 0.0)
    one, more, half = (_split_push(scene, dt, deep) for dt, deep in ((DT, 0.06), (DT, 0.07), (0.5 * DT, 0.06)))
    share = (more - one) * DT / 0.01
    assert 0.0 < share < 1.0 and half == pytest.approx(2.0 * one)
    assert 0.0 <= 0.06 - one * DT / share < 1e-3  # the slop
