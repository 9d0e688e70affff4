"""Recording, copies, determinism, and the uncompiled solver."""

import copy

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation

DT = 1.0 / 240.0
PROFILES = [Settings.classical, Settings.reference]


def mixed_model():
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    bodies = [floor]
    for i in range(4):
        bodies.append(Body(Box((0.5, 0.4)), 1.0, 0.2, (0.2 * i, 0.6 + 1.1 * i, 0.1 * i), (0.5, 0.0, -0.3)))
        bodies.append(Body(Disc(0.3), 2.0, 0.09, (1.6, 0.4 + 0.7 * i, 0.0), (-1.0, 0.0, 0.0)))
    return Model(2, bodies, (0.0, -9.81), 0.3, 0.4)


def bits(record):
    arrays = [record.t, record.pose, record.twist, record.offset, record.contacts.impulse, record.contacts.feature]
    return [np.ascontiguousarray(array).tobytes() for array in arrays]


@pytest.mark.parametrize("profile", PROFILES)
def test_two_runs_give_the_same_bits(profile):
    first, second = (Simulation(mixed_model(), profile(DT)).record(80, contacts=True) for _ in range(2))
    assert bits(first) == bits(second)
    assert len(first.contacts) > 50


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_bits_and_kernels_of_a_copy(copied):
    """Laws of pairs that are one number stay one: a table of them has another type, and all kernels would compile."""
    simulation = Simulation(mixed_model(), Settings.classical(DT))
    simulation.advance(5)
    pose, other = simulation.pose, copied(simulation)
    other.advance(5)
    assert np.array_equal(simulation.pose, pose) and simulation.time == 5 * DT
    simulation.advance(5)
    assert np.array_equal(other.pose, simulation.pose) and np.array_equal(other.twist, simulation.twist)
    assert other.time == simulation.time
    assert [x.strides for x in other._world._laws] == [x.strides for x in simulation._world._laws] == [(0, 0)] * 2


@pytest.mark.parametrize("profile", PROFILES)
def test_bits_of_one_call_and_many_calls(profile):
    whole = Simulation(mixed_model(), profile(DT)).record(60, stride=3, contacts=True)
    steps = Simulation(mixed_model(), profile(DT))
    for sample in range(1, 21):
        steps.advance(3)
        rows = slice(whole.offset[sample], whole.offset[sample + 1])
        assert (steps.pose == whole.pose[sample]).all()
        assert (steps.contacts().impulse == whole.contacts.impulse[rows]).all()
    assert steps.time == whole.t[-1]


def test_first_state_of_a_record():
    simulation = Simulation(mixed_model(), Settings.classical(DT))
    simulation.advance(5)
    record = simulation.record(10, stride=4)
    assert record.t == pytest.approx([5 * DT, 9 * DT, 13 * DT], rel=1e-15)
    assert record.offset.tolist() == [0, 0, 0, 0]
    assert simulation.time == 15 * DT


def test_contact_buffers_grow_as_needed():
    """200 boxes, three samples: far more rows than room was made for at first."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    boxes = [Body(Box((0.5, 0.5)), 1.0, 1 / 6, (1.0 * (i % 20), 0.5 + i // 20, 0.0)) for i in range(200)]
    model = Model(2, [floor, *boxes], (0.0, -9.81), 0.0, 0.5)
    record = Simulation(model, Settings.classical(DT, 1)).record(3, contacts=True)
    counts = np.diff(record.offset)
    # Below each box two points, beside it two more, corner to corner sometimes one: all are found in each step.
    assert (counts[1:] >= 2 * 200 + 2 * 190).all()
    for s in range(1, 4):
        rows = slice(record.offset[s], record.offset[s + 1])
        key = record.contacts.body_a[rows] * 1000 + record.contacts.body_b[rows]
        assert (np.diff(key * 64 + record.contacts.feature[rows]) > 0).all()


def test_copies_handed_out():
    simulation = Simulation(mixed_model(), Settings.classical(DT))
    simulation.pose[:] = 7.0
    simulation.twist[:] = 7.0
    assert simulation.pose[0, 0] == 0.0
    assert simulation.twist[0, 0] == 0.0


def test_twist_of_prescribed_bodies():
    wall = Body(Box((0.1, 1.0)), pose=(0.0, 0.0, 0.0), twist=(2.0, 0.0, 0.5), motion="prescribed")
    ball = Body(Disc(0.2), 5.0, 0.1, (0.5, 0.0, 0.0), (-3.0, 0.0, 0.0))
    simulation = Simulation(Model(2, [wall, ball], (0.0, 0.0), 0.5, 0.5), Settings.reference(DT))
    simulation.advance(48)
    assert simulation.twist[0].tolist() == [2.0, 0.0, 0.5]
    assert simulation.pose[0] == pytest.approx([0.4, 0.0, 0.1], rel=1e-12)
    assert simulation.twist[1, 0] > 2.0


def test_fall_of_a_free_body_by_semi_implicit_euler():
    """x_n = x_0 + v_0 t + g t (t + h)/2, v exact; force and torque alike."""
    body = Body(Disc(0.5), 2.0, 0.25, (1.0, 2.0, 0.3), (0.5, -1.0, 2.0), force=(3.0, 1.0), torque=-0.5)
    simulation = Simulation(Model(2, [body], (0.0, -9.81), 0.0, 0.0), Settings.classical(DT))
    simulation.advance(240)
    rate = np.array([1.5, -9.31, -2.0])
    start = np.array([0.5, -1.0, 2.0])
    assert simulation.twist[0] == pytest.approx(start + rate, rel=1e-13)
    assert simulation.pose[0] == pytest.approx(np.array([1.0, 2.0, 0.3]) + start + 0.5 * rate * (1.0 + DT), rel=1e-13)


@pytest.mark.parametrize("dimension", [2, 3])
def test_world_without_a_free_body(dimension):
    normal = (0.0,) * (dimension - 1) + (1.0,)
    pose, twist = ((0.0,) * 3, (0.0,) * 3) if dimension == 2 else ((0.0,) * 3 + (1.0,) + (0.0,) * 3, (0.0,) * 6)
    load = (0.0,) * dimension
    torque = 0.0 if dimension == 2 else (0.0,) * 3
    floor = Body(HalfSpace(normal, 0.0), pose=pose, twist=twist, motion="fixed", force=load, torque=torque)
    model = Model(dimension, (floor,), (0.0,) * dimension, np.zeros((1, 1)), np.zeros((1, 1)))
    simulation = Simulation(model, Settings.classical(1 / 240))
    simulation.advance(3)
    assert len(simulation.contacts().gap) == 0
