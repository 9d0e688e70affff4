"""Which face that separates two boxes is the contact's: the one that separates them longest (E31).

As in the plane: boxes touch when the last axis that separates them stops to. A box that slides over two flush boxes is
separated from the second one by the side of that box, which it comes up to, and by the faces that slide on each other,
which it does not; at the seam both gaps are zero to the last digit.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.textbook.noise import COORDINATE_NOISE, ROUND_OFF
from reference_solver.textbook3.state import Bodies
from reference_solver.textbook3.vector import Vector, axis, cross, dot, row, scale, times

#: Axes whose times differ by less than this share of them separate equally long.
SAME_TIME = 1e-6
#: Cosine of the angle between two axes of one contact: which of two faces that lie on each other is taken the order
#: says, not the time, which round-off would decide. Sides of a seam stand apart.
SAME_AXIS = 1.0 - 5e-7
#: No face but the chosen one.
NO_FACE = -1


@inner_kernel
def corner_speed(bodies: Bodies, i: int, n: Vector, noise: float) -> float:
    """Least rate along n of the corners of box i that reach farthest against n [m/s]."""
    x, y, z = bodies.geometry[i, 0], bodies.geometry[i, 1], bodies.geometry[i, 2]
    far = math.inf
    for c in range(8):
        far = min(far, dot(n, times(bodies.axes, i, (x if c & 1 else -x, y if c & 2 else -y, z if c & 4 else -z))))
    slowest = math.inf
    for c in range(8):
        arm = times(bodies.axes, i, (x if c & 1 else -x, y if c & 2 else -y, z if c & 4 else -z))
        if dot(n, arm) <= far + noise:
            slowest = min(slowest, dot(n, cross(row(bodies.twist, i, 3), arm)))
    return slowest + dot(n, row(bodies.twist, i, 0))


@inner_kernel
def closing_time(bodies: Bodies, f: int, s: int, n: Vector, gap: float, noise: float, ahead: float) -> float:
    """Time after which n, from f to s, no longer separates, at the present velocities; at most ``ahead`` [s].

    Of axes whose gaps are round-off the one closes last along which bodies approach least.
    """
    rate = corner_speed(bodies, s, n, noise) + corner_speed(bodies, f, scale(-1.0, n), noise)
    return min(ahead, max(gap, noise) / -rate) if rate < 0.0 else ahead


@inner_kernel
def lasting_face(
    bodies: Bodies, f: int, s: int, between: Vector, n: Vector, gap: float, margin: float, ahead: float
) -> int:
    """Face axis, of f or of s (3 and up), that separates the boxes longer than n; `NO_FACE` if none does.

    n, from f to s, is best by its gap, but for the ``margin`` [m] by which an axis earlier in order may be worse. It is
    kept where it stays apart for the time ``ahead``, and where nothing separates the boxes.
    """
    place = 0.0
    for d in range(3):
        place = max(place, abs(bodies.pose[f, d]), abs(bodies.pose[s, d]))
    noise = 2.0 * (ROUND_OFF * min(bodies.extent[f], bodies.extent[s]) + COORDINATE_NOISE * place)
    if gap < -noise - margin:
        return NO_FACE
    longest = closing_time(bodies, f, s, n, gap, noise, ahead) if gap >= -noise else -1.0
    if longest == ahead:
        return NO_FACE
    found = NO_FACE
    for k in range(6):
        u = axis(bodies.axes, f if k < 3 else s, k % 3)
        u = u if dot(u, between) >= 0.0 else scale(-1.0, u)
        apart = dot(u, between)
        for d in range(3):
            apart -= bodies.geometry[f, d] * abs(dot(u, axis(bodies.axes, f, d)))
            apart -= bodies.geometry[s, d] * abs(dot(u, axis(bodies.axes, s, d)))
        if apart < -noise or dot(u, n) > SAME_AXIS:
            continue
        time = closing_time(bodies, f, s, u, apart, noise, ahead)
        if time > longest * (1.0 + SAME_TIME):
            found, longest = k, time
    return found
