"""Worlds of many bodies that fall between walls, drawn from a seed: gates let them fall, and the bench clocks them."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Body, Model
from reference_solver.shapes import Box, Disc, HalfSpace, Sphere

#: Steps a second, and standard gravity [m/s^2].
RATE, GRAVITY = 240, 9.81
#: Half widths [m], width of a place and height of a layer they fall from, in the plane and in space [m].
SMALL, LARGE, PLACE = 0.25, 0.4, {2: 1.2, 3: 1.4}


def planar_pile(seed: int, count: int, discs: float) -> Model:
    """Return bodies of 1 kg at any angle, in layers between two walls over a floor; e = 0, mu = .5."""
    rng = np.random.default_rng(seed)
    across, place = round(math.sqrt(count / 2)), PLACE[2]
    half_width = 0.5 * across * place
    bodies = [Body(HalfSpace((0.0, 1.0)), motion="fixed")]
    bodies += [Body(HalfSpace((sign, 0.0), -half_width), motion="fixed") for sign in (1.0, -1.0)]
    for k in range(count):
        x = -half_width + (k % across + 0.5) * place + rng.uniform(-0.03, 0.03)
        pose = (x, 0.6 + place * (k // across), rng.uniform(0.0, 3.0))
        half = rng.uniform(SMALL, LARGE, 2)
        if rng.random() < discs:
            bodies.append(Body(Disc(float(half[0])), 1.0, 0.5 * half[0] ** 2, pose))
        else:
            bodies.append(Body(Box((float(half[0]), float(half[1]))), 1.0, float(half @ half) / 3.0, pose))
    return Model(2, bodies, (0.0, -GRAVITY), 0.0, 0.5)


def spatial_pile(seed: int, count: int, spheres: float) -> Model:
    """Return the same in space, between four walls."""
    rng = np.random.default_rng(seed)
    across, place = max(2, round((count / 2) ** (1 / 3))), PLACE[3]
    half_width, upright = 0.5 * across * place, (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    bodies = [Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=upright)]
    for normal in ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)):
        bodies.append(Body(HalfSpace(normal, -half_width), motion="fixed", pose=upright))
    for k in range(count):
        x, y = (-half_width + (cell % across + 0.5) * place + rng.uniform(-0.03, 0.03) for cell in (k, k // across))
        turn = rng.normal(size=4)
        pose = (x, y, 0.75 + place * (k // across**2), *(turn / np.linalg.norm(turn)))
        half = rng.uniform(SMALL, LARGE, 3)
        if rng.random() < spheres:
            bodies.append(Body(Sphere(float(half[0])), 1.0, (0.4 * half[0] ** 2,) * 3, pose))
        else:
            x, y, z = (float(width) for width in half)
            inertia = ((y * y + z * z) / 3.0, (z * z + x * x) / 3.0, (x * x + y * y) / 3.0)
            bodies.append(Body(Box((x, y, z)), 1.0, inertia, pose))
    return Model(3, bodies, (0.0, 0.0, -GRAVITY), 0.0, 0.5)
