"""A segment c + t e (|t| <= half, e of unit length) and a box about the origin with half extents h, in its axes."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.textbook3.vector import Vector, add_scaled, cross, dot, length, scale

#: Faces and edges that separate no better than another by this part of the box's size count as equal.
EQUAL = 1e-8
#: A segment closer to parallel with an edge than this [rad] makes no axis with it: a face normal covers it.
PARALLEL = 1e-6


@inner_kernel
def excess(p: Vector, h: Vector) -> Vector:
    """From the nearest point of the box to p; zero inside."""
    return (
        p[0] - max(-h[0], min(h[0], p[0])),
        p[1] - max(-h[1], min(h[1], p[1])),
        p[2] - max(-h[2], min(h[2], p[2])),
    )


@inner_kernel
def nearest_on_segment(c: Vector, e: Vector, half: float, h: Vector) -> float:
    """Place t of the segment's point nearest to the box.

    Half the derivative of the squared distance, e . excess, grows with t and is linear between the places where a
    coordinate passes a face: those places bracket its zero, and one interpolation finds it.
    """
    low, high = -half, half
    if dot(e, excess(add_scaled(c, low, e), h)) >= 0.0:
        return low
    if dot(e, excess(add_scaled(c, high, e), h)) <= 0.0:
        return high
    for k in range(3):
        for side in range(2):
            if e[k] == 0.0:
                continue
            t = ((h[k] if side == 0 else -h[k]) - c[k]) / e[k]
            if low < t < high:
                if dot(e, excess(add_scaled(c, t, e), h)) < 0.0:
                    low = t
                else:
                    high = t
    at_low = dot(e, excess(add_scaled(c, low, e), h))
    at_high = dot(e, excess(add_scaled(c, high, e), h))
    return low + (high - low) * (at_low / (at_low - at_high)) if at_high > at_low else high


@inner_kernel
def clipped(c: float, e: float, half: float, h: float) -> tuple[float, float]:
    """Places between which the coordinate c + t e stays within +-h, and the segment lasts; empty if low > high."""
    if e == 0.0:
        return (-half, half) if abs(c) <= h else (half, -half)
    low, high = (-h - c) / e, (h - c) / e
    if low > high:
        low, high = high, low
    return max(low, -half), min(high, half)


@inner_kernel
def support_of_box(n: Vector, h: Vector) -> float:
    """Largest n . p over the box."""
    return abs(n[0]) * h[0] + abs(n[1]) * h[1] + abs(n[2]) * h[2]


@inner_kernel
def best_face(c: Vector, e: Vector, half: float, h: Vector) -> tuple[int, float, float]:
    """Axis and side of the face that separates best from the segment, and the separation."""
    best, sign, separation = 0, 1.0, -math.inf
    size = min(h[0], h[1], h[2])
    for k in range(3):
        apart = abs(c[k]) - h[k] - half * abs(e[k])
        if apart > separation + EQUAL * size:
            best, sign, separation = k, math.copysign(1.0, c[k]), apart
    return best, sign, separation


@inner_kernel
def piercing_axis(c: Vector, e: Vector, half: float, h: Vector) -> tuple[int, float, Vector]:
    """Axis normal to the segment and to an edge along which they separate best: edge (-1: none), separation, axis."""
    best, separation, normal = -1, -math.inf, (0.0, 0.0, 1.0)
    size = min(h[0], h[1], h[2])
    for k in range(3):
        n = cross((1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0), e)
        sine = length(n)
        if sine < PARALLEL:
            continue
        n = scale((1.0 if dot(n, c) >= 0.0 else -1.0) / sine, n)
        apart = dot(n, c) - support_of_box(n, h)
        if apart > separation + EQUAL * size:
            best, separation, normal = k, apart, n
    return best, separation, normal
