"""Gaps, rows and their rates (`exact.rows`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import inner_kernel, kernel
from reference_solver.exact.kernels.features import FACE, LINE, POINT, ends
from reference_solver.exact.kernels.rotation import cross, dot


@inner_kernel
def write_inverse_inertia(bodies, axes, i, out):
    """Write the inverse inertia (s, s) of body i in world axes."""
    s = len(out)
    for p in range(s):
        for q in range(s):
            out[p, q] = 0.0
            if bodies.free[i] == 1:
                if s == 1:
                    out[p, q] = 1.0 / bodies.moment[i, 0]
                else:
                    for k in range(s):
                        out[p, q] += axes[i, p, k] * axes[i, q, k] / bodies.moment[i, k]


@inner_kernel
def write_motion(bodies, state, i, arm, spin, out):
    """Write place, velocity (2, d) of the point of body i with the lever ``axes @ arm``, and its spin matrix (d, d)."""
    place, axes, velocity = state
    d = len(arm)
    for p in range(d):
        for q in range(d):
            spin[p, q] = 0.0
            for e in range(bodies.generator.shape[0]):
                spin[p, q] += velocity[i, d + e] * bodies.generator[e, p, q]
    for p in range(d):
        out[0, p] = 0.0
        for q in range(d):
            out[0, p] += axes[i, p, q] * arm[q]
    for p in range(d):
        out[1, p] = velocity[i, p]
        for q in range(d):
            out[1, p] += spin[p, q] * out[0, q]
    for p in range(d):
        out[0, p] += place[i, p]


@inner_kernel
def write_tangents(frame):
    """Complete a frame (d, d) whose first row is a normal: planar by a quarter turn, in space from the second row."""
    d = len(frame)
    n, t = frame[0], frame[1]
    if d == 2:
        t[0], t[1] = -n[1], n[0]
        return
    t -= dot(t, n) * n
    size = dot(t, t)
    if size < 1e-12:
        least = np.argmin(np.abs(n))
        t[:] = -n[least] * n
        t[least] += 1.0
        size = dot(t, t)
    t /= np.sqrt(size)
    frame[2] = cross(n, t)


@kernel
def write_rows(bodies, state, features, rows):
    """Write all that `Rows` has, at a state (place, axes, velocity)."""
    place, axes, velocity = state
    d, s = place.shape[1], bodies.generator.shape[0]
    spin = np.zeros((2, d, d))
    core = np.zeros((2, 2, d))  # of each body a core point: place, velocity
    along = np.zeros((2, 2, d))  # of each body's line its direction and the rate of that
    end = np.zeros((2, d))
    n, dn, dwhere = np.zeros(d), np.zeros(d), np.zeros(d)
    inertia = np.zeros((2, s, s))
    none = np.zeros(d)
    for k in range(len(features)):
        a, b = features[k, 0], features[k, 1]
        for turn in range(2):
            i, kind, number = features[k, turn], features[k, 2 + 2 * turn], features[k, 3 + 2 * turn]
            write_inverse_inertia(bodies, axes, i, inertia[turn])
            if kind == POINT:
                write_motion(bodies, state, i, bodies.point[i, number], spin[turn], core[turn])
            elif kind == LINE:
                first, last = ends(bodies, i, kind, number)
                write_motion(bodies, state, i, bodies.point[i, last], spin[turn], end)
                write_motion(bodies, state, i, bodies.point[i, first], spin[turn], core[turn])
                along[turn] = end - core[turn]
                size = np.sqrt(dot(along[turn, 0], along[turn, 0]))
                along[turn] /= size
            else:
                write_motion(bodies, state, i, none, spin[turn], core[turn])
        r = bodies.radius[a] + bodies.radius[b]
        apart, parting = core[1, 0] - core[0, 0], core[1, 1] - core[0, 1]
        where = rows.place[k]
        kind_a, kind_b = features[k, 2], features[k, 4]
        if kind_a == FACE or kind_b == FACE:
            o, f, sign, owner, other = (
                (a, features[k, 3], 1.0, 0, 1) if kind_a == FACE else (b, features[k, 5], -1.0, 1, 0)
            )
            for p in range(d):
                n[p] = 0.0
                for q in range(d):
                    n[p] += sign * axes[o, p, q] * bodies.normal[o, f, q]
            for p in range(d):
                dn[p] = dot(spin[owner, p], n)
            rows.gap[k] = dot(n, apart) - bodies.offset[o, f] - r
            lies = sign * bodies.radius[features[k, other]]
            where[:] = core[other, 0] - lies * n
            dwhere[:] = core[other, 1] - lies * dn
        elif kind_a == LINE and kind_b == LINE:
            ea, eb = along[0, 0], along[1, 0]
            c = cross(ea, eb)
            dc = cross(along[0, 1], eb) + cross(ea, along[1, 1])
            square = dot(c, c)
            side = dot(c, place[b] - place[a])
            n[:] = c / (np.sqrt(square) if side > 0.0 else -np.sqrt(square))
            dn[:] = dc / (np.sqrt(square) if side > 0.0 else -np.sqrt(square))
            dn -= dot(n, dn) * n
            rows.gap[k] = dot(n, apart) - r
            moment = cross(apart, eb)
            share = dot(moment, c) / square
            dshare = dot(cross(parting, eb) + cross(apart, along[1, 1]), c) + dot(moment, dc)
            dshare = (dshare - 2.0 * share * dot(c, dc)) / square
            where[:] = core[0, 0] + share * ea + bodies.radius[a] * n
            dwhere[:] = core[0, 1] + share * along[0, 1] + dshare * ea + bodies.radius[a] * dn
        else:
            for turn in range(2):  # a point over a line: without what lies along the line
                if features[k, 2 + 2 * turn] == LINE:
                    e, de = along[turn, 0], along[turn, 1]
                    share, dshare = dot(e, apart), dot(de, apart) + dot(e, parting)
                    parting = parting - dshare * e - share * de
                    apart = apart - share * e
            distance = np.sqrt(dot(apart, apart))
            n[:] = apart / distance
            dn[:] = (parting - dot(n, parting) * n) / distance
            rows.gap[k] = distance - r
            other = 0 if kind_a == POINT else 1
            lies = bodies.radius[a] if other == 0 else -bodies.radius[b]
            where[:] = core[other, 0] + lies * n
            dwhere[:] = core[other, 1] + lies * dn
        rows.frame[k, 0] = n
        write_tangents(rows.frame[k])
        lever_a, lever_b = where - place[a], where - place[b]
        u, beta = velocity[b, :d] - velocity[a, :d], np.zeros(d)
        for p in range(d):
            u[p] += dot(spin[1, p], lever_b) - dot(spin[0, p], lever_a)
            beta[p] = dot(spin[1, p], dwhere - velocity[b, :d]) - dot(spin[0, p], dwhere - velocity[a, :d])
        for row in range(d):
            t = rows.frame[k, row]
            rows.speed[k, row] = dot(t, u)
            rows.rate[k, row] = dot(t, beta) + (dot(dn, u) if row == 0 else -dot(t, dn) * rows.speed[k, 0])
            for turn in range(2):
                i, sign = features[k, turn], 2.0 * turn - 1.0
                lever = lever_a if turn == 0 else lever_b
                own, yields = rows.row[k, row, turn], rows.yields[k, row, turn]
                for p in range(d):
                    own[p] = sign * t[p]
                    yields[p] = bodies.inverse_mass[i] * own[p]
                for e in range(s):
                    own[d + e] = 0.0
                    for p in range(d):
                        own[d + e] += sign * t[p] * dot(bodies.generator[e, p], lever)
                for e in range(s):
                    yields[d + e] = dot(inertia[turn, e], own[d:])
