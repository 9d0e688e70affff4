"""Force phases at impulse level: one solve for the mean velocity, with rows at mid-drift (E28).

    q_m = q0 + (h/2) v0,   v = v0 + (h/2) M^-1 f + M^-1 J(q_m)^T p,   v1 = 2 v - v0,   q1 = q0 + h v

Gaps at the end are those of the start and h J(q_m) v but for the third order: what may close, closes at the end. What
v1 misses of held contacts there is of second order, and `settle` takes it out: the mid-point rule with a projection, of
second order. For bodies that jam, and where no phase of fifth order is found.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.planar.block import prepare_blocks
from reference_solver.planar.certificate import row_work
from reference_solver.planar.columns import (
    APPROACH,
    ARM_A,
    ARM_B,
    COS,
    EXTENT,
    FORCE_N,
    FORCE_T,
    FRICTION,
    GAP,
    IMPACT_N,
    IMPACT_T,
    MOTION,
    NORMAL_MASS,
    NX,
    NY,
    OTHER,
    PN,
    PT,
    REACH,
    SIN,
    SPEED,
    TARGET,
    A,
    B,
)
from reference_solver.planar.flight import keep_start, put_back
from reference_solver.planar.impact import gap_noise
from reference_solver.planar.kinematics import apply_normal, apply_tangent, tangent_velocity
from reference_solver.planar.lasting import displace, evaluate, hold
from reference_solver.planar.residual import natural_map
from reference_solver.planar.rows import measure_speed, prepare_masses
from reference_solver.planar.state import CONTACTS, FREE, Bodies, Rows, SubStep
from reference_solver.stepping.iteration import sweep
from reference_solver.stepping.lasting import CONTACTS as HELD_CONTACTS
from reference_solver.stepping.lasting import Lasting
from reference_solver.stepping.midpoint import CLOSED, CLOSING_SWEEPS, FAR_ABOVE, GAP_SHARE, LEFT_OVER, LEVERAGE
from reference_solver.stepping.noise import NOISE
from reference_solver.stepping.options import Options
from reference_solver.stepping.sweeps import CHECK_INTERVAL
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTACT_WORK, SURFACE_WORK


@inner_kernel
def turn_rows(bodies: Bodies, rows: Rows, sub: SubStep, options: Options, length: float) -> None:
    """Give all rows the normals and levers that their features have at mid-drift of ``length``; bodies stay.

    Those of the start are kept: `exchange_levers` brings them back.
    """
    lasting, first = sub.lasting, 0
    keep_levers(rows)
    keep_start(bodies, sub)
    while first < rows.counts[CONTACTS]:
        count = min(len(lasting.row), rows.counts[CONTACTS] - first)
        for k in range(count):
            hold(bodies, rows, lasting, first + k, k)
        lasting.size[HELD_CONTACTS] = count
        drift(bodies, sub, lasting, 0.5 * length)
        evaluate(bodies, lasting)
        for k in range(count):
            take_levers(rows, lasting, first + k, k)
        for i in range(len(bodies.kind)):
            put_back(bodies, sub, i)
        first += count
    for c in range(rows.counts[CONTACTS]):
        prepare_masses(bodies, rows, c)
    prepare_blocks(bodies, rows)


@inner_kernel
def keep_levers(rows: Rows) -> None:
    """Keep normals and levers of all rows."""
    for c in range(rows.counts[CONTACTS]):
        for k in range(2):
            rows.real[c, OTHER + k] = rows.real[c, NX + k]
        for k in range(4):
            rows.real[c, OTHER + 2 + k] = rows.real[c, ARM_A + k]


@inner_kernel
def exchange_levers(rows: Rows) -> None:
    """Exchange normals and levers of all rows for those kept."""
    for c in range(rows.counts[CONTACTS]):
        for k in range(6):
            own = NX + k if k < 2 else ARM_A + k - 2
            rows.real[c, own], rows.real[c, OTHER + k] = rows.real[c, OTHER + k], rows.real[c, own]


@inner_kernel
def levers_of_start(bodies: Bodies, rows: Rows, options: Options) -> None:
    """Bring back what all rows were before `turn_rows`."""
    exchange_levers(rows)
    for c in range(rows.counts[CONTACTS]):
        prepare_masses(bodies, rows, c)
    prepare_blocks(bodies, rows)


@inner_kernel
def drift(bodies: Bodies, sub: SubStep, lasting: Lasting, time: float) -> None:
    """Put all bodies where the velocities of the start take them in ``time``."""
    for i in range(len(bodies.kind)):
        for d in range(3):
            lasting.base[i, d] = sub.pose[i, d]
            lasting.displacement[i, d] = time * sub.start[i, d]
        displace(bodies, lasting, i)


@inner_kernel
def take_levers(rows: Rows, lasting: Lasting, c: int, k: int) -> None:
    """Normal and levers of row c from the Jacobian of noted contact k: with a = x n + y t, a x n = -y and a x t = x."""
    nx, ny = lasting.frame[k, 0, 0], lasting.frame[k, 0, 1]
    rows.real[c, NX], rows.real[c, NY] = nx, ny
    for side in range(2):
        sign, arm = 2.0 * side - 1.0, ARM_A if side == 0 else ARM_B
        y, x = -sign * lasting.jacobian[k, side, 0, 2], sign * lasting.jacobian[k, side, 1, 2]
        rows.real[c, arm], rows.real[c, arm + 1] = x * nx - y * ny, x * ny + y * nx


@inner_kernel
def reach_end(bodies: Bodies, rows: Rows, sub: SubStep) -> None:
    """From mean velocities and half the impulses to those of the end, and to all of them."""
    for i in range(len(bodies.kind)):
        for d in range(3):
            bodies.twist[i, d] += bodies.twist[i, d] - sub.start[i, d]
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN], rows.real[c, PT] = 2.0 * rows.real[c, PN], 2.0 * rows.real[c, PT]


@inner_kernel
def misses_end(bodies: Bodies, rows: Rows, options: Options, time: float) -> bool:
    """Whether velocities are not those that contacts held over ``time`` allow at its end; gives rows their impulses."""
    misses = False
    for c in range(rows.counts[CONTACTS]):
        measure_speed(bodies, rows, c, options.dt)
        pn, pt = time * rows.real[c, FORCE_N], time * rows.real[c, FORCE_T]
        noise = NOISE * rows.real[c, SPEED]
        misses = misses or abs(rows.real[c, APPROACH]) > noise
        if options.friction and abs(pt) < rows.real[c, FRICTION] * pn:
            misses = misses or abs(tangent_velocity(bodies.twist, rows, c)) > noise
        rows.real[c, PN], rows.real[c, PT] = pn, pt
        rows.real[c, TARGET] = rows.real[c, IMPACT_N] = rows.real[c, IMPACT_T] = 0.0
    return misses


@inner_kernel
def closable(bodies: Bodies, rows: Rows, c: int) -> float:
    """What of the gap of row c is closed at a time [m]."""
    most = LEFT_OVER * min(bodies.real[rows.integer[c, A], REACH], bodies.real[rows.integer[c, B], REACH])
    return min(max(rows.real[c, GAP], -most), most)


@inner_kernel
def deepest(bodies: Bodies, rows: Rows) -> float:
    """Largest overlap of all rows, as a share of the smaller half width."""
    worst = 0.0
    for c in range(rows.counts[CONTACTS]):
        extent = min(bodies.real[rows.integer[c, A], EXTENT], bodies.real[rows.integer[c, B], EXTENT])
        worst = max(worst, -rows.real[c, GAP] / extent)
    return worst


@inner_kernel
def close_gaps(bodies: Bodies, rows: Rows, sub: SubStep, options: Options) -> bool:
    """Move bodies until the gaps of all rows are closed, by M^-1 J^T; whether rows are not what they were.

    Sweeps for displacements, whose impulses are counted from far above zero: contacts push and pull. Of gaps and
    overlaps that are wider than what the scheme leaves that much is closed at a time; where they contradict each other
    bodies stay.
    """
    widest = 0.0
    for c in range(rows.counts[CONTACTS]):
        if abs(rows.real[c, GAP]) > GAP_SHARE * gap_noise(bodies, rows, c):
            widest = max(widest, abs(closable(bodies, rows, c)))
    if widest == 0.0:
        return False
    copy_vectors(bodies.twist, sub.after)
    for i in range(len(bodies.kind)):
        for d in range(3):
            bodies.twist[i, d] = 0.0
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN], rows.real[c, PT] = FAR_ABOVE * widest * rows.real[c, NORMAL_MASS], 0.0
        rows.real[c, TARGET], rows.real[c, SPEED] = -closable(bodies, rows, c), widest
        rows.real[c, FRICTION] = 0.0
    for k in range(CLOSING_SWEEPS):
        sweep(bodies, rows, options, 1.0, 0, 0)
        if k % CHECK_INTERVAL == 0 and natural_map(bodies, rows, options) <= CLOSED:
            break
    farthest = 0.0
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FREE:
            way = abs(bodies.twist[i, 0]) + abs(bodies.twist[i, 1]) + bodies.real[i, REACH] * abs(bodies.twist[i, 2])
            farthest = max(farthest, way)
    if not farthest <= LEVERAGE * widest:
        copy_vectors(sub.after, bodies.twist)
        return True
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FREE:
            for d in range(3):
                bodies.pose[i, d] += bodies.twist[i, d]
            bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])
    copy_vectors(sub.after, bodies.twist)
    return True


@inner_kernel
def take_back(bodies: Bodies, rows: Rows, options: Options, tally: Array) -> None:
    """Velocities without the impulses of the rows, so that a solve may find other ones; their work in the tally."""
    copy_vectors(bodies.twist, bodies.start)
    for c in range(rows.counts[CONTACTS]):
        apply_normal(bodies, bodies.twist, rows, c, -rows.real[c, PN])
        if options.friction:
            apply_tangent(bodies, bodies.twist, rows, c, -rows.real[c, PT])
    for c in range(rows.counts[CONTACTS]):
        done, moved, _ = row_work(bodies, rows, c)
        tally[CONTACT_WORK], tally[SURFACE_WORK] = tally[CONTACT_WORK] - done, tally[SURFACE_WORK] - moved


@inner_kernel
def keep_change(rows: Rows, time: float) -> None:
    """Enter impulses less those that were there before as those of an impact."""
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, IMPACT_N] = rows.real[c, PN] - time * rows.real[c, FORCE_N]
        rows.real[c, IMPACT_T] = rows.real[c, PT] - time * rows.real[c, FORCE_T]
        rows.real[c, PN] = rows.real[c, PT] = 0.0
