"""The block solution in which all points of a manifold stay pressed and stick, found at once (E12).

Three or more points fix all six relative velocities, so the wrench that brings them about is unique: one 6 x 6
system. How the points share it is not: normals share it as an affine function of their place, friction in
proportion to the normals, which is what a cone allows most easily. Any other sharing acts on the bodies alike.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.textbook.options import BLOCK, Options
from reference_solver.textbook3.state import Bodies, Manifolds
from reference_solver.textbook3.vector import ZERO, Vector, add, cross, dot, row, scale, times

#: Points whose spread in the plane has a smaller determinant than this share of its trace squared are on a line.
COLLINEAR = 1e-6
#: Targets, and heights of points over their plane, count as affine up to this share of the largest.
AFFINE = 1e-13


@inner_kernel
def prepare_wrenches(bodies: Bodies, manifolds: Manifolds, options: Options) -> None:
    """Factorise the response of every manifold that could be solved by `stick`."""
    for m in range(len(manifolds)):
        manifolds.rigid[m] = 0
        manifolds.failures[m] = 0
        if options.solver == BLOCK and manifolds.points[m] > 2 and manifolds.friction[m] > 0.0:
            if set_spread(manifolds, m):
                set_admittance(bodies, manifolds, m)
                factorise(manifolds, m)
                manifolds.rigid[m] = 1


@inner_kernel
def set_spread(manifolds: Manifolds, m: int) -> bool:
    """Second moments of the points about their centre, along the tangents; False if they lie on a line."""
    xx, xy, yy = 0.0, 0.0, 0.0
    for p in range(manifolds.points[m]):
        x, y = manifolds.offset[m, p, 0], manifolds.offset[m, p, 1]
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
    manifolds.spread[m, 0], manifolds.spread[m, 1], manifolds.spread[m, 2] = xx, xy, yy
    return xx * yy - xy * xy > COLLINEAR * (xx + yy) * (xx + yy)


@inner_kernel
def set_admittance(bodies: Bodies, manifolds: Manifolds, m: int) -> None:
    """Relative twist (V, W) per unit wrench (force, moment) at the centre: a symmetric 6 x 6 matrix, frame."""
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    inverse_mass = bodies.inverse_mass[a] + bodies.inverse_mass[b]
    lever_a, lever_b = row(manifolds.lever_a, m, 0), row(manifolds.lever_b, m, 0)
    for j in range(6):
        unit = row(manifolds.frame[m], j % 3, 0)
        force, moment = (unit, ZERO) if j < 3 else (ZERO, unit)
        spin_a = times(bodies.inverse_inertia, a, add(cross(lever_a, force), moment))
        spin_b = times(bodies.inverse_inertia, b, add(cross(lever_b, force), moment))
        v = add(scale(inverse_mass, force), add(cross(spin_a, lever_a), cross(spin_b, lever_b)))
        w = add(spin_a, spin_b)
        for i in range(3):
            manifolds.factor[m, i, j] = dot(row(manifolds.frame[m], i, 0), v)
            manifolds.factor[m, 3 + i, j] = dot(row(manifolds.frame[m], i, 0), w)


@inner_kernel
def factorise(manifolds: Manifolds, m: int) -> None:
    """Factors L D L^T of the admittance, in place: D on the diagonal, L below it.

    Without square roots, so that units changed by powers of two change no bit.
    """
    f = manifolds.factor[m]
    for j in range(6):
        for i in range(j, 6):
            entry = f[i, j]
            for k in range(j):
                entry -= f[i, k] * (f[k, k] * f[j, k])
            f[i, j] = entry if i == j else entry / f[j, j]


@inner_kernel
def stick(manifolds: Manifolds, m: int, v: Vector, w: Vector) -> bool:
    """Set the impulses that bring manifold m to its targets without slip; False, nothing set, if none may.

    (v, w) is the relative twist with the present impulses.
    """
    fits, goal_v, goal_w = goal(manifolds, m)
    if not fits:
        return False
    x = manifolds.wrench[m]
    for d in range(3):
        x[d] = goal_v[d] - v[d]
        x[3 + d] = goal_w[d] - w[d]
    substitute(manifolds, m)
    for p in range(manifolds.points[m]):
        impulse = row(manifolds.impulse[m], p, 0)
        moment = cross(row(manifolds.offset[m], p, 0), impulse)
        for d in range(3):
            x[d] += impulse[d]
            x[3 + d] += moment[d]
    return share_wrench(manifolds, m)


@inner_kernel
def goal(manifolds: Manifolds, m: int) -> tuple[bool, Vector, Vector]:
    """Relative twist at which every point has its target and no slip; False if there is none."""
    count = manifolds.points[m]
    mean, along, aside, largest, highest = 0.0, 0.0, 0.0, 0.0, 0.0
    for p in range(count):
        target = manifolds.target[m, p]
        mean += target / count
        along += target * manifolds.offset[m, p, 0]
        aside += target * manifolds.offset[m, p, 1]
        largest = max(largest, abs(target))
        highest = max(highest, abs(manifolds.offset[m, p, 2]))
    if largest == 0.0:
        return True, ZERO, ZERO
    xx, xy, yy = row(manifolds.spread, m, 0)
    determinant = xx * yy - xy * xy
    slope_x = (yy * along - xy * aside) / determinant
    slope_y = (xx * aside - xy * along) / determinant
    width = math.sqrt(xx + yy)
    if (abs(slope_x) + abs(slope_y)) * highest > AFFINE * largest:
        return False, ZERO, ZERO  # turning would make points slip that do not lie in the plane of the centre
    for p in range(count):
        fitted = mean + slope_x * manifolds.offset[m, p, 0] + slope_y * manifolds.offset[m, p, 1]
        if abs(fitted - manifolds.target[m, p]) > AFFINE * (largest + (abs(slope_x) + abs(slope_y)) * width):
            return False, ZERO, ZERO
    return True, (0.0, 0.0, mean), (slope_y, -slope_x, 0.0)


@inner_kernel
def substitute(manifolds: Manifolds, m: int) -> None:
    """Solve for the wrench by forward and back substitution, in place."""
    f, x = manifolds.factor[m], manifolds.wrench[m]
    for i in range(6):
        for k in range(i):
            x[i] -= f[i, k] * x[k]
    for i in range(5, -1, -1):
        x[i] /= f[i, i]
        for k in range(i + 1, 6):
            x[i] -= f[k, i] * x[k]


@inner_kernel
def share_wrench(manifolds: Manifolds, m: int) -> bool:
    """Share the wrench among the points; False if one would pull or leave its cone."""
    x = manifolds.wrench[m]
    count = manifolds.points[m]
    if not share_normals(manifolds, m, x[3], x[4]):  # as if all points lay in the plane: weights of the friction
        return False
    sx, sy = 0.0, 0.0
    for p in range(count):
        weight = manifolds.share[m, p, 2] / x[2]
        sx += weight * manifolds.offset[m, p, 0]
        sy += weight * manifolds.offset[m, p, 1]
    polar = 0.0
    for p in range(count):
        ex, ey = manifolds.offset[m, p, 0] - sx, manifolds.offset[m, p, 1] - sy
        polar += manifolds.share[m, p, 2] / x[2] * (ex * ex + ey * ey)
    twist = (x[5] - (sx * x[1] - sy * x[0])) / polar if polar > 0.0 else 0.0
    tilt_x, tilt_y = x[3], x[4]
    for p in range(count):
        weight = manifolds.share[m, p, 2] / x[2]
        ex, ey, z = manifolds.offset[m, p, 0] - sx, manifolds.offset[m, p, 1] - sy, manifolds.offset[m, p, 2]
        manifolds.share[m, p, 0] = weight * (x[0] - twist * ey)
        manifolds.share[m, p, 1] = weight * (x[1] + twist * ex)
        tilt_x += z * manifolds.share[m, p, 1]
        tilt_y -= z * manifolds.share[m, p, 0]
    if not share_normals(manifolds, m, tilt_x, tilt_y):
        return False
    for p in range(count):
        bound = manifolds.friction[m] * manifolds.share[m, p, 2]
        if manifolds.share[m, p, 0] ** 2 + manifolds.share[m, p, 1] ** 2 > bound * bound:
            return False
    for p in range(count):
        for d in range(3):
            manifolds.impulse[m, p, d] = manifolds.share[m, p, d]
    return True


@inner_kernel
def share_normals(manifolds: Manifolds, m: int, tilt_x: float, tilt_y: float) -> bool:
    """Normal impulses affine in the place, with the wrench's force and moments; False if one would pull.

    n = f / k + c_y x + c_x y with moments sum y n = tilt_x, sum -x n = tilt_y.
    """
    xx, xy, yy = row(manifolds.spread, m, 0)
    determinant = xx * yy - xy * xy
    cx = (xx * tilt_x + xy * tilt_y) / determinant
    cy = (-yy * tilt_y - xy * tilt_x) / determinant
    for p in range(manifolds.points[m]):
        n = manifolds.wrench[m, 2] / manifolds.points[m]
        n += cy * manifolds.offset[m, p, 0] + cx * manifolds.offset[m, p, 1]
        if n <= 0.0:
            return False
        manifolds.share[m, p, 2] = n
    return True
