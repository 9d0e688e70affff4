"""Pairs of features that touch, and how far contacts are from the ends of their features (`exact.features`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import inner_kernel, kernel
from reference_solver.exact.kernels.rotation import cross, dot

POINT, LINE, FACE = 0, 1, 2


@kernel
def place_features(bodies, place, axes, point, normal):
    """Write points (n, p, d) and face normals (n, f, d) in world axes."""
    n, d = place.shape
    for i in range(n):
        for k in range(bodies.points[i]):
            for p in range(d):
                s = place[i, p]
                for q in range(d):
                    s += axes[i, p, q] * bodies.point[i, k, q]
                point[i, k, p] = s
        for k in range(bodies.faces[i]):
            for p in range(d):
                s = 0.0
                for q in range(d):
                    s += axes[i, p, q] * bodies.normal[i, k, q]
                normal[i, k, p] = s


@inner_kernel
def ends(bodies, i, kind, number):
    """Return the numbers of the points at both ends of a line of body i, of a point twice its own."""
    if kind == LINE:
        return bodies.line[i, number, 0], bodies.line[i, number, 1]
    return number, number


@inner_kernel
def beyond(bodies, point, i, kind, number, direction):
    """Return how far the farthest other point of body i lies beyond a point or line along ``direction`` (d,) [m]."""
    d = len(direction)
    first, second = ends(bodies, i, kind, number)
    most = -1e300
    for k in range(bodies.points[i]):
        if k == first or k == second:
            continue
        s = 0.0
        for p in range(d):
            s += direction[p] * (point[i, k, p] - point[i, first, p])
        most = max(most, s)
    return most


@inner_kernel
def within(bodies, axes, place, o, face, where, out):
    """Write how far a place (d,) is from the sides of a face of body o, < 0 outside; return the least of it [m]."""
    d = len(where)
    least = 1e300
    for k in range(bodies.sides[o, face]):
        s = bodies.limit[o, face, k]
        for p in range(d):
            for q in range(d):
                s -= bodies.side[o, face, k, q] * axes[o, p, q] * (where[p] - place[o, p])
        out[k] = s
        least = min(least, s)
    return least


@inner_kernel
def nearest_on_lines(start, along, other_start, other_along, share):
    """Write where two lines (d,) are nearest, as shares of their lengths (2,); return sin^2 of their angle."""
    aa, bb, ab, aw, bw = 0.0, 0.0, 0.0, 0.0, 0.0
    for p in range(len(start)):
        w = other_start[p] - start[p]
        aa += along[p] * along[p]
        bb += other_along[p] * other_along[p]
        ab += along[p] * other_along[p]
        aw += along[p] * w
        bw += other_along[p] * w
    spread = aa * bb - ab * ab
    if spread > 1e-12 * aa * bb:
        share[0] = (bb * aw - ab * bw) / spread
        share[1] = (ab * aw - aa * bw) / spread
    return spread / (aa * bb)


@inner_kernel
def nearest(bodies, point, feature, share, lines, apart):
    """Write where two points or lines are nearest to each other, which a row (a, b, kind, number, kind, number) names.

    ``share`` (2,): shares of their lengths; ``lines`` (2, d): from end to end, zeros for a point; ``apart`` (d,): from
    that of a to that of b. Return both lengths [m], and sin^2 of the angle of two lines, 1 where one is a point.
    """
    a, b, kind_a, ia, kind_b, jb = feature
    begin_a, end_a = ends(bodies, a, kind_a, ia)
    begin_b, end_b = ends(bodies, b, kind_b, jb)
    first, second, along, other = point[a, begin_a], point[b, begin_b], lines[0], lines[1]
    along[:] = point[a, end_a] - first
    other[:] = point[b, end_b] - second
    long_a, long_b, spread = np.sqrt(dot(along, along)), np.sqrt(dot(other, other)), 1.0
    share[0] = share[1] = 0.0
    if kind_a == LINE and kind_b == LINE:
        spread = nearest_on_lines(first, along, second, other, share)
    elif kind_a == LINE:
        share[0] = dot(second - first, along) / long_a**2
    elif kind_b == LINE:
        share[1] = dot(first - second, other) / long_b**2
    for p in range(len(apart)):
        apart[p] = second[p] + share[1] * other[p] - first[p] - share[0] * along[p]
    return long_a, long_b, spread


@inner_kernel
def touching_faces(bodies, place, axes, world, pair, found, tol):
    """Write contacts of faces of body a or b with points of the other from row ``pair[2]`` on; return the next row."""
    point, normal = world
    d = place.shape[1]
    count, deep = pair[2], tol[1]
    room = np.zeros(bodies.side.shape[2])
    for turn in range(2):
        o, w = pair[turn], pair[1 - turn]
        for f in range(bodies.faces[o]):
            level, least = bodies.offset[o, f] + bodies.radius[o] + bodies.radius[w], 1e300
            for p in range(d):
                level += normal[o, f, p] * place[o, p]
            for k in range(bodies.points[w]):
                h = -level
                for p in range(d):
                    h += normal[o, f, p] * point[w, k, p]
                least = min(least, h)
            if least > tol[0] or least < -deep:
                continue
            for k in range(bodies.points[w]):
                h = -level
                for p in range(d):
                    h += normal[o, f, p] * point[w, k, p]
                if h > tol[0] or within(bodies, axes, place, o, f, point[w, k], room) < -tol[0]:
                    continue
                if count < len(found):
                    found[count, 0], found[count, 1] = pair[0], pair[1]
                    found[count, 2 + 2 * turn], found[count, 3 + 2 * turn] = FACE, f
                    found[count, 4 - 2 * turn], found[count, 5 - 2 * turn] = POINT, k
                count += 1
    return count


@inner_kernel
def touching_points(bodies, world, pair, found, tol):
    """Write contacts of points or lines with points, and of lines that cross, as `touching_faces` does.

    In the plane lines are faces, and sharp points are on faces: there only points of round bodies are left.
    """
    point = world[0]
    d = point.shape[2]
    a, b, count = pair[0], pair[1], pair[2]
    r = bodies.radius[a] + bodies.radius[b]
    lines_a = bodies.lines[a] if d == 3 else 0
    lines_b = bodies.lines[b] if d == 3 else 0
    n, share, lines = np.zeros(d), np.zeros(2), np.zeros((2, d))
    for i in range(bodies.points[a] + lines_a):
        kind_a = POINT if i < bodies.points[a] else LINE
        ia = i if kind_a == POINT else i - bodies.points[a]
        for j in range(bodies.points[b] + lines_b):
            kind_b = POINT if j < bodies.points[b] else LINE
            jb = j if kind_b == POINT else j - bodies.points[b]
            if r == 0.0 and (kind_a == POINT or kind_b == POINT):
                continue
            long_a, long_b, spread = nearest(bodies, point, (a, b, kind_a, ia, kind_b, jb), share, lines, n)
            if spread < 1e-12:
                continue  # parallel: their ends are points on lines
            # At an end the point is nearer, or as near; but sharp edges that cross begin and end there.
            end = -tol[0] if kind_a == LINE and kind_b == LINE and r == 0.0 else tol[0]
            if kind_a == LINE and (share[0] * long_a < end or (1.0 - share[0]) * long_a < end):
                continue
            if kind_b == LINE and (share[1] * long_b < end or (1.0 - share[1]) * long_b < end):
                continue
            gap = np.sqrt(dot(n, n))
            if kind_a == LINE and kind_b == LINE and r == 0.0:
                n[:] = cross(lines[0], lines[1])
                size = np.sqrt(dot(n, n))
                if beyond(bodies, point, a, kind_a, ia, n) > tol[0] * size:
                    n *= -1.0
                n /= size
            elif gap == 0.0:
                continue
            else:
                n /= gap
            if gap - r > tol[0]:
                continue
            if beyond(bodies, point, a, kind_a, ia, n) > tol[0] or beyond(bodies, point, b, kind_b, jb, -n) > tol[0]:
                continue
            if count < len(found):
                found[count, 0], found[count, 1] = a, b
                found[count, 2], found[count, 3], found[count, 4], found[count, 5] = kind_a, ia, kind_b, jb
            count += 1
    return count


@kernel
def touching(bodies, place, axes, world, found, tol):
    """Write the contacts of all pairs into ``found`` (m, 6), faces first; return how many there are."""
    n, d = place.shape
    count = np.int64(0)  # a 0 of Python's is a constant, for which what is called would be compiled anew
    for a in range(n):
        for b in range(a + 1, n):
            if bodies.free[a] == 0 and bodies.free[b] == 0:
                continue
            apart = 0.0
            for p in range(d):
                apart += (place[a, p] - place[b, p]) ** 2
            if np.sqrt(apart) > bodies.reach[a] + bodies.reach[b] + bodies.radius[a] + bodies.radius[b] + tol[0]:
                continue
            count = touching_faces(bodies, place, axes, world, (a, b, count), found, tol)
            count = touching_points(bodies, world, (a, b, count), found, tol)
    return count


@kernel
def write_margins(bodies, place, axes, world, features, out):
    """Write how far contacts (m,) are from the ends of their features into ``out`` (m, width) [m]; 1e300 where none.

    Of a face: the distances of the point from its sides. Of a line: from both ends. Of a point or line whose
    other feature is no face: how far each other point of its body lies behind it along the normal.
    """
    point = world[0]
    d = place.shape[1]
    n, share, lines = np.zeros(d), np.zeros(2), np.zeros((2, d))
    for k in range(len(features)):
        out[k] = 1e300
        a, b = features[k, 0], features[k, 1]
        kind_a, ia, kind_b, jb = features[k, 2], features[k, 3], features[k, 4], features[k, 5]
        if kind_a == FACE or kind_b == FACE:
            o, f, w, j = (a, ia, b, jb) if kind_a == FACE else (b, jb, a, ia)
            within(bodies, axes, place, o, f, point[w, j], out[k])
            continue
        long_a, long_b, _ = nearest(bodies, point, (a, b, kind_a, ia, kind_b, jb), share, lines, n)
        if kind_a == LINE:
            out[k, 0], out[k, 1] = share[0] * long_a, (1.0 - share[0]) * long_a
        if kind_b == LINE:
            out[k, 2], out[k, 3] = share[1] * long_b, (1.0 - share[1]) * long_b
        if kind_a == LINE and kind_b == LINE and bodies.radius[a] + bodies.radius[b] == 0.0:
            n[:] = cross(lines[0], lines[1])
            if dot(n, place[b] - place[a]) < 0.0:
                n *= -1.0
        n /= np.sqrt(dot(n, n))
        column = 4
        for turn in range(2):
            i, kind, number, sign = (a, kind_a, ia, 1.0) if turn == 0 else (b, kind_b, jb, -1.0)
            e0, e1 = ends(bodies, i, kind, number)
            for e in range(bodies.points[i]):
                if e != e0 and e != e1:
                    s = 0.0
                    for p in range(d):
                        s += sign * n[p] * (point[i, e0, p] - point[i, e, p])
                    out[k, column] = s
                    column += 1
