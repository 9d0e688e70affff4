"""The direct solver inside a spatial step."""

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
def test_piles_of_tilted_bodies(build, fixed_step, seed):
    simulation = pile(build, seed, fixed_step)
    simulation.advance(300)
    certificate = simulation.certificate
    assert certificate["converged"] and certificate["residual"] <= 1e-13
    assert certificate["direct"] > 20
    assert not [reason for reason in certificate["reasons"] if "overlap" not in reason]  # some overlap at the start
