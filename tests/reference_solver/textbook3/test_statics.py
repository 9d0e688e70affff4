"""Bodies at rest: columns, loads shared by redundant points, leaning loads, and how fast sweeps converge."""

import dataclasses
import math

import numpy as np
import pytest

from reference_solver import Body, HalfSpace
from reference_solver.compilation import from_python
from reference_solver.textbook3 import manifolds as contacts
from reference_solver.textbook3.state import BODY, allocate_manifolds, allocate_memory

recall_points = from_python(contacts.recall_points)

G = 9.81


def interface_sums(simulation, n):
    """Normal impulse carried by each interface of a column, from the floor up [N s]."""
    contacts = simulation.contacts()
    return np.array([contacts.impulse[contacts.body_a == i, 2].sum() for i in range(n)])


def test_column_of_twenty_without_warm_start(build, fixed_step):
    cold = dataclasses.replace(fixed_step, warm_starting=False)
    simulation = build.column(20, cold)
    simulation.advance(3)
    assert interface_sums(simulation, 20) == pytest.approx(G * build.dt * np.arange(20, 0, -1), rel=1e-9)
    assert simulation.certificate["converged"]
    assert simulation.certificate["worst_sweeps"] <= 2000  # plain Gauss-Seidel would need 373 a decimal digit


def test_load_off_centre_on_four_corners(build, reference):
    """A box pressed by 30 N and tilted by 3 N m: the corners' resultant must balance both, whatever their split."""
    box = build.box((0.0, 0.0, 0.25), half=(0.5, 0.4, 0.25), force=(4.0, 3.0, -30.0), torque=(2.0, -3.0, 1.0))
    simulation = build.simulation([build.floor(), box], reference, (0.0, 0.0, -G), friction=0.5)
    simulation.advance(10)
    contacts = simulation.contacts()
    assert len(contacts) == 4
    # The box stays at rest, so that forces and moments about its centre cancel in every step.
    assert contacts.impulse.sum(axis=0) == pytest.approx(np.array([-4.0, -3.0, 30.0 + G]) * build.dt, abs=1e-13)
    moment = np.cross(contacts.point - [0.0, 0.0, 0.25], contacts.impulse).sum(axis=0)
    assert moment == pytest.approx(np.array([-2.0, 3.0, -1.0]) * build.dt, abs=1e-13)
    assert np.abs(simulation.twist).max() <= 1e-12


@pytest.mark.parametrize("direction", [0.0, 0.6, math.pi / 4])
def test_loads_of_a_ball_in_a_corner_of_three_planes(build, reference, direction):
    """Three mutually normal planes around the vertical, mu = 0: each carries m g / sqrt(3)."""
    c, s = math.cos(direction), math.sin(direction)
    bodies = []
    for k in range(3):
        around = 2 * math.pi * k / 3
        lateral = math.sqrt(2 / 3)
        x, y = lateral * math.cos(around), lateral * math.sin(around)
        normal = (c * x - s * y, s * x + c * y, 1 / math.sqrt(3))
        bodies.append(plane(normal))
    ball = build.sphere((0.0, 0.0, 0.5 * math.sqrt(3)))
    simulation = build.simulation([*bodies, ball], reference, (0.0, 0.0, -G))
    simulation.advance(10)
    pressed = np.linalg.norm(simulation.contacts().impulse, axis=1)
    assert pressed == pytest.approx(np.full(3, G * build.dt / math.sqrt(3)), rel=1e-12)


def recalled(remembered, found):
    """Normal impulse [N s] with which each point of this step starts; both bodies have a half width of 0.5 m.

    Parameters
    ----------
    remembered
        Contact points of the step before: (feature, x [m], normal impulse [N s]) each.
    found
        Contact points of this step: (feature, x [m]) each.
    """
    manifolds, memory = allocate_manifolds(1), allocate_memory(1)
    manifolds.frame[0] = np.eye(3)
    manifolds.points[0], memory.points[0] = len(found), len(remembered)
    for o, (feature, x, impulse) in enumerate(remembered):
        memory.feature[0, o], memory.arm[0, o, 0], memory.impulse[0, o] = feature, x, (0.1, 0.2, impulse)
    for p, (feature, x) in enumerate(found):
        manifolds.feature[0, p], manifolds.arm_b[0, p, 0] = feature, x
        manifolds.impulse[0, p] = 0.0
    manifolds.body_b[0] = 1
    bodies = np.zeros(2, BODY).view(np.recarray)
    bodies.extent = 0.5
    recall_points(bodies, manifolds, 0, memory, 0)
    return manifolds.impulse[0, : len(found), 2].tolist()


def test_first_impulses_by_feature_and_place():
    before = [(5, -0.5, 1.0), (6, 0.5, 2.0), (7, 0.0, 4.0)]
    assert recalled(before, [(5, -0.5), (6, 0.5), (7, 0.0)]) == [1.0, 2.0, 4.0]
    assert recalled(before, [(6, -0.5), (5, 0.5)]) == [2.0, 1.0]  # the feature counts first
    assert recalled(before, [(8, 0.49), (7, 0.0), (9, -0.54)]) == [2.0, 4.0, 1.0]
    assert recalled(before, [(8, 0.44), (9, -0.56)]) == [0.0, 0.0]  # a tenth of the half width is too far
    assert recalled([(5, 0.0, 1.0), (6, 0.03, 2.0)], [(8, 0.02), (9, 0.04)]) == [2.0, 1.0]  # each impulse is given once
    assert recalled(before[:1], [(8, -0.49), (5, -0.5)]) == [0.0, 1.0]
    assert recalled([], [(8, 0.4)]) == [0.0]


def plane(normal):
    """Fixed half-space through the origin."""
    return Body(HalfSpace(normal), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))


def test_speed_of_boxes_pushed_out_of_an_overlap(build, fixed_step):
    """Two boxes deep in each other and in the floor are pushed apart by position alone."""
    bodies = [build.floor(), build.box((0.0, 0.0, 0.4)), build.box((0.1, 0.0, 1.2))]
    simulation = build.simulation(bodies, fixed_step)
    simulation.advance(50)
    assert np.abs(simulation.twist).max() <= 1e-12
    assert simulation.pose[1, 2] >= 0.5 - 1e-9 and simulation.pose[2, 2] - simulation.pose[1, 2] >= 1.0 - 1e-9
