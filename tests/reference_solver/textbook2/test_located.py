"""A box that tumbles to rest, and impulses of steps with events, in the plane."""

import numpy as np
import pytest

from reference_solver import Settings
from reference_solver.settings import TOLERANCE

G = 9.81
DOWN = (0.0, -G)


@pytest.mark.parametrize("spin", [0.0, 3.0, 100.0])
def test_energy_and_rest_of_a_tumbling_box(build, spin):
    box = build.box(0.0, 3.0, (0.0, 0.0, spin), angle=0.3)
    simulation = build.simulation([build.floor(), box], Settings.reference(build.dt), DOWN, 0.5, 0.4)
    record = simulation.record(2400)
    twist, pose = record.twist[:, 1], record.pose[:, 1]
    energy = 0.5 * (twist[:, 0] ** 2 + twist[:, 1] ** 2 + twist[:, 2] ** 2 / 6.0) + G * pose[:, 1]
    assert np.diff(energy).max() < TOLERANCE * energy[0]  # what a step may err by
    assert np.abs(twist[-1]).max() < 1e-12
    assert pose[-1, 1] == pytest.approx(0.5, abs=1e-12)


def test_impulses_of_a_step_with_events(build):
    """Momentum is what contacts and weight gave, in every step, also where a step is cut."""
    bodies = [build.floor(), build.box(0.0, 1.2, (1.0, 0.0, 4.0), angle=0.4), build.disc(0.3, 2.6, mass=2.0)]
    simulation = build.simulation(bodies, Settings.reference(build.dt), DOWN, 0.4, 0.5)
    record = simulation.record(480, contacts=True)
    for k in range(480):
        gained = np.zeros((3, 2))
        own = slice(record.offset[k + 1], record.offset[k + 2])
        np.add.at(gained, record.contacts.body_b[own], record.contacts.impulse[own])
        np.add.at(gained, record.contacts.body_a[own], -record.contacts.impulse[own])
        for i, mass in ((1, 1.0), (2, 2.0)):
            change = mass * (record.twist[k + 1, i, :2] - record.twist[k, i, :2])
            assert change == pytest.approx(gained[i] + mass * build.dt * np.array(DOWN), abs=1e-12)
