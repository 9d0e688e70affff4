"""Momentum and angular momentum in free collisions."""

import numpy as np
import pytest

from reference_solver import Body, Box, Disc


def crowd(build, seed, shapes):
    """A ring of bodies thrown at the middle, spinning, no gravity."""
    rng = np.random.default_rng(seed)
    bodies = []
    for i in range(12):
        angle = 2.0 * np.pi * i / 12.0
        place = 2.5 * np.array([np.cos(angle), np.sin(angle)])
        velocity = -place * rng.uniform(0.3, 1.0)
        shape = Disc(0.3) if (shapes == "disc" or (shapes == "mixed" and i % 2)) else Box((0.3, 0.2))
        mass = rng.uniform(0.5, 2.0)
        bodies.append(Body(shape, mass, 0.05 * mass, (*place, rng.uniform(0, 3)), (*velocity, rng.uniform(-3, 3))))
    return bodies


def momenta(model, record):
    mass = np.array([body.mass for body in model.bodies])
    inertia = np.array([body.inertia for body in model.bodies])
    v, x = record.twist[:, :, :2], record.pose[:, :, :2]
    linear = (mass[None, :, None] * v).sum(axis=1)
    angular = (mass * (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0]) + inertia * record.twist[..., 2]).sum(axis=1)
    return linear, angular


@pytest.mark.parametrize("shapes", ["disc", "box", "mixed"])
@pytest.mark.parametrize("restitution", [0.0, 0.7])
def test_free_collisions_keep_momentum(build, settings, shapes, restitution):
    simulation = build.simulation(crowd(build, 7, shapes), settings, (0.0, 0.0), restitution, 0.4)
    record = simulation.record(480, contacts=True)
    linear, _ = momenta(simulation.model, record)
    assert (np.abs(record.contacts.impulse).sum(axis=1) > 0.0).sum() >= 10, "nothing collided"
    # 480 steps of a few dozen roundings of momenta of order ten.
    assert np.abs(linear - linear[0]).max() <= 1e-12


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_energy_lost_in_frictionless_collisions(build, reference, e):
    """One impact: dT = -(1 - e^2) m_eff v_rel^2 / 2."""
    a, b = build.disc(-0.5, 0.0, (3.0, 1.0, 2.0), mass=2.0), build.disc(0.5, 0.0, (-1.0, -4.0, 0.0), mass=5.0)
    simulation = build.simulation([a, b], reference, restitution=e)
    before = simulation.twist
    simulation.advance(1)
    after = simulation.twist
    mass = np.array([2.0, 5.0])
    change = 0.5 * (mass * ((after[:, :2] ** 2).sum(axis=1) - (before[:, :2] ** 2).sum(axis=1))).sum()
    assert change == pytest.approx(-0.5 * (1 - e * e) * (10.0 / 7.0) * 16.0, abs=1e-13 * 50.0)
