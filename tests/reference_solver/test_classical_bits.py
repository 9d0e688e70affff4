"""The bits of `classical` are pinned: the textbook stays what it is, whatever changes in the solver.

Cosines and sines differ in the last bit between mathematical libraries. Where a scene turns bodies, its bits are
therefore compared only where this machine's cosines and sines are those of the machine that wrote the pins.
"""

import hashlib
import math

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.simulation import UNCERTIFIED

DT = 1.0 / 240.0
#: Over the cosines and sines below, on the machine that wrote the pins.
TRIGONOMETRY = "bf00d6685df8b45d"


def planar_box(x, y, angle=0.0, twist=(0.0, 0.0, 0.0), half=(0.5, 0.5), mass=1.0):
    return Body(Box(half), mass, mass * (half[0] ** 2 + half[1] ** 2) / 3.0, (x, y, angle), twist)


def planar_disc(x, y, twist=(0.0, 0.0, 0.0), mass=1.0):
    return Body(Disc(0.5), mass, 0.125 * mass, (x, y, 0.0), twist)


def spatial_box(place, quaternion=(1.0, 0.0, 0.0, 0.0), twist=(0.0,) * 6, half=(0.5, 0.5, 0.5), mass=1.0):
    a, b, c = half
    moments = tuple(mass / 3.0 * s for s in (b * b + c * c, a * a + c * c, a * a + b * b))
    return Body(Box(half), mass, moments, (*place, *quaternion), twist)


def ball(place, twist=(0.0,) * 6, mass=1.0):
    return Body(Sphere(0.5), mass, (0.1 * mass,) * 3, (*place, 1.0, 0.0, 0.0, 0.0), twist)


LINE = Body(HalfSpace((0.0, 1.0)), motion="fixed")
FLOOR = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
PLANAR, SPATIAL = (0.0, -9.81), (0.0, 0.0, -9.81)

#: Name: model, whether anything in it turns, first digits of the hash of poses and twists after 240 steps.
SCENES = {
    "column of discs": (
        lambda: Model(2, [LINE, *(planar_disc(0.0, 0.5 + i) for i in range(8))], PLANAR, 0.0, 0.0),
        False,
        "ea3dfd756a44e2fb",
    ),
    "bouncing balls": (
        lambda: Model(3, [FLOOR, *(ball((2.0 * i, 0.0, 1.0 + i)) for i in range(4))], SPATIAL, 0.8, 0.0),
        False,
        "4b24f035bfaf6bfa",
    ),
    "stack of boxes": (
        lambda: Model(2, [LINE, *(planar_box(0.01 * i, 0.5 + i) for i in range(10))], PLANAR, 0.0, 0.5),
        True,
        "0f8da20f7383b1e2",
    ),
    "planar heap": (
        lambda: Model(
            2,
            [LINE, *(planar_box(0.3 * (i % 3), 1.0 + 1.3 * i, 0.4 * i) for i in range(6)), planar_disc(0.2, 9.0)],
            PLANAR,
            0.3,
            0.4,
        ),
        True,
        "ebfc694a3e1dbc6c",
    ),
    "sliding box": (
        lambda: Model(
            3, [FLOOR, spatial_box((0.0, 0.0, 0.5), twist=(3.0, 1.0, 0.0, 0.0, 0.0, 0.5))], SPATIAL, 0.0, 0.3
        ),
        True,
        "00e8ad21052101e2",
    ),
    "spatial heap": (
        lambda: Model(
            3,
            [
                FLOOR,
                *(
                    spatial_box((0.2 * (i % 3), 0.1 * i, 1.0 + 1.5 * i), (0.8, 0.6, 0.0, 0.0), half=(0.5, 0.4, 0.3))
                    for i in range(4)
                ),
                ball((0.1, 0.1, 8.0)),
            ],
            SPATIAL,
            0.2,
            0.5,
        ),
        True,
        "3d4d02765dca69b7",
    ),
}


def digest(*arrays):
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)).hexdigest()[:16]


def trigonometry():
    angles = [0.001 * k for k in range(7000)]
    return digest(np.array([math.cos(a) for a in angles]), np.array([math.sin(a) for a in angles]))


@pytest.mark.parametrize("name", SCENES)
def test_classical_gives_the_pinned_bits(name):
    build, turns, pinned = SCENES[name]
    if turns and trigonometry() != TRIGONOMETRY:
        pytest.skip("cosines and sines of this machine differ in the last bit from those the pins were made with")
    simulation = Simulation(build(), Settings.classical(DT))
    simulation.advance(240)
    assert np.isfinite(simulation.pose).all()
    assert digest(simulation.pose, simulation.twist) == pinned


@pytest.mark.parametrize("name", SCENES)
def test_a_certificate_changes_no_bit(name):
    build = SCENES[name][0]
    with_it, without = (Simulation(build(), Settings.classical(DT), certified=certified) for certified in (True, False))
    for simulation in (with_it, without):
        simulation.advance(240)
    assert digest(with_it.pose, with_it.twist) == digest(without.pose, without.twist)
    assert without.certificate == {name: with_it.certificate[name] for name in UNCERTIFIED}
