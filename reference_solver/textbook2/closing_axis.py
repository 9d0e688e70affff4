"""Which of several axes that separate two bodies is the contact's: the one that separates them longest (E50).

Bodies touch when the last axis that separates them stops to. A box that slides over two flush boxes is separated from
the second one by the side of that box, which it comes up to, and by the faces that slide on each other, which it does
not: at the seam both gaps are zero to the last digit, and a rule that looks at gaps alone lets round-off choose.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.textbook.noise import COORDINATE_NOISE, ROUND_OFF
from reference_solver.textbook2.columns import EXTENT, VERTICES
from reference_solver.textbook2.separating_axis import (
    AXIS_ADVANTAGE,
    CORNERS,
    corner,
    corner_line,
    edge_normal,
    support,
)
from reference_solver.textbook2.state import Bodies

#: Axes whose times differ by less than this share of them separate equally long.
SAME_TIME = 1e-6
#: Cosine of the angle between two axes of one contact. Faces that lie on each other have all but the same normal: which
#: of the two is taken the order says (E50), not the time, which round-off would decide. Sides of a seam stand apart.
SAME_AXIS = 1.0 - 5e-7


@spliced_kernel
def corner_speed(bodies: Bodies, i: int, nx: float, ny: float, noise: float) -> float:
    """Least rate along n of the corners of body i that reach farthest against n [m/s]."""
    far = -support(bodies, i, -nx, -ny)
    slowest = math.inf
    for k in range(bodies.kind[i, VERTICES]):
        x, y = corner(bodies, i, k)
        if nx * x + ny * y <= far + noise:
            slowest = min(slowest, bodies.twist[i, 2] * (ny * x - nx * y))
    return slowest + nx * bodies.twist[i, 0] + ny * bodies.twist[i, 1]


@spliced_kernel
def separation_along(bodies: Bodies, a: int, b: int, nx: float, ny: float, dx: float, dy: float) -> float:
    """Separation of the cores along n, from a to b; (dx, dy) leads from a to b [m]."""
    return nx * dx + ny * dy - support(bodies, a, nx, ny) - support(bodies, b, -nx, -ny)


@spliced_kernel
def closing_time(bodies: Bodies, a: int, b: int, nx: float, ny: float, gap: float, noise: float, ahead: float) -> float:
    """Time after which n, from a to b, no longer separates, at the present velocities; at most ``ahead`` [s].

    Of axes whose gaps are round-off the one closes last along which bodies approach least.
    """
    rate = corner_speed(bodies, b, nx, ny, noise) + corner_speed(bodies, a, -nx, -ny, noise)
    return min(ahead, max(gap, noise) / -rate) if rate < 0.0 else ahead


@spliced_kernel
def axis_normal(
    bodies: Bodies, a: int, b: int, reference: int, k: int, l: int, dx: float, dy: float
) -> tuple[float, float]:
    """Unit vector from a to b of the edge k of body ``reference``, or of the line from corner k to corner l."""
    if reference == CORNERS:
        return corner_line(bodies, a, b, k, l, dx, dy)
    x, y = edge_normal(bodies, reference, k)
    return (x, y) if reference == a else (-x, -y)


@inner_kernel
def lasting_axis(
    bodies: Bodies, a: int, b: int, way: tuple[float, float], reference: int, k: int, l: int, grown: float, ahead: float
) -> tuple[float, int, int, int]:
    """Axis that separates a and b longest, where the axis (reference, k, l), best by its gap, closes within ``ahead``.

    ``way``: from the centre of a to that of b; ``grown``: sum of both radii [m]. Returns the separation of the cores
    along it, the body whose edge it is, the edge, and a corner, as `separating_axis` does.
    """
    dx, dy = way
    nx, ny = axis_normal(bodies, a, b, reference, k, l, dx, dy)
    best = separation_along(bodies, a, b, nx, ny, dx, dy)
    place, extent = 0.0, min(bodies.real[a, EXTENT], bodies.real[b, EXTENT])
    for d in range(2):
        place = max(place, abs(bodies.pose[a, d]), abs(bodies.pose[b, d]))
    noise = 2.0 * (ROUND_OFF * extent + COORDINATE_NOISE * place)
    longest = -1.0
    if best - grown >= -noise:
        longest = closing_time(bodies, a, b, nx, ny, best - grown, noise, ahead)
    # By its gap it is best but for what an axis earlier in order may be worse by, at most twice (E50).
    margin = 2.0 * AXIS_ADVANTAGE * extent
    if longest == ahead or best - grown < -noise - margin:
        return best, reference, k, l
    largest = best
    for side in range(2):
        r = a if side == 0 else b
        for edge in range(bodies.kind[r, VERTICES] if bodies.kind[r, VERTICES] > 1 else 0):
            x, y = axis_normal(bodies, a, b, r, edge, 0, dx, dy)
            largest = max(largest, separation_along(bodies, a, b, x, y, dx, dy))
    if largest - grown < -noise:
        return best, reference, k, l  # they overlap: nothing separates them
    for side in range(2):
        r = a if side == 0 else b
        for edge in range(bodies.kind[r, VERTICES] if bodies.kind[r, VERTICES] > 1 else 0):
            x, y = axis_normal(bodies, a, b, r, edge, 0, dx, dy)
            gap = separation_along(bodies, a, b, x, y, dx, dy)
            if gap - grown < -noise or x * nx + y * ny > SAME_AXIS:
                continue
            time = closing_time(bodies, a, b, x, y, gap - grown, noise, ahead)
            if time > longest * (1.0 + SAME_TIME):
                best, reference, k, l, longest = gap, r, edge, 0, time
    return best, reference, k, l
