"""Velocities at contact points, what loads do to them, and what an impulse does to two bodies."""

from __future__ import annotations

import math

from reference_solver.compilation import spliced_kernel
from reference_solver.model import Array
from reference_solver.textbook2.columns import (
    AN,
    ARM_A,
    AT,
    BN,
    BT,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    NORMAL_MASS,
    NX,
    NY,
    PN,
    PT,
    SPEED,
    A,
    B,
)
from reference_solver.textbook2.state import Bodies, Rows


@spliced_kernel
def normal_velocity(twist: Array, rows: Rows, c: int) -> float:
    """u_n of row c (E2) [m/s]; ``twist`` may hold velocities or pseudo-velocities."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    along = rows.real[c, NX] * (twist[b, 0] - twist[a, 0]) + rows.real[c, NY] * (twist[b, 1] - twist[a, 1])
    return along + rows.real[c, BN] * twist[b, 2] - rows.real[c, AN] * twist[a, 2]


@spliced_kernel
def tangent_velocity(twist: Array, rows: Rows, c: int) -> float:
    """u_t of row c (E2) [m/s]."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    along = rows.real[c, NX] * (twist[b, 1] - twist[a, 1]) - rows.real[c, NY] * (twist[b, 0] - twist[a, 0])
    return along + rows.real[c, BT] * twist[b, 2] - rows.real[c, AT] * twist[a, 2]


@spliced_kernel
def apply_normal(bodies: Bodies, twist: Array, rows: Rows, c: int, p: float) -> None:
    """Add normal impulse p of row c to B and its opposite to A (E4)."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    px, py = p * rows.real[c, NX], p * rows.real[c, NY]
    twist[a, 0] -= bodies.real[a, INVERSE_MASS] * px
    twist[a, 1] -= bodies.real[a, INVERSE_MASS] * py
    twist[a, 2] -= bodies.real[a, INVERSE_INERTIA] * (rows.real[c, AN] * p)
    twist[b, 0] += bodies.real[b, INVERSE_MASS] * px
    twist[b, 1] += bodies.real[b, INVERSE_MASS] * py
    twist[b, 2] += bodies.real[b, INVERSE_INERTIA] * (rows.real[c, BN] * p)


@spliced_kernel
def apply_tangent(bodies: Bodies, twist: Array, rows: Rows, c: int, p: float) -> None:
    """Add tangential impulse p of row c to B and its opposite to A (E4)."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    px, py = -p * rows.real[c, NY], p * rows.real[c, NX]
    twist[a, 0] -= bodies.real[a, INVERSE_MASS] * px
    twist[a, 1] -= bodies.real[a, INVERSE_MASS] * py
    twist[a, 2] -= bodies.real[a, INVERSE_INERTIA] * (rows.real[c, AT] * p)
    twist[b, 0] += bodies.real[b, INVERSE_MASS] * px
    twist[b, 1] += bodies.real[b, INVERSE_MASS] * py
    twist[b, 2] += bodies.real[b, INVERSE_INERTIA] * (rows.real[c, BT] * p)


@spliced_kernel
def speed_at(bodies: Bodies, i: int, x: float, y: float) -> float:
    """Size of the velocities that the speed of a point of body i at arm (x, y) is the sum of [m/s].

    At the foot of a rolling disc they cancel; their round-off does not.
    """
    vx, vy, w = bodies.twist[i, 0], bodies.twist[i, 1], bodies.twist[i, 2]
    return math.sqrt(vx * vx + vy * vy) + abs(w) * math.sqrt(x * x + y * y)


@spliced_kernel
def load_speed(bodies: Bodies, rows: Rows, c: int, dt: float) -> float:
    """Largest relative speed that the loads can give the two points of row c within dt [m/s]."""
    speed = 0.0
    for side in range(2):
        i, arm = rows.integer[c, A if side == 0 else B], ARM_A + 2 * side
        ax = bodies.real[i, LOAD] - bodies.real[i, LOAD + 2] * rows.real[c, arm + 1]
        ay = bodies.real[i, LOAD + 1] + bodies.real[i, LOAD + 2] * rows.real[c, arm]
        speed += math.sqrt(ax * ax + ay * ay)
    return dt * speed


@spliced_kernel
def add_pressure(bodies: Bodies, rows: Rows, c: int) -> None:
    """Add what the impulses of row c, or its usual ones, can at most do to the velocities of its bodies.

    Its usual ones: of impulses that came and went during a solve the round-off stays.
    """
    size = abs(rows.real[c, PN]) + abs(rows.real[c, PT]) + rows.real[c, NORMAL_MASS] * rows.real[c, SPEED]
    for side in range(2):
        i = rows.integer[c, A if side == 0 else B]
        lever = max(abs(rows.real[c, ARM_A + 2 * side]), abs(rows.real[c, ARM_A + 2 * side + 1]))
        bodies.pressed[i, 0] += bodies.real[i, INVERSE_MASS] * size
        bodies.pressed[i, 1] += bodies.real[i, INVERSE_INERTIA] * size * lever
