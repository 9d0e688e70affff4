"""Forces of contacts whose modes are held, group by group (`exact.forces`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import inner_kernel, kernel
from reference_solver.exact.kernels.rotation import dot

OPEN, STICK, SLIP = 0, 1, 2
#: What is left of a row, as a share of it, that others say all of.
REDUNDANT = 1e-10


@kernel
def solve_near(matrix, wanted, start, scale):
    """Return x with ``matrix @ x = wanted`` whose change from ``start``, over ``scale``, is the least.

    Rows are made orthogonal, the one that those before say least of first (Gram and Schmidt); what they say all of is
    left out: where a trial of a step is off, redundant rows contradict each other by the square of that. Each round
    leaves of the last one's remainder what round-off does.
    """
    m, n = matrix.shape
    rows, size, left, ones = matrix * scale, np.empty(m), np.ones(m), np.ones(n)
    for i in range(m):
        size[i] = max(np.sqrt(dot(rows[i], rows[i])), 1e-300)
        rows[i] /= size[i]
    basis, lower, chosen = np.empty((m, n)), np.empty((m, m)), np.empty(m, np.int64)
    rank = 0
    while rank < m:
        best = np.argmax(left)
        if left[best] < REDUNDANT**2:
            break
        basis[rank] = rows[best] / np.sqrt(left[best])
        chosen[rank] = best
        lower[:, rank] = np.dot(rows, basis[rank])
        for i in range(m):
            rows[i] -= lower[i, rank] * basis[rank]
        rows[best] = 0.0
        left = np.dot(rows * rows, ones)
        rank += 1
    x, along = start.copy(), np.empty(m)
    for _ in range(3):
        remainder = wanted - np.dot(matrix, x)
        if np.abs(remainder).max() <= 1e-15 * np.abs(wanted).max():
            break
        for k in range(rank):
            i = chosen[k]
            along[k] = (remainder[i] / size[i] - dot(lower[i, :k], along[:k])) / lower[i, k]
            for j in range(n):
                x[j] += scale[j] * along[k] * basis[k, j]
    return x


@inner_kernel
def write_push(modes, directions, friction, yields, push):
    """Write how forces move bodies (m, d, 2, q): along the frame, but the load of a slip together with its friction."""
    push[:] = yields
    for c in range(len(modes)):
        if modes[c] == SLIP:
            for r in range(1, yields.shape[1]):
                push[c, 0] -= friction[c] * directions[c, r - 1] * yields[c, r]


@kernel
def solve_groups(features, held, rows, free, groups, forces, acceleration):
    """Write forces (m, d) of closed contacts and accelerations (n, q) of bodies under them and ``free`` (n, q).

    Parameters
    ----------
    held
        Modes, directions of slips, friction; forces (m, d) that those of redundant rows are nearest to, and how changes
        of them are weighed.
    groups
        Contacts in the order of their groups, and where each group begins.
    """
    modes, directions, friction, near, weight = held
    order, begin = groups
    d = rows.row.shape[1]
    push = np.empty(rows.yields.shape)
    write_push(modes, directions, friction, rows.yields, push)
    for g in range(len(begin) - 1):
        count = 0
        for a in range(begin[g], begin[g + 1]):
            count += 1 if modes[order[a]] == SLIP else d
        matrix, wanted, names = np.empty((count, count)), np.zeros(count), np.empty((count, 2), np.int64)
        i = 0
        for a in range(begin[g], begin[g + 1]):
            c = order[a]
            for r in range(d):
                does = rows.rate[c, r]
                for x in range(2):
                    does += dot(rows.row[c, r, x], free[features[c, x]])
                if r == 0 or modes[c] != SLIP:
                    names[i, 0], names[i, 1], wanted[i] = c, r, -does
                    i += 1
        for i in range(count):
            c, r = names[i]
            for j in range(count):
                e, t = names[j]
                matrix[i, j] = 0.0
                for x in range(2):
                    for y in range(2):
                        if features[c, x] == features[e, y]:
                            matrix[i, j] += dot(rows.row[c, r, x], push[e, t, y])
        start, scale = np.empty(count), np.empty(count)
        for i in range(count):
            start[i], scale[i] = near[names[i, 0], names[i, 1]], weight[names[i, 0], names[i, 1]]
        found = solve_near(matrix, wanted, start, scale)
        for i in range(count):
            forces[names[i, 0], names[i, 1]] = found[i]
    acceleration[:] = free
    for c in range(len(modes)):
        if modes[c] == SLIP:
            for r in range(1, d):
                forces[c, r] = -friction[c] * forces[c, 0] * directions[c, r - 1]
        for r in range(d):
            for x in range(2):
                acceleration[features[c, x]] += forces[c, r] * rows.yields[c, r, x]
