"""Held contacts: which feature of either body touches, and how gap, normal, levers and their rates follow the bodies.

A contact that lasts is held by its *features*, not by a point in space: the vertex of one body keeps to the face of the
other, an edge rolls over an edge. Every body offers one of three cores, grown by a radius:

* a **point** (vertex, end of a capsule, centre of a sphere),
* a **line** (edge, axis of a capsule),
* a **plane** (face, half-space), which only a point of the other body may touch.

With these the gap is a smooth function of the poses, so that its second derivative along the motion exists:

    d/dt (J v) = J dv/dt + gamma,      gamma = (d/ds J(q + s v)) v   (v, w held, orientations turned by exp(s w)).

Let u be the relative velocity of the two bodies at the contact point, n the normal, r_a and r_b the levers, and dots the
rates along that motion. Then beta = w_b x r_b' - w_a x r_a' and

    gamma_n = n . beta + n' . u,        gamma_t = t . beta - (t . n') u_n

with tangents that do not turn about n (their choice is free: where a contact sticks u is zero, where it slips only the
normal part is used). Levers lead to the *geometric* point of contact, which moves over both surfaces.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.spatial.points import share_of_gap
from reference_solver.spatial.state import BOX, CAPSULE, HALF_SPACE, Bodies, Manifolds
from reference_solver.spatial.vector import (
    ZERO,
    Vector,
    add,
    add_scaled,
    axis,
    cross,
    dot,
    length,
    row,
    scale,
    sub,
    tangents,
    times,
    times_transposed,
)

#: Cores.
POINT, LINE, PLANE = 0, 1, 2

#: One held contact point. Features in the axes of their bodies; what follows from the poses in world axes.
HELD = np.dtype(
    [
        ("body", "i8", 2),  # a, b
        ("manifold", "i8"),  # where it was found
        ("point", "i8"),
        ("core", "i8", 2),  # POINT, LINE or PLANE of either body
        ("place", "f8", (2, 3)),  # a point of the core, body axes [m]
        ("direction", "f8", (2, 3)),  # unit direction of a line, outward normal of a plane, body axes
        ("radius", "f8", 2),  # by which the core is grown [m]
        ("side", "f8"),  # line on line: sign of e_a x e_b along the normal
        ("friction", "f8"),  # mu
        ("gap", "f8"),  # [m]
        ("frame", "f8", (3, 3)),  # rows n, t1, t2; n from A to B
        ("arm", "f8", (2, 3)),  # contact point minus centre of either body [m]
        ("velocity", "f8", 3),  # u along n, t1, t2 [m/s]
        ("gamma", "f8", 3),  # along n, t1, t2 [m/s^2]
        ("mode", "i8"),  # see `phase`
        ("slip", "f8", 3),  # unit direction of the slip, world axes
        ("force", "f8", 3),  # on B along n, t1, t2 [N]
        ("along", "f8", (2,)),  # place on a line, from `place` [m]: where it reaches the end the feature changes
    ],
    align=True,
)
Held: TypeAlias = Any

#: Coordinates this near to a face, as a share of its half extent, lie on it.
ON_FACE = 1e-6
#: Cosines this near to 1 belong to parallel directions: the normal of a face against the one that was found.
PARALLEL = 1e-12


def allocate_held(capacity: int) -> Held:
    """Return room for ``capacity`` held contacts."""
    return np.zeros(capacity, HELD).view(np.recarray)


@kernel
def name_features(bodies: Bodies, manifolds: Manifolds, m: int, p: int, held: Held, c: int) -> bool:
    """Write the features that touch at point p of manifold m into record c; False where they have no normal.

    A face is taken where the normal is its own and the other body has a point there; else edges that cross; else an edge
    or a corner against whatever is round.
    """
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    held.body[c, 0], held.body[c, 1] = a, b
    held.manifold[c], held.point[c] = m, p
    held.friction[c] = manifolds.friction[m]
    held.side[c] = 1.0
    n = row(manifolds.frame[m], 2, 0)
    arm_a, arm_b = row(manifolds.arm_a[m], p, 0), row(manifolds.arm_b[m], p, 0)
    face_a, face_b = facing(bodies, a, n), facing(bodies, b, scale(-1.0, n))
    core_a = nearest_core(bodies, a, arm_a, n, held, c, 0)
    core_b = nearest_core(bodies, b, arm_b, scale(-1.0, n), held, c, 1)
    if face_a >= 0 and core_b == POINT:
        set_face(bodies, a, face_a, n, held, c, 0)
        return True
    if face_b >= 0 and core_a == POINT:
        set_face(bodies, b, face_b, scale(-1.0, n), held, c, 1)
        return True
    if core_a == PLANE or core_b == PLANE:
        return False
    if core_a == LINE and core_b == LINE:
        across = cross(times(bodies.axes, a, row(held.direction[c], 0, 0)), times(bodies.axes, b, row(held.direction[c], 1, 0)))
        held.side[c] = 1.0 if dot(across, n) > 0.0 else -1.0
        return dot(across, across) > ON_FACE
    return True


@inner_kernel
def facing(bodies: Bodies, i: int, n: Vector) -> int:
    """Body axis of the face of i whose outward normal is n, 0 for a half-space; -1 if there is none."""
    if bodies.kind[i] == HALF_SPACE:
        return 0
    if bodies.kind[i] != BOX:
        return -1
    for k in range(3):
        off = cross(axis(bodies.axes, i, k), n)
        if dot(off, off) <= PARALLEL:
            return k
    return -1


@inner_kernel
def set_face(bodies: Bodies, i: int, k: int, n: Vector, held: Held, c: int, side: int) -> None:
    """Take face k of body i, outward normal n, as its core."""
    held.core[c, side] = PLANE
    held.radius[c, side] = 0.0
    sign = 1.0
    if bodies.kind[i] == BOX:
        sign = 1.0 if dot(axis(bodies.axes, i, k), n) > 0.0 else -1.0
    for d in range(3):
        if bodies.kind[i] == HALF_SPACE:
            held.direction[c, side, d] = bodies.geometry[i, d]
            held.place[c, side, d] = bodies.geometry[i, 3] * bodies.geometry[i, d]
        else:
            held.direction[c, side, d] = sign if d == k else 0.0
            held.place[c, side, d] = sign * bodies.geometry[i, k] if d == k else 0.0


@inner_kernel
def nearest_core(bodies: Bodies, i: int, arm: Vector, n: Vector, held: Held, c: int, side: int) -> int:
    """Core of body i under the point ``arm`` from its centre, n its outward normal; its name."""
    local = times_transposed(bodies.axes, i, arm)
    held.radius[c, side] = 0.0
    for d in range(3):
        held.place[c, side, d] = held.direction[c, side, d] = 0.0
    kind = bodies.kind[i]
    core = POINT
    if kind == HALF_SPACE:
        core = PLANE
    elif kind == BOX:
        on = 0
        for d in range(3):
            half = bodies.geometry[i, d]
            if abs(local[d]) >= half * (1.0 - ON_FACE):
                held.place[c, side, d] = half if local[d] > 0.0 else -half
                on += 1
            else:
                held.direction[c, side, d] = 1.0
        core = POINT if on == 3 else LINE if on == 2 else PLANE
    elif kind == CAPSULE:
        held.radius[c, side] = bodies.geometry[i, 1]
        outward = times_transposed(bodies.axes, i, n)
        half, x = bodies.geometry[i, 0], local[0] - bodies.geometry[i, 1] * outward[0]
        if abs(x) >= half * (1.0 - ON_FACE):
            held.place[c, side, 0] = half if x > 0.0 else -half
        else:
            held.direction[c, side, 0] = 1.0
            core = LINE
    else:
        held.radius[c, side] = bodies.geometry[i, 0]
    held.core[c, side] = core
    return core


@kernel
def follow(bodies: Bodies, held: Held, c: int) -> None:
    """Gap, frame, levers, velocity and gamma of held contact c at the poses and twists of its bodies."""
    a, b = held.body[c, 0], held.body[c, 1]
    w_a, w_b = row(bodies.twist, a, 3), row(bodies.twist, b, 3)
    p_a = times(bodies.axes, a, row(held.place[c], 0, 0))
    p_b = times(bodies.axes, b, row(held.place[c], 1, 0))
    e_a = times(bodies.axes, a, row(held.direction[c], 0, 0))
    e_b = times(bodies.axes, b, row(held.direction[c], 1, 0))
    centres = sub(row(bodies.pose, b, 0), row(bodies.pose, a, 0))
    centres_rate = sub(row(bodies.twist, b, 0), row(bodies.twist, a, 0))
    p_a_rate, p_b_rate = cross(w_a, p_a), cross(w_b, p_b)
    e_a_rate, e_b_rate = cross(w_a, e_a), cross(w_b, e_b)
    between = sub(add(centres, p_b), p_a)
    between_rate = sub(add(centres_rate, p_b_rate), p_a_rate)
    core_a, core_b = held.core[c, 0], held.core[c, 1]
    # n and its rate, the distance of the cores, and the lever of the core's point on the body that tells the place.
    of_b = True
    tip, tip_rate = p_b, p_b_rate
    if core_a == PLANE:
        n, n_rate = e_a, e_a_rate
        distance = dot(n, between)
    elif core_b == PLANE:
        n, n_rate = scale(-1.0, e_b), scale(-1.0, e_b_rate)
        distance = dot(n, between)
        of_b, tip, tip_rate = False, p_a, p_a_rate
    elif core_a == LINE and core_b == LINE:
        n, n_rate = crossed_normal(e_a, e_b, e_a_rate, e_b_rate, held.side[c])
        distance = dot(n, between)
        cosine, cosine_rate = dot(e_a, e_b), dot(e_a_rate, e_b) + dot(e_a, e_b_rate)
        on_a, on_b = dot(between, e_a), dot(between, e_b)
        on_a_rate = dot(between_rate, e_a) + dot(between, e_a_rate)
        on_b_rate = dot(between_rate, e_b) + dot(between, e_b_rate)
        squared_sine = 1.0 - cosine * cosine
        held.along[c, 0] = (on_a - cosine * on_b) / squared_sine
        y = (cosine * on_a - on_b) / squared_sine
        y_rate = cosine_rate * on_a + cosine * on_a_rate - on_b_rate + 2.0 * cosine * cosine_rate * y
        held.along[c, 1] = y
        tip = add_scaled(p_b, y, e_b)
        tip_rate = add_scaled(add_scaled(p_b_rate, y, e_b_rate), y_rate / squared_sine, e_b)
    elif core_a == LINE:
        distance, n, n_rate, x = line_normal(e_a, e_a_rate, between, between_rate)
        held.along[c, 0] = x
    elif core_b == LINE:
        distance, n, n_rate, y = line_normal(e_b, e_b_rate, scale(-1.0, between), scale(-1.0, between_rate))
        n, n_rate = scale(-1.0, n), scale(-1.0, n_rate)
        held.along[c, 1] = y
        of_b, tip, tip_rate = False, p_a, p_a_rate
    else:
        distance = length(between)
        n = scale(1.0 / distance, between)
        n_rate = scale(1.0 / distance, add_scaled(between_rate, -dot(n, between_rate), n))
    gap = distance - held.radius[c, 0] - held.radius[c, 1]
    share = share_of_gap(bodies, a, b)
    if of_b:
        reach = held.radius[c, 1] + (1.0 - share) * gap
        arm_b = add_scaled(tip, -reach, n)
        arm_a = add(centres, arm_b)
    else:
        reach = held.radius[c, 0] + share * gap
        arm_a = add_scaled(tip, reach, n)
        arm_b = sub(arm_a, centres)
    u = sub(add(row(bodies.twist, b, 0), cross(w_b, arm_b)), add(row(bodies.twist, a, 0), cross(w_a, arm_a)))
    gap_rate = dot(n, u)
    if of_b:
        arm_b_rate = add_scaled(add_scaled(tip_rate, -reach, n_rate), -(1.0 - share) * gap_rate, n)
        arm_a_rate = add(centres_rate, arm_b_rate)
    else:
        arm_a_rate = add_scaled(add_scaled(tip_rate, reach, n_rate), share * gap_rate, n)
        arm_b_rate = sub(arm_a_rate, centres_rate)
    beta = sub(cross(w_b, arm_b_rate), cross(w_a, arm_a_rate))
    t1, t2 = tangents(n)
    held.gap[c] = gap
    held.velocity[c, 0], held.velocity[c, 1], held.velocity[c, 2] = gap_rate, dot(t1, u), dot(t2, u)
    held.gamma[c, 0] = dot(n, beta) + dot(n_rate, u)
    held.gamma[c, 1] = dot(t1, beta) - dot(t1, n_rate) * gap_rate
    held.gamma[c, 2] = dot(t2, beta) - dot(t2, n_rate) * gap_rate
    for d in range(3):
        held.frame[c, 0, d], held.frame[c, 1, d], held.frame[c, 2, d] = n[d], t1[d], t2[d]
        held.arm[c, 0, d], held.arm[c, 1, d] = arm_a[d], arm_b[d]


@inner_kernel
def crossed_normal(
    e_a: Vector, e_b: Vector, e_a_rate: Vector, e_b_rate: Vector, side: float
) -> tuple[Vector, Vector]:
    """Unit normal of two lines and its rate."""
    across = cross(e_a, e_b)
    across_rate = add(cross(e_a_rate, e_b), cross(e_a, e_b_rate))
    size = side / length(across)
    n = scale(size, across)
    rate = scale(size, across_rate)
    return n, add_scaled(rate, -dot(n, rate), n)


@inner_kernel
def line_normal(
    e: Vector, e_rate: Vector, between: Vector, between_rate: Vector
) -> tuple[float, Vector, Vector, float]:
    """Distance of a point from a line, unit normal from line to point, its rate, and the foot's place on the line.

    ``between`` leads from the line's own point to the point.
    """
    x = dot(e, between)
    x_rate = dot(e_rate, between) + dot(e, between_rate)
    off = add_scaled(between, -x, e)
    off_rate = add_scaled(add_scaled(between_rate, -x_rate, e), -x, e_rate)
    distance = length(off)
    n = scale(1.0 / distance, off)
    return distance, n, scale(1.0 / distance, add_scaled(off_rate, -dot(n, off_rate), n)), x


@inner_kernel
def half_length(bodies: Bodies, held: Held, c: int, side: int) -> float:
    """Half length of the line that body ``side`` offers [m]."""
    i = held.body[c, side]
    if bodies.kind[i] == CAPSULE:
        return bodies.geometry[i, 0]
    for d in range(3):
        if held.direction[c, side, d] != 0.0:
            return bodies.geometry[i, d]
    return 0.0
