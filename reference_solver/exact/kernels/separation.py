"""A bound of the least gap of all bodies (`exact.checks`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import kernel


@kernel
def least_separation(bodies, place, axes, point, normal, pair):
    """Return a bound of the least gap of all pairs of bodies [m], and write the pair.

    Along normals of faces and of the nearest points. In space lines are apart along other directions as well: bodies
    that have some are looked at over half-spaces only.
    """
    n, d = place.shape
    least = 1e300
    for a in range(n):
        for b in range(a + 1, n):
            if bodies.free[a] == 0 and bodies.free[b] == 0:
                continue
            r, apart = bodies.radius[a] + bodies.radius[b], 0.0
            for p in range(d):
                apart += (place[a, p] - place[b, p]) ** 2
            if d == 3 and bodies.points[a] * bodies.points[b] > 1:
                continue
            if np.sqrt(apart) - bodies.reach[a] - bodies.reach[b] - r > 0.0:
                continue
            gap = -1e300
            for turn in range(2):
                o, w = (a, b) if turn == 0 else (b, a)
                for f in range(bodies.faces[o] if bodies.points[w] > 0 else 0):
                    low = 1e300
                    for k in range(bodies.points[w]):
                        s = -bodies.offset[o, f]
                        for p in range(d):
                            s += normal[o, f, p] * (point[w, k, p] - place[o, p])
                        low = min(low, s)
                    gap = max(gap, low - r)
            if bodies.points[a] > 0 and bodies.points[b] > 0:
                near, first, last = 1e300, 0, 0
                for i in range(bodies.points[a]):
                    for j in range(bodies.points[b]):
                        s = 0.0
                        for p in range(d):
                            s += (point[b, j, p] - point[a, i, p]) ** 2
                        if s < near:
                            near, first, last = s, i, j
                if near > 0.0:
                    high, low = -1e300, 1e300
                    for i in range(bodies.points[a]):
                        s = 0.0
                        for p in range(d):
                            s += (point[b, last, p] - point[a, first, p]) * point[a, i, p]
                        high = max(high, s)
                    for j in range(bodies.points[b]):
                        s = 0.0
                        for p in range(d):
                            s += (point[b, last, p] - point[a, first, p]) * point[b, j, p]
                        low = min(low, s)
                    gap = max(gap, (low - high) / np.sqrt(near) - r)
            if gap < least:
                least = gap
                pair[0], pair[1] = a, b
    return least
