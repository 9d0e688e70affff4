"""Steps cut at events: planar trajectories against their closed forms, at any step length."""

import math

import numpy as np
import pytest

from reference_solver import Settings

G = 9.81
DOWN = (0.0, -G)


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240])
@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_sliding_box_until_it_stops(build, dt, mu):
    speed = 3.0
    box = build.box(0.0, 0.5, (speed, 0.0, 0.0), half=(0.7, 0.5))
    simulation = build.simulation([build.floor(), box], Settings.reference(dt), DOWN, 0.0, mu)
    simulation.advance(math.ceil(speed / (mu * G) / dt) + 10)
    assert simulation.pose[1, 0] == pytest.approx(speed**2 / (2.0 * mu * G), rel=1e-12)
    assert np.abs(simulation.twist[1]).max() < 1e-13


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240])
def test_disc_that_slides_until_it_rolls(build, dt):
    mu, speed, steps = 0.3, 3.0, 400
    ball = build.disc(0.0, 0.5, (speed, 0.0, 0.0))
    simulation = build.simulation([build.floor(), ball], Settings.reference(dt), DOWN, 0.0, mu)
    simulation.advance(steps)
    slides = speed / (3.0 * mu * G)  # v - mu g t = mu g t (m r^2 / I), I = m r^2 / 2
    rolls = 2.0 / 3.0 * speed
    truth = speed * slides - 0.5 * mu * G * slides**2 + rolls * (steps * dt - slides)
    assert simulation.pose[1, 0] == pytest.approx(truth, rel=1e-12)
    assert simulation.twist[1] == pytest.approx([rolls, 0.0, -rolls / 0.5], abs=1e-12)


@pytest.mark.parametrize("spin", [0.0, 3.0, 100.0])
def test_energy_and_rest_of_a_tumbling_box(build, spin):
    box = build.box(0.0, 3.0, (0.0, 0.0, spin), angle=0.3)
    simulation = build.simulation([build.floor(), box], Settings.reference(build.dt), DOWN, 0.5, 0.4)
    record = simulation.record(2400)
    twist, pose = record.twist[:, 1], record.pose[:, 1]
    energy = 0.5 * (twist[:, 0] ** 2 + twist[:, 1] ** 2 + twist[:, 2] ** 2 / 6.0) + G * pose[:, 1]
    # A corner that turns drifts off the floor by second order in the step and is put back: round-off of the energy
    # otherwise, 30 J to 900 J.
    assert np.diff(energy).max() < 1e-6
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
