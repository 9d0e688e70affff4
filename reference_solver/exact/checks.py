"""Cheap checks of every piece: bodies do not overlap, and contacts do not create energy.

They do not replace the audit: a lever that is wrong passes both.
"""

from __future__ import annotations

import numpy as np

from reference_solver.exact.bodies import World
from reference_solver.exact.features import features_of
from reference_solver.exact.kernels.separation import least_separation
from reference_solver.exact.motion import Piece
from reference_solver.exact.refusals import EnergyGrows, Overlap

#: Overlap that is refused, as a share of the smallest half width; growth of energy, as a share of what there is.
DEEP, GROWS = 1e-8, 1e-9
#: Shares of a piece at which bodies are looked at.
LOOK = (0.0, 0.25, 0.5, 0.75, 1.0)


def check(world: World, piece: Piece) -> None:
    """Refuse a piece in which bodies overlap or whose energy grows.

    Raises
    ------
    Overlap, EnergyGrows
    """
    pair = np.zeros(2, np.int64)
    for share in LOOK:
        place, axes, _ = piece.at(share)
        least = least_separation(world.bodies, place, axes, *features_of(world, place, axes), pair)
        if least < -DEEP * world.size:
            a, b = sorted(pair.tolist())
            raise Overlap(a=a, b=b, depth=-least, t=piece.start.t + share * piece.length)
    if world.dimension == 2 and not _is_driven(world, piece):
        before, size = energy(world, piece, 0.0)
        after, _ = energy(world, piece, 1.0)
        if after - before > GROWS * (size + abs(before)):
            raise EnergyGrows(amount=after - before, t=piece.start.t)


def _is_driven(world: World, piece: Piece) -> bool:
    """Whether a body touches one that moves whatever it meets."""
    touched = np.unique(piece.held.contacts.features[:, :2])
    moved = (world.bodies.free == 0) & (np.abs(piece.start.velocity).max(axis=1) > 0.0)
    return bool(moved[touched].any())


def energy(world: World, piece: Piece, share: float) -> tuple[float, float]:
    """Return the energy of free bodies at a share, less the work of loads in the piece, and its size [J]."""
    free, d = world.bodies.free == 1, world.dimension
    velocity = (piece.velocity @ share ** np.arange(piece.velocity.shape[2]))[free]
    way = (piece.way @ share ** np.arange(piece.way.shape[2]))[free]
    mass = np.concatenate(
        [np.repeat(1.0 / world.bodies.inverse_mass[free, None], d, axis=1), world.bodies.moment[free]], axis=1
    )
    load = world.bodies.load[free]
    kinetic, work = 0.5 * (mass * velocity**2).sum(), (mass * load * way).sum()
    return float(kinetic - work), float(kinetic + world.size * np.abs(mass * load).sum())
