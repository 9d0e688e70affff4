"""When bodies meet next: points followed in the axes of the other body, as far as they stay clear of it for certain.

Two convex cores that are apart meet first with a point of one on the boundary of the other, grown by both radii, or, in
space, with two edges that cross. Seen from the other body, its *owner*, a point moves along a smooth curve c(s). It is
clear of the owner for as long as it is clear of one half-space ``n . x <= level + r`` that holds the owner. Such a
half-space stands still in these axes, however the owner turns. With delta, delta', delta'' of the gap ``n . c - level -
r`` now, and c3 >= |c'''| over all the piece,

    delta + delta' s + (delta'' - c3 S / 3) s^2 / 2 > 0   for all s <= S    means    clear for all s <= S.

Both bodies are clear of each other as long as all points of one are clear of one half-space of the other. That serves
pairs in space that may meet with their edges: of all half-spaces the one is taken that stays clear longest. Near the
meeting it is the plane between the edges, whose direction matters in second order only, so that steps converge fast.

A contact holds its own point; all other points of its bodies are followed like any. One that touches and is not held
leaves: with a speed, or without one, and then it must first rise over the noise. Of a body in space with a corner on a
face all points are above the whole plane of that face: where one comes down on it beyond the face, an edge has come
down on the end of the face.
"""

from __future__ import annotations

from operator import itemgetter
from typing import NamedTuple

import numpy as np

from reference_solver.exact.bodies import World
from reference_solver.exact.features import no_gap
from reference_solver.exact.kernels.features import FACE, LINE, POINT
from reference_solver.exact.kernels.meeting import first_meeting, first_meeting_of_pairs
from reference_solver.exact.motion import Piece
from reference_solver.exact.rows import Contacts
from reference_solver.model import Array

#: Gaps below this share of the smallest half width touch; with less than this share of the world's speed a point
#: leaves without one.
NOISE, SLOW = 1e-12, 1e-10


class Course(NamedTuple):
    """A piece as kernels read it: places (n, d) and axes (n, d, d) at its start, and polynomials by its share.

    Ways are (n, q, k), spins (n, s, k) in radians per whole piece.
    """

    place: Array
    axes: Array
    way: Array
    spin: Array


def course_of(piece: Piece) -> Course:
    """Return a piece as kernels read it."""
    d = piece.start.place.shape[1]
    if d == 2:
        spin = piece.way[:, d:, 1:] * np.arange(1, piece.way.shape[2])
    else:
        spin = piece.length * piece.velocity[:, d:]
    return Course(piece.start.place, piece.start.axes, piece.way, np.ascontiguousarray(spin))


def next_meeting(world: World, piece: Piece, contacts: Contacts, after_instant: bool) -> tuple[float, bool]:
    """Return the share of the first meeting in a piece in which contacts stay closed, `NEVER` if there is none.

    Where the search takes too many steps, return the share up to which nothing meets, and True.
    """
    bodies, n = world.bodies, len(world.bodies.free)
    held = np.zeros((2, n, n, bodies.point.shape[1]), np.bool_)
    touch, planes = np.zeros((n, n), np.bool_), set()
    for a, b, kind_a, i, kind_b, j in contacts.features.tolist():
        touch[a, b] = touch[b, a] = True
        for o, kind, k, w, on, e in ((a, kind_a, i, b, kind_b, j), (b, kind_b, j, a, kind_a, i)):
            if on == POINT:
                held[:, o, w, e] = True
                if kind == FACE and world.edged[o, w]:
                    planes.add((o, w, k))
            elif on == LINE:
                held[1, o, w, bodies.line[w, e]] = True
    over = np.array(sorted(planes), np.int64).reshape(-1, 3)
    course = course_of(piece)
    edges = world.edged & ~touch
    none = no_gap(world, piece.start.place)
    if after_instant:
        none = np.maximum(none, NOISE * world.size)
    scales = np.array([NOISE * world.size, SLOW * world.speed * piece.length])
    found = first_meeting(bodies, course, held, (~edges).astype(np.int64), over, scales, none)
    if edges.any():
        crossed = first_meeting_of_pairs(bodies, course, edges.astype(np.int64), scales, none)
        found = min(found, crossed, key=itemgetter(0))
    return float(found[0]), bool(found[1])
