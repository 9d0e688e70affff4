"""How far two shapes are apart, and along which direction: a lower bound of their distance (E31).

Positive where the shapes are apart, zero where they touch. For boxes it is the largest gap over the separating axes.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.spatial.box_box import best_edges, best_face, half_width
from reference_solver.spatial.capsule import nearest_of_segments
from reference_solver.spatial.segment_box import best_face as best_face_for_segment
from reference_solver.spatial.segment_box import excess, nearest_on_segment
from reference_solver.spatial.state import BOX, CAPSULE, HALF_SPACE, SPHERE, Bodies
from reference_solver.spatial.vector import (
    Vector,
    add_scaled,
    axis,
    dot,
    length,
    row,
    scale,
    sub,
    times,
    times_transposed,
)


@inner_kernel
def separation(bodies: Bodies, f: int, s: int) -> tuple[float, Vector]:
    """Gap of bodies f and s [m] and the unit vector from f to s it is measured along; kind of f <= kind of s."""
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    if bodies.kind[f] == HALF_SPACE:
        n = times(bodies.axes, f, row(bodies.geometry, f, 0))
        return dot(n, between) - bodies.geometry[f, 3] - core_width(bodies, s, n) - radius_of(bodies, s), n
    if bodies.kind[f] == BOX:
        if bodies.kind[s] == BOX:
            return box_box_separation(bodies, f, s, between)
        return box_segment_separation(bodies, f, s, between)
    x, y = nearest_of_segments(
        between, axis(bodies.axes, f, 0), half_length(bodies, f), axis(bodies.axes, s, 0), half_length(bodies, s)
    )
    core = add_scaled(add_scaled(between, y, axis(bodies.axes, s, 0)), -x, axis(bodies.axes, f, 0))
    distance = length(core)
    n = scale(1.0 / distance, core) if distance > 0.0 else axis(bodies.axes, f, 2)
    return distance - radius_of(bodies, f) - radius_of(bodies, s), n


@inner_kernel
def radius_of(bodies: Bodies, i: int) -> float:
    """By how much the core of a shape (point, segment or box) is grown [m]."""
    if bodies.kind[i] == CAPSULE:
        return bodies.geometry[i, 1]
    return bodies.geometry[i, 0] if bodies.kind[i] == SPHERE else 0.0


@inner_kernel
def half_length(bodies: Bodies, i: int) -> float:
    """Half length of a capsule's segment; 0 of a sphere [m]."""
    return bodies.geometry[i, 0] if bodies.kind[i] == CAPSULE else 0.0


@inner_kernel
def core_width(bodies: Bodies, i: int, n: Vector) -> float:
    """Half width of the core of body i along the unit vector n [m]."""
    if bodies.kind[i] == BOX:
        return half_width(bodies, i, n)
    return half_length(bodies, i) * abs(dot(axis(bodies.axes, i, 0), n))


@inner_kernel
def box_box_separation(bodies: Bodies, f: int, s: int, between: Vector) -> tuple[float, Vector]:
    """Largest gap over the three face normals of each box and the nine products of their edges."""
    k, gap = best_face(bodies, f, s, between)
    n = axis(bodies.axes, f, k)
    other, other_gap = best_face(bodies, s, f, between)
    if other_gap > gap:
        gap, n = other_gap, axis(bodies.axes, s, other)
    if dot(n, between) < 0.0:
        n = scale(-1.0, n)
    edges, edge_gap, edge_normal = best_edges(bodies, f, s, between)
    if edges >= 0 and edge_gap > gap:
        return edge_gap, edge_normal
    return gap, n


@inner_kernel
def box_segment_separation(bodies: Bodies, f: int, s: int, between: Vector) -> tuple[float, Vector]:
    """Distance of a capsule's segment, or a sphere's centre, to the box, less the radius; a face's gap if they meet."""
    half, along = row(bodies.geometry, f, 0), half_length(bodies, s)
    c = times_transposed(bodies.axes, f, between)
    e = times_transposed(bodies.axes, f, axis(bodies.axes, s, 0))
    outside = excess(add_scaled(c, nearest_on_segment(c, e, along, half) if along > 0.0 else 0.0, e), half)
    distance = length(outside)
    if distance > 0.0:
        return distance - radius_of(bodies, s), times(bodies.axes, f, scale(1.0 / distance, outside))
    k, sign, gap = best_face_for_segment(c, e, along, half)
    return gap - radius_of(bodies, s), scale(sign, axis(bodies.axes, f, k))
