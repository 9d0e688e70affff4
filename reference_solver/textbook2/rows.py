"""From geometry to rows: levers, effective masses, targets, and the scale of the residual."""

from __future__ import annotations

import math

from reference_solver.compilation import spliced_kernel
from reference_solver.coulomb import into_interval
from reference_solver.textbook.noise import COORDINATE_NOISE, ROUND_OFF, SPEED_SHARE, STILL
from reference_solver.textbook.options import BAUMGARTE, Options
from reference_solver.textbook2.columns import (
    AN,
    APPROACH,
    ARM_A,
    ARM_B,
    AT,
    BN,
    BT,
    COUPLING,
    EXTENT,
    FRICTION,
    GAP,
    IMPACT,
    INVERSE_INERTIA,
    INVERSE_MASS,
    NORMAL_MASS,
    NX,
    NY,
    PN,
    POINT,
    PT,
    SPEED,
    TANGENT_MASS,
    TARGET,
    A,
    B,
)
from reference_solver.textbook2.kinematics import (
    apply_normal,
    apply_tangent,
    load_speed,
    normal_velocity,
    speed_at,
    tangent_velocity,
)
from reference_solver.textbook2.state import CONTACTS, Bodies, Pairs, Rows


@spliced_kernel
def prepare(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> None:
    """Fill all rows from the poses and velocities at the start of the step, before forces act."""
    for c in range(rows.counts[CONTACTS]):
        prepare_masses(bodies, rows, c)
        a, b = rows.integer[c, A], rows.integer[c, B]
        for k in range(2):
            rows.real[c, POINT + k] = bodies.pose[a, k] + rows.real[c, ARM_A + k]
        rows.real[c, FRICTION] = pairs.friction[a, b]
        rows.real[c, APPROACH] = normal_velocity(bodies.twist, rows, c)
        set_target(bodies, pairs, rows, c, options)
        set_speed(bodies, rows, c, options)


@spliced_kernel
def prepare_masses(bodies: Bodies, rows: Rows, c: int) -> None:
    """Levers (E2) and effective masses (E3)."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    nx, ny = rows.real[c, NX], rows.real[c, NY]
    an = rows.real[c, ARM_A] * ny - rows.real[c, ARM_A + 1] * nx
    bn = rows.real[c, ARM_B] * ny - rows.real[c, ARM_B + 1] * nx
    at = rows.real[c, ARM_A] * nx + rows.real[c, ARM_A + 1] * ny
    bt = rows.real[c, ARM_B] * nx + rows.real[c, ARM_B + 1] * ny
    rows.real[c, AN], rows.real[c, BN], rows.real[c, AT], rows.real[c, BT] = an, bn, at, bt
    mass = bodies.real[a, INVERSE_MASS] + bodies.real[b, INVERSE_MASS]
    ia, ib = bodies.real[a, INVERSE_INERTIA], bodies.real[b, INVERSE_INERTIA]
    rows.real[c, NORMAL_MASS] = 1.0 / (mass + ia * (an * an) + ib * (bn * bn))
    rows.real[c, TANGENT_MASS] = 1.0 / (mass + ia * (at * at) + ib * (bt * bt))
    rows.real[c, COUPLING] = ia * (an * at) + ib * (bn * bt)


@spliced_kernel
def set_target(bodies: Bodies, pairs: Pairs, rows: Rows, c: int, options: Options) -> None:
    """Normal velocity b_n to reach (E7, E8, E15).

    A gap may be closed within the step, down to the slop, not more; an overlap asks for nothing. A gap within
    round-off counts as touching: divided by dt it would be noise that the solver had to answer in every step.
    """
    a, b = rows.integer[c, A], rows.integer[c, B]
    u, gap = rows.real[c, APPROACH], rows.real[c, GAP]
    place = max(abs(rows.real[c, POINT]), abs(rows.real[c, POINT + 1]))
    noise = ROUND_OFF * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT]) + COORDINATE_NOISE * place
    target = -(gap - options.slop) / options.dt if gap > options.slop + noise else 0.0
    if options.correction == BAUMGARTE:
        target = max(target, options.beta * (-gap - options.slop) / options.dt)
    if options.restitution:
        rebound = -pairs.restitution[a, b] * u
        if u < 0.0 and rebound > 0.0:
            target = max(rebound, target)
    rows.real[c, TARGET] = target


@spliced_kernel
def set_speed(bodies: Bodies, rows: Rows, c: int, options: Options) -> None:
    """Speed that the residual is measured against (E14), and which impulses may be warm started.

    A contact whose bodies part or meet faster than the loads of one step explain is an impact: the impulse of the
    step before does not guess this step's, nor this one the next (E9).
    """
    a, b = rows.integer[c, A], rows.integer[c, B]
    by_loads = load_speed(bodies, rows, c, options.dt)
    if options.certified:
        approach, slip = rows.real[c, APPROACH], tangent_velocity(bodies.twist, rows, c)
        meeting = math.sqrt(approach * approach + slip * slip)
        moving = speed_at(bodies, a, rows.real[c, ARM_A], rows.real[c, ARM_A + 1])
        moving += speed_at(bodies, b, rows.real[c, ARM_B], rows.real[c, ARM_B + 1])
        # Bodies stand still to each other below this: loads elsewhere leave as much where none act.
        still = STILL * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT]) / options.dt
        rows.real[c, SPEED] = max(max(meeting, by_loads), max(SPEED_SHARE * moving, still))
    approach = rows.real[c, APPROACH]
    rows.integer[c, IMPACT] = 1 if abs(approach) > by_loads else 0
    if approach > by_loads:
        rows.real[c, PN] = rows.real[c, PT] = 0.0


@spliced_kernel
def warm_start(bodies: Bodies, rows: Rows, options: Options) -> None:
    """Apply the remembered impulses, the tangential ones inside the cone of the row's friction (E9)."""
    for c in range(rows.counts[CONTACTS]):
        apply_normal(bodies, bodies.twist, rows, c, rows.real[c, PN])
        # Where nothing rubs, what a turning normal left of an impulse along the old one is none.
        bound = rows.real[c, FRICTION] * rows.real[c, PN] if options.friction else 0.0
        rows.real[c, PT] = into_interval(rows.real[c, PT], bound)
        if options.friction:
            apply_tangent(bodies, bodies.twist, rows, c, rows.real[c, PT])
