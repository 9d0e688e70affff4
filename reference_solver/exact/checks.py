"""Cheap checks of every piece: bodies do not overlap, and in the plane contacts do not create energy.

In space moments of inertia turn with their bodies, which `energy` does not follow. The checks do not replace the audit:
a lever that is wrong passes both.
"""

from __future__ import annotations

import numpy as np

from reference_solver.exact.bodies import World
from reference_solver.exact.motion import Piece
from reference_solver.exact.refusals import EnergyGrows, Overlap
from reference_solver.exact.rotation import turned
from reference_solver.geometry import gap, rotation
from reference_solver.model import Array

#: Overlap that is refused, as a share of the smallest half width; growth of energy, as a share of what there is; and
#: how many tolerances of a step either may be, where those are coarse.
DEEP, GROWS, TOLERATED = 1e-8, 1e-9, 1e2
#: Shares of a piece at which bodies are looked at.
LOOK = np.array([0.0, 0.25, 0.5, 0.75, 1.0])


def check(world: World, piece: Piece, tolerance: float) -> None:
    """Refuse a piece in which bodies overlap, or a planar one whose energy grows, by more than its tolerance explains.

    Raises
    ------
    Overlap
        If bodies are deeper in each other than `DEEP` half widths, or `TOLERATED` tolerances.
    EnergyGrows
        If energy grows by more than `GROWS` of it, or `TOLERATED` tolerances.
    """
    a, b, share, depth = deepest(world, piece)
    if depth > max(DEEP, TOLERATED * tolerance) * world.size:
        raise Overlap(a=a, b=b, depth=depth, t=piece.start.t + share * piece.length)
    if world.dimension == 2 and not _is_driven(world, piece):
        before, size = energy(world, np.zeros(world.shape), piece.start.velocity)
        after, _ = energy(world, piece.way.sum(axis=2), piece.velocity.sum(axis=2))
        if after - before > max(GROWS, TOLERATED * tolerance) * (size + abs(before)):
            raise EnergyGrows(amount=after - before, t=piece.start.t)


def deepest(world: World, piece: Piece) -> tuple[int, int, float, float]:
    """Return the bodies that are deepest in each other at shares of a piece, the share, and how deep [m].

    What balls around bodies show to be apart is not looked at: -inf where that is everything.
    """
    found = (0, 0, 0.0, -np.inf)
    near = (_balls_apart(world, piece) < -0.5 * DEEP * world.size).any(axis=0)
    if not near.any():
        return found
    poses, _ = piece.looked_at(LOOK)
    alike: dict[tuple[object, object], list[tuple[int, int]]] = {}
    for a, b in world.pairs[:, near].T.tolist():
        alike.setdefault((world.shapes[a], world.shapes[b]), []).append((a, b))
    for (shape_a, shape_b), same in alike.items():
        first, second = np.array(same).T
        many = [poses[:, each].swapaxes(0, 1).reshape(-1, poses.shape[2]) for each in (first, second)]
        gaps = gap(shape_a, many[0], shape_b, many[1]).reshape(len(same), -1)
        worst = int(gaps.min(axis=1).argmin())
        least = int((gaps[worst] < gaps[worst].min() + DEEP * world.size).argmax())  # the first that is as deep
        if -gaps[worst, least] > found[3]:
            found = (*same[worst], float(LOOK[least]), -float(gaps[worst, least]))
    return found


def _balls_apart(world: World, piece: Piece) -> Array:
    """Return how far apart the balls around two bodies are, or a ball and a half-space (k, pairs), at `LOOK` [m]."""
    bodies, (a, b), d = world.bodies, world.pairs, world.dimension
    way, reach = (
        (piece.way @ LOOK ** np.arange(piece.way.shape[2])[:, None]).transpose(2, 0, 1),
        bodies.reach + bodies.radius,
    )
    place = piece.start.place + way[..., :d]
    apart = np.sqrt(((place[:, a] - place[:, b]) ** 2).sum(axis=2)) - reach[a] - reach[b]
    for h in np.flatnonzero(bodies.points == 0):
        orientation = turned(piece.start.orientation[h], way[:, h, d:])
        normal = rotation(np.concatenate([place[:, h], orientation], axis=1)) @ bodies.normal[h, 0]
        above = ((place - place[:, h, None]) * normal[:, None]).sum(axis=2) - bodies.offset[h, 0] - reach
        for one, other in ((a, b), (b, a)):
            apart[:, one == h] = above[:, other[one == h]]
    return np.asarray(apart)


def _is_driven(world: World, piece: Piece) -> bool:
    """Whether a body touches one that moves whatever it meets."""
    moved = (world.bodies.free == 0) & (np.abs(piece.start.velocity).max(axis=1) > 0.0)
    return bool(moved.any() and moved[piece.held.contacts.features[:, :2]].any())


def energy(world: World, way: Array, velocity: Array) -> tuple[float, float]:
    """Return the energy of free bodies with twists (n, q), less the work of loads on ways (n, q), and its size [J]."""
    free, mass = world.bodies.free == 1, world.mass
    force = mass * world.bodies.load[free]
    kinetic, work = 0.5 * (mass * velocity[free] ** 2).sum(), (force * way[free]).sum()
    return float(kinetic - work), float(kinetic + world.size * np.abs(force).sum())
