"""Coulomb friction at rest and in motion, against closed forms."""

import math

import numpy as np
import pytest

G = 9.81
MU = 0.5


def tilted(ratio):
    """Gravity rotated so that tan(theta) = ratio * mu."""
    theta = math.atan(ratio * MU)
    return theta, (G * math.sin(theta), -G * math.cos(theta))


@pytest.mark.parametrize("shape", ["box", "two boxes"])
@pytest.mark.parametrize("ratio", [0.5, 0.9, 0.99, 0.999])
def test_creep_of_a_box_below_the_friction_limit(build, reference, ratio, shape):
    _, gravity = tilted(ratio)
    # The lower box carries what the upper one adds; two unit boxes still do not tip below tan(theta) = 1/2.
    bodies = [build.floor(), build.box(0.0, 0.5), build.box(0.0, 1.5)][: 2 if shape == "box" else 3]
    simulation = build.simulation(bodies, reference, gravity, 0.0, MU)
    record = simulation.record(480)
    assert np.abs(record.twist).max() <= 1e-12
    assert np.abs(record.pose - record.pose[0]).max() <= 1e-12


@pytest.mark.parametrize("ratio", [1.001, 1.01, 1.1, 1.5, 1.9])
def test_box_above_the_friction_limit(build, reference, ratio):
    theta, gravity = tilted(ratio)
    simulation = build.simulation([build.floor(), build.box(0.0, 0.5)], reference, gravity, 0.0, MU)
    record = simulation.record(480)
    acceleration = (record.twist[-1, 1, 0] - record.twist[0, 1, 0]) / record.t[-1]
    expected = G * (math.sin(theta) - MU * math.cos(theta))
    # The difference cancels to 1/1000 of its terms at worst: 1e-13 of the solver becomes 1e-10.
    assert acceleration == pytest.approx(expected, rel=1e-9)
    # The residual is scaled by the slip speed: 1e-13 of it may be left in the normal rows.
    assert np.abs(record.twist[:, 1, 2]).max() <= 2e-13 * max(record.twist[-1, 1, 0], 1.0)


def test_creep_of_classical_on_an_incline(build, classical):
    """Warm starting carries the ten sweeps of each step on to the solution within some ten steps."""
    _, gravity = tilted(0.999)
    simulation = build.simulation([build.floor(), build.box(0.0, 0.5)], classical, gravity, 0.0, MU)
    simulation.advance(60)
    assert np.abs(simulation.twist).max() <= 1e-12


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_box_that_slides_and_stands(build, reference, direction):
    bodies = [build.floor(), build.box(0.0, 0.5, (direction * 3.0, 0.0, 0.0), half=(0.5, 0.25))]
    bodies[1] = build.box(0.0, 0.25, (direction * 3.0, 0.0, 0.0), half=(0.5, 0.25))
    simulation = build.simulation(bodies, reference, (0.0, -G), 0.0, MU)
    simulation.advance(100)
    assert simulation.twist[1, 0] == pytest.approx(direction * (3.0 - MU * G * 100 * build.dt), abs=1e-12)
    simulation.advance(100)  # stops after 147 steps
    assert np.abs(simulation.twist).max() <= 1e-12


def test_disc_that_rolls_down_an_incline(build, reference):
    theta, gravity = tilted(0.8)
    simulation = build.simulation([build.floor(), build.disc(0.0, 0.5)], reference, gravity, 0.0, MU)
    simulation.advance(240)
    assert simulation.twist[1, 0] == pytest.approx(G * math.sin(theta) / 1.5, rel=1e-12)


def test_grip_grows_with_load(build, reference):
    """A pressing force F raises the limit to mu (m g + F): the box holds just below it and slides just above."""
    limit = MU * (G + 20.0)
    for pull, held in ((0.999 * limit, True), (1.001 * limit, False)):
        pressed = build.box(0.0, 0.1, half=(1.0, 0.1), force=(pull, -20.0))
        simulation = build.simulation([build.floor(), pressed], reference, (0.0, -G), 0.0, MU)
        simulation.advance(240)
        expected = 0.0 if held else (pull - limit) * 1.0
        assert simulation.twist[1, 0] == pytest.approx(expected, abs=1e-11)


def test_box_on_a_conveyor(build, reference):
    """A floor with a prescribed tangential speed V: slip lasts V / (mu g), then exact stick (scene S-C9)."""
    belt = build.floor(motion="prescribed", twist=(1.5, 0.0, 0.0))
    simulation = build.simulation([belt, build.box(0.0, 0.25, half=(0.5, 0.25))], reference, (0.0, -G), 0.0, MU)
    simulation.advance(60)
    assert simulation.twist[1, 0] == pytest.approx(MU * G * 60 * build.dt, rel=1e-12)
    simulation.advance(60)
    assert simulation.twist[1] == pytest.approx([1.5, 0.0, 0.0], abs=1e-12)


# In the loop of events impulses add up over all that happens in a step, in which normals turn.
@pytest.mark.parametrize("settings", ["classical", "fixed_step"], indirect=True)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_friction_cone_and_pull_of_contacts(build, settings, seed):
    rng = np.random.default_rng(seed)
    bodies = [build.floor()]
    for i in range(8):
        bodies.append(build.box(rng.uniform(-0.3, 0.3), 0.6 + 1.2 * i, half=(0.5, 0.4), angle=rng.uniform(-0.4, 0.4)))
        bodies.append(build.disc(1.2 + rng.uniform(-0.1, 0.1), 0.5 + 1.1 * i, mass=3.0))
    simulation = build.simulation(bodies, settings, (0.0, -G), 0.2, MU)
    contacts = simulation.record(360, contacts=True).contacts
    normal = (contacts.impulse * contacts.normal).sum(axis=1)
    tangent = contacts.impulse[:, 1] * contacts.normal[:, 0] - contacts.impulse[:, 0] * contacts.normal[:, 1]
    assert (normal > 0.0).sum() > 1000
    # Components are recomputed from world vectors: a few roundings of the largest impulse.
    noise = 1e-14 * normal.max()
    assert normal.min() >= -noise
    assert (np.abs(tangent) <= MU * normal + noise).all()
