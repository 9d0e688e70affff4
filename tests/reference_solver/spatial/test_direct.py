"""The direct solver inside a spatial step."""

from dataclasses import replace

import numpy as np
import pytest

G = 9.81
DOWN = (0.0, 0.0, -G)


def pile(build, seed, settings, bodies=8):
    """Tilted boxes and spheres of masses 0.1 to 10 that fall onto each other between boxes that are fixed."""
    rng = np.random.default_rng(seed)
    walls = [
        build.box(place, half=half, motion="fixed")
        for place, half in (
            ((1.7, 0.0, 1.0), (0.5, 2.2, 1.5)),
            ((-1.7, 0.0, 1.0), (0.5, 2.2, 1.5)),
            ((0.0, 1.7, 1.0), (1.2, 0.5, 1.5)),
            ((0.0, -1.7, 1.0), (1.2, 0.5, 1.5)),
        )
    ]
    things = []
    for k in range(bodies):
        place, mass = (*rng.uniform(-0.5, 0.5, 2), 0.8 + 0.7 * k), 10.0 ** rng.uniform(-1.0, 1.0)
        if rng.random() < 0.7:
            things.append(build.box(place, half=tuple(rng.uniform(0.2, 0.5, 3)), mass=mass, turn=rng.normal(size=4)))
        else:
            things.append(build.sphere(place, radius=rng.uniform(0.2, 0.45), mass=mass))
    friction = float(rng.choice([0.3, 0.6, 1.0]))
    return build.simulation([build.floor(), *walls, *things], settings, DOWN, 0.0, friction)


@pytest.mark.parametrize("seed", [0, 1])
def test_piles_of_tilted_bodies_are_solved_in_every_step(build, fixed_step, seed):
    simulation = pile(build, seed, fixed_step)
    simulation.advance(300)
    certificate = simulation.certificate
    assert certificate["converged"] and certificate["residual"] <= 1e-13
    assert certificate["direct"] > 20
    assert not [reason for reason in certificate["reasons"] if "overlap" not in reason]  # some overlap at the start


def test_direct_answer_is_that_of_the_sweeps(build, fixed_step):
    """Six boxes of different masses, sliding past each other along one line.

    In one line, because where the points of a face slip in different directions, friction depends on how redundant
    points share their load, and Coulomb's law leaves that open: such a step has many answers.
    """
    answers = []
    for direct in (True, False):
        boxes = [build.box((0.02 * i, 0.0, 0.5 + i), (0.4 - 0.2 * i, 0.0, 0.0), mass=1.0 + 2.0 * i) for i in range(6)]
        settings = replace(fixed_step, direct=direct, max_sweeps=100_000)
        simulation = build.simulation([build.floor(), *boxes], settings, DOWN, 0.0, 0.4)
        simulation.advance(1)
        assert simulation.certificate["converged"]
        assert (simulation.certificate["direct"] > 0) is direct
        answers.append(simulation.twist)
    assert answers[0] == pytest.approx(answers[1], abs=1e-11)


@pytest.mark.parametrize("ratio", [1e2, 1e4, 1e6])
def test_interfaces_of_alternating_masses_in_every_step(build, fixed_step, ratio):
    masses = np.array([1.0, ratio] * 3)
    boxes = [build.box((0.0, 0.0, 0.5 + i), mass=m) for i, m in enumerate(masses)]
    simulation = build.simulation([build.floor(), *boxes], fixed_step, DOWN, 0.0, 0.5)
    weight = G * build.dt * np.cumsum(masses[::-1])[::-1]
    for _ in range(30):
        simulation.advance(1)
        contacts = simulation.contacts()
        carried = np.bincount(contacts.body_b - 1, contacts.impulse[:, 2])
        assert np.abs(carried / weight - 1.0).max() <= 1e-14 * ratio


def test_column_of_thirty_in_one_step(build, fixed_step):
    n = 30
    simulation = build.column(n, fixed_step)
    simulation.advance(1)
    contacts = simulation.contacts()
    carried = np.bincount(contacts.body_b - 1, contacts.impulse[:, 2])
    assert carried / (G * build.dt * np.arange(n, 0, -1)) == pytest.approx(1.0, abs=1e-13)
    assert simulation.certificate["direct"] == 1


def test_frictionless_spheres_without_rotation_are_solved_as_well(build, fixed_step):
    n = 30
    spheres = [build.sphere((0.0, 0.0, 0.5 + i)) for i in range(n)]
    simulation = build.simulation([build.floor(), *spheres], fixed_step, DOWN)
    simulation.advance(1)
    assert "rotation" in simulation.left_out and simulation.certificate["direct"] == 1
    weight = G * build.dt * np.arange(n, 0, -1)
    assert simulation.contacts().impulse[:, 2] / weight == pytest.approx(1.0, abs=1e-13)
