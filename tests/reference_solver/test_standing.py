"""The textbook step with ten sweeps: columns stand, pyramids come to rest, nothing creeps to one side."""

import numpy as np
import pytest

from reference_solver import Model, Settings, Simulation
from tests.verification.space import GRAVITY as G
from tests.verification.space import SPACES

PLANE = SPACES[0]


def pyramid(rows, gap):
    places = [((1.0 + gap) * (k - 0.5 * (rows - r - 1)), 0.5 + r) for r in range(rows) for k in range(rows - r)]
    return Model(2, [PLANE.floor(), *(PLANE.box(*place) for place in places)], (0.0, -G), 0.0, 0.5)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
@pytest.mark.parametrize("rate", [60, 240])
def test_minute_of_a_column_of_ten(space, rate):
    """Within .1 m sideways, a tenth of a box. In one order of corners it falls."""
    simulation = space.simulation(space.column([1.0] * 10), Settings.classical(1.0 / rate), G, 0.0, 0.5)
    start = simulation.pose
    for _ in range(60):
        simulation.advance(rate)
        assert np.abs(simulation.pose[:, : space.up]).max() < 0.1
    # Each contact gives by the slop at most, and by what one step closes before the impulses of all are found.
    assert float((start - simulation.pose)[:, space.up].max()) < 10 * 3.0 * G / rate**2


@pytest.mark.parametrize("gap", [0.0, 0.1])
@pytest.mark.parametrize("rate", [60, 240])
def test_a_pyramid_comes_to_rest(rate, gap):
    """To round-off: ten sweeps lift a corner by less than the slop, so that all corners go on carrying load."""
    simulation = Simulation(pyramid(13, gap), Settings.classical(1.0 / rate))
    simulation.advance(20 * rate)
    assert float(np.abs(simulation.twist).max()) < 1e-12


def test_pyramid_without_slop():
    """What the test before rests on: with half of what weight closes in a step corners part and are pushed for ever."""
    simulation = Simulation(pyramid(13, 0.1), Settings.classical(1.0 / 240, pull=0.25 * G))
    simulation.advance(2400)
    assert float(np.abs(simulation.twist).max()) > 1e-4
