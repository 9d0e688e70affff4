"""Box against box: separating axes, face clipping, reduction to four points, edge against edge.

The fifteen candidate axes are the three face normals of each box and the nine products of their edges
(Gottschalk, Lin, Manocha, "OBBTree", SIGGRAPH 1996). The axis of largest separation decides. Parallel faces make
several candidates equal but for round-off, so candidates are ranked: a face of A, then a face of B, then an
edge pair; a lower rank must win by `PREFERENCE` of the smallest half extent.
"""

from __future__ import annotations

import math

from reference_solver.compilation import kernel
from reference_solver.spatial.vector import add, add_scaled, axis, cross, dot, row, scale, sub

# A lower-ranked axis must separate better by this part of the smallest half extent. It has to exceed the tilt
# (rad) with which boxes land on each other, about v dt / L = 1e-3; the overlap is then wrong by at most as much.
PREFERENCE = 1e-3
# Edges closer to parallel than this [rad] give no axis of their own: a face normal covers them.
PARALLEL = 1e-6
# Vertices this far outside a side plane, in half extents, count as on it: equal boxes stacked flush have all
# their vertices exactly on the planes, and round-off must not turn vertices into edge crossings.
ON_PLANE = 1e-8
# Feature ids: face contacts below, edge pairs from here on (12 x 12 of them).
EDGE_FEATURE = 100_000


@kernel
def box_box(size, pose, axes, a, b, reach, m, point, gap, feature, scratch, scratch_edge):
    """Manifold of boxes a and b; see `collision.collide` for the arguments."""
    between = sub(row(pose, b, 0), row(pose, a, 0))
    smallest = min(min(size[a, 0], min(size[a, 1], size[a, 2])), min(size[b, 0], min(size[b, 1], size[b, 2])))
    preference = PREFERENCE * smallest

    face_of_a, separation_a = _best_face(size, axes, a, b, between)
    face_of_b, separation_b = _best_face(size, axes, b, a, between)
    if separation_a > reach or separation_b > reach:
        return 0, (0.0, 0.0, 1.0)
    edge, separation_e, normal_e = _best_edge_pair(size, axes, a, b, between)
    if separation_e > reach:
        return 0, (0.0, 0.0, 1.0)

    by_b = separation_b > separation_a + preference
    separation_face = separation_b if by_b else separation_a
    count = 0
    if separation_e <= separation_face + preference:
        if by_b:
            count, normal = _clip_faces(
                size, pose, axes, b, a, face_of_b, 36, reach, m, point, gap, feature, scratch, scratch_edge
            )
            normal = scale(-1.0, normal)
        else:
            count, normal = _clip_faces(
                size, pose, axes, a, b, face_of_a, 0, reach, m, point, gap, feature, scratch, scratch_edge
            )
        if count > 0:
            return count, normal
    if edge < 0:  # no edge pair offers an axis and no clipped vertex lies within reach
        return 0, (0.0, 0.0, 1.0)
    _edge_contact(size, pose, axes, a, b, edge, normal_e, separation_e, m, point, gap, feature)
    return 1, normal_e


@kernel
def _reach_of_box(size, axes, i, n):
    """Half width of box i along the unit vector n."""
    return (
        size[i, 0] * abs(dot(axis(axes, i, 0), n))
        + size[i, 1] * abs(dot(axis(axes, i, 1), n))
        + size[i, 2] * abs(dot(axis(axes, i, 2), n))
    )


@kernel
def _best_face(size, axes, a, b, between):
    """Face axis of box a with the largest separation from box b, and that separation."""
    best = 0
    best_separation = -math.inf
    for k in range(3):
        n = axis(axes, a, k)
        separation = abs(dot(between, n)) - size[a, k] - _reach_of_box(size, axes, b, n)
        if separation > best_separation + ON_PLANE * size[a, k]:
            best = k
            best_separation = separation
    return best, best_separation


@kernel
def _best_edge_pair(size, axes, a, b, between):
    """Edge pair (3 i + j) with the largest separation, that separation, and the unit normal from a to b."""
    best = -1
    best_separation = -math.inf
    best_normal = (0.0, 0.0, 1.0)
    for i in range(3):
        for j in range(3):
            n = cross(axis(axes, a, i), axis(axes, b, j))
            size_n = math.sqrt(dot(n, n))
            if size_n < PARALLEL:
                continue
            n = scale((1.0 if dot(n, between) >= 0.0 else -1.0) / size_n, n)
            separation = dot(between, n) - _reach_of_box(size, axes, a, n) - _reach_of_box(size, axes, b, n)
            if separation > best_separation + ON_PLANE * size[a, i]:
                best = 3 * i + j
                best_separation = separation
                best_normal = n
    return best, best_separation, best_normal


@kernel
def _edge_contact(size, pose, axes, a, b, edge, n, separation, m, point, gap, feature):
    """Middle of the shortest segment between the supporting edges of a (along +n) and of b (along -n)."""
    i, j = edge // 3, edge % 3
    p, name_a = _supporting_edge(size, pose, axes, a, i, n)
    q, name_b = _supporting_edge(size, pose, axes, b, j, scale(-1.0, n))
    e, f = axis(axes, a, i), axis(axes, b, j)
    # p + s e and q + t f: the connecting segment is normal to both unit vectors e and f
    c = dot(e, f)
    d = sub(q, p)
    divisor = 1.0 - c * c
    s = (dot(d, e) - c * dot(d, f)) / divisor
    t = (c * dot(d, e) - dot(d, f)) / divisor
    s = max(-size[a, i], min(size[a, i], s))
    t = max(-size[b, j], min(size[b, j], t))
    where = scale(0.5, add(add_scaled(p, s, e), add_scaled(q, t, f)))
    point[m, 0, 0] = where[0]
    point[m, 0, 1] = where[1]
    point[m, 0, 2] = where[2]
    gap[m, 0] = separation
    feature[m, 0] = EDGE_FEATURE + 12 * name_a + name_b


@kernel
def _supporting_edge(size, pose, axes, i, k, n):
    """Middle of the edge of box i parallel to its axis k that lies farthest along n, and its number 0..11."""
    middle = row(pose, i, 0)
    name = 4 * k
    bit = 1
    for other in range(3):
        if other != k:
            direction = axis(axes, i, other)
            if dot(direction, n) >= 0.0:
                middle = add_scaled(middle, size[i, other], direction)
                name += bit
            else:
                middle = add_scaled(middle, -size[i, other], direction)
            bit *= 2
    return middle, name


@kernel
def _clip_faces(size, pose, axes, r, c, k, base, reach, m, point, gap, feature, scratch, scratch_edge):
    """Clip the facing face of box c to face +-k of box r and keep what lies within reach.

    Works in the frame of the reference face: (along axis k+1, along axis k+2, above the face). Contact points
    are the clipped vertices, on the surface of c. Returns the number of points and the outward face normal.
    """
    n = axis(axes, r, k)
    between = sub(row(pose, c, 0), row(pose, r, 0))
    towards = dot(between, n) >= 0.0
    if not towards:
        n = scale(-1.0, n)
    ku, kv = (k + 1) % 3, (k + 2) % 3
    u, v = axis(axes, r, ku), axis(axes, r, kv)
    face = _incident_face(size, pose, axes, r, c, n, u, v, size[r, k], scratch, scratch_edge)
    count = 4
    source = 0
    for side in range(4):
        coordinate = side // 2
        half = size[r, ku] if coordinate == 0 else size[r, kv]
        sign = 1.0 if side % 2 == 0 else -1.0
        count = _clip(scratch, scratch_edge, source, count, coordinate, sign, half, 4 + side)
        source = 1 - source
    reference = 2 * k + (1 if towards else 0)
    kept = _name_points(scratch, scratch_edge, source, count, base + 6 * reference + face, reach)
    if kept > 4:
        kept = _reduce_to_four(scratch, scratch_edge, 1 - source, kept, ON_PLANE * (size[r, ku] + size[r, kv]))
    origin = add_scaled(row(pose, r, 0), size[r, k], n)
    for s in range(kept):
        x, y, z = row(scratch[1 - source], s, 0)
        where = add_scaled(add_scaled(add_scaled(origin, x, u), y, v), z, n)
        point[m, s, 0] = where[0]
        point[m, s, 1] = where[1]
        point[m, s, 2] = where[2]
        gap[m, s] = z
        feature[m, s] = scratch_edge[1 - source, s]
    return kept, n


@kernel
def _incident_face(size, pose, axes, r, c, n, u, v, height, scratch, scratch_edge):
    """Write the face of box c that looks most directly against n as a polygon; return its number 0..5.

    Polygon edge i runs from vertex i to vertex i+1 and carries the number i.
    """
    k = 0
    for i in range(1, 3):
        if abs(dot(axis(axes, c, i), n)) > abs(dot(axis(axes, c, k), n)) + ON_PLANE:
            k = i
    sign = -1.0 if dot(axis(axes, c, k), n) > 0.0 else 1.0
    e, f = axis(axes, c, (k + 1) % 3), axis(axes, c, (k + 2) % 3)
    he, hf = size[c, (k + 1) % 3], size[c, (k + 2) % 3]
    middle = add_scaled(sub(row(pose, c, 0), row(pose, r, 0)), sign * size[c, k], axis(axes, c, k))
    for i in range(4):
        se = 1.0 if i == 0 or i == 3 else -1.0
        sf = 1.0 if i < 2 else -1.0
        vertex = add_scaled(add_scaled(middle, se * he, e), sf * hf, f)
        scratch[0, i, 0] = dot(vertex, u)
        scratch[0, i, 1] = dot(vertex, v)
        scratch[0, i, 2] = dot(vertex, n) - height
        scratch_edge[0, i] = i
    return 2 * k + (1 if sign > 0.0 else 0)


@kernel
def _clip(scratch, scratch_edge, source, count, coordinate, sign, half, plane):
    """Keep the part of polygon `source` with sign x[coordinate] <= half; write it to the other buffer.

    `scratch_edge` numbers the edge that leaves each vertex: 0..3 edges of the incident face, 4..7 the clip
    planes (Sutherland and Hodgman, CACM 17, 1974).
    """
    target = 1 - source
    kept = 0
    tolerance = ON_PLANE * half
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        from_plane = sign * scratch[source, i, coordinate] - half
        next_plane = sign * scratch[source, j, coordinate] - half
        inside = from_plane <= tolerance
        if inside:
            for d in range(3):
                scratch[target, kept, d] = scratch[source, i, d]
            scratch_edge[target, kept] = scratch_edge[source, i]
            kept += 1
        if inside == (next_plane <= tolerance):
            continue
        if inside and from_plane >= -tolerance:  # the vertex itself lies on the plane
            scratch_edge[target, kept - 1] = plane
        elif inside or next_plane < -tolerance:
            part = from_plane / (from_plane - next_plane)
            for d in range(3):
                start = scratch[source, i, d]
                scratch[target, kept, d] = start + part * (scratch[source, j, d] - start)
            scratch_edge[target, kept] = plane if inside else scratch_edge[source, i]
            kept += 1
    return kept


@kernel
def _name_points(scratch, scratch_edge, source, count, faces, reach):
    """Copy the vertices within reach to the other buffer, with feature ids in place of edge numbers.

    A vertex of a convex polygon is where two of its lines meet: (faces, line arriving, line leaving).
    """
    target = 1 - source
    kept = 0
    for i in range(count):
        if scratch[source, i, 2] <= reach:
            arriving = scratch_edge[source, i - 1 if i > 0 else count - 1]
            for d in range(3):
                scratch[target, kept, d] = scratch[source, i, d]
            scratch_edge[target, kept] = 64 * faces + 8 * arriving + scratch_edge[source, i]
            kept += 1
    return kept


@kernel
def _reduce_to_four(scratch, names, buffer, count, tolerance):
    """Keep the deepest vertex, the one farthest from it, and the widest to either side of that line.

    A later vertex must be better by `tolerance` [m], so that round-off does not choose among equals.
    Polygon order is kept. Returns the number of points kept, 3 or 4.
    """
    p = scratch[buffer]
    first = 0
    for i in range(1, count):
        if p[i, 2] < p[first, 2] - tolerance:
            first = i
    second = first
    farthest = 0.0
    for i in range(count):
        distance = math.hypot(p[i, 0] - p[first, 0], p[i, 1] - p[first, 1])
        if distance > farthest + tolerance:
            farthest = distance
            second = i
    left, right = -1, -1
    widest_left, widest_right = 0.0, 0.0
    ex, ey = (p[second, 0] - p[first, 0]) / farthest, (p[second, 1] - p[first, 1]) / farthest
    for i in range(count):
        width = ex * (p[i, 1] - p[first, 1]) - ey * (p[i, 0] - p[first, 0])
        if width > widest_left + tolerance:
            widest_left, left = width, i
        if -width > widest_right + tolerance:
            widest_right, right = -width, i
    kept = 0
    for i in range(count):
        if i == first or i == second or i == left or i == right:
            for d in range(3):
                p[kept, d] = p[i, d]
            names[buffer, kept] = names[buffer, i]
            kept += 1
    return kept
