"""When one looks changes nothing: parts of a run, copies, and other dt give the same bits."""

import copy

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Settings, Simulation

G = 9.81


def falling_box_and_disc():
    """A box that lands on a corner and tips, and a disc that bounces and rolls."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    box = Body(Box((0.5, 0.25)), 1.0, 0.1, (0.0, 0.8, 0.3), (0.5, 0.0, 1.0))
    disc = Body(Disc(0.2), 0.5, 0.01, (1.5, 0.4, 0.0), (-1.0, 0.0, 0.0))
    return Model(2, [floor, box, disc], (0.0, -G), 0.3, 0.4)


def looked_at(dt, *parts):
    simulation = Simulation(falling_box_and_disc(), Settings.reference(dt))
    for steps in parts:
        simulation.advance(steps)
    return simulation.pose, simulation.twist


@pytest.mark.parametrize("parts", [(240,), (1,) * 240, (7, 100, 133)])
def test_bits_of_a_run_in_parts(parts):
    whole, parted = looked_at(1 / 240, 240), looked_at(1 / 240, *parts)
    assert np.array_equal(whole[0], parted[0]) and np.array_equal(whole[1], parted[1])


@pytest.mark.parametrize("steps", [1, 4, 1024])
def test_bits_of_a_run_with_another_dt(steps):
    """One second in steps that are powers of two, so that the time of the end has no round-off."""
    pose, twist = looked_at(1 / steps, steps)
    truth = looked_at(1 / 64, 64)
    assert np.array_equal(pose, truth[0]) and np.array_equal(twist, truth[1])


def test_bits_of_a_copy():
    simulation = Simulation(falling_box_and_disc(), Settings.reference(1 / 240))
    simulation.advance(100)
    other = copy.copy(simulation)
    other.advance(140)
    assert not np.array_equal(simulation.pose, other.pose)
    simulation.advance(140)
    assert np.array_equal(simulation.pose, other.pose) and np.array_equal(simulation.twist, other.twist)


def test_tolerance_as_change_of_an_answer():
    """A rod falls over on its round end, without an event: coarser tolerances differ by more."""
    rod = Body(Capsule(0.4, 0.1), 1.0, 0.06, (0.0, 0.1 + 0.4 * np.sin(1.4), 1.4))
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), rod], (0.0, -G), 0.0, 3.0)
    settings = [Settings.reference(1 / 240, tolerance) for tolerance in (1e-12, 1e-10, 3e-9)]
    runs = [Simulation(model, each).record(120).pose for each in settings]
    near, far = (np.abs(run - runs[0]).max() for run in runs[1:])
    assert 0.0 < near < far < 1e-4


def test_no_problem_of_a_step():
    with pytest.raises(ValueError, match="fixed_step"):
        Simulation(falling_box_and_disc(), Settings.reference(1 / 240)).step_problem()
