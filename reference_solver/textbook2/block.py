"""Block solve: all rows of one manifold together, normal and friction, then over-relaxed (E12, E13)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.coulomb import into_interval
from reference_solver.model import Array
from reference_solver.textbook.options import Options
from reference_solver.textbook2.columns import (
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
from reference_solver.textbook2.kinematics import apply_normal, apply_tangent, normal_velocity, tangent_velocity
from reference_solver.textbook2.pair_modes import (
    FALLBACK_PASSES,
    IMPULSE,
    PARALLEL,
    VELOCITY,
    coulomb_point,
    solve_modes,
)
from reference_solver.textbook2.state import MANIFOLDS, Bodies, Rows


@spliced_kernel
def prepare_blocks(bodies: Bodies, rows: Rows) -> None:
    """Matrix W of every two-point manifold (E12)."""
    for m in range(rows.counts[MANIFOLDS]):
        first = rows.manifold[m]
        if rows.manifold[m + 1] - first != 2:
            continue
        a, b = rows.integer[first, A], rows.integer[first, B]
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
    for m in range(rows.counts[MANIFOLDS]):
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


@spliced_kernel
def relax_point(bodies: Bodies, rows: Rows, c: int, row: int, options: Options, relaxation: float) -> None:
    """Go from the old impulse through the block's solution by the factor, stay in the cone, apply the change."""
    old = rows.real[c, PN]
    new = max(old + relaxation * (rows.local[IMPULSE, row] - old), 0.0)
    rows.real[c, PN] = new
    apply_normal(bodies, bodies.twist, rows, c, new - old)
    if options.friction:
        bound = rows.real[c, FRICTION] * new
        old = rows.real[c, PT]
        new = into_interval(old + relaxation * (rows.local[IMPULSE, row + 1] - old), bound)
        rows.real[c, PT] = new
        apply_tangent(bodies, bodies.twist, rows, c, new - old)


@spliced_kernel
def solve_point(rows: Rows, c: int, options: Options) -> None:
    """Exact solution of one contact point (E12): open, sticking, or sliding either way."""
    p, u = rows.local[IMPULSE], rows.local[VELOCITY]
    kn, kt, kx = 1.0 / rows.real[c, NORMAL_MASS], 1.0 / rows.real[c, TANGENT_MASS], rows.real[c, COUPLING]
    qn = u[0] - kn * p[0] - kx * p[1]
    qt = u[1] - kx * p[0] - kt * p[1]
    p[0], p[1] = coulomb_point(qn, qt, kn, kt, kx, rows.real[c, FRICTION] if options.friction else 0.0)


@inner_kernel
def solve_pair(rows: Rows, m: int, options: Options) -> None:
    """Two points: exactly by modes; where there is none, or no friction, by the normal and friction rows in turn."""
    w, local = rows.block[m], rows.local
    p, u = local[IMPULSE], local[VELOCITY]
    if not options.friction:
        press_normals(w, p, u)
        return
    first = rows.manifold[m]
    mu1, mu2 = rows.real[first, FRICTION], rows.real[first + 1, FRICTION]
    if solve_modes(w, local, mu1, mu2):
        return
    for _ in range(FALLBACK_PASSES):
        press_normals(w, p, u)
        slide_row(w, p, u, 1, mu1 * p[0])
        slide_row(w, p, u, 3, mu2 * p[2])


@spliced_kernel
def change_impulse(w: Array, p: Array, u: Array, row: int, new: float) -> None:
    """Set one impulse of the block and update its four velocities."""
    step = new - p[row]
    p[row] = new
    for i in range(4):
        u[i] += w[i, row] * step


@spliced_kernel
def slide_row(w: Array, p: Array, u: Array, row: int, bound: float) -> None:
    """Friction row of the block by itself (E11)."""
    change_impulse(w, p, u, row, into_interval(p[row] - u[row] / w[row, row], bound))


@spliced_kernel
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


@spliced_kernel
def sweep_block_pushes(bodies: Bodies, rows: Rows, relaxation: float) -> None:
    """One sweep over the pseudo-velocity rows, two points of a manifold together (E12, E16)."""
    p, u = rows.local[IMPULSE], rows.local[VELOCITY]
    for m in range(rows.counts[MANIFOLDS]):
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
