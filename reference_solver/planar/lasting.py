"""Held contacts at any pose of their bodies: the same features, their gap, rows and gamma (E36)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar.columns import (
    ARM_A,
    ARM_B,
    COS,
    EXTENT,
    FRICTION,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    MOTION,
    NX,
    NY,
    ROUNDING,
    SHAPE,
    SIN,
    SIZE,
    VERTICES,
    A,
    B,
)
from reference_solver.planar.separating_axis import corner, edge_normal
from reference_solver.planar.state import FREE, HALF_SPACE, Bodies, Rows
from reference_solver.stepping import operations
from reference_solver.stepping.lasting import FEATURE, Lasting
from reference_solver.stepping.operations import provide

#: Forms of a contact: two core points; a core point on an edge of A or of B.
POINTS, EDGE_OF_A, EDGE_OF_B = 0, 1, 2
#: Forms in the order in which a contact tries them, one after the other and round again.
FORMS = 3
#: Entries of `Lasting.kind`: the form; the vertices of A and B nearest to the contact; the edges of A and B along it on
#: which a vertex of the other lies, -1 if there is none; how many forms have been tried.
FORM, VERTEX_A, VERTEX_B, EDGE_A, EDGE_B, TRIED = 0, 1, 2, 3, 4, 5
#: Entries of `Lasting.place`: core points of A and B in body axes, two numbers each; the normal, from A to B, in the
#: axes of the edge's owner; distance of the edge from the owner's centre; its two ends along the tangent.
POINT_A, POINT_B, NORMAL, OFFSET, LOW, HIGH = 0, 2, 4, 6, 7, 8
#: A contact this near a vertex, as a share of the smaller half width, is at it; a normal this near that of an edge
#: [rad] is its. Ends of features are located a thousand times better.
AT_FEATURE = 1e-8


@inner_kernel
def into_body(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """A vector in the axes of body i."""
    c, s = bodies.real[i, COS], bodies.real[i, SIN]
    return c * x + s * y, c * y - s * x


@inner_kernel
def out_of_body(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """A vector given in the axes of body i, in world axes."""
    c, s = bodies.real[i, COS], bodies.real[i, SIN]
    return c * x - s * y, s * x + c * y


@inner_kernel
def nearest_vertex(bodies: Bodies, i: int, x: float, y: float) -> tuple[int, float]:
    """Vertex of core i nearest to the lever (x, y), and how near; infinitely far from a half-space."""
    best, nearest = 0, math.inf
    for k in range(bodies.kind[i, VERTICES]):
        cx, cy = corner(bodies, i, k)
        distance = math.hypot(x - cx, y - cy)
        if distance < nearest:
            best, nearest = k, distance
    return best, nearest


@inner_kernel
def edge_along(bodies: Bodies, i: int, nx: float, ny: float) -> int:
    """Edge of core i whose outward normal is (nx, ny), -1 if there is none."""
    count = bodies.kind[i, VERTICES]
    for k in range(count if count > 1 else 0):
        ex, ey = edge_normal(bodies, i, k)
        if ex * nx + ey * ny > 0.0 and abs(ex * ny - ey * nx) <= AT_FEATURE:
            return k
    return -1


@inner_kernel
def hold(bodies: Bodies, rows: Rows, lasting: Lasting, c: int, k: int) -> None:
    """Note the features of row c in body axes: which vertex touches which edge, or which vertices (E36)."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    nx, ny = rows.real[c, NX], rows.real[c, NY]
    ra, rb = bodies.real[a, ROUNDING], bodies.real[b, ROUNDING]
    ax, ay = rows.real[c, ARM_A] - ra * nx, rows.real[c, ARM_A + 1] - ra * ny
    bx, by = rows.real[c, ARM_B] + rb * nx, rows.real[c, ARM_B + 1] + rb * ny
    lasting.body[k, 0], lasting.body[k, 1], lasting.row[k] = a, b, c
    lasting.friction[k] = rows.real[c, FRICTION]
    vertex_a, far_a = nearest_vertex(bodies, a, ax, ay)
    vertex_b, far_b = nearest_vertex(bodies, b, bx, by)
    near = AT_FEATURE * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT])
    lasting.kind[k, VERTEX_A], lasting.kind[k, VERTEX_B] = vertex_a, vertex_b
    if far_a <= near:
        ax, ay = corner(bodies, a, vertex_a)
    if far_b <= near:
        bx, by = corner(bodies, b, vertex_b)
    set_pair(lasting.place[k], POINT_A, into_body(bodies, a, ax, ay))
    set_pair(lasting.place[k], POINT_B, into_body(bodies, b, bx, by))
    lasting.kind[k, EDGE_A] = edge_along(bodies, a, nx, ny) if far_b <= near else -1
    lasting.kind[k, EDGE_B] = edge_along(bodies, b, -nx, -ny) if far_a <= near else -1
    lasting.kind[k, FORM], lasting.kind[k, TRIED] = POINTS, FORMS
    if bodies.kind[a, SHAPE] == HALF_SPACE:
        own_half_space(bodies, lasting, k, a, EDGE_OF_A)
    elif bodies.kind[b, SHAPE] == HALF_SPACE:
        own_half_space(bodies, lasting, k, b, EDGE_OF_B)
    elif lasting.kind[k, EDGE_A] >= 0 or lasting.kind[k, EDGE_B] >= 0:
        lasting.kind[k, TRIED] = 0
        while next_features(bodies, lasting, k) and leaves_edge(bodies, lasting, k, near):
            pass
        lasting.kind[k, TRIED] = 1
    elif far_a > near or far_b > near or ra + rb == 0.0:  # neither: a point of B that keeps to the plane through it
        lasting.kind[k, FORM] = EDGE_OF_A
        set_pair(lasting.place[k], NORMAL, into_body(bodies, a, nx, ny))
        lasting.place[k, OFFSET] = nx * ax + ny * ay
        lasting.place[k, LOW], lasting.place[k, HIGH] = -math.inf, math.inf


@inner_kernel
def next_features(bodies: Bodies, lasting: Lasting, k: int) -> bool:
    """Let contact k go on with the next features that touch in its place; False, with those it has, if all were tried.

    At the end of an edge the other body's edge may lie on this one's vertex; what is round goes by vertices.
    """
    kind, form = lasting.kind[k], lasting.kind[k, FORM]
    while kind[TRIED] < FORMS:
        kind[TRIED] += 1
        form = (form + 1) % FORMS
        if (
            form == POINTS
            and bodies.real[lasting.body[k, 0], ROUNDING] + bodies.real[lasting.body[k, 1], ROUNDING] > 0.0
        ):
            for side in range(2):
                i = lasting.body[k, side]
                x, y = corner(bodies, i, kind[VERTEX_A + side])
                set_pair(lasting.place[k], POINT_A + 2 * side, into_body(bodies, i, x, y))
            kind[FORM] = POINTS
            return True
        if form != POINTS and kind[EDGE_A + form - EDGE_OF_A] >= 0:
            own_edge(bodies, lasting, k, form, kind[EDGE_A + form - EDGE_OF_A])
            return True
    return False


@inner_kernel
def set_pair(place: Array, entry: int, pair: tuple[float, float]) -> None:
    """Two neighbouring entries."""
    place[entry], place[entry + 1] = pair


@inner_kernel
def own_half_space(bodies: Bodies, lasting: Lasting, k: int, i: int, form: int) -> None:
    """The edge is the surface of half-space i."""
    sign = 1.0 if form == EDGE_OF_A else -1.0
    lasting.kind[k, FORM] = form
    lasting.place[k, NORMAL] = sign * bodies.real[i, SIZE]
    lasting.place[k, NORMAL + 1] = sign * bodies.real[i, SIZE + 1]
    lasting.place[k, OFFSET] = bodies.real[i, SIZE + 2]
    lasting.place[k, LOW], lasting.place[k, HIGH] = -math.inf, math.inf


@inner_kernel
def own_edge(bodies: Bodies, lasting: Lasting, k: int, form: int, edge: int) -> None:
    """The edge is that of A or B with number ``edge``."""
    place, owner = lasting.place[k], lasting.body[k, 0 if form == EDGE_OF_A else 1]
    sign = 1.0 if form == EDGE_OF_A else -1.0
    mx, my = edge_normal(bodies, owner, edge)
    px, py = corner(bodies, owner, edge)
    qx, qy = corner(bodies, owner, edge + 1)
    lasting.kind[k, FORM] = form
    set_pair(place, NORMAL, into_body(bodies, owner, sign * mx, sign * my))
    place[OFFSET] = mx * px + my * py
    tx, ty = -sign * my, sign * mx
    first, second = tx * px + ty * py, tx * qx + ty * qy
    place[LOW], place[HIGH] = min(first, second), max(first, second)


@inner_kernel
def leaves_edge(bodies: Bodies, lasting: Lasting, k: int, near: float) -> bool:
    """Whether the core point stands at an end of its edge, on the way out, or beyond it."""
    if lasting.kind[k, FORM] == POINTS:
        return False
    along, rate = along_edge(bodies, lasting, k)
    low, high = along - lasting.place[k, LOW], lasting.place[k, HIGH] - along
    return low < -near or high < -near or (low <= near and rate < 0.0) or (high <= near and rate > 0.0)


@inner_kernel
def core_levers(bodies: Bodies, lasting: Lasting, k: int) -> tuple[float, float, float, float]:
    """World levers of the core points of A and B; on the owner's side that of the other's point."""
    place = lasting.place[k]
    a, b = lasting.body[k, 0], lasting.body[k, 1]
    ax, ay = out_of_body(bodies, a, place[POINT_A], place[POINT_A + 1])
    bx, by = out_of_body(bodies, b, place[POINT_B], place[POINT_B + 1])
    dx, dy = bodies.pose[b, 0] - bodies.pose[a, 0], bodies.pose[b, 1] - bodies.pose[a, 1]
    if lasting.kind[k, FORM] == EDGE_OF_A:
        ax, ay = dx + bx, dy + by
    elif lasting.kind[k, FORM] == EDGE_OF_B:
        bx, by = ax - dx, ay - dy
    return ax, ay, bx, by


@inner_kernel
def core_velocity(bodies: Bodies, a: int, b: int, levers: tuple[float, float, float, float]) -> tuple[float, float]:
    """Velocity of B less that of A at the core points [m/s]."""
    ax, ay, bx, by = levers
    wa, wb = bodies.twist[a, 2], bodies.twist[b, 2]
    x = (bodies.twist[b, 0] - bodies.twist[a, 0]) - wb * by + wa * ay
    y = (bodies.twist[b, 1] - bodies.twist[a, 1]) + wb * bx - wa * ax
    return x, y


@inner_kernel
def along_edge(bodies: Bodies, lasting: Lasting, k: int) -> tuple[float, float]:
    """Where the core point stands along its edge [m], and its rate [m/s]."""
    ax, ay, bx, by = core_levers(bodies, lasting, k)
    a, b = lasting.body[k, 0], lasting.body[k, 1]
    of_a = lasting.kind[k, FORM] == EDGE_OF_A
    nx, ny = out_of_body(bodies, a if of_a else b, lasting.place[k, NORMAL], lasting.place[k, NORMAL + 1])
    x, y = core_velocity(bodies, a, b, (ax, ay, bx, by))
    slip = nx * y - ny * x
    if of_a:
        return nx * ay - ny * ax, slip
    return nx * by - ny * bx, -slip


@inner_kernel
def evaluate(bodies: Bodies, lasting: Lasting) -> None:
    """Gap, frame, rows, speeds and gamma of all contacts (E36)."""
    for k in range(lasting.size[0]):
        a, b, form = lasting.body[k, 0], lasting.body[k, 1], lasting.kind[k, FORM]
        ra, rb = bodies.real[a, ROUNDING], bodies.real[b, ROUNDING]
        wa, wb = bodies.twist[a, 2], bodies.twist[b, 2]
        ax, ay, bx, by = core_levers(bodies, lasting, k)
        x, y = core_velocity(bodies, a, b, (ax, ay, bx, by))
        if form == POINTS:
            dx = (bodies.pose[b, 0] - bodies.pose[a, 0]) + bx - ax
            dy = (bodies.pose[b, 1] - bodies.pose[a, 1]) + by - ay
            distance = math.sqrt(dx * dx + dy * dy)
            nx, ny = dx / distance, dy / distance
            turning = (nx * y - ny * x) / distance
            gap = distance - ra - rb
        elif form == EDGE_OF_A:
            nx, ny = out_of_body(bodies, a, lasting.place[k, NORMAL], lasting.place[k, NORMAL + 1])
            turning = 2.0 * wa
            gap = nx * ax + ny * ay - lasting.place[k, OFFSET] - ra - rb
        else:
            nx, ny = out_of_body(bodies, b, lasting.place[k, NORMAL], lasting.place[k, NORMAL + 1])
            turning = 2.0 * wb
            gap = -(nx * bx + ny * by) - lasting.place[k, OFFSET] - ra - rb
        normal, tangent = nx * x + ny * y, nx * y - ny * x
        beta_x, beta_y = wa * wa * ax - wb * wb * bx, wa * wa * ay - wb * wb * by
        lasting.gap[k] = gap
        lasting.gamma[k, 0] = nx * beta_x + ny * beta_y + turning * tangent
        lasting.gamma[k, 1] = nx * beta_y - ny * beta_x - turning * normal
        # The contact point: on the surface of the body with the core point; of two points, on the surface of each.
        if form == EDGE_OF_A:
            ax, ay, bx, by = ax - rb * nx, ay - rb * ny, bx - rb * nx, by - rb * ny
        elif form == EDGE_OF_B:
            ax, ay, bx, by = ax + ra * nx, ay + ra * ny, bx + ra * nx, by + ra * ny
        else:
            ax, ay, bx, by = ax + ra * nx, ay + ra * ny, bx - rb * nx, by - rb * ny
        write_rows(bodies, lasting, k, (nx, ny), (ax, ay, bx, by))


@inner_kernel
def write_rows(
    bodies: Bodies,
    lasting: Lasting,
    k: int,
    normal: tuple[float, float],
    arms: tuple[float, float, float, float],
) -> None:
    """Frame, Jacobian, response and speeds of contact k."""
    nx, ny = normal
    lasting.frame[k, 0, 0], lasting.frame[k, 0, 1] = nx, ny
    lasting.frame[k, 1, 0], lasting.frame[k, 1, 1] = -ny, nx
    for row in range(2):
        x, y = lasting.frame[k, row, 0], lasting.frame[k, row, 1]
        speed = 0.0
        for side in range(2):
            i, sign = lasting.body[k, side], 2.0 * side - 1.0
            ax, ay = (arms[0], arms[1]) if side == 0 else (arms[2], arms[3])
            jacobian = lasting.jacobian[k, side, row]
            jacobian[0], jacobian[1], jacobian[2] = sign * x, sign * y, sign * (ax * y - ay * x)
            for d in range(3):
                inverse = bodies.real[i, INVERSE_MASS if d < 2 else INVERSE_INERTIA]
                lasting.response[k, side, row, d] = inverse * jacobian[d]
        for d in range(3):  # B less A first: what both share cancels exactly
            if d < 2:
                shared = bodies.twist[lasting.body[k, 1], d] - bodies.twist[lasting.body[k, 0], d]
                speed += lasting.jacobian[k, 1, row, d] * shared
            else:
                for side in (1, 0):
                    speed += lasting.jacobian[k, side, row, d] * bodies.twist[lasting.body[k, side], d]
        lasting.speed[k, row] = speed


@inner_kernel
def free_accelerations(bodies: Bodies, lasting: Lasting) -> None:
    """Loads alone: planar bodies have no gyroscopic term."""
    for i in range(len(bodies.kind)):
        for d in range(3):
            lasting.free[i, d] = bodies.real[i, LOAD + d] if bodies.kind[i, MOTION] == FREE else 0.0


@inner_kernel
def displace(bodies: Bodies, lasting: Lasting, i: int) -> None:
    """Pose of body i: where the phase began, moved by its displacement."""
    for d in range(3):
        bodies.pose[i, d] = lasting.base[i, d] + lasting.displacement[i, d]
    bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])


@inner_kernel
def displacement_rate(bodies: Bodies, lasting: Lasting, i: int, stage: int) -> None:
    """In the plane the rate of the displacement is the twist."""
    for d in range(3):
        lasting.rate[stage, i, d] = bodies.twist[i, d]


@inner_kernel
def displacement_curvature(bodies: Bodies, lasting: Lasting, i: int, end: int) -> None:
    """In the plane the second derivative of the displacement is the acceleration."""
    for d in range(3):
        lasting.bend[end, i, d] = lasting.acceleration[i, d]


@inner_kernel
def feature_limits(bodies: Bodies, lasting: Lasting, k: int, place: int) -> None:
    """Distance of the core point from the ends of its edge; of a vertex, of its normal from those of its edges [m]."""
    monitor = lasting.monitor[place, k]
    for m in range(FEATURE, len(monitor)):
        monitor[m] = math.inf
    if lasting.kind[k, FORM] != POINTS:
        along, _ = along_edge(bodies, lasting, k)
        monitor[FEATURE], monitor[FEATURE + 1] = along - lasting.place[k, LOW], lasting.place[k, HIGH] - along
        return
    a, b = lasting.body[k, 0], lasting.body[k, 1]
    nx, ny = lasting.frame[k, 0, 0], lasting.frame[k, 0, 1]
    reach = bodies.real[a, ROUNDING] + bodies.real[b, ROUNDING]
    for step in range(2):
        monitor[FEATURE + step] = reach * cone_limit(bodies, a, lasting.kind[k, VERTEX_A], step, nx, ny)
        monitor[FEATURE + 2 + step] = reach * cone_limit(bodies, b, lasting.kind[k, VERTEX_B], step, -nx, -ny)


@inner_kernel
def cone_limit(bodies: Bodies, i: int, vertex: int, step: int, nx: float, ny: float) -> float:
    """How far (nx, ny) is from the normal of the edge after (``step`` 0) or before a vertex of body i, as a sine."""
    count = bodies.kind[i, VERTICES]
    if count < 2:
        return math.inf
    px, py = corner(bodies, i, vertex)
    qx, qy = corner(bodies, i, (vertex + (1 if step == 0 else count - 1)) % count)
    ex, ey = qx - px, qy - py
    return -(ex * nx + ey * ny) / math.hypot(ex, ey)


@inner_kernel
def is_free(bodies: Bodies, i: int) -> bool:
    """Whether forces move body i."""
    return bodies.kind[i, MOTION] == FREE


provide(operations.is_free, Bodies, is_free)
provide(operations.hold, Bodies, hold)
provide(operations.next_features, Bodies, next_features)
provide(operations.evaluate, Bodies, evaluate)
provide(operations.free_accelerations, Bodies, free_accelerations)
provide(operations.displace, Bodies, displace)
provide(operations.displacement_rate, Bodies, displacement_rate)
provide(operations.displacement_curvature, Bodies, displacement_curvature)
provide(operations.feature_limits, Bodies, feature_limits)
