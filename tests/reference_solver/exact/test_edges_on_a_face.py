"""A bar in space with a corner on a face, and an edge that comes down on the end of that face."""

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, HalfSpace, Model, Settings, Simulation
from reference_solver.geometry import gap, rotation

G = 9.81
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
#: Half sides of the bar, and its lowest edge below its centre where it is turned by 45 degrees about its length [m].
LONG, SIDE = 0.5, 0.1
LOW = np.sqrt(2.0) * SIDE
TURNED = (np.cos(np.pi / 8), np.sin(np.pi / 8), 0.0, 0.0)


@pytest.mark.parametrize(("open_by", "speed", "e"), [(9e-14, 0.1, 0.0), (0.0, 1e-5, 0.3)])
def test_edge_within_round_off_of_the_end_of_a_face(open_by, speed, e):
    """The bar's lowest edge, one end of it on the face, turns about that end; its other end is beyond the face.

    Either it is open by what counts as a gap and no more, or its rebound rises by less than round-off of heights.
    """
    table = Body(Box((1.0, 1.0, 0.5)), motion="fixed", pose=(0.0, 0.0, -0.5, *UPRIGHT))
    lean = 0.5 * open_by / LONG
    turn = np.array((np.cos(0.5 * lean), 0.0, -np.sin(0.5 * lean), 0.0))
    pose = (0.7, 0.0, LOW + 0.5 * open_by, *product(turn, TURNED))
    spin = 0.5 * speed / LONG
    bar = Body(Box((LONG, SIDE, SIDE)), 1.0, (0.01, 0.1, 0.1), pose, (spin * LOW, 0.0, -0.5 * speed, 0.0, spin, 0.0))
    simulation = Simulation(Model(3, [table, bar], (0.0, 0.0, -G), e, 0.0), Settings.reference(1 / 100))
    for _ in range(5):
        simulation.advance(1)
        found = gap(table.shape, np.array([table.pose]), bar.shape, simulation.pose[1][None])
        assert found.min() > -1e-11


def product(q, p):
    """Quaternion of the turn p, then q."""
    (a, *u), (b, *v) = q, p
    u, v = np.array(u), np.array(v)
    return (a * b - u @ v, *(a * v + b * u + np.cross(u, v)))


def test_rod_that_rolls_on_a_turntable():
    """Friction holds both its ends, and what one row along the rod says the other says as well: both stay closed."""
    spin, radius, x, y = 0.5, 0.15, 0.6, 0.3
    turning = (0.0, 0.0, 0.0, 0.0, 0.0, spin)
    table = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="prescribed", twist=turning)
    twist = (-spin * y, spin * x, 0.0, 0.0, 0.0, spin)
    rod = Body(Capsule(0.2, radius), 1.0, (0.01, 0.03, 0.03), (x, y, radius, *UPRIGHT), twist)
    simulation = Simulation(Model(3, [table, rod], (0.0, 0.0, -G), 0.0, 0.5), Settings.reference(1 / 10))
    simulation.advance(20)
    along = rotation(simulation.pose[1][None])[0, :, 0]
    assert abs(simulation.pose[1][2] - radius) < 1e-11 and abs(along[2]) < 1e-10
    assert simulation.twist[1, 5] == pytest.approx(spin, abs=1e-10)  # of seven steps to 1e-11
