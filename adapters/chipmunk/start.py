"""Touching bodies at the start, and their places with a small overlap of every touching pair."""

from __future__ import annotations

import numpy as np

from adapters.chipmunk.translation import made_body, made_shape
from adapters.engine import Array
from adapters.needs import needs
from adapters.scene import Scene

#: Faces closer than this share of the smallest body count as touching when the resting overlap is applied: a
#: thousandth of the tuned slop, so its error is far below the effect of the overlap itself.
TOUCHING = 1e-6


def touching_pairs(scene: Scene) -> list[tuple[int, int, Array, float]]:
    """Touching or overlapping pairs at the start: ``(i, j, normal from i to j, gap)``, by the engine's own detection.

    All shapes are grown by a skin, so touching pairs overlap in spite of round-off; the skin is subtracted from the
    reported depth.
    """
    import pymunk

    skin = TOUCHING * needs(scene).smallest_size
    space = pymunk.Space()
    shapes = []
    for asked in scene.bodies:
        body = made_body(asked)
        shapes.append(made_shape(scene, asked, body, 0.5 * skin))
        space.add(body, shapes[-1])
    found = []
    index = {id(shape): i for i, shape in enumerate(shapes)}
    for i, shape in enumerate(shapes):
        for hit in space.shape_query(shape):
            j = index[id(hit.shape)]
            if i < j and "free" in (scene.bodies[i].motion, scene.bodies[j].motion):
                depth = max(abs(point.distance) for point in hit.contact_point_set.points)
                found.append((i, j, np.array(hit.contact_point_set.normal, float), skin - depth))
    return sorted(found, key=lambda pair: pair[:2])


def overlap_displacement(scene: Scene, touching: list[tuple[int, int, Array, float]], overlap: float) -> Array | None:
    """Smallest translation of each free body after which touching pairs overlap by ``overlap``, (n, 2) [m].

    One equation per pair, ``n . (d_j - d_i) = -overlap - gap``; pairs deeper in the scene itself keep their depth
    (right-hand side 0). A column sinks by one overlap more at each interface, a box on an incline moves along the
    floor's normal. None if the equations contradict each other (a box that exactly fits between two walls).
    """
    if not touching:
        return np.zeros((len(scene.bodies), 2))
    rows, goal = np.zeros((len(touching), 2 * len(scene.bodies))), np.zeros(len(touching))
    for row, (i, j, normal, gap) in enumerate(touching):
        for body, sign in ((i, -1.0), (j, 1.0)):
            if scene.bodies[body].motion == "free":
                rows[row, 2 * body : 2 * body + 2] = sign * normal
        goal[row] = -overlap - gap if gap > -overlap else 0.0
    shift = np.linalg.lstsq(rows, goal, rcond=None)[0]
    # A thousandth of the overlap: an order below the required accuracy of the overlap, far above round-off.
    if np.abs(rows @ shift - goal).max() > 1e-3 * overlap:
        return None
    return np.asarray(shift.reshape(-1, 2))
