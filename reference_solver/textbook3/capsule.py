"""Capsules against half-spaces, spheres, boxes and each other: a segment on the body's x axis, grown by a radius.

Where the segment does not meet the other core, the normal is the line through the nearest points, and the gap is
exact. A segment that lies along a face, an edge or another segment touches at both ends of what they share.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.textbook.motion import share_of_gap
from reference_solver.textbook3.points import write_point
from reference_solver.textbook3.segment_box import (
    best_face,
    clipped,
    excess,
    nearest_on_segment,
    piercing_axis,
    support_of_box,
)
from reference_solver.textbook3.state import Bodies, Manifolds
from reference_solver.textbook3.vector import Vector, add_scaled, axis, cross, dot, length, row, scale, sub, times

#: Axes closer to parallel than this [rad] share a line of contact, seen as its two ends. It has to exceed the tilt
#: with which bodies land on each other, about v dt / L = 1e-3; crossed by so little, capsules of length L and
#: radius R part by (1e-3 L)^2 / 16 R at the ends of that line.
ALONG = 1e-3
#: Cores nearer than this part of the smaller half width meet: their distance has no direction but round-off's.
MEETING = 1e-9
#: Features of a capsule on a box: 6 faces and 12 edges with two ends each, then edges and corners met in one point.
ON_EDGE, ACROSS = 12, 36


@inner_kernel
def half_space_capsule(
    bodies: Bodies, f: int, s: int, reach: float, manifolds: Manifolds, m: int
) -> tuple[int, Vector]:
    """Half-space f and capsule s: both ends of the segment."""
    normal = times(bodies.axes, f, row(bodies.geometry, f, 0))
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    radius = bodies.geometry[s, 1]
    height = dot(normal, between) - bodies.geometry[f, 3] - radius
    count = 0
    for end in range(2):
        along = scale(bodies.geometry[s, 0] if end == 0 else -bodies.geometry[s, 0], axis(bodies.axes, s, 0))
        gap = height + dot(normal, along)
        if gap <= reach:
            arm = add_scaled(along, -radius, normal)
            write_point(manifolds, m, count, f, s, end, add_scaled(arm, 1.0, between), arm, gap)
            count += 1
    return count, normal


@inner_kernel
def arms_below(bodies: Bodies, f: int, s: int, core: Vector, n: Vector, gap: float) -> tuple[Vector, Vector]:
    """Arms of the contact point below ``core``, a point of capsule s's segment minus the centre of f.

    ``n`` leads from f to s.
    """
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    arm = add_scaled(core, -(bodies.geometry[s, 1] + (1.0 - share_of_gap(bodies.motion[f], bodies.motion[s])) * gap), n)
    return arm, sub(arm, between)


@inner_kernel
def sphere_capsule(bodies: Bodies, f: int, s: int, reach: float, manifolds: Manifolds, m: int) -> tuple[int, Vector]:
    """Sphere f and capsule s: the nearest point of the segment; a centre on the segment leaves along body axis z."""
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    along, half = axis(bodies.axes, s, 0), bodies.geometry[s, 0]
    core = add_scaled(between, max(-half, min(half, -dot(between, along))), along)
    distance = length(core)
    radius = bodies.geometry[s, 1]
    gap = distance - bodies.geometry[f, 0] - radius
    normal = axis(bodies.axes, s, 2)
    if gap > reach:
        return 0, normal
    if distance > MEETING * min(bodies.extent[f], bodies.extent[s]):
        normal = scale(1.0 / distance, core)
    at_f, at_s = arms_below(bodies, f, s, core, normal, gap)
    write_point(manifolds, m, 0, f, s, 0, at_f, at_s, gap)
    return 1, normal


@inner_kernel
def nearest_of_segments(between: Vector, e: Vector, a: float, g: Vector, b: float) -> tuple[float, float]:
    """Where x e (|x| <= a) and between + y g (|y| <= b) come nearest, e and g of unit length.

    Free minimum, clamped on the first, projected on the second, clamped and projected back (C. Ericson, *Real-Time
    Collision Detection*, 2005, 5.1.9). Parallel segments: some nearest pair.
    """
    cosine = dot(e, g)
    on_e, on_g = dot(between, e), dot(between, g)
    divisor = 1.0 - cosine * cosine
    x = (on_e - cosine * on_g) / divisor if divisor > 0.0 else on_e
    x = max(-a, min(a, x))
    y = x * cosine - on_g
    if abs(y) > b:
        y = math.copysign(b, y)
        x = max(-a, min(a, on_e + y * cosine))
    return x, y


@inner_kernel
def capsule_capsule(bodies: Bodies, f: int, s: int, reach: float, manifolds: Manifolds, m: int) -> tuple[int, Vector]:
    """Capsules f and s: one point; two where they lie along each other."""
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    e, g = axis(bodies.axes, f, 0), axis(bodies.axes, s, 0)
    a, b = bodies.geometry[f, 0], bodies.geometry[s, 0]
    x, y = nearest_of_segments(between, e, a, g, b)
    core = add_scaled(between, y, g)
    apart = add_scaled(core, -x, e)
    distance = length(apart)
    normal, across = axis(bodies.axes, f, 2), cross(e, g)
    if distance > MEETING * min(bodies.extent[f], bodies.extent[s]):
        normal = scale(1.0 / distance, apart)
    elif length(across) > 0.0:
        normal = scale(1.0 / length(across), across)
    radius = bodies.geometry[s, 1]
    gap = distance - bodies.geometry[f, 1] - radius
    if gap > reach:
        return 0, normal
    middle, width = dot(between, e), b * abs(dot(e, g))
    low, high = max(-a, middle - width), min(a, middle + width)
    aligned = length(across) < ALONG and abs(dot(normal, e)) < ALONG
    if not aligned or low >= high:
        at_f, at_s = arms_below(bodies, f, s, core, normal, gap)
        write_point(manifolds, m, 0, f, s, 0, at_f, at_s, gap)
        return 1, normal
    count = 0
    for end in range(2):
        x = low if end == 0 else high
        y = (x - middle) / dot(e, g)
        core = add_scaled(between, y, g)
        gap = dot(normal, add_scaled(core, -x, e)) - bodies.geometry[f, 1] - radius
        if gap <= reach:
            at_f, at_s = arms_below(bodies, f, s, core, normal, gap)
            write_point(manifolds, m, count, f, s, 1 + end, at_f, at_s, gap)
            count += 1
    return count, normal


@inner_kernel
def box_capsule(bodies: Bodies, f: int, s: int, reach: float, manifolds: Manifolds, m: int) -> tuple[int, Vector]:
    """Box f and capsule s: one point, or the two ends of what lies along a face or an edge. Local: in f's axes."""
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    along = axis(bodies.axes, s, 0)
    c = (
        dot(axis(bodies.axes, f, 0), between),
        dot(axis(bodies.axes, f, 1), between),
        dot(axis(bodies.axes, f, 2), between),
    )
    e = (dot(axis(bodies.axes, f, 0), along), dot(axis(bodies.axes, f, 1), along), dot(axis(bodies.axes, f, 2), along))
    h, half, radius = row(bodies.geometry, f, 0), bodies.geometry[s, 0], bodies.geometry[s, 1]
    t = nearest_on_segment(c, e, half, h)
    outside = excess(add_scaled(c, t, e), h)
    distance = length(outside)
    if distance <= MEETING * min(bodies.extent[f], bodies.extent[s]):
        distance = 0.0
    face, sign, separation = best_face(c, e, half, h)
    if max(distance, separation) - radius > reach:
        return 0, along
    feature = 4 * face + (2 if sign > 0.0 else 0)
    local = (sign if face == 0 else 0.0, sign if face == 1 else 0.0, sign if face == 2 else 0.0)
    low, high = -half, half
    if distance > separation + 1e-6 * bodies.extent[f] and distance > 0.0:
        local = scale(1.0 / distance, outside)
        feature, k = _feature(outside, e, c, t)
        low = high = t
        if k >= 0:
            low, high = clipped(c[k], e[k], half, h[k])
    elif distance == 0.0:
        edge, apart, across = piercing_axis(c, e, half, h)
        if apart > separation + 1e-3 * min(bodies.extent[f], bodies.extent[s]):
            local, feature = across, ACROSS + edge
            low = high = _across(c, e, half, h, across, edge)
    if feature < ON_EDGE:
        for k in range(3):
            if k != face:
                to_low, to_high = clipped(c[k], e[k], half, h[k])
                low, high = max(low, to_low), min(high, to_high)
        if low > high:  # beside the face, by less than what a corner must win by
            low = high = t
    normal = times(bodies.axes, f, local)
    count = 0
    for end in range(1 if low == high else 2):
        t = low if end == 0 else high
        gap = dot(local, add_scaled(c, t, e)) - support_of_box(local, h) - radius
        if gap <= reach:
            at_f, at_s = arms_below(bodies, f, s, add_scaled(between, t, along), normal, gap)
            write_point(manifolds, m, count, f, s, feature + end, at_f, at_s, gap)
            count += 1
    return count, normal


@inner_kernel
def _feature(outside: Vector, e: Vector, c: Vector, t: float) -> tuple[int, int]:
    """Name of the edge or corner of the box that is nearest; the edge's axis if the segment lies along it, else -1."""
    k, edges, name = -1, 0, 0
    for d in range(3):
        if outside[d] == 0.0:
            k = d
            edges += 1
        elif outside[d] > 0.0:
            name += 1 << d
    if edges == 1:
        name = 4 * k + ((name >> 1) if k == 0 else (name & 1) + ((name >> 2) << 1) if k == 1 else name & 3)
        if math.sqrt(max(1.0 - e[k] * e[k], 0.0)) < ALONG:
            return ON_EDGE + 2 * name, k
        return ACROSS + name, -1
    return ACROSS + 12 + name, -1


@inner_kernel
def _across(c: Vector, e: Vector, half: float, h: Vector, n: Vector, edge: int) -> float:
    """Place on the segment, met by the box's edge along axis `edge` that lies farthest along n."""
    middle = (
        0.0 if edge == 0 else math.copysign(h[0], n[0]),
        0.0 if edge == 1 else math.copysign(h[1], n[1]),
        0.0 if edge == 2 else math.copysign(h[2], n[2]),
    )
    u = (1.0 if edge == 0 else 0.0, 1.0 if edge == 1 else 0.0, 1.0 if edge == 2 else 0.0)
    _, y = nearest_of_segments(sub(c, middle), u, h[edge], e, half)
    return y
