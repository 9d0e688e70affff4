"""The direct solver inside a step: when it is asked, and whether its answers are those of the sweeps."""

import numpy as np
import pytest

from reference_solver import Body, Box, HalfSpace

G = 9.81


def pile(build, seed, settings, bodies=14):
    """Tilted boxes and discs of masses 0.1 to 10 that fall into a trough and come to lie on each other."""
    rng = np.random.default_rng(seed)
    walls = [Body(HalfSpace((sign, 0.0), -2.5), motion="fixed") for sign in (1.0, -1.0)]
    things = []
    for k in range(bodies):
        place = (rng.uniform(-1.7, 1.7), 1.0 + 0.6 * k)
        mass = 10.0 ** rng.uniform(-1.0, 1.0)
        if rng.random() < 0.6:
            half = tuple(rng.uniform(0.2, 0.6, 2))
            things.append(build.box(*place, half=half, mass=mass, angle=rng.uniform(0.0, 3.0)))
        else:
            things.append(build.disc(*place, radius=rng.uniform(0.2, 0.5), mass=mass))
    friction = float(rng.choice([0.1, 0.3, 0.6, 1.0]))
    return build.simulation([build.floor(), *walls, *things], settings, (0.0, -G), 0.0, friction)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_piles_of_tilted_bodies(build, fixed_step, seed):
    """Sweeps alone leave a quarter of the steps of such piles unsolved after 4000 of them."""
    simulation = pile(build, seed, fixed_step)
    simulation.advance(500)
    certificate = simulation.certificate
    assert certificate["converged"] and certificate["residual"] <= 1e-13
    assert certificate["direct"] > 100
    assert not [reason for reason in certificate["reasons"] if "overlap" not in reason]  # some overlap at the start


def test_bits_of_a_pile_run_twice(build, fixed_step):
    """Neither start values nor the memory of an earlier run enter: equal bits."""
    poses = []
    for _ in range(2):
        simulation = pile(build, 4, fixed_step)
        simulation.advance(400)
        poses.append(simulation.pose)
    assert np.array_equal(*poses)


def test_easy_steps_never_ask(build, fixed_step):
    """A box and a disc at rest, and a column of three, are solved by fewer sweeps than it is asked after."""
    simulation = build.simulation([build.floor(), build.box(0.0, 0.5), build.disc(2.0, 0.5)], fixed_step, (0.0, -G))
    simulation.advance(100)
    column = build.column(3, fixed_step)
    column.advance(100)
    assert simulation.certificate["factorisations"] == column.certificate["factorisations"] == 0


def test_room_grows_with_the_contacts(build, fixed_step):
    """Many points on few bodies: more contacts than there was room for at first."""
    boxes = [build.box(0.4 * i, 0.5, (1.0, 0.0, 0.0), half=(0.19, 0.5)) for i in range(40)]
    lid = build.box(7.8, 1.1, half=(8.1, 0.1), mass=50.0)
    simulation = build.simulation([build.floor(), *boxes, lid], fixed_step, (0.0, -G), 0.0, 0.5)
    simulation.advance(3)
    assert simulation.certificate["converged"]


def test_weight_of_a_slab_on_many_columns(build, fixed_step):
    """A body that touches 20 others: a dense row of the matrix, and sums of forces that must balance."""
    n, mass = 20, 30.0
    posts = [build.box(0.5 * i, 0.5, half=(0.1, 0.5)) for i in range(n)]
    slab = Body(Box((5.2, 0.1)), mass, mass * (5.2**2 + 0.01) / 3.0, (0.25 * (n - 1), 1.1, 0.0))
    simulation = build.simulation([build.floor(), *posts, slab], fixed_step, (0.0, -G), 0.0, 0.3)
    simulation.advance(2)
    assert simulation.certificate["converged"]
    contacts = simulation.contacts()
    on_floor = contacts.body_a == 0
    assert contacts.impulse[on_floor, 1].sum() == pytest.approx((n + mass) * G * build.dt, rel=1e-13)
    assert contacts.impulse[~on_floor, 1].sum() == pytest.approx(mass * G * build.dt, rel=1e-13)
