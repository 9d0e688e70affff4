"""What the certificate counts as unique is: enumeration finds one answer (E66)."""

import numpy as np
import pytest

from reference_solver import Body, Disc, Settings, Sphere
from reference_solver.exact_contact import coulomb_solutions
from tests.verification.space import SPACES

DT, G = 1.0 / 240.0, 9.81


def test_uniqueness_of_a_planar_contact_below_the_bound():
    """Random W, q and friction up to the bound mu |k_nt| = k_n: never none, never two."""
    rng = np.random.default_rng(66)
    for _ in range(2000):
        root = rng.normal(size=(2, 2))
        matrix = root @ root.T + 1e-3 * np.eye(2)
        mu = rng.uniform(0.0, 0.999) * matrix[0, 0] / abs(matrix[0, 1])
        found = coulomb_solutions(matrix, rng.normal(size=2), [mu])
        assert len(found) == 1


def round_body(dimension, x):
    if dimension == 2:
        return Body(Disc(0.5), 1.0, 0.125, (x, 0.5, 0.0), (1.0, 0.0, 0.0))
    return Body(Sphere(0.5), 1.0, (0.1,) * 3, (x, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0), (1.0, 0.2, 0.0, 0.0, 0.0, 0.0))


def box(dimension, x):
    space = SPACES[dimension - 2]
    return space.box(x, 0.5, space.twist(1.0))


def certificate(dimension, bodies, friction):
    space = SPACES[dimension - 2]
    simulation = space.simulation([space.floor(), *bodies], Settings.fixed_step(DT), G, 0.0, friction)
    simulation.advance(5)
    return simulation.certificate


@pytest.mark.parametrize("dimension", [2, 3])
def test_uniqueness_of_separate_round_bodies_and_smooth_boxes(dimension):
    balls = [round_body(dimension, x) for x in (0.0, 3.0)]
    for bodies, friction in ((balls, 0.4), ([box(dimension, 0.0)], 0.0), (balls[:1], 5.0)):
        found = certificate(dimension, bodies, friction)
        assert found["unique"] == found["solves"] > 0


@pytest.mark.parametrize("dimension", [2, 3])
def test_uniqueness_of_a_box_on_several_rough_points(dimension):
    found = certificate(dimension, [box(dimension, 0.0)], 0.4)
    assert found["unique"] == 0 < found["solves"]


@pytest.mark.parametrize("dimension", [2, 3])
def test_uniqueness_of_a_ball_in_a_rough_and_a_smooth_corner(dimension):
    """It is body B of both contacts: friction of one presses it into the other."""
    wall = SPACES[dimension - 2].wall(-1.0, -0.5)
    for friction, share in ((0.4, 0.0), (0.0, 1.0)):
        found = certificate(dimension, [wall, round_body(dimension, 0.0)], friction)
        assert found["unique"] == share * found["solves"] and found["solves"] > 0
