"""Sweeps over friction cones in space (`exact.cones`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import kernel

#: How sweeps end.
CONVERGED, UNCONVERGED, JAMMED = 0, 1, 2


@kernel
def sweep(yields, free, friction, slips, p):
    """Sweep over contacts until no force changes by 1e-14 of the largest; write p (m d,)."""
    m = len(friction)
    for _ in range(20000):
        change, size = 0.0, 1e-300
        for k in range(m):
            o = 3 * k
            s = slips[k, 0] ** 2 + slips[k, 1] ** 2
            stiff = yields[o, o] - friction[k] * (slips[k, 0] * yields[o, o + 1] + slips[k, 1] * yields[o, o + 2])
            if stiff <= 0.0:
                return JAMMED
            u = free[o]
            for j in range(3 * m):
                u += yields[o, j] * p[j]
            load = max(0.0, p[o] - u / stiff)
            change, size = max(change, abs(load - p[o])), max(size, load)
            p[o] = load
            if s > 0.0:
                p[o + 1], p[o + 2] = -friction[k] * load * slips[k, 0], -friction[k] * load * slips[k, 1]
                continue
            stiff = max(yields[o + 1, o + 1], yields[o + 2, o + 2]) + abs(yields[o + 1, o + 2])
            for _inner in range(3):
                u1, u2 = free[o + 1], free[o + 2]
                for j in range(3 * m):
                    u1 += yields[o + 1, j] * p[j]
                    u2 += yields[o + 2, j] * p[j]
                p1, p2 = p[o + 1] - u1 / stiff, p[o + 2] - u2 / stiff
                most = np.sqrt(p1 * p1 + p2 * p2)
                if most > friction[k] * load:
                    p1, p2 = p1 * friction[k] * load / most, p2 * friction[k] * load / most
                change = max(change, abs(p1 - p[o + 1]), abs(p2 - p[o + 2]))
                p[o + 1], p[o + 2] = p1, p2
        if change <= 1e-14 * size:
            return CONVERGED
    return UNCONVERGED
