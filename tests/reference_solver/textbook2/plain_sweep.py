"""The plain sweep of sequential impulses, to be read; `sequential_impulses.sweep_rows` does it in fewer operations.

For each row in turn: relative velocity, impulse, clamp, apply (E10, E11). ``row`` is a line of `Rows.real`, whose
columns are those of `columns`.
"""

import numpy as np

from reference_solver.textbook2.columns import (
    AN,
    AT,
    BN,
    BT,
    FRICTION,
    INVERSE_INERTIA,
    INVERSE_MASS,
    NORMAL_MASS,
    NX,
    NY,
    PN,
    PT,
    TANGENT_MASS,
    TARGET,
    A,
    B,
)
from reference_solver.textbook2.state import MANIFOLDS


def plain_sweep(bodies, rows, backwards):
    """One sweep; ``backwards``: the second point of two comes first."""
    for m in range(rows.counts[MANIFOLDS]):
        points = range(rows.manifold[m], rows.manifold[m + 1])
        for c in reversed(points) if backwards else points:
            row, a, b = rows.real[c], *rows.integer[c, [A, B]]
            normal = np.array([row[NX], row[NY]])
            tangent = np.array([-row[NY], row[NX]])

            u = relative_velocity(bodies, a, b, normal, row[AN], row[BN])
            impulse = row[PN] - (u - row[TARGET]) * row[NORMAL_MASS]
            impulse = max(impulse, 0.0)  # of all sweeps: nothing pulls
            apply(bodies, a, b, normal, row[AN], row[BN], impulse - row[PN])
            row[PN] = impulse

            u = relative_velocity(bodies, a, b, tangent, row[AT], row[BT])
            impulse = row[PT] - u * row[TANGENT_MASS]
            most = row[FRICTION] * row[PN]  # Coulomb
            impulse = min(max(impulse, -most), most)
            apply(bodies, a, b, tangent, row[AT], row[BT], impulse - row[PT])
            row[PT] = impulse


def relative_velocity(bodies, a, b, direction, arm_a, arm_b):
    """Velocity of B less that of A at the contact (E2) [m/s]."""
    va, vb = bodies.twist[a], bodies.twist[b]
    return direction @ (vb[:2] - va[:2]) + arm_b * vb[2] - arm_a * va[2]


def apply(bodies, a, b, direction, arm_a, arm_b, impulse):
    """Add an impulse [N s] to B and its opposite to A (E4)."""
    for i, arm, sign in ((a, arm_a, -1.0), (b, arm_b, 1.0)):
        inverse_mass, inverse_inertia = bodies.real[i, [INVERSE_MASS, INVERSE_INERTIA]]
        bodies.twist[i, :2] += sign * impulse * inverse_mass * direction
        bodies.twist[i, 2] += sign * impulse * inverse_inertia * arm
