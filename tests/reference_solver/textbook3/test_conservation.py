"""What collisions must keep: momentum, angular momentum, and never more energy than before."""

import dataclasses

import numpy as np
import pytest

from reference_solver import Settings


@pytest.fixture(params=["classical", "reference"])
def unpushed(request, build):
    """Without position correction, which moves bodies and so shifts x cross m v."""
    return dataclasses.replace(getattr(Settings, request.param)(build.dt), position_correction="none")


def cloud(build, settings, restitution, friction, seed=3):
    """Twelve spheres and boxes flying towards each other."""
    rng = np.random.default_rng(seed)
    bodies = []
    for i in range(12):
        place = np.array([i % 3, i // 3 % 2, i // 6]) * 1.3 + 0.05 * rng.normal(size=3)
        velocity = -place + [1.3, 0.65, 0.65] + 0.3 * rng.normal(size=3)
        if i % 2:
            bodies.append(build.sphere(place, velocity, rng.normal(size=3), 0.4, 0.5 + rng.random()))
        else:
            half = 0.3 + 0.1 * rng.random(3)
            bodies.append(build.box(place, velocity, rng.normal(size=3), tuple(half), 1.0, tuple(rng.normal(size=4))))
    return build.simulation(bodies, settings, restitution=restitution, friction=friction)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_momentum_in_free_collisions(build, mechanics, unpushed, friction):
    simulation = cloud(build, unpushed, 0.6, friction)
    momentum, angular = mechanics.momentum(simulation), mechanics.angular_momentum(simulation)
    contacts = 0
    for _ in range(240):
        simulation.advance(1)
        contacts += len(simulation.contacts())
    assert contacts > 10
    # 240 steps of round-off at speeds and places of order one: 1e-15 a step
    assert np.abs(mechanics.momentum(simulation) - momentum).max() <= 1e-12
    assert np.abs(mechanics.angular_momentum(simulation) - angular).max() <= 1e-12


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_frictionless_collisions_never_gain_energy(build, mechanics, unpushed, restitution):
    """Newton's law without friction loses energy or keeps it; free rotation swings by (dt w)^2 of it, 2e-4 here."""
    simulation = cloud(build, unpushed, restitution, 0.0)
    before = mechanics.kinetic_energy(simulation)
    simulation.advance(240)
    after = mechanics.kinetic_energy(simulation)
    assert after <= before * (1 + 2e-4)
    if restitution == 1.0 and unpushed.solver == "block":
        assert after == pytest.approx(before, rel=2e-3)
    else:
        assert restitution == 1.0 or after < 0.99 * before


# In the loop of events impulses add up over all that happens in a step, in which normals turn.
@pytest.mark.parametrize("settings", ["classical", "fixed_step"], indirect=True)
def test_opposite_and_push_of_impulses(build, settings):
    simulation = cloud(build, settings, 0.3, 0.4)
    for _ in range(120):
        simulation.advance(1)
        contacts = simulation.contacts()
        pressed = np.einsum("kd,kd->k", contacts.impulse, contacts.normal)
        dragged = np.linalg.norm(contacts.impulse - pressed[:, None] * contacts.normal, axis=1)
        assert (pressed >= -1e-15).all()
        assert (dragged <= 0.4 * pressed * (1 + 1e-12) + 1e-15).all()
