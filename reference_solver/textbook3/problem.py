"""The contact problem of the next step, built but not solved (E64)."""

from __future__ import annotations

import numpy as np

from reference_solver.compilation import kernel
from reference_solver.step_problem import StepProblem
from reference_solver.textbook.options import Options
from reference_solver.textbook3.manifolds import detect, recall
from reference_solver.textbook3.motion import accelerate
from reference_solver.textbook3.prepare import prepare
from reference_solver.textbook3.state import Bodies, Detection, Manifolds, Memory

#: Rows of a manifold's frame are t1, t2, n; a problem has n first.
NORMAL_FIRST = (2, 0, 1)


@kernel
def pose_problem(bodies: Bodies, detection: Detection, room: Manifolds, memory: Memory, options: Options) -> int:
    """Do all of a step that comes before its solve; return the number of manifolds, -1 if an array is too small."""
    found = detect(bodies, detection, room, options)
    if found < 0:
        return -1
    manifolds = room[:found]
    recall(bodies, detection, manifolds, memory, options)
    prepare(bodies, detection, manifolds, options)
    accelerate(bodies, options.dt)
    return found


def assemble(bodies: Bodies, manifolds: Manifolds) -> StepProblem:
    """Return W = J M^-1 J^T and q = J v* - b of a problem that was posed."""
    places = [(m, p) for m in range(len(manifolds)) for p in range(manifolds.points[m])]
    m, p = (np.array([place[k] for place in places], np.int64) for k in range(2))
    count, n, each = len(places), len(bodies), np.arange(len(places))
    frame = np.asarray(manifolds.frame)[m][:, NORMAL_FIRST]
    jacobian = np.zeros((count, 3, n, 6))
    for bodies_of, arms, sign in (("body_a", "arm_a", -1.0), ("body_b", "arm_b", 1.0)):
        arm = np.asarray(manifolds[arms])[m, p]
        sides = np.concatenate([frame, np.cross(arm[:, None], frame)], axis=2)
        for k in range(3):
            jacobian[each, k, manifolds[bodies_of][m]] += sign * sides[:, k]
    inverse = np.zeros((n, 6, 6))
    inverse[:, :3, :3] = np.eye(3) * bodies.inverse_mass[:, None, None]
    inverse[:, 3:, 3:] = bodies.inverse_inertia
    carried = np.einsum("cknj,nij->ckni", jacobian, inverse).reshape(3 * count, 6 * n)
    rows = jacobian.reshape(3 * count, 6 * n)
    free = rows @ np.asarray(bodies.twist).ravel()
    free[::3] -= manifolds.target[m, p]
    a, b = (np.asarray(manifolds[name])[m] for name in ("body_a", "body_b"))
    return StepProblem(carried @ rows.T, free, np.asarray(manifolds.friction)[m], frame, a, b)
