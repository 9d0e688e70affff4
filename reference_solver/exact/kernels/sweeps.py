"""Sweeps over contacts, slow and sure, for what Newton's method does not find (`exact.cones`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import kernel
from reference_solver.exact.kernels.rotation import dot

#: Share of the largest force by which one changes in a last sweep.
SETTLED = 1e-13


@kernel
def sweep(matrix, free, friction, most):
    """Return forces p (m, 3) of contacts that part or are held and stick or slip, and whether sweeps settled.

    Contact by contact a load takes off what approaches, and friction what slips as far as its cone allows: where
    nothing changes any more, each obeys Coulomb's law.

    Parameters
    ----------
    matrix, free
        (3 m, 3 m) and (3 m,): what contacts do is ``matrix @ p + free``, the normal first.
    friction
        (m,).
    most
        Sweeps.
    """
    m = len(friction)
    p, contacts = np.zeros((m, 3)), 3 * np.arange(m)
    flat = p.reshape(3 * m)
    for _ in range(most):
        change, size = 0.0, 0.0
        for c in range(m):
            n = contacts[c]
            load = max(0.0, p[c, 0] - (dot(matrix[n], flat) + free[n]) / matrix[n, n])
            change = max(change, abs(load - p[c, 0]))
            p[c, 0] = load
            if friction[c] > 0.0:
                yields = max(matrix[n + 1, n + 1], matrix[n + 2, n + 2]) + abs(matrix[n + 1, n + 2])
                x = p[c, 1] - (dot(matrix[n + 1], flat) + free[n + 1]) / yields
                y = p[c, 2] - (dot(matrix[n + 2], flat) + free[n + 2]) / yields
                rubs = np.sqrt(x * x + y * y)
                if rubs > friction[c] * load:
                    x, y = x * friction[c] * load / rubs, y * friction[c] * load / rubs
                change = max(change, abs(x - p[c, 1]), abs(y - p[c, 2]))
                p[c, 1], p[c, 2] = x, y
            size = max(size, load)
        if change <= SETTLED * size:
            return p, True
    return p, False
