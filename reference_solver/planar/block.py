"""Block solve: all rows of one manifold together, normal and friction, then over-relaxed (E12, E13).

A two-point manifold has four rows but only three degrees of relative freedom, so its 4 x 4 matrix is always
singular: when both points stick, the split of the friction between them is undetermined. The modes below fix it
in proportion to the normal impulses, which the cone of each point allows whenever it allows any split.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar.columns import (
    AN,
    COUPLING,
    FRICTION,
    INVERSE_INERTIA,
    INVERSE_MASS,
    NORMAL_MASS,
    PN,
    PT,
    PUSH,
    PUSH_TARGET,
    TANGENT_MASS,
    TARGET,
    A,
    B,
)
from reference_solver.planar.kinematics import apply_normal, apply_tangent, normal_velocity, tangent_velocity
from reference_solver.planar.state import MANIFOLDS, Bodies, Options, Rows

#: Two points whose normal rows are this close to parallel (1 - cos^2) are solved one after the other.
PARALLEL = 1e-12
#: Alternations of normal and friction rows that finish a block. Modes solve it at once except where points at
#: different depth stick and slip at the same time; later sweeps go on where this ends.
POLISHING_PASSES = 8
#: A block whose last alternation changed impulses by less than this share is solved.
POLISHED = 1e-15

# Rows of `Rows.local`.
IMPULSE, VELOCITY = 0, 1


@inner_kernel
def prepare_blocks(bodies: Bodies, rows: Rows) -> None:
    """Matrix W of every two-point manifold (E12)."""
    for m in range(rows.count[MANIFOLDS]):
        first = rows.manifold[m]
        if rows.manifold[m + 1] - first != 2:
            continue
        a, b = rows.index[first, A], rows.index[first, B]
        mass = bodies.real[a, INVERSE_MASS] + bodies.real[b, INVERSE_MASS]
        for i in range(4):
            for j in range(4):
                # Levers of A stand at 0 (normal) and 2 (tangent), those of B one behind.
                ci, cj, ki, kj = first + i // 2, first + j // 2, 2 * (i % 2), 2 * (j % 2)
                turning = bodies.real[a, INVERSE_INERTIA] * (rows.real[ci, AN + ki] * rows.real[cj, AN + kj])
                turning += bodies.real[b, INVERSE_INERTIA] * (rows.real[ci, AN + ki + 1] * rows.real[cj, AN + kj + 1])
                rows.block[m, i, j] = turning + (mass if ki == kj else 0.0)


@inner_kernel
def sweep_blocks(bodies: Bodies, rows: Rows, options: Options, relaxation: float) -> None:
    """One sweep over all manifolds in canonical order."""
    for m in range(rows.count[MANIFOLDS]):
        first = rows.manifold[m]
        points = rows.manifold[m + 1] - first
        for i in range(points):
            c = first + i
            rows.local[IMPULSE, 2 * i], rows.local[IMPULSE, 2 * i + 1] = rows.real[c, PN], rows.real[c, PT]
            rows.local[VELOCITY, 2 * i] = normal_velocity(bodies.twist, rows, c) - rows.real[c, TARGET]
            rows.local[VELOCITY, 2 * i + 1] = tangent_velocity(bodies.twist, rows, c) if options.friction else 0.0
        if points == 1:
            solve_point(rows, first, options)
        else:
            solve_pair(rows, m, options)
        for i in range(points):
            relax_point(bodies, rows, first + i, 2 * i, options, relaxation)


@inner_kernel
def relax_point(bodies: Bodies, rows: Rows, c: int, row: int, options: Options, relaxation: float) -> None:
    """Go from the old impulse through the block's solution by the factor, stay in the cone, apply the change."""
    old = rows.real[c, PN]
    new = max(old + relaxation * (rows.local[IMPULSE, row] - old), 0.0)
    rows.real[c, PN] = new
    apply_normal(bodies, bodies.twist, rows, c, new - old)
    if options.friction:
        bound = rows.real[c, FRICTION] * new
        old = rows.real[c, PT]
        new = min(max(old + relaxation * (rows.local[IMPULSE, row + 1] - old), -bound), bound)
        rows.real[c, PT] = new
        apply_tangent(bodies, bodies.twist, rows, c, new - old)


@inner_kernel
def solve_point(rows: Rows, c: int, options: Options) -> None:
    """Exact solution of one contact point (E11): open, sticking, or sliding either way."""
    p, u = rows.local[IMPULSE], rows.local[VELOCITY]
    kn, kt, kx = 1.0 / rows.real[c, NORMAL_MASS], 1.0 / rows.real[c, TANGENT_MASS], rows.real[c, COUPLING]
    qn = u[0] - kn * p[0] - kx * p[1]
    qt = u[1] - kx * p[0] - kt * p[1]
    p[0], p[1] = coulomb_point(qn, qt, kn, kt, kx, rows.real[c, FRICTION] if options.friction else 0.0)


@inner_kernel
def coulomb_point(qn: float, qt: float, kn: float, kt: float, kx: float, mu: float) -> tuple[float, float]:
    """Normal and tangential impulse of one point, q the velocities (minus target) without them.

    Where several modes fit, the first of open, stick, slide; where none does, contact without friction.
    """
    if qn >= 0.0:
        return 0.0, 0.0
    if mu == 0.0:
        return -qn / kn, 0.0
    det = kn * kt - kx * kx
    if det > 0.0:
        n, t = (kx * qt - kt * qn) / det, (kx * qn - kn * qt) / det
        if n >= 0.0 and abs(t) <= mu * n:
            return n, t
    for mode in range(2):
        way = 1.0 if mode == 0 else -1.0
        stiffness = kn - way * mu * kx
        if stiffness > 0.0:
            n = -qn / stiffness
            t = -way * mu * n
            if way * (qt + kx * n + kt * t) >= 0.0:
                return n, t
    return -qn / kn, 0.0


@inner_kernel
def solve_pair(rows: Rows, m: int, options: Options) -> None:
    """Two points: try the modes with both pressed, else the normal rows alone; finish by alternation."""
    w, p, u = rows.block[m], rows.local[IMPULSE], rows.local[VELOCITY]
    first = rows.manifold[m]
    mu1, mu2 = 0.0, 0.0
    if options.friction:
        mu1, mu2 = rows.real[first, FRICTION], rows.real[first + 1, FRICTION]
        press_both(w, p, u, mu1, mu2)
    for _ in range(POLISHING_PASSES):
        n1, t1, n2, t2 = p[0], p[1], p[2], p[3]
        press_normals(w, p, u)
        if not options.friction:
            return
        slide_row(w, p, u, 1, mu1 * p[0])
        slide_row(w, p, u, 3, mu2 * p[2])
        change = max(abs(p[0] - n1), abs(p[2] - n2), abs(p[1] - t1), abs(p[3] - t2))
        if change <= POLISHED * (p[0] + p[2]):
            return


@inner_kernel
def change_impulse(w: Array, p: Array, u: Array, row: int, new: float) -> None:
    """Set one impulse of the block and update its four velocities."""
    step = new - p[row]
    p[row] = new
    for i in range(4):
        u[i] += w[i, row] * step


@inner_kernel
def slide_row(w: Array, p: Array, u: Array, row: int, bound: float) -> None:
    """Friction row of the block by itself (E11)."""
    change_impulse(w, p, u, row, min(max(p[row] - u[row] / w[row, row], -bound), bound))


@inner_kernel
def press_normals(w: Array, p: Array, u: Array) -> None:
    """Both normal rows with friction held: enumeration of the 2 x 2 complementarity problem (E12)."""
    k1, k2, k12 = w[0, 0], w[2, 2], w[0, 2]
    q1 = u[0] - k1 * p[0] - k12 * p[2]
    q2 = u[2] - k12 * p[0] - k2 * p[2]
    det = k1 * k2 - k12 * k12
    n1, n2 = max(-q1 / k1, 0.0), 0.0
    if det > PARALLEL * k1 * k2:
        both1, both2 = (k12 * q2 - k2 * q1) / det, (k12 * q1 - k1 * q2) / det
        if both1 >= 0.0 and both2 >= 0.0:
            n1, n2 = both1, both2
        elif q2 + k12 * n1 < 0.0:
            n1, n2 = 0.0, max(-q2 / k2, 0.0)
    elif q2 + k12 * n1 < 0.0:  # the points coincide: the one that must reach the higher speed carries all
        n1, n2 = 0.0, max(-q2 / k2, 0.0)
    change_impulse(w, p, u, 0, n1)
    change_impulse(w, p, u, 2, n2)


@inner_kernel
def press_both(w: Array, p: Array, u: Array, mu1: float, mu2: float) -> None:
    """Both points pressed and sticking, or sliding the same way; nothing changes where no mode fits."""
    det = w[0, 0] * w[2, 2] - w[0, 2] * w[0, 2]
    if det <= PARALLEL * w[0, 0] * w[2, 2]:
        return
    q0 = u[0] - w[0, 0] * p[0] - w[0, 1] * p[1] - w[0, 2] * p[2] - w[0, 3] * p[3]
    q1 = u[1] - w[1, 0] * p[0] - w[1, 1] * p[1] - w[1, 2] * p[2] - w[1, 3] * p[3]
    q2 = u[2] - w[2, 0] * p[0] - w[2, 1] * p[1] - w[2, 2] * p[2] - w[2, 3] * p[3]
    q3 = u[3] - w[3, 0] * p[0] - w[3, 1] * p[1] - w[3, 2] * p[2] - w[3, 3] * p[3]
    # Stick: T acts on the mean friction row; c = (c1, c2) couples it to the normal rows.
    c1, c2 = 0.5 * (w[0, 1] + w[0, 3]), 0.5 * (w[2, 1] + w[2, 3])
    x1, x2 = (w[2, 2] * c1 - w[0, 2] * c2) / det, (w[0, 0] * c2 - w[0, 2] * c1) / det
    stiffness = 0.25 * (w[1, 1] + 2.0 * w[1, 3] + w[3, 3]) - x1 * c1 - x2 * c2
    if stiffness > 0.0:
        total = -(0.5 * (q1 + q3) - x1 * q0 - x2 * q2) / stiffness
        r1, r2 = q0 + c1 * total, q2 + c2 * total
        n1, n2 = (w[0, 2] * r2 - w[2, 2] * r1) / det, (w[0, 2] * r1 - w[0, 0] * r2) / det
        if n1 >= 0.0 and n2 >= 0.0 and abs(total) <= mu1 * n1 + mu2 * n2:
            share = mu1 * n1 / (mu1 * n1 + mu2 * n2) if mu1 * n1 + mu2 * n2 > 0.0 else 0.5
            set_block(w, p, u, n1, share * total, n2, (1.0 - share) * total)
            return
    for mode in range(2):
        way = 1.0 if mode == 0 else -1.0
        s1, s2 = -way * mu1, -way * mu2
        a11, a12 = w[0, 0] + s1 * w[0, 1], w[0, 2] + s2 * w[0, 3]
        a21, a22 = w[2, 0] + s1 * w[2, 1], w[2, 2] + s2 * w[2, 3]
        sliding = a11 * a22 - a12 * a21
        if sliding <= PARALLEL * w[0, 0] * w[2, 2]:
            continue
        n1, n2 = (a12 * q2 - a22 * q0) / sliding, (a21 * q0 - a11 * q2) / sliding
        slip1 = q1 + (w[1, 0] + s1 * w[1, 1]) * n1 + (w[1, 2] + s2 * w[1, 3]) * n2
        slip2 = q3 + (w[3, 0] + s1 * w[3, 1]) * n1 + (w[3, 2] + s2 * w[3, 3]) * n2
        if n1 >= 0.0 and n2 >= 0.0 and way * slip1 >= 0.0 and way * slip2 >= 0.0:
            set_block(w, p, u, n1, s1 * n1, n2, s2 * n2)
            return


@inner_kernel
def set_block(w: Array, p: Array, u: Array, n1: float, t1: float, n2: float, t2: float) -> None:
    """Set all four impulses of the block and update its velocities."""
    change_impulse(w, p, u, 0, n1)
    change_impulse(w, p, u, 1, t1)
    change_impulse(w, p, u, 2, n2)
    change_impulse(w, p, u, 3, t2)


@inner_kernel
def sweep_block_pushes(bodies: Bodies, rows: Rows, relaxation: float) -> None:
    """One sweep over the pseudo-velocity rows, two points of a manifold together (E12, E16)."""
    p, u = rows.local[IMPULSE], rows.local[VELOCITY]
    for m in range(rows.count[MANIFOLDS]):
        first = rows.manifold[m]
        points = rows.manifold[m + 1] - first
        for i in range(points):
            p[2 * i], p[2 * i + 1] = rows.real[first + i, PUSH], 0.0
            u[2 * i] = normal_velocity(bodies.pseudo, rows, first + i) - rows.real[first + i, PUSH_TARGET]
            u[2 * i + 1] = 0.0
        if points == 2:
            press_normals(rows.block[m], p, u)
        else:
            p[0] = max(p[0] - u[0] * rows.real[first, NORMAL_MASS], 0.0)
        for i in range(points):
            old = rows.real[first + i, PUSH]
            rows.real[first + i, PUSH] = max(old + relaxation * (p[2 * i] - old), 0.0)
            apply_normal(bodies, bodies.pseudo, rows, first + i, rows.real[first + i, PUSH] - old)
