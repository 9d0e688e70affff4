"""Each shape that an engine has: its size along each axis, and each moment of inertia."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np

from adapters.conformance.finding import NotAsked
from adapters.conformance.mechanics import BOOKKEEPING, loss
from adapters.conformance.scenes import DT, driven
from adapters.engine import Engine
from adapters.needs import needs
from adapters.receipts.probes import HALF_EXTENTS
from adapters.scene import Body, Box, Capsule, Cylinder, Disc, HalfSpace, Hull, Pair, Polygon, Scene, Sphere
from adapters.scene.drives import asked_abilities
from adapters.stepping import posed_for

#: Speed of approach [m/s], slow enough that neither a step nor a soft contact matters, and the gap before [m].
SPEED, GAP = 0.05, 0.004
#: Farthest from the expected height that a body may come [m]: a step is .2 mm, contacts as shipped sink and hover by
#: 1.7 mm.
SIZE = 2e-3
#: Torque about an axis [N m].
TORQUE = 0.3
#: Dimension and shape, and its extents from the centre along each axis of the body [m].
SHAPES: tuple[tuple[int, Any, tuple[float, ...]], ...] = (
    (2, Disc(0.5), (0.5, 0.5)),
    (2, Box((0.5, 0.4)), (0.5, 0.4)),
    (2, Capsule(0.6, 0.3), (0.9, 0.3)),
    (2, Polygon(((0.7, 0.0), (0.3, 0.5), (-0.3, 0.5), (-0.7, 0.0), (-0.3, -0.5), (0.3, -0.5))), (0.7, 0.5)),
    (3, Sphere(0.5), (0.5, 0.5, 0.5)),
    (3, Box((0.5, 0.4, 0.6)), (0.5, 0.4, 0.6)),
    (3, Capsule(0.6, 0.3), (0.9, 0.3, 0.3)),
    (3, Cylinder(0.6, 0.4), (0.6, 0.4, 0.4)),
    (3, Hull(tuple(product((-0.5, 0.5), (-0.4, 0.4), (-0.6, 0.6)))), (0.5, 0.4, 0.6)),
)


def sizes(engine: Engine) -> str:
    """A body of each shape that moves slowly to a floor comes down to its height, with each axis upwards."""
    for where, d, extent, _, scene, profile in _asked(engine, _landing):
        off = driven(engine, scene, profile).pose[:, 1, d - 1].min() - extent
        told = engine.declares(profile, needs(scene), DT).get("size")  # shares of the box of `adapters.receipts.probes`
        band = SIZE + (HALF_EXTENTS[0] * (abs(told.value - 1.0) + told.band) if told else 0.0)
        if not abs(off) <= band:
            return f"{where}: its lowest position is {off:+.2g} m from its height, {band:.2g} m is allowed"
    return ""


def moments(engine: Engine) -> str:
    """A constant torque about each axis of a body of each shape gives the spin of its moment of inertia."""
    for where, _, _, axis, scene, profile in _asked(engine, _turning):
        moment = np.resize(scene.bodies[0].inertia, 3)[axis]
        found = driven(engine, scene, profile).twist[-1, 0, -1]
        off, band = found * moment / (TORQUE * scene.duration) - 1.0, BOOKKEEPING + loss(engine, profile, scene)[1]
        if not abs(off) <= band:
            return f"{where}: the spin is off by {off:+.2g} of it, {band:.2g} is allowed"
    return ""


def _landing(d: int, shape: Any, axis: int, extent: float) -> Scene:
    flat, still = (0.0,) * (d - 1), (0.0,) * (1 if d == 2 else 3)
    pose = (*flat, extent + GAP, *_upright(d, axis))
    floor = Body("floor", HalfSpace((*flat, 1.0)), motion="fixed")
    body = Body("body", shape, 2.0, 0.5 if d == 2 else (0.5, 0.5, 0.5), pose, (*flat, -SPEED, *still))
    return Scene("check_size", 1, d, (floor, body), (Pair(),), (0.0,) * d, 72 * DT)


def _turning(d: int, shape: Any, axis: int, extent: float) -> Scene:
    torque, inertia = ((TORQUE,), 0.4) if d == 2 else ((0.0, 0.0, TORQUE), (0.4, 0.5, 0.6))
    body = Body("body", shape, 2.0, inertia, (*[0.0] * d, *_upright(d, axis)), torque=torque)
    return Scene("check_moment", 1, d, (body,), (), (0.0,) * d, 48 * DT)


def _asked(
    engine: Engine, make: Callable[[int, Any, int, float], Scene]
) -> Iterator[tuple[str, int, float, int, Scene, str]]:
    """What is asked in words, dimension, extent, axis, scene and profile, for each shape that the engine takes.

    Raises
    ------
    NotAsked
        If it takes none.
    """
    taken, reasons = False, []
    for profile, (d, shape, extents) in product(engine.profiles, SHAPES):
        for axis, extent in enumerate(extents):
            scene = make(d, shape, axis, extent)
            if d not in engine.facts.dimensions or {a for _, a in asked_abilities(scene)} - engine.facts.abilities:
                continue
            reason = engine.refuses(posed_for(engine, scene), profile)
            reasons.append(f"{profile}: {reason}")
            if reason is None:
                taken = True
                yield f"{profile}: {type(shape).__name__} {d}-D, axis {'xyz'[axis]}", d, extent, axis, scene, profile
    if not taken:
        raise NotAsked(reasons[0])


def _upright(dimension: int, axis: int) -> tuple[float, ...]:
    """Attitude that turns an axis of the body upwards."""
    if dimension == 2:
        return (0.5 * math.pi if axis == 0 else 0.0,)
    half = math.sqrt(0.5)
    return ((half, 0.0, -half, 0.0), (half, half, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))[axis]
