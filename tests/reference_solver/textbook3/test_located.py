"""Blows within a step in space, what they keep, and what comes to rest."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Settings

G = 9.81
DOWN = (0.0, 0.0, -G)


def falling(speed, dt, phase):
    """Height [m] and speed [m/s] from which a sphere reaches the floor after a share of a step, when, and how fast."""
    early = phase * dt
    start = speed - G * early
    place = 0.5 + start * early + 0.5 * G * early**2
    if start < 0.0 or place < 0.5:
        place, speed = 0.5 + speed * early + 0.5 * G * early**2, speed + G * early
        start = speed - G * early
    return place, start, early, speed


FALLS = [
    (e, speed, dt, phase)
    for e in (0.0, 0.3, 0.8, 1.0)
    for speed in (1e-3, 0.1, 6.0, 1e3)
    for dt in (1 / 60, 1 / 1000)
    for phase in (0.0, 0.137, 0.5, 0.999)
]


def bounces_once(e, speed, dt, phase):
    """Whether the flight after the impact lasts beyond the step."""
    _, _, early, speed = falling(speed, dt, phase)
    return 2.0 * e * speed > G * (dt - early)


def after_a_step(build, e, speed, dt, phase):
    place, start, _, _ = falling(speed, dt, phase)
    ball = build.sphere((0.0, 0.0, place), (0.0, 0.0, -start), mass=0.5)
    simulation = build.simulation([build.floor(), ball], Settings.reference(dt), DOWN, e)
    simulation.advance(1)
    return simulation


@pytest.mark.parametrize("e, speed, dt, phase", [fall for fall in FALLS if bounces_once(*fall)])
def test_rebound_speed_of_a_sphere(build, e, speed, dt, phase):
    """It starts where it reaches the floor after a share of the step; what counts is the impulse of the impact."""
    simulation = after_a_step(build, e, speed, dt, phase)
    _, _, early, speed = falling(speed, dt, phase)
    scale = max(speed, G * dt)
    # The place itself is rounded by 1e-16 m, which the fall turns into g / speed of it.
    lasting = e * speed - G * (dt - early)
    assert abs(simulation.twist[1, 2] - lasting) <= 1e-14 * scale + 4e-16 * G / speed
    impulse = simulation.contacts().impulse.sum(axis=0)
    assert impulse[2] == pytest.approx(0.5 * (1 + e) * speed, rel=1e-14 * scale / speed + 4e-16 * G / speed**2)


@pytest.mark.parametrize("e, speed, dt, phase", [fall for fall in FALLS if not bounces_once(*fall)])
def test_energy_of_a_sphere_with_several_bounces_a_step(build, e, speed, dt, phase):
    simulation = after_a_step(build, e, speed, dt, phase)
    place, start, _, _ = falling(speed, dt, phase)
    before = 0.5 * start**2 + G * (place - 0.5)
    height, fast = simulation.pose[1, 2] - 0.5, simulation.twist[1, 2]
    assert height >= -1e-15
    assert 0.5 * fast**2 + G * height <= before + 1e-14 * max(1.0, before)


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("half", [(0.5, 0.5, 0.5), (1.0, 0.3, 0.2)])
@pytest.mark.parametrize("height", [0.0, 1e-3, 0.02])
def test_rebound_of_a_flat_box_on_four_points(build, half, friction, height):
    box = build.box((0.0, 0.0, half[2] + height), (0.0, 0.0, -3.0), half=half, turn=(0.9, 0.0, 0.0, 0.3))
    dt = 1 / 60
    simulation = build.simulation([build.floor(), box], Settings.reference(dt), DOWN, 0.5, friction)
    simulation.advance(1)
    impact = math.sqrt(9.0 + 2 * G * height)
    early = 2 * height / (3.0 + impact)
    expected = [0, 0, 0.5 * impact - G * (dt - early), 0, 0, 0]
    assert simulation.twist[1] == pytest.approx(expected, abs=1e-12 * impact)
    assert simulation.contacts().impulse.sum(axis=0) == pytest.approx([0, 0, 1.5 * impact], abs=5e-12)


def cloud(build, settings, restitution, friction, count, shape, seed=5):
    """Bodies that fly towards each other's middle."""
    rng = np.random.default_rng(seed)
    bodies = []
    for i in range(count):
        place = 2.2 * np.array([i % 2, i // 2 % 2, i // 4])
        velocity = [1.1, 1.1, 1.1] - place + 0.2 * rng.normal(size=3)
        turn = tuple(rng.normal(size=4))
        if shape == "sphere":
            bodies.append(build.sphere(place, velocity, rng.normal(size=3), 0.5, 1.0 + i))
        else:
            bodies.append(build.box(place, velocity, rng.normal(size=3), (0.5, 0.4, 0.3), 1.0 + i, turn))
    return build.simulation(bodies, settings, restitution=restitution, friction=friction)


@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_elastic_collisions_without_friction_keep_energy(build, mechanics, shape):
    """Impacts keep it to round-off; the free rotation of boxes swings by (w dt)^2 of it."""
    simulation = cloud(build, Settings.reference(1 / 240), 1.0, 0.0, 8, shape)
    before = mechanics.kinetic_energy(simulation)
    simulation.advance(2000)
    assert mechanics.kinetic_energy(simulation) == pytest.approx(before, rel=1e-12 if shape == "sphere" else 1e-4)


def test_impulses_of_a_step_with_several_impacts(build, mechanics):
    """A ball between floor and ceiling: several impacts in one step; the impulses add up to the change of momentum."""
    ceiling = Body(Box((5.0, 5.0, 0.1)), motion="fixed", pose=(0.0, 0.0, 1.2, 1.0, 0.0, 0.0, 0.0))
    ball = build.sphere((0.0, 0.0, 0.55), (0.0, 0.0, -60.0))
    simulation = build.simulation([build.floor(), ceiling, ball], Settings.reference(1 / 60), DOWN, 0.9)
    before = simulation.twist[2, 2]
    simulation.advance(1)
    contacts = simulation.contacts()
    assert len(contacts) == 2
    gained = (contacts.impulse[:, 2]).sum()
    assert simulation.twist[2, 2] - before == pytest.approx(gained - G / 60, abs=1e-13 * 120)


def test_rest_of_a_box_dropped_on_its_edge(build):
    simulation = build.simulation(
        [build.floor(), build.box((0, 0, 1.2), spin=(0, 5.0, 0), turn=(math.cos(0.3), 0, math.sin(0.3), 0))],
        Settings.reference(1 / 240),
        DOWN,
        0.3,
        0.4,
    )
    simulation.advance(720)
    assert simulation.pose[1, 2] == pytest.approx(0.5, abs=1e-9)
    assert np.abs(simulation.twist[1]).max() <= 1e-9


def test_angular_momentum_of_a_ball_rolling_over_a_sphere(build, mechanics):
    """Both are free: a curved contact that spins keeps x cross m v of both."""
    a = build.sphere((0.0, 0.0, 0.0), spin=(0.0, 3.0, 0.0))
    b = build.sphere((0.0, 0.0, 1.0), (0.5, 0.0, -0.2), (0.0, -1.0, 0.0), mass=2.0)
    simulation = build.simulation([a, b], Settings.reference(1 / 240), friction=0.5)
    momentum, angular = mechanics.momentum(simulation), mechanics.angular_momentum(simulation)
    simulation.advance(240)
    assert np.abs(mechanics.momentum(simulation) - momentum).max() <= 1e-12
    assert np.abs(mechanics.angular_momentum(simulation) - angular).max() <= 1e-12
