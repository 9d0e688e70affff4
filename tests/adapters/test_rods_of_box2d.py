"""Reasons of both Box2D for a rod that lands on its end, shown by closed forms."""

import numpy as np
import pytest
from rods import end_of, struck, textbook

#: Singles, of speeds of some metres a second and a hundred roundings.
SINGLES = 1e-5
#: Share of an arm of some tenths of a metre that is lost where places are told in singles as coarse as a large ground.
PLACES = 1e-4


@pytest.mark.optional("box2d")
@pytest.mark.parametrize("delay", [0.0507, 0.0525, 0.0539])
@pytest.mark.parametrize("params", [{}, {"e": 0.5, "mu": 0.1}])
def test_box2d_strike_of_a_rod_at_half_the_overlap(params, delay):
    params = params | {"delay": delay}
    found, depth = struck("box2d", "tuned", params)
    assert np.abs(found - textbook(params, 0.5 * depth)).max() < SINGLES
    assert np.abs(found - textbook(params)).max() > 5.0 * SINGLES


@pytest.mark.optional("box2d3")
@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize("params", [{"e": 0.8}, {"e": 0.5, "mu": 0.1}])
def test_rebound_of_box2d3_without_friction(profile, params):
    """One that is faster turns the rod and lifts it, and leaves it as fast along the floor, unlike the textbook's."""
    x, _, square, p = end_of(params)
    slower = params | {"e": 0.1}
    found, _ = struck("box2d3", profile, params)
    rise, ahead, spin = found - struck("box2d3", profile, slower)[0]
    assert abs(ahead) < SINGLES < 1e-3 * abs((textbook(params) - textbook(slower))[1])
    assert spin == pytest.approx(x / square * rise, rel=PLACES)
    assert found[0] + x * found[2] == pytest.approx(p["e"] * p["v"], rel=PLACES)
