"""Box against box: separating axes, face clipping, edge against edge.

The fifteen candidate axes are the three face normals of each box and the nine products of their edges
(Gottschalk, Lin and Manocha, "OBBTree", SIGGRAPH 1996). The axis of largest separation decides. Parallel faces
make several candidates equal but for round-off, so candidates are ranked: a face of f, a face of s, a pair of
edges; a lower rank must win by an advantage.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.textbook.motion import share_of_gap
from reference_solver.textbook3.closing_axis import NO_FACE, lasting_face
from reference_solver.textbook3.points import write_point
from reference_solver.textbook3.polygon import ON_SIDE, clip_to_rectangle, keep_within_reach, reduce_to_four
from reference_solver.textbook3.state import Bodies, Detection, Manifolds
from reference_solver.textbook3.vector import Vector, add, add_scaled, axis, cross, dot, length, row, scale, sub

#: A face of s must separate better than one of f by this part of the smaller half extent, so that ties of aligned
#: boxes are always decided the same way and round-off cannot swap the reference face.
FACE_ADVANTAGE = 1e-6
#: A pair of edges must separate better than any face by this part. It has to exceed the tilt [rad] with which boxes
#: land on each other, about v dt / L = 1e-3: an edge pair is one point where a face offers up to eight.
EDGE_ADVANTAGE = 1e-3
#: Edges closer to parallel than this [rad] offer no axis of their own: a face normal covers them.
PARALLEL = 1e-6
#: Cosines above -TIE, and distances above -TIE half extents, count as positive. Where a direction is exactly tied (two
#: edges equally far out, centres side by side along the normal) round-off would choose, and another one in a turned
#: world; so the positive body axis wins. The cross product of edges nearly `PARALLEL` has round-off of 1e-16 / 1e-6.
TIE = 1e-9
#: Feature numbers: face contacts lie below (72 pairs of faces, 64 vertices each), 12 x 12 pairs of edges above.
EDGES = 72 * 64


@inner_kernel
def box_box(
    bodies: Bodies,
    detection: Detection,
    f: int,
    s: int,
    reach: float,
    ahead: float,
    manifolds: Manifolds,
    m: int,
) -> tuple[int, Vector]:
    """Boxes f and s: up to eight points of two faces, or one of two edges; ``ahead`` as in `collide`."""
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    extent = min(bodies.extent[f], bodies.extent[s])
    face_f, gap_f = best_face(bodies, f, s, between)
    face_s, gap_s = best_face(bodies, s, f, between)
    if gap_f > reach or gap_s > reach:
        return 0, (0.0, 0.0, 1.0)
    edges, gap_e, normal_e = best_edges(bodies, f, s, between)
    if gap_e > reach:
        return 0, (0.0, 0.0, 1.0)
    by_s = gap_s > gap_f + FACE_ADVANTAGE * extent
    if ahead > 0.0:
        gap, n = (gap_s, axis(bodies.axes, s, face_s)) if by_s else (gap_f, axis(bodies.axes, f, face_f))
        n = n if dot(n, between) >= 0.0 else scale(-1.0, n)
        if gap_e > gap + EDGE_ADVANTAGE * extent:
            gap, n = gap_e, normal_e
        face = lasting_face(bodies, f, s, between, n, gap, 2.0 * FACE_ADVANTAGE * extent, ahead)
        if face >= 3:
            count, normal = _clip_faces(bodies, detection, s, f, face - 3, reach, ahead, manifolds, m)
            return count, scale(-1.0, normal)
        if face != NO_FACE:
            return _clip_faces(bodies, detection, f, s, face, reach, ahead, manifolds, m)
    if gap_e <= (gap_s if by_s else gap_f) + EDGE_ADVANTAGE * extent:
        if by_s:
            count, normal = _clip_faces(bodies, detection, s, f, face_s, reach, ahead, manifolds, m)
            normal = scale(-1.0, normal)
        else:
            count, normal = _clip_faces(bodies, detection, f, s, face_f, reach, ahead, manifolds, m)
        if count > 0:
            return count, normal
    if edges < 0:  # parallel boxes whose overlap is thinner than the reach at every vertex
        return 0, (0.0, 0.0, 1.0)
    _write_edges(bodies, f, s, edges, normal_e, gap_e, between, manifolds, m)
    return 1, normal_e


@inner_kernel
def half_width(bodies: Bodies, i: int, n: Vector) -> float:
    """Half width of box i along the unit vector n."""
    return (
        bodies.geometry[i, 0] * abs(dot(axis(bodies.axes, i, 0), n))
        + bodies.geometry[i, 1] * abs(dot(axis(bodies.axes, i, 1), n))
        + bodies.geometry[i, 2] * abs(dot(axis(bodies.axes, i, 2), n))
    )


@inner_kernel
def best_face(bodies: Bodies, r: int, c: int, between: Vector) -> tuple[int, float]:
    """Face axis of box r with the largest gap to box c, and that gap."""
    best, best_gap = 0, -math.inf
    for k in range(3):
        n = axis(bodies.axes, r, k)
        gap = abs(dot(between, n)) - bodies.geometry[r, k] - half_width(bodies, c, n)
        if gap > best_gap + ON_SIDE * bodies.extent[r]:
            best, best_gap = k, gap
    return best, best_gap


@inner_kernel
def best_edges(bodies: Bodies, f: int, s: int, between: Vector) -> tuple[int, float, Vector]:
    """Pair of edges (3 i + j) with the largest gap, that gap, and the unit normal from f to s; -1 if none."""
    best, best_gap, best_normal = -1, -math.inf, (0.0, 0.0, 1.0)
    for i in range(3):
        for j in range(3):
            n = cross(axis(bodies.axes, f, i), axis(bodies.axes, s, j))
            sine = length(n)
            if sine < PARALLEL:
                continue
            n = scale((1.0 if dot(n, between) >= -TIE * sine * bodies.extent[f] else -1.0) / sine, n)
            gap = dot(between, n) - half_width(bodies, f, n) - half_width(bodies, s, n)
            if gap > best_gap + ON_SIDE * bodies.extent[f]:
                best, best_gap, best_normal = 3 * i + j, gap, n
    return best, best_gap, best_normal


@inner_kernel
def _write_edges(
    bodies: Bodies,
    f: int,
    s: int,
    edges: int,
    n: Vector,
    gap: float,
    between: Vector,
    manifolds: Manifolds,
    m: int,
) -> None:
    """One point on the shortest line between the supporting edges of f (along +n) and of s (along -n)."""
    i, j = edges // 3, edges % 3
    p, name_f = _supporting_edge(bodies, f, i, n)
    q, name_s = _supporting_edge(bodies, s, j, scale(-1.0, n))
    e, g = axis(bodies.axes, f, i), axis(bodies.axes, s, j)
    # The line from p + x e to between + q + y g is normal to both edges.
    across = sub(add_scaled(between, 1.0, q), p)
    cosine = dot(e, g)
    divisor = 1.0 - cosine * cosine
    x = (dot(across, e) - cosine * dot(across, g)) / divisor
    y = (cosine * dot(across, e) - dot(across, g)) / divisor
    x = max(-bodies.geometry[f, i], min(bodies.geometry[f, i], x))
    y = max(-bodies.geometry[s, j], min(bodies.geometry[s, j], y))
    on_f = add_scaled(p, x, e)
    on_s = add_scaled(add_scaled(between, 1.0, q), y, g)
    where = add_scaled(on_f, share_of_gap(bodies.motion[f], bodies.motion[s]), sub(on_s, on_f))
    write_point(manifolds, m, 0, f, s, EDGES + 12 * name_f + name_s, where, sub(where, between), gap)


@inner_kernel
def _supporting_edge(bodies: Bodies, i: int, k: int, n: Vector) -> tuple[Vector, int]:
    """Middle of the edge of box i, parallel to its axis k, farthest along n, from its centre; number 0..11."""
    middle = (0.0, 0.0, 0.0)
    name, bit = 4 * k, 1
    for other in range(3):
        if other != k:
            direction = axis(bodies.axes, i, other)
            if dot(direction, n) >= -TIE:
                middle = add_scaled(middle, bodies.geometry[i, other], direction)
                name += bit
            else:
                middle = add_scaled(middle, -bodies.geometry[i, other], direction)
            bit *= 2
    return middle, name


@inner_kernel
def _clip_faces(
    bodies: Bodies,
    detection: Detection,
    r: int,
    c: int,
    k: int,
    reach: float,
    ahead: float,
    manifolds: Manifolds,
    m: int,
) -> tuple[int, Vector]:
    """Clip the face of box c that looks against face +-k of box r; return point count and normal from r to c."""
    between = sub(row(bodies.pose, c, 0), row(bodies.pose, r, 0))
    n = axis(bodies.axes, r, k)
    towards = dot(between, n) >= -TIE * bodies.extent[r]
    if not towards:
        n = scale(-1.0, n)
    ku, kv = (k + 1) % 3, (k + 2) % 3
    u, v = axis(bodies.axes, r, ku), axis(bodies.axes, r, kv)
    face = _project_incident_face(bodies, detection, r, c, n, u, v, between, bodies.geometry[r, k])
    half_u, half_v = bodies.geometry[r, ku], bodies.geometry[r, kv]
    count = clip_to_rectangle(detection, half_u, half_v, ahead)
    count = keep_within_reach(detection, count, reach)
    if ahead == 0.0 and count > 4:  # the textbook's four
        count = reduce_to_four(detection, count, ON_SIDE * (half_u + half_v))
    name = 64 * ((0 if r < c else 36) + 6 * (2 * k + (1 if towards else 0)) + face)
    share = share_of_gap(bodies.motion[r], bodies.motion[c])
    for p in range(count):
        x, y, gap = detection.polygon[1, p, 0], detection.polygon[1, p, 1], detection.polygon[1, p, 2]
        arm = add_scaled(add_scaled(scale(bodies.geometry[r, k] + share * gap, n), x, u), y, v)
        write_point(manifolds, m, p, r, c, name + detection.polygon_edge[1, p], arm, sub(arm, between), gap)
    return count, n


@inner_kernel
def _project_incident_face(
    bodies: Bodies,
    detection: Detection,
    r: int,
    c: int,
    n: Vector,
    u: Vector,
    v: Vector,
    between: Vector,
    height: float,
) -> int:
    """Write the face of box c that looks most against n as polygon 0; return its number 0..5.

    Coordinates are (along u, along v, above the reference face of box r), and the rates of the first two; edge i runs
    from vertex i to vertex i + 1.
    """
    w_r, w_c = row(bodies.twist, r, 3), row(bodies.twist, c, 3)
    passing = sub(row(bodies.twist, c, 0), row(bodies.twist, r, 0))
    k = 0
    for i in range(1, 3):
        if abs(dot(axis(bodies.axes, c, i), n)) > abs(dot(axis(bodies.axes, c, k), n)) + ON_SIDE:
            k = i
    e, g = axis(bodies.axes, c, (k + 1) % 3), axis(bodies.axes, c, (k + 2) % 3)
    half_e, half_g = bodies.geometry[c, (k + 1) % 3], bodies.geometry[c, (k + 2) % 3]
    sign = -1.0 if dot(axis(bodies.axes, c, k), n) > 0.0 else 1.0
    middle = add_scaled(between, sign * bodies.geometry[c, k], axis(bodies.axes, c, k))
    for i in range(4):
        along = half_e if i == 0 or i == 3 else -half_e
        aside = half_g if i < 2 else -half_g
        vertex = add_scaled(add_scaled(middle, along, e), aside, g)
        rate = sub(add(passing, cross(w_c, sub(vertex, between))), cross(w_r, vertex))
        detection.polygon[0, i, 0] = dot(vertex, u)
        detection.polygon[0, i, 1] = dot(vertex, v)
        detection.polygon[0, i, 2] = dot(vertex, n) - height
        detection.polygon[0, i, 3] = dot(rate, u)
        detection.polygon[0, i, 4] = dot(rate, v)
        detection.polygon_edge[0, i] = i
    return 2 * k + (1 if sign > 0.0 else 0)
