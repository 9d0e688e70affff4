"""Accelerations without contacts, and where ways lead (`exact.motion`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import kernel
from reference_solver.exact.kernels.rotation import turn_axes, write_turn_rate
from reference_solver.exact.kernels.rows import write_inverse_inertia, write_rows


@kernel
def write_free_acceleration(bodies, axes, velocity, out):
    """Write accelerations (n, q) without contacts: loads, and in space torques and the gyroscopic term.

    Euler: I w' = torque - w x I w; equal moments have no such term.
    """
    n, d = axes.shape[0], axes.shape[1]
    s = bodies.generator.shape[0]
    inverse = np.zeros((3, 3))
    rest, moment = np.zeros(3), np.zeros(3)
    for i in range(n):
        for e in range(d + s):
            out[i, e] = bodies.load[i, e]
        if s == 1 or bodies.free[i] == 0:
            continue
        write_inverse_inertia(bodies, axes, i, inverse)
        for p in range(3):
            rest[p] = bodies.torque[i, p]
        m = bodies.moment[i]
        if m[0] != m[1] or m[1] != m[2]:
            for p in range(3):
                moment[p] = 0.0
                for k in range(3):
                    for q in range(3):
                        moment[p] += axes[i, p, k] * m[k] * axes[i, q, k] * velocity[i, 3 + q]
            w = velocity[i, 3:]
            rest[0] -= w[1] * moment[2] - w[2] * moment[1]
            rest[1] -= w[2] * moment[0] - w[0] * moment[2]
            rest[2] -= w[0] * moment[1] - w[1] * moment[0]
        for p in range(3):
            for q in range(3):
                out[i, 3 + p] += inverse[p, q] * rest[q]


@kernel
def write_moved(place, axes, way, velocity, moved):
    """Write places, axes and rates of ways (n, q) after ways (n, q) into ``moved``."""
    d = place.shape[1]
    for i in range(len(place)):
        for p in range(d):
            moved[0][i, p] = place[i, p] + way[i, p]
            moved[2][i, p] = velocity[i, p]
        turn_axes(axes[i], way[i, d:], moved[1][i])
        write_turn_rate(way[i, d:], velocity[i, d:], moved[2][i, d:])


@kernel
def write_along(bodies, place, axes, way, velocity, contacts, rows, found):
    """Write gaps (k, m), places (k, m, d) and frames (k, m, d, d) of contacts after ways with twists (k, n, q).

    ``contacts``: features and tangents that frames take up; ``rows``: room.
    """
    features, along = contacts
    moved = np.empty(place.shape), np.empty(axes.shape), np.empty(way.shape[1:])
    for k in range(len(way)):
        write_moved(place, axes, way[k], velocity[k], moved)
        rows.frame[:, 1] = along
        write_rows(bodies, (moved[0], moved[1], velocity[k]), features, rows)
        found[0][k], found[1][k], found[2][k] = rows.gap, rows.place, rows.frame
