"""All points of one manifold solved together by a semismooth Newton method, for blocks that do not simply stick (E12).

Unknown is the relative twist x = (V, W) at the manifold's centre, six numbers however many points there are, so that
redundant points make nothing singular. With z_i = p_i - rho_i (u_i(x) - b_i) the Coulomb law is p_i = Pi(z_i), Pi
the projection to n >= 0 and then to the disc of radius mu n. Each round solves

    F(x) = x - x_free - sum_i R_i Pi(p_i - rho_i (J_i x - b_i)) = 0,      F' = 1 + sum_i rho_i R_i Pi' J_i

with R_i the response, and then puts Pi(z_i) in place of p_i: a proximal point iteration, whose rounds gain a factor
of about `STIFFNESS` each (P. Alart, A. Curnier, Comput. Methods Appl. Mech. Eng. 92, 1991).
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.textbook.elimination import eliminate
from reference_solver.textbook3.kinematics import velocity_at
from reference_solver.textbook3.state import Manifolds
from reference_solver.textbook3.vector import ZERO, Vector, add, cross, length, row, scale, sub

#: rho in units of 1 / k_nn. A round contracts by its inverse; its round-off enters impulses multiplied by it.
STIFFNESS = 100.0
#: Rounds at that value; most blocks need no more.
EASY_ROUNDS = 8
#: Bound of the stiffness afterwards. Points that cannot all stick, because they lie at different depth, slip at speeds
#: far below the others' (1e-7 of them for a tilt of 1e-5); only a stiffness as large as the inverse of that ratio
#: brings their friction to the cone within a few rounds.
LARGEST_STIFFNESS = 1e10
#: Rounds in all.
ROUNDS = 100
#: A round that changes impulses by more than this share of the largest is at work: the stiffness stays.
AT_WORK = 0.3
#: Newton steps per round; usual are 1 or 2, after 3 to 6 in the first.
NEWTON_STEPS = 60
#: Halvings of a step that does not reduce F.
HALVINGS = 4
#: F is round-off when it is this small relative to the terms it sums, or to stiffness times the velocities in z.
SOLVED = 5e-16
#: Impulses that change by less than this share of the largest are final: velocities then miss their targets by
#: that share over `STIFFNESS`.
SETTLED = 1e-12


@inner_kernel
def solve_by_newton(manifolds: Manifolds, m: int, v: Vector, w: Vector) -> bool:
    """Set the impulses that solve manifold m; (v, w) is the twist with the present ones. False: none found.

    Rounds start from the present impulses. These may carry friction that cancels between the points and stands in
    the way; rounds from zero find the solution without it.
    """
    free_v, free_w = v, w
    for p in range(manifolds.points[m]):
        free_v, free_w = moved_twist(manifolds, m, p, row(manifolds.impulse[m], p, 0), -1.0, free_v, free_w)
    if iterate(manifolds, m, free_v, free_w, v, w, EASY_ROUNDS):
        return True
    for p in range(manifolds.points[m]):
        for d in range(3):
            manifolds.impulse[m, p, d] = 0.0
    return iterate(manifolds, m, free_v, free_w, free_v, free_w, ROUNDS)


@inner_kernel
def iterate(manifolds: Manifolds, m: int, free_v: Vector, free_w: Vector, v: Vector, w: Vector, rounds: int) -> bool:
    """Proximal rounds until the impulses are final.

    The stiffness grows when easy rounds have not been enough, stays while impulses change, gives way where Newton's
    method fails, and falls back once nothing is left but its own round-off, to take that out again.
    """
    stiffness, growth = STIFFNESS, 10.0
    for k in range(rounds):
        solved, new_v, new_w = newton(manifolds, m, stiffness, free_v, free_w, v, w)
        if not solved:
            if stiffness == STIFFNESS:
                return False
            stiffness = max(0.1 * stiffness, STIFFNESS)
            growth = math.sqrt(growth)
            continue
        v, w = new_v, new_w
        change, largest = 0.0, 0.0
        for p in range(manifolds.points[m]):
            for d in range(3):
                change = max(change, abs(manifolds.trial[m, p, d] - manifolds.impulse[m, p, d]))
                manifolds.impulse[m, p, d] = manifolds.trial[m, p, d]
            largest = max(largest, manifolds.impulse[m, p, 2])
        if change <= SETTLED * (stiffness / STIFFNESS) * largest:
            if stiffness == STIFFNESS:
                return True
            stiffness, growth = STIFFNESS, 1.0
        elif k + 1 >= EASY_ROUNDS and change <= AT_WORK * largest:
            stiffness = min(growth * stiffness, LARGEST_STIFFNESS)
    return False


@inner_kernel
def moved_twist(
    manifolds: Manifolds, m: int, p: int, impulse: Vector, sign: float, v: Vector, w: Vector
) -> tuple[Vector, Vector]:
    """(v, w) plus sign times the response to an impulse at point p."""
    r = manifolds.response[m, p]
    x, y, z = sign * impulse[0], sign * impulse[1], sign * impulse[2]
    return (
        (
            v[0] + (r[0, 0] * x + r[0, 1] * y + r[0, 2] * z),
            v[1] + (r[1, 0] * x + r[1, 1] * y + r[1, 2] * z),
            v[2] + (r[2, 0] * x + r[2, 1] * y + r[2, 2] * z),
        ),
        (
            w[0] + (r[3, 0] * x + r[3, 1] * y + r[3, 2] * z),
            w[1] + (r[4, 0] * x + r[4, 1] * y + r[4, 2] * z),
            w[2] + (r[5, 0] * x + r[5, 1] * y + r[5, 2] * z),
        ),
    )


@inner_kernel
def newton(
    manifolds: Manifolds, m: int, stiffness: float, free_v: Vector, free_w: Vector, v: Vector, w: Vector
) -> tuple[bool, Vector, Vector]:
    """Root of F from the start (v, w); leaves the impulses Pi(z) in `trial`.

    A step that does not reduce F is halved, a few times at most: F has kinks, and where only a kink separates two
    slopes a step across it, though uphill, is the way on.
    """
    system = manifolds.system[m]
    step_v, step_w = ZERO, ZERO
    before, halvings, width = math.inf, 0, extent(manifolds, m)
    for _ in range(NEWTON_STEPS):
        miss, noise = set_system(manifolds, m, stiffness, free_v, free_w, v, w)
        if miss <= SOLVED * noise:
            return True, v, w
        if miss > before and halvings < HALVINGS:
            halvings += 1
            step_v, step_w = scale(0.5, step_v), scale(0.5, step_w)
            v, w = sub(v, step_v), sub(w, step_w)
            continue
        before, halvings = miss, 0
        for i in range(3, 6):  # angular rows compare with the others as pivots, whatever the unit of length
            for j in range(7):
                system[i, j] *= width
        if not eliminate(system, 6, 0.0):
            return False, v, w
        step_v = (system[0, 6], system[1, 6], system[2, 6])
        step_w = (system[3, 6], system[4, 6], system[5, 6])
        v, w = add(v, step_v), add(w, step_w)
    return False, v, w


@inner_kernel
def set_system(
    manifolds: Manifolds, m: int, stiffness: float, free_v: Vector, free_w: Vector, v: Vector, w: Vector
) -> tuple[float, float]:
    """Matrix F' and right side -F at (v, w); returns the size of F and of what it is the sum of [m/s].

    Angular velocities count with the distance of the farthest point.
    """
    set_matrix(manifolds, m, stiffness, v, w)
    made_v, made_w = free_v, free_w
    noise, width, speed = 0.0, 0.0, 0.0
    for p in range(manifolds.points[m]):
        trial = row(manifolds.trial[m], p, 0)
        made_v, made_w = moved_twist(manifolds, m, p, trial, 1.0, made_v, made_w)
        noise = max(noise, response_size(manifolds.response[m, p], trial))
        width = max(width, length(row(manifolds.offset[m], p, 0)))
        speed = max(speed, abs(manifolds.target[m, p]))
    for d in range(3):
        manifolds.system[m, d, 6] = made_v[d] - v[d]
        manifolds.system[m, 3 + d, 6] = made_w[d] - w[d]
    speed = max(speed, length(v) + width * length(w))
    noise = max(noise, length(free_v) + width * length(free_w), stiffness * speed)
    return length(sub(made_v, v)) + width * length(sub(made_w, w)), noise


@inner_kernel
def response_size(r: Array, impulse: Vector) -> float:
    """Size of the terms of the velocity response to an impulse, for the round-off of their sum [m/s]."""
    largest = 0.0
    for d in range(3):
        size = abs(r[d, 0] * impulse[0]) + abs(r[d, 1] * impulse[1]) + abs(r[d, 2] * impulse[2])
        largest = max(largest, size)
    return largest


@inner_kernel
def set_matrix(manifolds: Manifolds, m: int, stiffness: float, v: Vector, w: Vector) -> None:
    """Impulses Pi(z) and the matrix F' at (v, w)."""
    system = manifolds.system[m]
    for i in range(6):
        for j in range(6):
            system[i, j] = 1.0 if i == j else 0.0
    for p in range(manifolds.points[m]):
        rho = stiffness / manifolds.matrix[m, p, 5]
        u = velocity_at(v, w, manifolds, m, p)
        z1 = manifolds.impulse[m, p, 0] - rho * u[0]
        z2 = manifolds.impulse[m, p, 1] - rho * u[1]
        zn = manifolds.impulse[m, p, 2] - rho * (u[2] - manifolds.target[m, p])
        trial = manifolds.trial[m, p]
        trial[0], trial[1], trial[2] = 0.0, 0.0, 0.0
        if zn <= 0.0:
            continue
        trial[2] = zn
        bound = manifolds.friction[m] * zn
        size = math.sqrt(z1 * z1 + z2 * z2)
        if size <= bound:
            trial[0], trial[1] = z1, z2
            add_derivative(manifolds, m, p, rho, 1.0, 0.0, 1.0, 0.0, 0.0)
        else:
            d1, d2 = z1 / size, z2 / size
            trial[0], trial[1] = bound * d1, bound * d2
            part = bound / size
            mu = manifolds.friction[m]
            add_derivative(manifolds, m, p, rho, part * d2 * d2, -part * d1 * d2, part * d1 * d1, mu * d1, mu * d2)


@inner_kernel
def add_derivative(
    manifolds: Manifolds,
    m: int,
    p: int,
    rho: float,
    d11: float,
    d12: float,
    d22: float,
    d1n: float,
    d2n: float,
) -> None:
    """Add rho R Pi' J of one pressed point: Pi' has the friction part d, its coupling to the normal, and 1."""
    r = manifolds.response[m, p]
    offset = row(manifolds.offset[m], p, 0)
    for j in range(6):
        u = unit_velocity(j, offset)
        p1 = rho * (d11 * u[0] + d12 * u[1] + d1n * u[2])
        p2 = rho * (d12 * u[0] + d22 * u[1] + d2n * u[2])
        pn = rho * u[2]
        for i in range(6):
            manifolds.system[m, i, j] += r[i, 0] * p1 + r[i, 1] * p2 + r[i, 2] * pn


@inner_kernel
def unit_velocity(j: int, offset: Vector) -> Vector:
    """Column j of J: velocity of a point for a unit of component j of (V, W)."""
    unit = (1.0 if j % 3 == 0 else 0.0, 1.0 if j % 3 == 1 else 0.0, 1.0 if j % 3 == 2 else 0.0)
    return unit if j < 3 else cross(unit, offset)


@inner_kernel
def extent(manifolds: Manifolds, m: int) -> float:
    """Distance of the farthest point from the centre: what an angular velocity counts with [m]."""
    width = 0.0
    for p in range(manifolds.points[m]):
        width = max(width, length(row(manifolds.offset[m], p, 0)))
    return width
