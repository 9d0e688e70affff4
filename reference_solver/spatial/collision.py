"""Contact detection of spheres, boxes and half-spaces in space.

Every pair function answers for one manifold m: it writes up to four points into ``point[m], gap[m], feature[m]``
and returns ``(count, normal)``. The normal points from the first body to the second. ``gap`` is the signed
separation along the normal [m]; a point counts when ``gap <= reach``. Feature ids name what touches (vertex,
edge pair, clipped edge), never an index into a list, so that they survive from step to step and can carry
accumulated impulses.

Where the point lies matters for lever arms: a sphere is touched at its own surface, so that rolling without
slip is v = omega R exactly, whatever the overlap; two spheres touch in the middle of the overlap.

Kinds are ordered from round to flat. `collide` calls each pair as (flatter, rounder) and turns the normal back.
"""

from __future__ import annotations

import math

from reference_solver.compilation import kernel
from reference_solver.spatial.box_box import box_box
from reference_solver.spatial.vector import add_scaled, axis, dot, length, row, scale, sub, turn, turn_back

SPHERE = 0
BOX = 1
HALF_SPACE = 2


@kernel
def collide(kind, size, pose, axes, a, b, reach, m, point, gap, feature, scratch, scratch_edge):
    """Manifold of bodies a and b; the normal points from a to b.

    Parameters
    ----------
    kind : (n,) int
        SPHERE, BOX or HALF_SPACE.
    size : (n, 4)
        Radius; half extents; or unit normal and offset of a half-space, in body axes [m].
    pose : (n, 7)
        Position [m] and quaternion.
    axes : (n, 3, 3)
        Rotation matrices, body to world.
    reach : float
        Largest gap that still counts as contact [m].
    m : int
        Row of `point` (., 4, 3), `gap` (., 4) and `feature` (., 4) to write.
    scratch, scratch_edge : (2, 16, 3) float, (2, 16) int
        Working space of the polygon clipper.

    Returns
    -------
    (int, (float, float, float))
        Number of points, unit normal.
    """
    if kind[a] >= kind[b]:
        return _collide_ordered(
            kind, size, pose, axes, a, b, reach, m, point, gap, feature, scratch, scratch_edge
        )
    count, normal = _collide_ordered(
        kind, size, pose, axes, b, a, reach, m, point, gap, feature, scratch, scratch_edge
    )
    return count, scale(-1.0, normal)


@kernel
def _collide_ordered(kind, size, pose, axes, a, b, reach, m, point, gap, feature, scratch, scratch_edge):
    if kind[a] == HALF_SPACE:
        if kind[b] == SPHERE:
            return _half_space_sphere(size, pose, axes, a, b, reach, m, point, gap, feature)
        if kind[b] == BOX:
            return _half_space_box(size, pose, axes, a, b, reach, m, point, gap, feature)
        return 0, (0.0, 0.0, 1.0)  # two half-spaces overlap always and are never free: no contact
    if kind[a] == SPHERE:
        return _sphere_sphere(size, pose, a, b, reach, m, point, gap, feature)
    if kind[b] == SPHERE:
        return _box_sphere(size, pose, axes, a, b, reach, m, point, gap, feature)
    return box_box(size, pose, axes, a, b, reach, m, point, gap, feature, scratch, scratch_edge)


@kernel
def _write(m, s, where, separation, name, point, gap, feature):
    point[m, s, 0] = where[0]
    point[m, s, 1] = where[1]
    point[m, s, 2] = where[2]
    gap[m, s] = separation
    feature[m, s] = name


@kernel
def _plane(size, pose, axes, a):
    """World normal and offset of half-space a."""
    normal = turn(axes, a, row(size, a, 0))
    return normal, size[a, 3] + dot(normal, row(pose, a, 0))


@kernel
def _half_space_sphere(size, pose, axes, a, b, reach, m, point, gap, feature):
    normal, offset = _plane(size, pose, axes, a)
    centre = row(pose, b, 0)
    separation = dot(normal, centre) - offset - size[b, 0]
    if separation > reach:
        return 0, normal
    _write(m, 0, add_scaled(centre, -size[b, 0], normal), separation, 0, point, gap, feature)
    return 1, normal


@kernel
def _half_space_box(size, pose, axes, a, b, reach, m, point, gap, feature):
    """Vertices of the box face that looks most directly at the plane; the deepest vertex is always among them.

    The feature is the vertex number: bit k set where the vertex lies at +half_extent along body axis k.
    """
    normal, offset = _plane(size, pose, axes, a)
    down = turn_back(axes, b, scale(-1.0, normal))
    k = 0
    for i in range(1, 3):  # a later axis must look clearly more directly: round-off must not choose the face
        if abs(down[i]) > abs(down[k]) + 1e-9:
            k = i
    count = 0
    for vertex in range(8):
        if (vertex >> k & 1) != (down[k] > 0.0):
            continue
        corner = (
            size[b, 0] if vertex & 1 else -size[b, 0],
            size[b, 1] if vertex & 2 else -size[b, 1],
            size[b, 2] if vertex & 4 else -size[b, 2],
        )
        arm = turn(axes, b, corner)
        separation = (dot(normal, row(pose, b, 0)) - offset) + dot(normal, arm)
        if separation <= reach:
            where = add_scaled(row(pose, b, 0), 1.0, arm)
            _write(m, count, where, separation, vertex, point, gap, feature)
            count += 1
    return count, normal


@kernel
def _sphere_sphere(size, pose, a, b, reach, m, point, gap, feature):
    between = sub(row(pose, b, 0), row(pose, a, 0))
    distance = length(between)
    separation = distance - size[a, 0] - size[b, 0]
    if separation > reach:
        return 0, (0.0, 0.0, 1.0)
    normal = (0.0, 0.0, 1.0)  # coincident centres have no direction: any fixed one is as good
    if distance > 0.0:
        normal = scale(1.0 / distance, between)
    where = add_scaled(row(pose, a, 0), size[a, 0] + 0.5 * separation, normal)
    _write(m, 0, where, separation, 0, point, gap, feature)
    return 1, normal


@kernel
def _box_sphere(size, pose, axes, a, b, reach, m, point, gap, feature):
    """Nearest point of the box to the sphere's centre; from inside, out through the nearest face."""
    centre = row(pose, b, 0)
    local = turn_back(axes, a, sub(centre, row(pose, a, 0)))
    outside = (
        local[0] - max(-size[a, 0], min(size[a, 0], local[0])),
        local[1] - max(-size[a, 1], min(size[a, 1], local[1])),
        local[2] - max(-size[a, 2], min(size[a, 2], local[2])),
    )
    distance = math.sqrt(dot(outside, outside))
    if distance > 0.0:
        normal = turn(axes, a, scale(1.0 / distance, outside))
    else:
        k = 0
        for i in range(1, 3):
            if abs(local[i]) - size[a, i] > abs(local[k]) - size[a, k]:
                k = i
        distance = abs(local[k]) - size[a, k]
        normal = scale(1.0 if local[k] >= 0.0 else -1.0, axis(axes, a, k))
    separation = distance - size[b, 0]
    if separation > reach:
        return 0, normal
    _write(m, 0, add_scaled(centre, -size[b, 0], normal), separation, 0, point, gap, feature)
    return 1, normal
