"""What touches: pairs of features, one of each body, and how far each pair is from its ends.

A contact is a row (a, b, kind on a, number, kind on b, number) with a < b. A kind is `POINT`, `LINE` or `FACE`; of two
features one is a point, or both are lines. Cores that touch have a common supporting plane. So a pair of features
touches where its gap is none, its place lies within both features, and no other point of either body lies beyond the
feature along the normal.
"""

from __future__ import annotations

import numpy as np

from reference_solver.exact.bodies import State, World
from reference_solver.exact.kernels.features import place_features, touching, write_margins
from reference_solver.model import Array
from reference_solver.pieces import Indices

#: Features nearer than this share of the smallest half width may touch, and places as near to an end are at it (E20).
#: A contact that is projected has 1e-15.
TOUCH = 1e-11
#: Gaps of so many units in the last place of coordinates are none, beside `World.no_gap`.
UNITS = 8.0
#: Cores may be this deep in each other along a face that touches; along other faces they are far deeper.
DEEP = 1e-3
#: Room for the contacts of a world, and more where it has more.
ROOM = 2048


def no_gap(world: World, place: Array) -> Array:
    """Return the gaps of pairs up to which they count as none (n, n) [m], where bodies are (n, d) [m]."""
    return world.no_gap + UNITS * np.spacing(np.abs(place).max())


def width_of_margins(world: World) -> int:
    """Return how many margins a contact can have."""
    return max(world.bodies.side.shape[2], 4 + 2 * world.bodies.point.shape[1])


def features_of(world: World, place: Array, axes: Array) -> tuple[Array, Array]:
    """Return points (n, p, d) and face normals (n, f, d) in world axes."""
    point, normal = np.zeros(world.bodies.point.shape), np.zeros(world.bodies.normal.shape)
    place_features(world.bodies, place, axes, point, normal)
    return point, normal


def margins(world: World, place: Array, axes: Array, features: Indices) -> Array:
    """Return how far contacts are from the ends of their features (m, width) [m], 1e300 where there is none.

    Parameters
    ----------
    place, axes
        (n, d) [m] and (n, d, d).
    features
        (m, 6).
    """
    out = np.zeros((len(features), width_of_margins(world)))
    write_margins(world.bodies, place, axes, features_of(world, place, axes), features, out)
    return out


def find(world: World, state: State, ended: frozenset[tuple[int, ...]] = frozenset()) -> Indices:
    """Return the contacts (m, 6) of a state, without features that end at once.

    Parameters
    ----------
    ended
        Contacts whose features are known to end here.
    """
    tol = TOUCH * world.size
    placed, limits, count = features_of(world, state.place, state.axes), np.array([tol, DEEP * world.size]), ROOM
    found = np.zeros((0, 6), np.int64)
    while count > len(found):
        found = np.zeros((count, 6), np.int64)
        count = touching(world.bodies, state.place, state.axes, placed, found, limits)
    found = found[:count]
    if not count:
        return found
    out = np.array([tuple(each) in ended for each in found.tolist()])
    margin = margins(world, state.place, state.axes, found)
    at_end = margin < tol
    if at_end.any():
        # A place at an end that moves out: seen after a moment in which all move by 1e-7 of a half width at most. What
        # that bends, to second order, is less than the noise; what moves at 1e-5 of the fastest speed is more.
        moment = 1e-7 * world.size / (1e-9 * world.speed + np.abs(state.velocity / world.per_length).max())
        later = state.moved(moment * state.velocity)
        falls = margins(world, later.place, later.axes, found) < margin - 1e-12 * world.size
        out |= (at_end & falls).any(axis=1)
    return found[~out]
