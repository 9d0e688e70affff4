"""Until when points, and pairs of bodies, stay clear of each other (`exact.meeting`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import inner_kernel, kernel
from reference_solver.exact.kernels.rotation import cross, dot, turn_axes

#: Which point of a pair: none; no body's turn is left out; all faces of the owner count. Numbers of numpy's: a kernel
#: is compiled anew for a constant of Python's.
PAIR, TURNS, ALL = np.int64(-1), np.int64(0), np.int64(-1)
#: A share that no piece has.
NEVER = 2.0
#: Steps after which a search stops: the piece is cut there, and the search goes on from its end.
MOST_STEPS = 400


@inner_kernel
def safe(delta, delta1, delta2, third, ahead):
    """Return for how long, up to ``ahead``, a gap stays above zero for certain."""
    best = 0.0
    for _ in range(40):
        bend = delta2 - third * ahead / 3.0
        root = 1e300  # of delta + delta1 s + bend s^2 / 2
        if delta1 < 0.0:
            square = delta1 * delta1 - 2.0 * bend * delta
            if square >= 0.0:
                root = 2.0 * delta / (np.sqrt(square) - delta1)
        elif bend < 0.0:
            root = (delta1 + np.sqrt(delta1 * delta1 - 2.0 * bend * delta)) / -bend
        if root >= ahead:
            return max(best, ahead)
        best = max(best, root)
        if third == 0.0 or ahead <= 2.0 * best:
            return best
        ahead = max(2.0 * best, 0.2 * ahead)
    return best


@inner_kernel
def write_seen(course, generator, who, point, s, seen):
    """Write a point of body ``who[1]`` in the axes of body ``who[0]``, and its first two derivatives by s (3, d).

    Without the owner's turn where ``who[2]``. With c = R^T D and the owner's spin matrix O, c' = R^T (D' - O D) and
    c'' = R^T (D'' - 2 O D' - O' D + O O D).
    """
    d, q, powers = course.place.shape[1], course.way.shape[1], course.way.shape[2]
    axes, turn = np.zeros((d, d)), np.zeros(q - d)
    apart, spin, change = np.zeros((3, d)), np.zeros((d, d)), np.zeros((d, d))
    arm, once, twice = np.zeros(d), np.zeros(d), np.zeros(d)
    for side in range(2):
        i, sign = who[1 - side], 1.0 - 2.0 * side
        for e in range(q):
            way, way1, way2 = 0.0, 0.0, 0.0
            for j in range(powers - 1, 0, -1):
                way = (way + course.way[i, e, j]) * s
                way1 = way1 * s + j * course.way[i, e, j]
                if j > 1:
                    way2 = way2 * s + j * (j - 1) * course.way[i, e, j]
            if e >= d:
                turn[e - d] = way
            else:
                apart[0, e] += sign * (course.place[i, e] + way)
                apart[1, e] += sign * way1
                apart[2, e] += sign * way2
        spin[:] = 0.0
        change[:] = 0.0
        for e in range(q - d):
            w, w1 = 0.0, 0.0
            for j in range(course.spin.shape[2] - 1, -1, -1):
                w = w * s + course.spin[i, e, j]
                if j > 0:
                    w1 = w1 * s + j * course.spin[i, e, j]
            for p in range(d):
                for k in range(d):
                    spin[p, k] += generator[e, p, k] * w
                    change[p, k] += generator[e, p, k] * w1
        turn_axes(course.axes[i], turn, axes)
        if side == 1 and who[2] == 1:
            for p in range(d):
                for k in range(d):
                    axes[p, k] = 1.0 if p == k else 0.0
            spin[:] = 0.0
            change[:] = 0.0
        if side == 0:
            for p in range(d):
                arm[p] = once[p] = twice[p] = 0.0
                for k in range(d):
                    arm[p] += axes[p, k] * point[k]
            for p in range(d):
                for k in range(d):
                    once[p] += spin[p, k] * arm[k]
            for p in range(d):
                for k in range(d):
                    twice[p] += spin[p, k] * once[k] + change[p, k] * arm[k]
                apart[0, p] += arm[p]
                apart[1, p] += once[p]
                apart[2, p] += twice[p]
    for p in range(d):
        once[p] = twice[p] = 0.0
        for k in range(d):
            once[p] += spin[p, k] * apart[0, k]
    for p in range(d):
        for k in range(d):
            twice[p] += spin[p, k] * (once[k] - 2.0 * apart[1, k]) - change[p, k] * apart[0, k]
    for p in range(d):
        seen[0, p] = seen[1, p] = seen[2, p] = 0.0
        for k in range(d):
            seen[0, p] += axes[k, p] * apart[0, k]
            seen[1, p] += axes[k, p] * (apart[1, k] - once[k])
            seen[2, p] += axes[k, p] * (apart[2, k] + twice[k])


@inner_kernel
def holds_all(bodies, course, who, s, normal):
    """Return whether no point of body ``who[1]`` lies deeper along a normal (d,) in axes of ``who[0]`` than the first.

    ``normal`` has the level and what counts as none in the two numbers behind it.
    """
    d = course.place.shape[1]
    seen = np.zeros((3, d))
    for k in range(bodies.points[who[1]]):
        write_seen(course, bodies.generator, who, bodies.point[who[1], k], s, seen)
        if dot(normal[:d], seen[0]) < normal[d] - normal[d + 1]:
            return False
    return True


@inner_kernel
def clear(bodies, course, who, s, seen, bounds):
    """Return the gap of a point from body ``who[0]`` grown by both radii, and how far it stays clear.

    Of all the body, or only of the half-space of its face ``who[4]`` if that is not `ALL`.
    ``bounds``: a lift that is added to the gap, the least rate of gaps that count, c3, how far to look, and the gap
    below which a half-space counts only if it holds all of the point's body as well: else the point runs along it, as
    a corner of a box does along the side of another that stands on the same floor. Nor is it the gap, if there is a
    lift.
    """
    d, o = seen.shape[1], who[0]
    r = bodies.radius[who[0]] + bodies.radius[who[1]]
    lift, slow, third, ahead, noise = bounds
    wall = np.zeros(d + 2)
    gap, far = -1e300, 0.0
    n = np.zeros(d)
    for f in range(bodies.faces[o] + 1):
        if who[4] != ALL and f != who[4]:
            continue
        if f < bodies.faces[o]:
            delta = -bodies.offset[o, f] - r
            for p in range(d):
                n[p] = bodies.normal[o, f, p]
                delta += n[p] * seen[0, p]
        else:  # from the nearest place of the core
            if r == 0.0 or bodies.points[o] == 0:
                continue
            near = 1e300
            for e in range(max(1, bodies.lines[o])):
                i, j = (0, 0) if bodies.lines[o] == 0 else (bodies.line[o, e, 0], bodies.line[o, e, 1])
                along, long = 0.0, 0.0
                for p in range(d):
                    edge = bodies.point[o, j, p] - bodies.point[o, i, p]
                    along += edge * (seen[0, p] - bodies.point[o, i, p])
                    long += edge * edge
                share = 0.0
                if along > 0.0:
                    share = along / long if along < long else 1.0
                square = 0.0
                for p in range(d):
                    edge = bodies.point[o, j, p] - bodies.point[o, i, p]
                    square += (seen[0, p] - bodies.point[o, i, p] - share * edge) ** 2
                if square < near:
                    near = square
                    for p in range(d):
                        edge = bodies.point[o, j, p] - bodies.point[o, i, p]
                        n[p] = seen[0, p] - bodies.point[o, i, p] - share * edge
            if near == 0.0:
                continue
            delta, level = 0.0, -1e300
            for k in range(bodies.points[o]):
                reach = 0.0
                for p in range(d):
                    reach += n[p] * bodies.point[o, k, p]
                level = max(level, reach)
            for p in range(d):
                delta += n[p] * seen[0, p]
            delta = (delta - level) / np.sqrt(near) - r
            for p in range(d):
                n[p] /= np.sqrt(near)
        counts = delta + lift >= 0.0 and ahead > 0.0
        if counts and delta <= noise:
            wall[:d], wall[d], wall[d + 1] = n, dot(n, seen[0]), noise + lift
            if not holds_all(bodies, course, who, s, wall):
                gap = max(gap, delta) if lift == 0.0 else gap
                continue
        gap = max(gap, delta)
        if counts:
            delta1, delta2 = dot(n, seen[1]), dot(n, seen[2])
            if delta1 > slow:
                far = max(far, safe(delta + lift, delta1, delta2, third, ahead))
    return gap, far


@inner_kernel
def write_bounds(course, bounds):
    """Write bounds of the first three derivatives by s of every body's position and orientation (n, 2, 3)."""
    n, d = course.place.shape
    for i in range(n):
        bounds[i] = 0.0
        for e in range(d):
            for j in range(1, course.way.shape[2]):
                size = abs(course.way[i, e, j])
                bounds[i, 0, 0] += j * size
                bounds[i, 0, 1] += j * (j - 1) * size
                bounds[i, 0, 2] += j * (j - 1) * (j - 2) * size
        w, w1, w2 = 0.0, 0.0, 0.0
        for e in range(course.spin.shape[1]):
            for j in range(course.spin.shape[2]):
                size = abs(course.spin[i, e, j])
                w += size
                w1 += j * size
                w2 += j * (j - 1) * size
        bounds[i, 1, 0], bounds[i, 1, 1], bounds[i, 1, 2] = w, w1 + w * w, w2 + 3.0 * w * w1 + w * w * w


@inner_kernel
def write_rates(bounds, o, w, arm, apart, out):
    """Write bounds of |c'|, |c''|, |c'''| of a point of body w with a lever ``arm``, seen from o, ``apart`` [m]."""
    d0 = apart + bounds[o, 0, 0] + bounds[w, 0, 0] + arm
    d1 = bounds[o, 0, 0] + bounds[w, 0, 0] + arm * bounds[w, 1, 0]
    d2 = bounds[o, 0, 1] + bounds[w, 0, 1] + arm * bounds[w, 1, 1]
    d3 = bounds[o, 0, 2] + bounds[w, 0, 2] + arm * bounds[w, 1, 2]
    out[0] = d0 * bounds[o, 1, 0] + d1
    out[1] = d0 * bounds[o, 1, 1] + 2.0 * d1 * bounds[o, 1, 0] + d2
    out[2] = d0 * bounds[o, 1, 2] + 3.0 * d1 * bounds[o, 1, 1] + 3.0 * d2 * bounds[o, 1, 0] + d3


@inner_kernel
def write_directions(bodies, o, w, seen, out):
    """Write directions (m, 3, d) along which cores may be apart, in axes of o; ``seen`` (p, 3, d) are points of w.

    Normals of faces of o; of planes through edges of both; towards each other at the nearest places of lines and
    points. The two vectors behind each say how it turns, n + n1 s + n2 s^2: with both edges, so that it stays square
    to them but for s^3. Return how many there are.
    """
    d = seen.shape[2]
    count = 0
    out[:] = 0.0
    for f in range(bodies.faces[o]):
        out[count, 0] = bodies.normal[o, f]
        count += 1
    lines_o, lines_w = bodies.lines[o], bodies.lines[w]
    share, u, v, z = np.zeros(2), np.zeros(d), np.zeros(d), np.zeros(d)
    for i in range(max(1, lines_o)):
        a0, a1 = (bodies.line[o, i, 0], bodies.line[o, i, 1]) if lines_o > 0 else (0, 0)
        for j in range(max(1, lines_w)):
            b0, b1 = (bodies.line[w, j, 0], bodies.line[w, j, 1]) if lines_w > 0 else (0, 0)
            for p in range(d):
                u[p], v[p] = bodies.point[o, a1, p] - bodies.point[o, a0, p], seen[b1, 0, p] - seen[b0, 0, p]
                z[p] = seen[b0, 0, p] - bodies.point[o, a0, p]
            aa, bb, ab, aw, bw = dot(u, u), dot(v, v), dot(u, v), dot(u, z), dot(v, z)
            spread = aa * bb - ab * ab
            inside = False
            if spread > 1e-12 * aa * bb and aa > 0.0 and bb > 0.0:
                share[0], share[1] = (bb * aw - ab * bw) / spread, (ab * aw - aa * bw) / spread
                inside = 0.0 < share[0] < 1.0 and 0.0 < share[1] < 1.0
            if inside and d == 3:
                out[count, 0] = cross(u, v)
            else:  # one is nearest with an end
                best = 1e300
                for end in range(4):
                    u0 = float(end) if end < 2 else 0.0
                    v0 = float(end - 2) if end >= 2 else 0.0
                    if end < 2 and bb > 0.0:
                        v0 = (u0 * ab - bw) / bb
                        v0 = 0.0 if v0 < 0.0 else (1.0 if v0 > 1.0 else v0)
                    if end >= 2 and aa > 0.0:
                        u0 = (v0 * ab + aw) / aa
                        u0 = 0.0 if u0 < 0.0 else (1.0 if u0 > 1.0 else u0)
                    square = aa * u0 * u0 + bb * v0 * v0 - 2.0 * ab * u0 * v0 - 2.0 * aw * u0 + 2.0 * bw * v0
                    if square < best:
                        best = square
                        for p in range(d):
                            out[count, 0, p] = z[p] + v0 * v[p] - u0 * u[p]
            n = out[count, 0]
            size, way = dot(n, n), dot(n, z)
            if size <= 1e-30:
                continue
            n *= (1.0 if way > 0.0 else -1.0) / np.sqrt(size)
            if inside and d == 3:
                along = cross(n, u)
                along /= dot(along, v)
                out[count, 1] = -dot(n, seen[b1, 1] - seen[b0, 1]) * along
                turns = 0.5 * dot(n, seen[b1, 2] - seen[b0, 2]) + dot(out[count, 1], seen[b1, 1] - seen[b0, 1])
                out[count, 2] = -turns * along
            count += 1
    return count


@inner_kernel
def clear_of_pair(bodies, course, who, s, bounds, rates, room):
    """Return the gap of two bodies at a share s, and how far they stay clear of each other.

    ``bounds``: a lift that is added to gaps, the least rate of gaps that count, how far to look, and what touches.
    ``rates``: of points of either body (`write_rates`). Half-spaces of either body hold it. One that turns with a
    normal n(s) leaves a point of w and one of o apart by ``n`` times their distance, less ``r |n|``.
    """
    lift, slow, ahead, touches = bounds
    seen, directions = room
    gap, best = -1e300, 0.0
    apart = np.zeros(seen.shape[2])
    for side in range(2):
        o, w = who[side], who[1 - side]
        if bodies.points[w] == 0:
            continue
        r = bodies.radius[o] + bodies.radius[w]
        for k in range(bodies.points[w]):
            write_seen(course, bodies.generator, (o, w, TURNS, PAIR, ALL), bodies.point[w, k], s, seen[k])
        count = write_directions(bodies, o, w, seen, directions)
        for m in range(count):
            n, n1, n2 = directions[m, 0], directions[m, 1], directions[m, 2]
            level, low = -1e300, 1e300
            for j in range(bodies.points[o]):
                level = max(level, dot(n, bodies.point[o, j]))
            if bodies.points[o] == 0:
                level = bodies.offset[o, m]
            for k in range(bodies.points[w]):
                low = min(low, dot(n, seen[k, 0]) - level - r)
            gap = max(gap, low)
            if low + lift < 0.0 or ahead <= best:
                continue
            far, third = ahead, rates[side, 2]
            turn, bend = np.sqrt(dot(n1, n1)), np.sqrt(dot(n2, n2))
            turns = turn + bend > 0.0
            if turns:  # so far that 1/2 <= |n| <= 2
                far = min(far, 0.25 / (turn + np.sqrt(bend)))
                turn, bend = turn + 2.0 * bend * far, 2.0 * bend
                third = 2.0 * third + 3.0 * turn * rates[side, 1] + 3.0 * bend * rates[side, 0]
                third += r * (6.0 * bend * turn + 12.0 * turn**3)
            for k in range(bodies.points[w]):
                for j in range(bodies.points[o] if turns else 1):
                    delta, delta1, delta2 = (
                        dot(n, seen[k, 0]) - level - r + lift,
                        dot(n, seen[k, 1]),
                        dot(n, seen[k, 2]),
                    )
                    if turns:
                        apart[:] = seen[k, 0] - bodies.point[o, j]
                        delta = dot(n, apart) - r + lift
                        delta1 += dot(n1, apart)
                        delta2 += (
                            2.0 * dot(n1, seen[k, 1]) + 2.0 * dot(n2, apart) - r * (dot(n1, n1) + 2.0 * dot(n, n2))
                        )
                    # What touches counts only where it leaves, but for points that are away.
                    far = 0.0 if delta <= lift + touches and delta1 <= slow else far
                    far = min(far, safe(delta, delta1, delta2, third, far))
            best = max(best, far)
    return gap, best


@inner_kernel
def clear_at(bodies, course, who, s, bounds, rates, room):
    """Return the gap and how far it stays clear: of point ``who[3]`` (`clear`), or of two bodies if that is -1.

    ``bounds``: the lift, the least rate of gaps that count, how far to look, the noise of `clear` and that of
    `clear_of_pair`. ``rates``: see there.
    """
    lift, slow, ahead, runs, touches = bounds
    if who[3] < 0:
        return clear_of_pair(bodies, course, who, s, (lift, slow, ahead, touches), rates, room)
    seen = room[0][0]
    write_seen(course, bodies.generator, who, bodies.point[who[1], who[3]], s, seen)
    return clear(bodies, course, who, s, seen, (lift, slow, rates[0, 2], ahead, runs))


@inner_kernel
def meeting(bodies, course, who, limits, rates, room):
    """Return the first share below ``limits[0]`` at which a point or a body meets body ``who[0]``, or `NEVER`.

    ``limits``: the share to look up to, noise [m], speed of what leaves [m], gaps that are none [m], round-off of gaps
    [m]. The second number tells whether the search stopped there before anything met. See `clear_at` for the rest.
    """
    until, noise, slow, none, least = limits
    s, lift, leaves, before, runs = 0.0, 0.0, True, 0.0, noise
    for step in range(MOST_STEPS):
        ahead = until - s
        gap, far = clear_at(bodies, course, who, s, (lift, -1e300, ahead, runs, 0.0), rates, room)
        if step == 0 and gap <= noise:  # it touches
            # Half-spaces that hold all of its body tell the gap, and whether it approaches, where there are any.
            lift, far = max(0.0, -gap), 0.0
            whole = clear_at(bodies, course, who, s, (noise + lift, -1e300, ahead, noise, 0.0), rates, room)[0]
            holds = whole >= -noise - lift
            if holds:
                gap, lift = whole, max(0.0, -whole)
                far = clear_at(bodies, course, who, s, (lift, slow, ahead, runs, noise), rates, room)[1]
            if far == 0.0:  # a point may leave alone, over the end of a face
                runs = -1e300
                far = clear_at(bodies, course, who, s, (lift, slow, ahead, runs, noise), rates, room)[1]
            if far == 0.0:  # nothing leaves with a speed
                along = noise if holds else runs
                drifts = clear_at(bodies, course, who, s, (lift, -slow, ahead, along, noise), rates, room)[1]
                runs = noise if drifts == 0.0 and (holds or gap > none) else runs
                if drifts == 0.0 and gap > none:  # it approaches, and meets
                    lift = 0.0
                else:  # no contact until it is deeper than now by the noise
                    lift, leaves = noise + lift, False
                far = clear_at(bodies, course, who, s, (lift, -1e300, ahead, runs, 0.0), rates, room)[1]
        elif gap > noise and (runs < noise or not leaves):
            lift, leaves, runs = lift if leaves else 0.0, True, noise
            far = clear_at(bodies, course, who, s, (lift, -1e300, ahead, runs, 0.0), rates, room)[1]
        if s > 0.0 and gap + lift <= least:
            low, high = before, s
            while gap + lift < 0.0:  # passed by round-off
                middle = 0.5 * (low + high)
                if not low < middle < high:
                    break
                if clear_at(bodies, course, who, middle, (0.0, 0.0, 0.0, runs, 0.0), rates, room)[0] + lift > 0.0:
                    low = middle
                else:
                    high = middle
            return (high if gap + lift >= 0.0 else low), 0
        if far >= ahead:
            return NEVER, 0
        if s + far <= s:
            return s, 0
        before = s
        s += far
    return s, 1


@inner_kernel
def meeting_of_points(bodies, course, who, held, bounds, limits, room):
    """Return what `meeting` does, of all points of body ``who[1]`` that are not held (p,) with body ``who[0]``.

    ``who``: both bodies, whether the owner's turn is left out, and which face of it counts (`clear`). ``bounds``: see
    `write_bounds`.
    """
    o, w, fixed, face = who
    until, noise, slow, none, least = limits
    first, stopped = until, 0
    rates = np.zeros((2, 3))
    apart = np.sqrt(dot(course.place[o] - course.place[w], course.place[o] - course.place[w]))
    own = bounds[o, 1].copy()
    if fixed == 1:
        bounds[o, 1] = 0.0
    for k in range(bodies.points[w]):
        if held[k]:
            continue
        arm = np.sqrt(dot(bodies.point[w, k], bodies.point[w, k]))
        write_rates(bounds, o, w, arm, apart, rates[0])
        if rates[0, 0] > 0.0:
            s, ended = meeting(bodies, course, (o, w, fixed, k, face), (first, noise, slow, none, least), rates, room)
            if s < first:
                first, stopped = s, ended
    bounds[o, 1] = own
    return first, stopped


@kernel
def first_meeting(bodies, course, held, pairs, planes, scales, none):
    """Return the first share of a piece at which points that are not held meet another body, or `NEVER`; see `meeting`.

    Parameters
    ----------
    held
        (2, n, n, p): by owner, other body and point, whether a contact holds the point; and the same with both ends of
        lines that contacts hold.
    pairs
        (n, n): whether the pair is followed here.
    planes
        (c, 3): owner, other body, and a face of the owner whose whole plane that body stays above.
    scales
        Noise of gaps [m], speed of what leaves, as a way in the piece [m].
    none
        (n, n): gaps that count as none [m].
    """
    n, d = course.place.shape
    bounds = np.zeros((n, 2, 3))
    write_bounds(course, bounds)
    room = np.zeros((1, 3, d)), np.zeros((1, 3, d))
    first, stopped = NEVER, 0
    for o in range(n):
        for w in range(n):
            if o == w or pairs[o, w] == 0 or bodies.points[w] == 0 or (bodies.free[o] == 0 and bodies.free[w] == 0):
                continue
            if bodies.points[o] == 1 and (bodies.points[w] > 1 or o > w):
                continue  # what is round meets corners where they meet it
            fixed = 1 if bodies.points[o] == 1 else 0
            apart = np.sqrt(dot(course.place[o] - course.place[w], course.place[o] - course.place[w]))
            r = bodies.radius[o] + bodies.radius[w]
            way = min(first, 1.0) * (bounds[o, 0, 0] + bounds[w, 0, 0])
            if bodies.points[o] > 0 and apart - bodies.reach[o] - bodies.reach[w] - r > way:
                continue
            size = apart + bodies.reach[w] + r + (bodies.reach[o] if bodies.points[o] > 0 else 0.0)
            limits = (min(first, 1.0), max(scales[0], none[o, w]), scales[1], none[o, w], 1e-16 * size)
            s, ended = meeting_of_points(bodies, course, (o, w, fixed, ALL), held[0, o, w], bounds, limits, room)
            if s < limits[0]:
                first, stopped = s, ended
    for c in range(len(planes)):
        o, w, face = planes[c]
        size = bodies.reach[o] + bodies.reach[w]
        limits = (min(first, 1.0), max(scales[0], none[o, w]), scales[1], none[o, w], 1e-16 * size)
        s, ended = meeting_of_points(bodies, course, (o, w, TURNS, face), held[1, o, w], bounds, limits, room)
        if s < limits[0]:
            first, stopped = s, ended
    return first, stopped


@kernel
def first_meeting_of_pairs(bodies, course, pairs, scales, none):
    """Return the first share of a piece at which pairs that no contact holds meet, or `NEVER`; see `first_meeting`."""
    n, d = course.place.shape
    bounds = np.zeros((n, 2, 3))
    rates = np.zeros((2, 3))
    write_bounds(course, bounds)
    lines = bodies.line.shape[1]
    room = np.zeros((bodies.point.shape[1], 3, d)), np.zeros((bodies.normal.shape[1] + lines * lines + 1, 3, d))
    first, stopped = NEVER, 0
    for o in range(n):
        for w in range(o + 1, n):
            if pairs[o, w] == 0 or (bodies.free[o] == 0 and bodies.free[w] == 0):
                continue
            apart = np.sqrt(dot(course.place[o] - course.place[w], course.place[o] - course.place[w]))
            way, r = bounds[o, 0, 0] + bounds[w, 0, 0], bodies.radius[o] + bodies.radius[w]
            if (
                apart - bodies.reach[o] - bodies.reach[w] - r > min(first, 1.0) * way
                or way + bounds[o, 1, 0] + bounds[w, 1, 0] == 0.0
            ):
                continue
            reach_o, reach_w = min(bodies.reach[o], 1e300), min(bodies.reach[w], 1e300)
            write_rates(bounds, o, w, reach_w, apart, rates[0])
            write_rates(bounds, w, o, reach_o, apart, rates[1])
            limits = (min(first, 1.0), max(scales[0], none[o, w]), scales[1], none[o, w], 1e-15 * (apart + r))
            s, ended = meeting(bodies, course, (o, w, TURNS, PAIR, ALL), limits, rates, room)
            if s < first:
                first, stopped = s, ended
    return first, stopped
