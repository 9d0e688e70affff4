"""Held contacts: which feature of either body touches, and how gap, normal, levers and their rates follow the bodies.

A contact that lasts is held by its *features*, not by a point in space: the vertex of one body keeps to the face of the
other, an edge rolls over an edge. Every body offers one of three cores, grown by a radius:

* a **point** (vertex, end of a capsule, centre of a sphere),
* a **line** (edge, axis of a capsule),
* a **plane** (face, half-space), which only a point of the other body may touch.

With these the gap is a smooth function of the poses, so that its second derivative along the motion exists:

    d/dt (J v) = J dv/dt + gamma,      gamma = (d/ds J(q + s v)) v   (v, w held, orientations turned by exp(s w)).

Let u be the relative velocity of the two bodies at the contact point, n the normal, r_a and r_b the levers, and primes
the rates along that motion. Then beta = w_b x r_b' - w_a x r_a' and

    gamma_n = n . beta + n' . u,        gamma_t = t . beta - (t . n') u_n

with tangents that do not turn about n (their choice is free: where a contact sticks u is zero, where it slips only the
normal part is used). Levers lead to the *geometric* point of contact, which moves over both surfaces.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.spatial.box_box import crossing_edge, is_crossing
from reference_solver.spatial.points import share_of_gap
from reference_solver.spatial.state import BOX, CAPSULE, HALF_SPACE, POINTS, Bodies, Manifolds
from reference_solver.spatial.vector import (
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
from reference_solver.stepping.lasting import FEATURE, Lasting

#: Cores.
POINT, LINE, PLANE = 0, 1, 2

#: Entries of `Lasting.kind`: the cores of A and B; which of `FEATURES` they are, and how many of those were tried.
CORE, CHOICE, TRIED = 0, 2, 3
#: What may touch in one place: a point of B on a face of A, one of A on a face of B, one of two edges of A across one
#: of two of B, and what is nearest on both. They are tried in this order, round again.
ON_A, ON_B, CROSSED, NEAREST, FEATURES = 0, 1, 2, 6, 7
#: Entries of `Lasting.place`, those of B after those of A: a point of the core [m], the direction of a line or the
#: outward normal of a plane (body axes), the radius by which the core is grown [m], and, as they follow from the poses,
#: the place on a line, from its middle [m]. Then the sign of e_a x e_b along n where lines cross; where A and B touched
#: when the contact was noted (body axes) [m].
PLACE, DIRECTION, RADIUS, ALONG, SIDE, NOTED = 0, 6, 12, 14, 16, 17

#: Coordinates this near to a face, as a share of its half extent, lie on it.
ON_FACE = 1e-6
#: What rolls off a face is as near to its edge as this share of its half extent: events are located to 1e-13.
AT_EDGE = 1e-9
#: Squared sines below this belong to parallel directions: the normal of a face against the one that was found.
PARALLEL = 1e-12
#: A tangent that the new normal leaves less of is replaced: it turned by more than 80 degrees.
NEAR_TANGENT = 0.2


@inner_kernel
def part(lasting: Lasting, k: int, entry: int, side: int) -> Vector:
    """Vector of a feature, body axes."""
    return row(lasting.place, k, entry + 3 * side)


@inner_kernel
def set_part(lasting: Lasting, k: int, entry: int, side: int, v: Vector) -> None:
    """Write a vector of a feature."""
    for d in range(3):
        lasting.place[k, entry + 3 * side + d] = v[d]


@kernel
def name_features(bodies: Bodies, manifolds: Manifolds, lasting: Lasting, c: int, k: int) -> bool:
    """Note the features that touch at row c (point c % 8 of manifold c // 8) as contact k; False without a normal.

    A face is taken where the normal is its own and the other body has a point there that stays over it; else edges that
    cross; else an edge or a corner against whatever is round.
    """
    m, p = c // POINTS, c % POINTS
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    lasting.body[k, 0], lasting.body[k, 1] = a, b
    lasting.friction[k] = manifolds.friction[m]
    lasting.place[k, SIDE] = 1.0
    lasting.kind[k, TRIED] = 1
    set_part(lasting, k, NOTED, 0, times_transposed(bodies.axes, a, row(manifolds.arm_a[m], p, 0)))
    set_part(lasting, k, NOTED, 1, times_transposed(bodies.axes, b, row(manifolds.arm_b[m], p, 0)))
    n = row(manifolds.frame[m], 2, 0)
    for d in range(3):
        lasting.frame[k, 1, d] = manifolds.frame[m, 0, d]
    for side in range(2):
        if not take_features(bodies, lasting, k, n, side):
            continue
        lasting.kind[k, CHOICE] = side
        if bodies.kind[lasting.body[k, side]] == HALF_SPACE or not goes_off(bodies, manifolds, lasting, c, k, side):
            return True
        if lasting.place[k, RADIUS + 1 - side] > 0.0:
            tip, i = part(lasting, k, PLACE, 1 - side)[0], lasting.body[k, 1 - side]
            onward = tip * dot(passing(bodies, manifolds, lasting, c, k, side), axis(bodies.axes, i, 0))
            for choice in range(CROSSED if onward > 0.0 else NEAREST, NEAREST):  # a capsule slides out over the edge
                lasting.kind[k, CHOICE] = choice
                if take_features(bodies, lasting, k, n, choice):
                    return True
            break
        lasting.kind[k, CHOICE] = ON_B
        if cross_over(bodies, manifolds, lasting, c, k):
            return cross_lines(bodies, lasting, k, n)
        if side == 1 or not take_features(bodies, lasting, k, n, ON_B):  # corners on each other: that of A on B's face
            lasting.kind[k, CHOICE] = side
            return take_features(bodies, lasting, k, n, side)
    lasting.kind[k, CHOICE] = NEAREST
    return take_features(bodies, lasting, k, n, NEAREST)


@inner_kernel
def cross_lines(bodies: Bodies, lasting: Lasting, k: int, n: Vector) -> bool:
    """Note on which side of A's line that of B crosses it, n the normal; False where they are all but parallel."""
    e_a = times(bodies.axes, lasting.body[k, 0], part(lasting, k, DIRECTION, 0))
    e_b = times(bodies.axes, lasting.body[k, 1], part(lasting, k, DIRECTION, 1))
    across = cross(e_a, e_b)
    lasting.place[k, SIDE] = 1.0 if dot(across, n) > 0.0 else -1.0
    return dot(across, across) > ON_FACE


@kernel
def name_next(bodies: Bodies, lasting: Lasting, k: int) -> bool:
    """Let contact k go on with the next features that touch in its place; False, with those it has, if all were tried.

    Where corners lie on each other either may be over the other's face, and edges that begin there may cross; what is
    round rolls on over an edge. Bodies stand at the start of the phase.
    """
    n, kind = row(lasting.normal, k, 0), lasting.kind[k]
    choice = kind[CHOICE]
    while kind[TRIED] < FEATURES:
        kind[TRIED] += 1
        choice = (choice + 1) % FEATURES
        touches = take_features(bodies, lasting, k, n, choice)
        if touches and (choice != NEAREST or lasting.place[k, RADIUS] + lasting.place[k, RADIUS + 1] > 0.0):
            kind[CHOICE] = choice
            return True
    return False


@inner_kernel
def take_features(bodies: Bodies, lasting: Lasting, k: int, n: Vector, choice: int) -> bool:
    """Take what ``choice`` of `FEATURES` says as the cores of contact k, n its normal; False if that does not touch."""
    core_a = nearest_core(bodies, lasting.body[k, 0], noted_arm(bodies, lasting, k, 0), n, lasting, k, 0)
    core_b = nearest_core(bodies, lasting.body[k, 1], noted_arm(bodies, lasting, k, 1), scale(-1.0, n), lasting, k, 1)
    if choice < CROSSED:
        out = scale(1.0 - 2.0 * choice, n)
        face = facing(bodies, lasting.body[k, choice], out)
        if face < 0 or (core_b if choice == ON_A else core_a) != POINT:
            return False
        set_face(bodies, lasting.body[k, choice], face, out, lasting, k, choice)
        return True
    if choice < NEAREST:
        of_a, of_b = (choice - CROSSED) // 2, (choice - CROSSED) % 2
        return (
            take_line(bodies, lasting, k, 0, n, of_a)
            and take_line(bodies, lasting, k, 1, n, of_b)
            and cross_lines(bodies, lasting, k, n)
        )
    if core_a == PLANE or core_b == PLANE:
        return False
    return core_a != LINE or core_b != LINE or cross_lines(bodies, lasting, k, n)


@inner_kernel
def noted_arm(bodies: Bodies, lasting: Lasting, k: int, side: int) -> Vector:
    """Where contact k was when it was noted, from the centre of one of its bodies."""
    return times(bodies.axes, lasting.body[k, side], part(lasting, k, NOTED, side))


@inner_kernel
def take_line(bodies: Bodies, lasting: Lasting, k: int, side: int, n: Vector, choice: int) -> bool:
    """Take as a core the edge of a box, or the axis of a capsule, that begins where `nearest_core` stands; if there is.

    Of a box's at a right angle to the normal n the first (``choice`` 0), or the next.
    """
    i, core = lasting.body[k, side], lasting.kind[k, CORE + side]
    if core == LINE:
        return choice == 0
    axes = 0 if core == PLANE else 3 if bodies.kind[i] == BOX else 1 if bodies.kind[i] == CAPSULE else 0
    for d in range(axes):
        if dot(axis(bodies.axes, i, d), n) ** 2 <= PARALLEL:
            if choice == 0:
                lasting.kind[k, CORE + side] = LINE
                lasting.place[k, PLACE + 3 * side + d], lasting.place[k, DIRECTION + 3 * side + d] = 0.0, 1.0
                return True
            choice -= 1
    return False


@inner_kernel
def cross_over(bodies: Bodies, manifolds: Manifolds, lasting: Lasting, c: int, k: int) -> bool:
    """Take the edges that cross at row c as the cores of contact k; False if there are none."""
    a, b, feature = lasting.body[k, 0], lasting.body[k, 1], manifolds.feature[c // POINTS, c % POINTS]
    if bodies.kind[a] != BOX or bodies.kind[b] != BOX or not is_crossing(feature):
        return False
    middle_a, along_a = crossing_edge(bodies, a, feature, False)
    middle_b, along_b = crossing_edge(bodies, b, feature, True)
    across = cross(times(bodies.axes, a, along_a), times(bodies.axes, b, along_b))
    if dot(across, across) <= ON_FACE:
        return False
    set_part(lasting, k, PLACE, 0, middle_a)
    set_part(lasting, k, PLACE, 1, middle_b)
    set_part(lasting, k, DIRECTION, 0, along_a)
    set_part(lasting, k, DIRECTION, 1, along_b)
    lasting.kind[k, CORE] = lasting.kind[k, CORE + 1] = LINE
    return True


@inner_kernel
def goes_off(bodies: Bodies, manifolds: Manifolds, lasting: Lasting, c: int, k: int, side: int) -> bool:
    """Whether the point of the other body stands where the face of the box on this side ends, and goes on over its end.

    What is round rolls on over it: its core, which is above the point of contact by its radius, moves out of the face.
    """
    i, arms = lasting.body[k, side], manifolds.arm_a if side == 0 else manifolds.arm_b
    local = times_transposed(bodies.axes, i, row(arms[c // POINTS], c % POINTS, 0))
    way = times_transposed(bodies.axes, i, passing(bodies, manifolds, lasting, c, k, side))
    for d in range(3):
        half, aside = bodies.geometry[i, d], part(lasting, k, DIRECTION, side)[d] == 0.0
        if aside and half - abs(local[d]) <= AT_EDGE * half and way[d] * local[d] > 0.0:
            return True
    return False


@inner_kernel
def passing(bodies: Bodies, manifolds: Manifolds, lasting: Lasting, c: int, k: int, side: int) -> Vector:
    """Velocity of the core of the other body at row c, less that of the body on this side [m/s]."""
    m, p, i, other = c // POINTS, c % POINTS, lasting.body[k, side], lasting.body[k, 1 - side]
    up = scale(lasting.place[k, RADIUS + 1 - side] * (1.0 - 2.0 * side), row(manifolds.frame[m], 2, 0))
    arm, far = row(manifolds.arm_a[m], p, 0), row(manifolds.arm_b[m], p, 0)
    if side == 1:
        arm, far = far, arm
    at_other = add(row(bodies.twist, other, 0), cross(row(bodies.twist, other, 3), add(far, up)))
    return sub(at_other, add(row(bodies.twist, i, 0), cross(row(bodies.twist, i, 3), add(arm, up))))


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
def set_face(bodies: Bodies, i: int, k: int, n: Vector, lasting: Lasting, c: int, side: int) -> None:
    """Take face k of body i, outward normal n, as its core."""
    lasting.kind[c, CORE + side] = PLANE
    lasting.place[c, RADIUS + side] = 0.0
    if bodies.kind[i] == HALF_SPACE:
        normal = row(bodies.geometry, i, 0)
        far = bodies.geometry[i, 3]
    else:
        sign = 1.0 if dot(axis(bodies.axes, i, k), n) > 0.0 else -1.0
        normal = (sign if k == 0 else 0.0, sign if k == 1 else 0.0, sign if k == 2 else 0.0)
        far = bodies.geometry[i, k]
    set_part(lasting, c, DIRECTION, side, normal)
    set_part(lasting, c, PLACE, side, scale(far, normal))


@inner_kernel
def nearest_core(bodies: Bodies, i: int, arm: Vector, n: Vector, lasting: Lasting, c: int, side: int) -> int:
    """Core of body i under the point ``arm`` from its centre, n its outward normal; its name."""
    local = times_transposed(bodies.axes, i, arm)
    place, direction = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    lasting.place[c, RADIUS + side] = 0.0
    core = POINT
    if bodies.kind[i] == HALF_SPACE:
        core = PLANE
    elif bodies.kind[i] == BOX:
        half = row(bodies.geometry, i, 0)
        x, y, z = on_face(local[0], half[0]), on_face(local[1], half[1]), on_face(local[2], half[2])
        place = (x, y, z)
        direction = (0.0 if x != 0.0 else 1.0, 0.0 if y != 0.0 else 1.0, 0.0 if z != 0.0 else 1.0)
        free = direction[0] + direction[1] + direction[2]
        core = POINT if free == 0.0 else LINE if free == 1.0 else PLANE
    elif bodies.kind[i] == CAPSULE:
        radius = bodies.geometry[i, 1]
        lasting.place[c, RADIUS + side] = radius
        x = on_face(local[0] - radius * dot(axis(bodies.axes, i, 0), n), bodies.geometry[i, 0])
        place = (x, 0.0, 0.0)
        if x == 0.0:
            direction = (1.0, 0.0, 0.0)
            core = LINE
    else:
        lasting.place[c, RADIUS + side] = bodies.geometry[i, 0]
    set_part(lasting, c, PLACE, side, place)
    set_part(lasting, c, DIRECTION, side, direction)
    lasting.kind[c, CORE + side] = core
    return core


@inner_kernel
def on_face(x: float, half: float) -> float:
    """Coordinate of the face on which x lies, 0 if on neither."""
    if abs(x) < half * (1.0 - ON_FACE):
        return 0.0
    return math.copysign(half, x)


@kernel
def follow(bodies: Bodies, lasting: Lasting, k: int) -> None:
    """Gap, frame, levers, velocity and gamma of noted contact k at the poses and twists of its bodies."""
    a, b = lasting.body[k, 0], lasting.body[k, 1]
    w_a, w_b = row(bodies.twist, a, 3), row(bodies.twist, b, 3)
    p_a = times(bodies.axes, a, part(lasting, k, PLACE, 0))
    p_b = times(bodies.axes, b, part(lasting, k, PLACE, 1))
    e_a = times(bodies.axes, a, part(lasting, k, DIRECTION, 0))
    e_b = times(bodies.axes, b, part(lasting, k, DIRECTION, 1))
    centres = sub(row(bodies.pose, b, 0), row(bodies.pose, a, 0))
    centres_rate = sub(row(bodies.twist, b, 0), row(bodies.twist, a, 0))
    p_a_rate, p_b_rate = cross(w_a, p_a), cross(w_b, p_b)
    e_a_rate, e_b_rate = cross(w_a, e_a), cross(w_b, e_b)
    between = sub(add(centres, p_b), p_a)
    between_rate = sub(add(centres_rate, p_b_rate), p_a_rate)
    core_a, core_b = lasting.kind[k, CORE], lasting.kind[k, CORE + 1]
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
        n, n_rate = crossed_normal(e_a, e_b, e_a_rate, e_b_rate, lasting.place[k, SIDE])
        distance = dot(n, between)
        cosine, cosine_rate = dot(e_a, e_b), dot(e_a_rate, e_b) + dot(e_a, e_b_rate)
        on_a, on_b = dot(between, e_a), dot(between, e_b)
        on_a_rate = dot(between_rate, e_a) + dot(between, e_a_rate)
        on_b_rate = dot(between_rate, e_b) + dot(between, e_b_rate)
        squared_sine = 1.0 - cosine * cosine
        lasting.place[k, ALONG] = (on_a - cosine * on_b) / squared_sine
        y = (cosine * on_a - on_b) / squared_sine
        y_rate = cosine_rate * on_a + cosine * on_a_rate - on_b_rate + 2.0 * cosine * cosine_rate * y
        lasting.place[k, ALONG + 1] = y
        tip = add_scaled(p_b, y, e_b)
        tip_rate = add_scaled(add_scaled(p_b_rate, y, e_b_rate), y_rate / squared_sine, e_b)
    elif core_a == LINE:
        distance, n, n_rate, x = line_normal(e_a, e_a_rate, between, between_rate)
        lasting.place[k, ALONG] = x
    elif core_b == LINE:
        distance, n, n_rate, y = line_normal(e_b, e_b_rate, scale(-1.0, between), scale(-1.0, between_rate))
        n, n_rate = scale(-1.0, n), scale(-1.0, n_rate)
        lasting.place[k, ALONG + 1] = y
        of_b, tip, tip_rate = False, p_a, p_a_rate
    else:
        distance = length(between)
        n = scale(1.0 / distance, between)
        n_rate = scale(1.0 / distance, add_scaled(between_rate, -dot(n, between_rate), n))
    gap = distance - lasting.place[k, RADIUS] - lasting.place[k, RADIUS + 1]
    share = share_of_gap(bodies, a, b)
    if of_b:
        reach = lasting.place[k, RADIUS + 1] + (1.0 - share) * gap
        arm_b = add_scaled(tip, -reach, n)
        arm_a = add(centres, arm_b)
    else:
        reach = lasting.place[k, RADIUS] + share * gap
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
    t1, t2 = turned_tangents(row(lasting.frame[k], 1, 0), n)
    lasting.gap[k] = gap
    lasting.speed[k, 0], lasting.speed[k, 1], lasting.speed[k, 2] = gap_rate, dot(t1, u), dot(t2, u)
    lasting.gamma[k, 0] = dot(n, beta) + dot(n_rate, u)
    lasting.gamma[k, 1] = dot(t1, beta) - dot(t1, n_rate) * gap_rate
    lasting.gamma[k, 2] = dot(t2, beta) - dot(t2, n_rate) * gap_rate
    for d in range(3):
        lasting.frame[k, 0, d], lasting.frame[k, 1, d], lasting.frame[k, 2, d] = n[d], t1[d], t2[d]
    set_rows(bodies, lasting, k, arm_a, arm_b)


@inner_kernel
def turned_tangents(t1: Vector, n: Vector) -> tuple[Vector, Vector]:
    """Tangents of n nearest to those of a normal a moment ago, so that components along them go on smoothly."""
    across = add_scaled(t1, -dot(t1, n), n)
    size = length(across)
    if size < NEAR_TANGENT:
        return tangents(n)
    t1 = scale(1.0 / size, across)
    return t1, cross(n, t1)


@inner_kernel
def crossed_normal(e_a: Vector, e_b: Vector, e_a_rate: Vector, e_b_rate: Vector, side: float) -> tuple[Vector, Vector]:
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
def set_rows(bodies: Bodies, lasting: Lasting, k: int, arm_a: Vector, arm_b: Vector) -> None:
    """Rows of contact k and their responses, from its frame and levers (E2, E3)."""
    for side in range(2):
        i, arm, sign = lasting.body[k, side], arm_b if side else arm_a, 2.0 * side - 1.0
        jacobian, response = lasting.jacobian[k, side], lasting.response[k, side]
        for r in range(3):
            along = scale(sign, row(lasting.frame[k], r, 0))
            turning = cross(arm, along)
            spin = times(bodies.inverse_inertia, i, turning)
            for d in range(3):
                jacobian[r, d], jacobian[r, 3 + d] = along[d], turning[d]
                response[r, d], response[r, 3 + d] = bodies.inverse_mass[i] * along[d], spin[d]


@kernel
def distances_to_limits(bodies: Bodies, lasting: Lasting, k: int, place: int) -> None:
    """How far contact k is from where its features end, < 0 beyond, infinite where there is no end [m].

    A line ends where it is as long as its body, a face at its edges; an edge or a corner of a box, and the end of a
    capsule, meets what is round, or another edge, only while the normal looks out of it. Both ends along each body axis
    stand by themselves: what begins at one of them may go on to the other.
    """
    monitor = lasting.monitor[place, k]
    for m in range(FEATURE, len(monitor)):
        monitor[m] = math.inf
    for side in range(2):
        i, core, other = lasting.body[k, side], lasting.kind[k, CORE + side], lasting.kind[k, CORE + 1 - side]
        if bodies.kind[i] != BOX and bodies.kind[i] != CAPSULE:
            continue
        outward = times_transposed(bodies.axes, i, scale(1.0 - 2.0 * side, row(lasting.frame[k], 0, 0)))
        local = times_transposed(bodies.axes, i, lever(lasting, k, side))
        for d in range(3):
            if bodies.kind[i] == CAPSULE and d > 0:
                continue
            along, at = part(lasting, k, DIRECTION, side)[d], part(lasting, k, PLACE, side)[d]
            half, first = bodies.geometry[i, d], FEATURE + 6 * side + 2 * d
            if core == PLANE and along == 0.0:
                monitor[first], monitor[first + 1] = half - local[d], half + local[d]
            elif core == LINE and along != 0.0:
                way = lasting.place[k, ALONG + side]
                monitor[first], monitor[first + 1] = half - way, half + way
            elif core != PLANE and other != PLANE:
                reach = half if bodies.kind[i] == BOX else bodies.geometry[i, 1]
                monitor[first] = reach * outward[d] * (1.0 if at > 0.0 else -1.0)


@inner_kernel
def lever(lasting: Lasting, k: int, side: int) -> Vector:
    """Lever of contact k on one of its bodies, without its part along the normal: n x (r x n)."""
    n, turning = row(lasting.frame[k], 0, 0), row(lasting.jacobian[k, side], 0, 3)
    return scale(2.0 * side - 1.0, cross(n, turning))
