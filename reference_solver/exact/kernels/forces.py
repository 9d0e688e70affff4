"""Forces of contacts whose modes are held, group by group (`exact.forces`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import kernel

OPEN, STICK, SLIP = 0, 1, 2
#: Whether rows of a group are redundant.
UNKNOWN, SINGLE, SHARED = -1, 0, 1


@kernel
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
        Contacts in the order of their groups, where each group begins, and whether its rows are redundant, which is
        found out once.
    """
    modes, directions, friction, near, weight = held
    order, begin, shared = groups
    d = rows.row.shape[1]
    push = np.empty(rows.yields.shape)
    write_push(modes, directions, friction, rows.yields, push)
    for g in range(len(begin) - 1):
        count = 0
        for a in range(begin[g], begin[g + 1]):
            count += 1 if modes[order[a]] == SLIP else d
        matrix, wanted, names = np.empty((count, count)), np.zeros(count), np.empty((count, 2), np.int64)
        i, size = 0, 0.0
        for a in range(begin[g], begin[g + 1]):
            c = order[a]
            for r in range(d):
                does = rows.rate[c, r]
                for x in range(2):
                    does += np.dot(rows.row[c, r, x], free[features[c, x]])
                size = max(size, abs(does))
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
                            matrix[i, j] += np.dot(rows.row[c, r, x], push[e, t, y])
        if shared[g] == UNKNOWN:
            values = np.linalg.svd(matrix)[1]
            shared[g] = SHARED if values[-1] < 1e-9 * values[0] else SINGLE
        if shared[g] == SHARED:
            start, scale = np.empty(count), np.empty(count)
            for i in range(count):
                start[i], scale[i] = near[names[i, 0], names[i, 1]], weight[names[i, 0], names[i, 1]]
            found = start.copy()
            for _ in range(3):  # each round leaves of the last one's remainder what round-off does
                rest = wanted - np.dot(matrix, found)
                if np.abs(rest).max() <= 1e-15 * np.abs(wanted).max():
                    break
                found += scale * np.linalg.lstsq(matrix * scale, rest, 1e-11)[0]
            if np.abs(np.dot(matrix, found) - wanted).max() > 1e-9 * size:
                found = start
        else:
            found = np.linalg.solve(matrix, wanted)
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
