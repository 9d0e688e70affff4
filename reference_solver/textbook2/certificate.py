"""How good the answer of one contact solve is, measured from what it left behind (E14, E60 to E63).

The measure knows nothing of how the answer was found: it sees velocities before impulses and after, the rows, and
the impulses. Every contact solve opens with `open_solve` and ends with `certify`.
"""

from __future__ import annotations

from reference_solver.compilation import kernel, spliced_kernel
from reference_solver.coulomb import cone_defect
from reference_solver.direct.problem import IMPULSE_SHARE
from reference_solver.model import Array
from reference_solver.tally import (
    CONE,
    EXCESS,
    LOAD_WORK,
    MOMENTUM,
    NATURAL,
    OPENED,
    PENETRATION,
    PULL,
    RESOLUTION,
    UNIQUE,
)
from reference_solver.textbook.accounting import (
    LAST_PLACE,
    begin_certificate,
    enter_creation,
    enter_energy,
    enter_overlap,
    enter_share,
)
from reference_solver.textbook.motion import FREE
from reference_solver.textbook.options import Options
from reference_solver.textbook2.columns import (
    ARM_A,
    ARM_B,
    COUPLING,
    EXTENT,
    FRICTION,
    GAP,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    MOTION,
    NORMAL_MASS,
    NX,
    NY,
    PN,
    PT,
    SPEED,
    TANGENT_MASS,
    TARGET,
    A,
    B,
)
from reference_solver.textbook2.kinematics import (
    add_pressure,
    apply_normal,
    apply_tangent,
    normal_velocity,
    tangent_velocity,
)
from reference_solver.textbook2.residual import row_residual
from reference_solver.textbook2.state import CONTACTS, Bodies, Rows


@kernel
def open_solve(bodies: Bodies, dt: float, tally: Array) -> None:
    """Keep v* before impulses act, and enter the work of the loads that brought it about within ``dt``."""
    tally[OPENED] += 1.0
    for i in range(len(bodies.kind)):
        place = max(abs(bodies.pose[i, 0]), abs(bodies.pose[i, 1]))
        tally[RESOLUTION] = max(tally[RESOLUTION], LAST_PLACE * place / bodies.real[i, EXTENT])
        for k in range(3):
            bodies.start[i, k] = bodies.twist[i, k]
        if bodies.kind[i, MOTION] != FREE:
            continue
        power = 0.0
        for k in range(3):
            inverse = bodies.real[i, INVERSE_MASS if k < 2 else INVERSE_INERTIA]
            load = bodies.real[i, LOAD + k]
            if inverse > 0.0:
                power += load / inverse * (bodies.twist[i, k] - 0.5 * dt * load)
        tally[LOAD_WORK] += dt * power


@kernel
def certify(bodies: Bodies, rows: Rows, options: Options, tally: Array) -> None:
    """Enter how well velocities and impulses solve the contact problem; velocities and impulses are not changed."""
    if not begin_certificate(bodies.twist, tally):
        return
    work, surface, effort, restored = 0.0, 0.0, 0.0, False
    before, tally[PENETRATION] = tally[PENETRATION], 0.0
    for c in range(rows.counts[CONTACTS]):
        inspect_row(bodies, rows, c, options, tally)
        done, moved, size = row_work(bodies, rows, c)
        work, surface, effort = work + done, surface + moved, effort + size
        restored = restored or rows.real[c, TARGET] > 0.0
    enter_overlap(before, tally)
    enter_creation(work, effort, restored, tally)
    enter_energy(work, surface, effort, kinetic_change(bodies), tally)
    tally[UNIQUE] += 1.0 if is_unique(bodies, rows, options) else 0.0
    check_momentum(bodies, rows, options, tally)


@spliced_kernel
def is_unique(bodies: Bodies, rows: Rows, options: Options) -> bool:
    """Whether the velocities are proven to be the only answer (E66); uses up ``pressed``."""
    if not options.friction:
        return True
    for i in range(len(bodies.kind)):
        bodies.pressed[i, 0] = 0.0
    for c in range(rows.counts[CONTACTS]):
        bodies.pressed[rows.integer[c, A], 0] += 1.0
        bodies.pressed[rows.integer[c, B], 0] += 1.0
    for c in range(rows.counts[CONTACTS]):
        mu = rows.real[c, FRICTION]
        if mu == 0.0:
            continue
        for side in range(2):
            i = rows.integer[c, A + side]
            if bodies.kind[i, MOTION] == FREE and bodies.pressed[i, 0] > 1.0:
                return False
        if mu * abs(rows.real[c, COUPLING]) * rows.real[c, NORMAL_MASS] >= 1.0:
            return False
    return True


@spliced_kernel
def inspect_row(bodies: Bodies, rows: Rows, c: int, options: Options, tally: Array) -> None:
    """Law and limits of one row."""
    pn, pt, mu = rows.real[c, PN], rows.real[c, PT], rows.real[c, FRICTION] if options.friction else 0.0
    un, ut = normal_velocity(bodies.twist, rows, c), 0.0
    mass = rows.real[c, NORMAL_MASS]
    if options.friction:
        ut, mass = tangent_velocity(bodies.twist, rows, c), min(mass, rows.real[c, TANGENT_MASS])
    scale = max(mass * rows.real[c, SPEED], IMPULSE_SHARE * abs(pn))
    tally[NATURAL] = max(tally[NATURAL], row_residual(rows, c, un, ut, options))
    enter_share(tally, CONE, cone_defect((pt, 0.0, pn), (ut, 0.0, un), rows.real[c, TARGET], mu, mass), scale)
    enter_share(tally, PULL, -pn, scale)
    enter_share(tally, EXCESS, abs(pt) - mu * pn, scale)
    extent = min(bodies.real[rows.integer[c, A], EXTENT], bodies.real[rows.integer[c, B], EXTENT])
    enter_share(tally, PENETRATION, -rows.real[c, GAP], extent)


@spliced_kernel
def row_work(bodies: Bodies, rows: Rows, c: int) -> tuple[float, float, float]:
    """Work on the relative motion, work of surfaces that move as prescribed, and the size of both (E62) [J].

    The size is at least what a contact of this mass and speed usually does: where impulses came and went during the
    solve, all work is round-off.
    """
    pn, pt = rows.real[c, PN], rows.real[c, PT]
    usual = rows.real[c, NORMAL_MASS] * rows.real[c, SPEED] ** 2
    normal = 0.5 * pn * (normal_velocity(bodies.twist, rows, c) + normal_velocity(bodies.start, rows, c))
    tangent = 0.5 * pt * (tangent_velocity(bodies.twist, rows, c) + tangent_velocity(bodies.start, rows, c))
    px, py = pn * rows.real[c, NX] - pt * rows.real[c, NY], pn * rows.real[c, NY] + pt * rows.real[c, NX]
    a, b = rows.integer[c, A], rows.integer[c, B]
    by_a, by_b = 0.0, 0.0
    if bodies.kind[a, MOTION] != FREE:
        by_a = surface_power(bodies, a, rows.real[c, ARM_A], rows.real[c, ARM_A + 1], px, py)
    if bodies.kind[b, MOTION] != FREE:
        by_b = -surface_power(bodies, b, rows.real[c, ARM_B], rows.real[c, ARM_B + 1], px, py)
    return normal + tangent, by_a + by_b, usual + abs(normal) + abs(tangent) + abs(by_a) + abs(by_b)


@spliced_kernel
def surface_power(bodies: Bodies, i: int, x: float, y: float, px: float, py: float) -> float:
    """Impulse (px, py) times the velocity of the point of body i at the arm (x, y) [J]."""
    w = bodies.twist[i, 2]
    return px * (bodies.twist[i, 0] - w * y) + py * (bodies.twist[i, 1] + w * x)


@spliced_kernel
def kinetic_change(bodies: Bodies) -> tuple[float, float]:
    """Change of kinetic energy from v* to v+, and what its round-off is a share of: that energy itself [J]."""
    gained, size = 0.0, 0.0
    for i in range(len(bodies.kind)):
        for k in range(3):
            inverse = bodies.real[i, INVERSE_MASS if k < 2 else INVERSE_INERTIA]
            change = bodies.twist[i, k] - bodies.start[i, k]
            if inverse > 0.0 and change != 0.0:
                both = bodies.twist[i, k] + bodies.start[i, k]
                gained += 0.5 * change * both / inverse
                size += 0.5 * (abs(change * both) + 0.25 * both * both) / inverse
    return gained, size


@spliced_kernel
def check_momentum(bodies: Bodies, rows: Rows, options: Options, tally: Array) -> None:
    """Defect of v+ = v* + M^-1 J^T p, linear and angular part of each body by itself (E61); uses up ``start``."""
    for i in range(len(bodies.kind)):
        bodies.pressed[i, 0] = bodies.pressed[i, 1] = 0.0
    for c in range(rows.counts[CONTACTS]):
        pn, pt = rows.real[c, PN], rows.real[c, PT]
        apply_normal(bodies, bodies.start, rows, c, pn)
        if options.friction:
            apply_tangent(bodies, bodies.start, rows, c, pt)
        add_pressure(bodies, rows, c)
    for i in range(len(bodies.kind)):
        for part in range(2):
            defect, speed = 0.0, bodies.pressed[i, part]
            for k in range(2 * part, 2 + part):
                defect = max(defect, abs(bodies.twist[i, k] - bodies.start[i, k]))
                speed = max(speed, abs(bodies.twist[i, k]))
            enter_share(tally, MOMENTUM, defect, speed)
