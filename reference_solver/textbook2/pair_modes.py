"""Exact solution of a two-point manifold with friction: enumeration of its contact modes (E12).

Each point is open, sticking, or sliding one way or the other. A mode turns the problem into a linear system; what
solves it is accepted if it solves the contact problem, measured by its natural map. A two-point manifold has four
rows but three degrees of relative freedom, so "both sticking" is singular: the split of the friction between the
points is free, and chosen in proportion to their normal impulses.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.coulomb import into_interval
from reference_solver.model import Array
from reference_solver.textbook.elimination import eliminate

#: A mode is accepted if no row misses by more than this share of the pressure: some ten roundings, and as much as
#: the residual of the reference profile allows.
MODE_DEFECT = 5e-15
#: Two points whose normal rows are this close to parallel (1 - cos^2) count as one.
PARALLEL = 1e-12
#: Alternations of normal and friction rows where no mode fits (Painleve); later sweeps go on where they end.
FALLBACK_PASSES = 8

# Rows of `Rows.local`: impulses and velocities of the block, velocities without its impulses, a trial, and from
# SYSTEM on the four equations of a mode with their right-hand sides.
IMPULSE, VELOCITY, FREE_VELOCITY, TRIAL, SYSTEM = 0, 1, 2, 3, 4
LOCAL_ROWS, LOCAL_COLUMNS = 8, 5


@inner_kernel
def solve_modes(w: Array, local: Array, mu1: float, mu2: float) -> bool:
    """Replace the impulses of the block by its exact solution; False, with impulses as before, if none is found.

    The order decides where several solutions exist: open, sticking, sliding together, one point open, mixed.
    """
    for i in range(4):
        local[FREE_VELOCITY, i] = local[VELOCITY, i]
        for j in range(4):
            local[FREE_VELOCITY, i] -= w[i, j] * local[IMPULSE, j]
        local[TRIAL, i] = 0.0
    if accept(w, local, mu1, mu2):
        return True
    if try_sticking(w, local, mu1, mu2) and accept(w, local, mu1, mu2):
        return True
    for way in range(-1, 2, 2):
        if try_mode(w, local, mu1, mu2, way, way) and accept(w, local, mu1, mu2):
            return True
    for pressed in range(2):
        try_one_point(w, local, 2 * pressed, mu1 if pressed == 0 else mu2)
        if accept(w, local, mu1, mu2):
            return True
    for first in range(-1, 2):
        for second in range(-1, 2):
            if first != second and try_mode(w, local, mu1, mu2, first, second) and accept(w, local, mu1, mu2):
                return True
    return False


@spliced_kernel
def accept(w: Array, local: Array, mu1: float, mu2: float) -> bool:
    """Take the trial if it solves the block's contact problem (E14)."""
    p, q = local[TRIAL], local[FREE_VELOCITY]
    if p[0] < 0.0 or p[2] < 0.0:
        return False
    allowed = MODE_DEFECT * (p[0] + p[2])
    for i in range(4):
        u = q[i] + w[i, 0] * p[0] + w[i, 1] * p[1] + w[i, 2] * p[2] + w[i, 3] * p[3]
        moved = p[i] - u / w[i, i]
        if i % 2 == 0:
            moved = max(moved, 0.0)
        else:
            bound = mu1 * p[0] if i == 1 else mu2 * p[2]
            moved = into_interval(moved, bound)
        if abs(moved - p[i]) > allowed:
            return False
        local[VELOCITY, i] = u
    for i in range(4):
        local[IMPULSE, i] = p[i]
    return True


@spliced_kernel
def try_sticking(w: Array, local: Array, mu1: float, mu2: float) -> bool:
    """Both points pressed, their mean friction row at rest."""
    p, q = local[TRIAL], local[FREE_VELOCITY]
    det = w[0, 0] * w[2, 2] - w[0, 2] * w[0, 2]
    if det <= PARALLEL * w[0, 0] * w[2, 2]:
        return False
    c1, c2 = 0.5 * (w[0, 1] + w[0, 3]), 0.5 * (w[2, 1] + w[2, 3])
    x1, x2 = (w[2, 2] * c1 - w[0, 2] * c2) / det, (w[0, 0] * c2 - w[0, 2] * c1) / det
    stiffness = 0.25 * (w[1, 1] + 2.0 * w[1, 3] + w[3, 3]) - x1 * c1 - x2 * c2
    if stiffness <= 0.0:
        return False
    total = -(0.5 * (q[1] + q[3]) - x1 * q[0] - x2 * q[2]) / stiffness
    r1, r2 = q[0] + c1 * total, q[2] + c2 * total
    p[0], p[2] = (w[0, 2] * r2 - w[2, 2] * r1) / det, (w[0, 2] * r1 - w[0, 0] * r2) / det
    capacity = mu1 * p[0] + mu2 * p[2]
    share = mu1 * p[0] / capacity if capacity > 0.0 else 0.5
    p[1], p[3] = share * total, (1.0 - share) * total
    return True


@spliced_kernel
def try_one_point(w: Array, local: Array, row: int, mu: float) -> None:
    """The other point open, this one solved exactly."""
    q, p = local[FREE_VELOCITY], local[TRIAL]
    p[0] = p[1] = p[2] = p[3] = 0.0
    p[row], p[row + 1] = coulomb_point(q[row], q[row + 1], w[row, row], w[row + 1, row + 1], w[row, row + 1], mu)


@spliced_kernel
def try_mode(w: Array, local: Array, mu1: float, mu2: float, first: int, second: int) -> bool:
    """Both points pressed, each sticking (0) or sliding with (+1) or against (-1) the tangent; False if singular."""
    system = local[SYSTEM:]
    for i in range(4):
        for j in range(4):
            system[i, j] = w[i, j]
        system[i, 4] = -local[FREE_VELOCITY, i]
    for point in range(2):
        way = first if point == 0 else second
        if way != 0:
            row = 2 * point + 1
            for j in range(5):
                system[row, j] = 0.0
            # Friction acts against the slip: p_t = -way mu p_n. Scaled like the other rows for the pivots.
            system[row, row] = w[row, row]
            system[row, row - 1] = way * (mu1 if point == 0 else mu2) * w[row, row]
    if not eliminate(system, 4, PARALLEL):
        return False
    for i in range(4):
        local[TRIAL, i] = system[i, 4]
    return True


@spliced_kernel
def coulomb_point(qn: float, qt: float, kn: float, kt: float, kx: float, mu: float) -> tuple[float, float]:
    """Normal and tangential impulse of one point (E12), q the velocities (minus target) without them.

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
    for way in range(-1, 2, 2):
        stiffness = kn - way * mu * kx
        if stiffness > 0.0:
            n = -qn / stiffness
            t = -way * mu * n
            if way * (qt + kx * n + kt * t) >= 0.0:
                return n, t
    return -qn / kn, 0.0
