"""The contact problem of the next step, built but not solved (E64)."""

from __future__ import annotations

import numpy as np

from reference_solver.compilation import kernel
from reference_solver.step_problem import StepProblem
from reference_solver.textbook.options import Options
from reference_solver.textbook2.columns import (
    AN,
    AT,
    BN,
    BT,
    FRICTION,
    INVERSE_INERTIA,
    INVERSE_MASS,
    NX,
    NY,
    TARGET,
    A,
    B,
)
from reference_solver.textbook2.manifolds import detect
from reference_solver.textbook2.rows import prepare
from reference_solver.textbook2.state import CONTACTS, Bodies, Pairs, Rows
from reference_solver.textbook2.step import accelerate


@kernel
def pose_problem(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options) -> bool:
    """Do all of a step that comes before its solve; False if an array is too small."""
    if not detect(bodies, pairs, rows, options):
        return False
    prepare(bodies, pairs, rows, options)
    accelerate(bodies, options)
    return True


def assemble(bodies: Bodies, rows: Rows, options: Options) -> StepProblem:
    """Return W = J M^-1 J^T and q = J v* - b of a problem that was posed."""
    count = int(rows.counts[CONTACTS])
    real, a, b = rows.real[:count], rows.integer[:count, A], rows.integer[:count, B]
    n = len(bodies.pose)
    normal = np.stack([real[:, NX], real[:, NY]], axis=1)
    frame = np.stack([normal, np.stack([-normal[:, 1], normal[:, 0]], axis=1)], axis=1)
    jacobian = np.zeros((count, 2, n, 3))
    each = np.arange(count)
    for k, (at_a, at_b) in enumerate(((AN, BN), (AT, BT))):
        jacobian[each, k, a] -= np.column_stack([frame[:, k], real[:, at_a]])
        jacobian[each, k, b] += np.column_stack([frame[:, k], real[:, at_b]])
    rows_of = jacobian.reshape(2 * count, 3 * n)
    inverse = bodies.real[:, [INVERSE_MASS, INVERSE_MASS, INVERSE_INERTIA]].ravel()
    free = rows_of @ bodies.twist.ravel()
    free[::2] -= real[:, TARGET]
    friction = real[:, FRICTION].copy() if options.friction else np.zeros(count)
    return StepProblem((rows_of * inverse) @ rows_of.T, free, friction, frame, a.copy(), b.copy())
