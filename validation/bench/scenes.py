"""Scenes of the bench that no suite has, because they have no truth to check.

    empty    only the floor, for the cost of a step without contact
    free     one body without contact
    wall     rows of boxes as in a pyramid, of any number, ``gap`` apart; with 0 the sides of neighbours touch
    heap     n discs or spheres between walls, which fall a little from the places of a grid

Each is an ordinary `Scene`. `validation.bench.units.scene_of` looks for a name here before it looks in the catalogue.
To add one, write a function ``(dimension, params) -> Scene`` and a line of `OWN`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from adapters.scene import Body, HalfSpace, Pair, Scene
from validation.canonical import GRAVITY, Params
from validation.scenes.parts import along, at, ball, cube, floor, upward

SIDE = 1.0
#: Range of the uniform random radii of a heap's balls [m]; equal ones would settle as a crystal.
RADII = (0.48, 0.5)
#: Gap between neighbours of the largest radius on the grid of a heap [m]. With these radii, ten layers fall for a
#: quarter of a second.
CLEARANCE = 0.005


def empty(dimension: int, params: Params) -> Scene:
    """Only a floor."""
    return _scene("empty", dimension, (floor(dimension),), params)


def free(dimension: int, params: Params) -> Scene:
    """One ball without contact."""
    return _scene("free", dimension, (ball("ball", dimension, 1.0, 0.5 * SIDE, 0.5 * SIDE),), params)


def wall(dimension: int, params: Params) -> Scene:
    """``rows`` boxes in the lowest row, one fewer in each row above; neighbours in a row are ``gap`` [m] apart."""
    rows, pitch = int(params["rows"]), SIDE + params["gap"]
    boxes = list[Body]()
    for row in range(rows):
        for k in range(rows - row):
            box = cube(f"box{len(boxes) + 1}", dimension, 1.0, SIDE, 0.0)
            place = along(dimension, (k - 0.5 * (rows - row - 1)) * pitch, (row + 0.5) * SIDE)
            boxes.append(at(box, dimension, place))
    return _scene("wall", dimension, (floor(dimension), *boxes), params)


def heap(dimension: int, params: Params) -> Scene:
    """``n`` balls of 1 kg in ``layers`` between walls, random by ``seed``; each layer lies over the hollows below."""
    count, rng = int(params["n"]), np.random.default_rng(int(params["seed"]))
    across = math.ceil((count / params["layers"]) ** (1.0 / (dimension - 1)) - 1e-9)  # the root may be rounded up
    pitch = 2.0 * RADII[1] + CLEARANCE
    rise = pitch * math.sqrt(1.0 - 0.25 * (dimension - 1))  # layers shift by half a pitch per level axis
    half_width = 0.5 * (across + 0.5) * pitch
    bodies = [floor(dimension)]
    for axis in range(dimension - 1):
        for sign in (1.0, -1.0):
            normal = tuple(sign * (k == axis) for k in range(dimension))
            bodies.append(Body(f"wall{len(bodies)}", HalfSpace(normal, -half_width), motion="fixed"))
    for k in range(count):
        layer, rest = divmod(k, across ** (dimension - 1))
        cells = [rest // across**axis % across for axis in range(dimension - 1)]
        level = [-half_width + pitch * (cell + 0.5 + 0.5 * (layer % 2)) for cell in cells]
        body = ball(f"ball{k + 1}", dimension, 1.0, float(rng.uniform(*RADII)), 0.0)
        bodies.append(at(body, dimension, (*level, RADII[1] + rise * layer)))
    return _scene("heap", dimension, tuple(bodies), params)


def _scene(name: str, dimension: int, bodies: tuple[Body, ...], params: Params) -> Scene:
    pairs = (Pair(restitution=0.0, friction=0.5),)
    return Scene(name, 1, dimension, bodies, pairs, upward(dimension, -GRAVITY), 1.0, params)


OWN: Mapping[str, Callable[[int, Params], Scene]] = {"empty": empty, "free": free, "wall": wall, "heap": heap}
