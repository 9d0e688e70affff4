"""Contact points of one pair of shapes: normal, gap, arms and the number of the touching features.

A pair function gets the bodies in the order of their shape codes (f, s), finds at most eight points whose normal
leads from f to s, and returns ``(count, normal)``; `collide` turns them so that A has the lower index. Arms are
measured from the bodies' centres, so that nothing depends on where the origin is. With an immovable partner the
contact point lies on the free body's own surface (a rolling sphere keeps its radius, whatever the overlap);
between two free bodies it lies midway, one point for both, which conserves angular momentum.

Feature numbers name what touches (a vertex, a pair of edges, a clipped edge), never a place in a list: they
survive from step to step and carry accumulated impulses with them.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.textbook.motion import share_of_gap
from reference_solver.textbook3.box_box import TIE, box_box
from reference_solver.textbook3.capsule import box_capsule, capsule_capsule, half_space_capsule, sphere_capsule
from reference_solver.textbook3.points import write_point
from reference_solver.textbook3.state import BOX, CAPSULE, HALF_SPACE, SPHERE, Bodies, Detection, Manifolds
from reference_solver.textbook3.vector import (
    Vector,
    add,
    axis,
    dot,
    length,
    row,
    scale,
    sub,
    times,
    times_transposed,
)

#: Cosines closer than this are equal up to round-off; it must not choose between two faces of a box.
SAME_SLOPE = 1e-9


@inner_kernel
def collide(
    bodies: Bodies,
    detection: Detection,
    a: int,
    b: int,
    margin: float,
    ahead: float,
    manifolds: Manifolds,
    m: int,
) -> int:
    """Write the manifold of bodies a < b in row m; return its number of points (0: no contact).

    ``ahead``: time [s] within which axes that separate them are told apart by when they close, and corners on the side
    of a face by whether they leave it; 0: by places alone, and four points at most, as in the textbook.
    """
    reach = margin * min(bodies.extent[a], bodies.extent[b])
    manifolds.body_a[m] = a
    manifolds.body_b[m] = b
    if bodies.kind[a] <= bodies.kind[b]:
        count, normal = _pair(bodies, detection, a, b, reach, ahead, manifolds, m)
    else:
        count, normal = _pair(bodies, detection, b, a, reach, ahead, manifolds, m)
        normal = scale(-1.0, normal)
    manifolds.points[m] = count
    for d in range(3):
        manifolds.frame[m, 2, d] = normal[d]
    return count


@inner_kernel
def _pair(
    bodies: Bodies,
    detection: Detection,
    f: int,
    s: int,
    reach: float,
    ahead: float,
    manifolds: Manifolds,
    m: int,
) -> tuple[int, Vector]:
    if bodies.kind[s] == CAPSULE:
        if bodies.kind[f] == HALF_SPACE:
            return half_space_capsule(bodies, f, s, reach, manifolds, m)
        if bodies.kind[f] == SPHERE:
            return sphere_capsule(bodies, f, s, reach, manifolds, m)
        if bodies.kind[f] == CAPSULE:
            return capsule_capsule(bodies, f, s, reach, manifolds, m)
        return box_capsule(bodies, f, s, reach, manifolds, m)
    if bodies.kind[f] == HALF_SPACE:
        if bodies.kind[s] == SPHERE:
            return half_space_sphere(bodies, f, s, reach, manifolds, m)
        if bodies.kind[s] == BOX:
            return half_space_box(bodies, f, s, reach, manifolds, m)
        return 0, (0.0, 0.0, 1.0)  # two half-spaces: neither is ever free
    if bodies.kind[f] == SPHERE:
        return sphere_sphere(bodies, f, s, reach, manifolds, m)
    if bodies.kind[s] == SPHERE:
        return box_sphere(bodies, f, s, reach, manifolds, m)
    return box_box(bodies, detection, f, s, reach, ahead, manifolds, m)


@inner_kernel
def half_space_sphere(bodies: Bodies, f: int, s: int, reach: float, manifolds: Manifolds, m: int) -> tuple[int, Vector]:
    """Half-space f and sphere s: one point under the centre."""
    normal = times(bodies.axes, f, row(bodies.geometry, f, 0))
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    gap = dot(normal, between) - bodies.geometry[f, 3] - bodies.geometry[s, 0]
    if gap > reach:
        return 0, normal
    arm = scale(-bodies.geometry[s, 0], normal)
    write_point(manifolds, m, 0, f, s, 0, add(between, arm), arm, gap)
    return 1, normal


@inner_kernel
def half_space_box(bodies: Bodies, f: int, s: int, reach: float, manifolds: Manifolds, m: int) -> tuple[int, Vector]:
    """Half-space f and box s: corners of the face that looks most against the normal; the deepest is among them.

    The feature is the number of the corner: bit k is set where it lies at +half_extent along body axis k.
    """
    normal = times(bodies.axes, f, row(bodies.geometry, f, 0))
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    height = dot(normal, between) - bodies.geometry[f, 3]
    down = times_transposed(bodies.axes, s, scale(-1.0, normal))
    k = 0
    for i in range(1, 3):
        if abs(down[i]) > abs(down[k]) + SAME_SLOPE:
            k = i
    count = 0
    for corner in range(8):
        if ((corner >> k) & 1 == 1) != (down[k] > 0.0):
            continue
        arm = times(
            bodies.axes,
            s,
            (
                bodies.geometry[s, 0] if corner & 1 else -bodies.geometry[s, 0],
                bodies.geometry[s, 1] if corner & 2 else -bodies.geometry[s, 1],
                bodies.geometry[s, 2] if corner & 4 else -bodies.geometry[s, 2],
            ),
        )
        gap = height + dot(normal, arm)
        if gap <= reach:
            write_point(manifolds, m, count, f, s, corner, add(between, arm), arm, gap)
            count += 1
    return count, normal


@inner_kernel
def sphere_sphere(bodies: Bodies, f: int, s: int, reach: float, manifolds: Manifolds, m: int) -> tuple[int, Vector]:
    """Spheres f and s: one point on the line of centres; concentric spheres separate along z."""
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    distance = length(between)
    gap = distance - bodies.geometry[f, 0] - bodies.geometry[s, 0]
    normal = (0.0, 0.0, 1.0)
    if gap > reach:
        return 0, normal
    if distance > 0.0:
        normal = scale(1.0 / distance, between)
    share = share_of_gap(bodies.motion[f], bodies.motion[s])
    near = bodies.geometry[f, 0] + share * gap
    far = bodies.geometry[s, 0] + (1.0 - share) * gap
    write_point(manifolds, m, 0, f, s, 0, scale(near, normal), scale(-far, normal), gap)
    return 1, normal


@inner_kernel
def box_sphere(bodies: Bodies, f: int, s: int, reach: float, manifolds: Manifolds, m: int) -> tuple[int, Vector]:
    """Box f and sphere s: nearest point of the box, or its nearest face if the centre is inside."""
    between = sub(row(bodies.pose, s, 0), row(bodies.pose, f, 0))
    local = times_transposed(bodies.axes, f, between)
    half = row(bodies.geometry, f, 0)
    outside = (
        local[0] - max(-half[0], min(half[0], local[0])),
        local[1] - max(-half[1], min(half[1], local[1])),
        local[2] - max(-half[2], min(half[2], local[2])),
    )
    distance = length(outside)
    if distance > 0.0:
        normal = times(bodies.axes, f, scale(1.0 / distance, outside))
    else:
        k = 0
        for i in range(1, 3):
            if abs(local[i]) - half[i] > abs(local[k]) - half[k] + TIE * bodies.extent[f]:
                k = i
        distance = abs(local[k]) - half[k]
        normal = scale(1.0 if local[k] >= -TIE * bodies.extent[f] else -1.0, axis(bodies.axes, f, k))
    gap = distance - bodies.geometry[s, 0]
    if gap > reach:
        return 0, normal
    arm = scale(-(bodies.geometry[s, 0] + (1.0 - share_of_gap(bodies.motion[f], bodies.motion[s])) * gap), normal)
    write_point(manifolds, m, 0, f, s, 0, add(between, arm), arm, gap)
    return 1, normal
