"""First contact of two bodies on their paths: never passed, spins included (E25, E26).

All that is asked of a dimension is where the corners of two bodies are at a time, and how far the bodies are apart
along which direction. A body is a core (the polygon or polyhedron of its corners) grown by a radius; a turning disc or
sphere is a single corner, which its turning does not move. Vectors have three components in the plane as well.

Along a fixed direction n every corner c of one body keeps clear of every corner d of the other as long as

    g + g' s + (n.a - B) s^2 / 2 > 0,      B = sum of (|w|^2 + |dw/dt|) r of both bodies + change of a

does: g and g' are exact now, n.a is the present acceleration of the centres, B bounds the rest over the whole of the
time ahead (conservative advancement: B. Mirtich, thesis, Berkeley 1996). Such a step ends before the first contact, its
defect is of second order, so that steps converge like Newton's; for constant acceleration without turning the first
step is the closed form. The first contact is therefore found, not some contact.
"""

from __future__ import annotations

import math
from typing import Any

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.stepping.noise import COORDINATE_NOISE, ROUND_OFF
from reference_solver.stepping.operations import operation
from reference_solver.stepping.paths import derivative, derivative_bound

#: Entries of `Meeting.kind`: first and second body, number of their corners, whether the first is a plane.
FIRST, SECOND, CORNERS_FIRST, CORNERS_SECOND, PLANE = 0, 1, 2, 3, 4
KINDS = 5
#: Columns of `Meeting.size`: radius a core is grown by, largest distance of a corner from the centre (0 of a round
#: body), smallest half width, all [m].
RADIUS, REACH, EXTENT = 0, 1, 2
SIZES = 3
#: Rows of `Meeting.vector`: centre of the first and of the second body, their velocities and spins, the direction of
#: the separation from first to second, the plane's normal in the first body's axes, the spin of that direction [rad/s].
CENTRE, VELOCITY, SPIN, NORMAL, FACE, TURN = 0, 2, 4, 6, 7, 8
VECTORS = 9

#: Units in the last place of coordinates and sizes below which a separation is round-off: four.
UNITS = 4.0 * 2.0**-52
#: Steps of one advancement; usual are 3 to 10, one per radian of turn, a few dozen for grazing passes. Bodies that take
#: more are said to meet: the caller goes there, finds no contact, and asks anew.
STEPS = 2000
#: Steps of one whose bodies touch and do not part for certain.
CREEPS = 100
#: Steps shorter than this share of what is ahead are tried with a direction that turns along.
TURN_ALONG = 0.01
#: Corners that are off a face by less than this share of its body are on it.
ON_FACE = 1e-9
#: A direction that turns faster than this many times both bodies together keeps to edges that are nearly parallel.
HASTY = 10.0
#: Share of the noise of its gap below which a corner is held for certain, however gaps are rounded. One that is held
#: and watched comes no nearer.
SURELY_HELD = 0.5
#: Overlap of bodies held at impulse level, as a share of the smaller half width, that is an impact if it is hard.
DEEP = 3e-5
#: Overlap at the end of a sub-step with which they are held by the wrong features, however softly they meet.
TOO_DEEP = 10.0 * DEEP
#: Margin with which every pair of shapes answers with its points, however far apart they are.
UNLIMITED = 1e300


@operation
def is_half_space(meeting: Any, i: int) -> bool:
    """Whether body i is one."""
    raise NotImplementedError


@operation
def introduce(meeting: Any, first: int, second: int) -> None:
    """Fill `kind` and `size` of a pair, and plane and offset where the first is a half-space; the second is none."""


@operation
def stand(meeting: Any, t: float) -> None:
    """Put both bodies where their paths are at time t: fill `vector` but for the normal, and `corner`."""


@operation
def separate(meeting: Any) -> float:
    """Return the distance of two bodies with corners [m], below zero where they overlap; fill the normal.

    Positive where they are apart, and never more than their distance.
    """
    raise NotImplementedError


@kernel
def first_contact(meeting: Any, a: int, b: int, now: float, until: float) -> float:
    """First time after ``now`` at which bodies a and b come into contact; inf if there is none up to ``until`` [s].

    Bodies that touch now, and part, are met at their return; overlap they have now is no contact until it grows.
    """
    if is_half_space(meeting, b):
        introduce(meeting, b, a)
    else:
        introduce(meeting, a, b)
    watch_all(meeting)
    return advance(meeting, now, until)


@kernel
def next_contact_of_held(
    meeting: Any, a: int, b: int, nx: float, ny: float, nz: float, now: float, until: float
) -> float:
    """First time after ``now`` at which another corner comes down on the face on which bodies a and b touch [s].

    The normal (nx, ny, nz) leads from a to b. Convex bodies that touch in a point or a line touch elsewhere no earlier
    than a face of one comes to lie along that of the other; which corners are held now is seen from their height. inf
    if none comes down, or if neither has a face there: then no other corner can be next.
    """
    if is_half_space(meeting, b):
        introduce(meeting, b, a)
    else:
        introduce(meeting, a, b)
    stand(meeting, now)
    if meeting.kind[PLANE] == 0 and not choose_face(meeting, nx, ny, nz, now):
        return math.inf
    if not watch_free_corners(meeting, until - now):
        return math.inf
    return advance(meeting, now, until)


@kernel
def overlap_time(meeting: Any, a: int, b: int, until: float, depth: float) -> float:
    """Time at which bodies a and b that touch overlap by ``depth``, inf if they do not at ``until`` [s].

    For bodies that are held at impulse level: what holds them may let go, and nobody looks for what touches.
    """
    if is_half_space(meeting, b):
        introduce(meeting, b, a)
    else:
        introduce(meeting, a, b)
    watch_all(meeting)
    stand(meeting, until)
    if gap(meeting) >= -depth:
        return math.inf
    stand(meeting, 0.0)
    return crossing(meeting, -depth, 0.0, until) if gap(meeting) >= -depth else math.inf


@inner_kernel
def choose_face(meeting: Any, nx: float, ny: float, nz: float, now: float) -> bool:
    """Make a body that has a face along the normal, from first to second, the first one, as a plane; False: none."""
    set_normal(meeting, nx, ny, nz)
    least = meeting.paths.coefficient.shape[1] // 3 + 1  # corners that span a face: 2 in the plane, 3 in space
    own = face_corners(meeting, 0, 1.0) >= least
    other = face_corners(meeting, 1, -1.0) >= least
    if not own and not other:
        return False
    if not own:
        introduce(meeting, meeting.kind[SECOND], meeting.kind[FIRST])
        set_normal(meeting, -nx, -ny, -nz)
        stand(meeting, now)
    meeting.offset[0] = meeting.size[0, RADIUS] + farthest(meeting, 0, 1.0)
    fix_plane(meeting)
    return True


@operation
def fix_plane(meeting: Any) -> None:
    """Note the normal in the axes of the first body: from here on it turns with it, as that of a plane."""


@inner_kernel
def set_normal(meeting: Any, x: float, y: float, z: float) -> None:
    """Store the direction of the separation."""
    meeting.vector[NORMAL, 0], meeting.vector[NORMAL, 1], meeting.vector[NORMAL, 2] = x, y, z


@inner_kernel
def height(meeting: Any, k: int, c: int, sign: float) -> float:
    """How far corner c of body k reaches along the normal times ``sign`` from its centre [m]."""
    along = 0.0
    for d in range(3):
        along += meeting.vector[NORMAL, d] * meeting.corner[k, c, d]
    return sign * along


@inner_kernel
def face_corners(meeting: Any, k: int, sign: float) -> int:
    """Corners of body k that lie as far along the normal times ``sign`` as any."""
    far, found = -math.inf, 0
    for c in range(meeting.kind[CORNERS_FIRST + k]):
        far = max(far, height(meeting, k, c, sign))
    for c in range(meeting.kind[CORNERS_FIRST + k]):
        if height(meeting, k, c, sign) >= far - ON_FACE * meeting.size[k, REACH]:
            found += 1
    return found


@inner_kernel
def watch_free_corners(meeting: Any, time: float) -> bool:
    """Watch the corners of the second body that may not be held: off the plane, or leaving; False if there are none."""
    found, extent = False, min(meeting.size[0, EXTENT], meeting.size[1, EXTENT])
    for c in range(meeting.kind[CORNERS_SECOND]):
        place = 0.0
        for d in range(3):
            place = max(place, abs(meeting.vector[CENTRE + 1, d] + meeting.corner[1, c, d]))
        noise, (rate, _) = ROUND_OFF * extent + COORDINATE_NOISE * place, corner_rate(meeting, 0, c)
        meeting.watched[c] = 1 if corner_gap(meeting, c) > SURELY_HELD * noise or rate * time > noise else 0
        meeting.sunk[c] = 0.0
        found = found or meeting.watched[c] == 1
    return found


@inner_kernel
def gap(meeting: Any) -> float:
    """Separation of the watched corners where bodies stand now [m]; fills the normal."""
    if meeting.kind[PLANE] == 0:
        return separate(meeting)
    value = math.inf
    for c in range(meeting.kind[CORNERS_SECOND]):
        if meeting.watched[c]:
            value = min(value, corner_gap(meeting, c) + meeting.sunk[c])
    return value


@inner_kernel
def corner_gap(meeting: Any, c: int) -> float:
    """Distance of corner c of the second body from the plane [m]."""
    value = -meeting.offset[0] - meeting.size[1, RADIUS] - height(meeting, 1, c, -1.0)
    for d in range(3):
        between = meeting.vector[CENTRE + 1, d] - meeting.vector[CENTRE, d]
        value += meeting.vector[NORMAL, d] * between
    return value


@inner_kernel
def sink(meeting: Any) -> None:
    """Note how deep each corner of the second body is in the plane."""
    for c in range(meeting.kind[CORNERS_SECOND]):
        meeting.sunk[c] = max(-corner_gap(meeting, c), 0.0)


@inner_kernel
def farthest(meeting: Any, k: int, sign: float) -> float:
    """How far the watched corners of body k reach along the normal times ``sign`` from its centre [m]."""
    far = -math.inf
    for c in range(meeting.kind[CORNERS_FIRST + k]):
        if k == 0 or meeting.watched[c]:
            far = max(far, height(meeting, k, c, sign) - (0.0 if k == 0 else meeting.sunk[c]))
    return far


@inner_kernel
def round_off(meeting: Any) -> float:
    """Round-off of a separation [m]."""
    largest = abs(meeting.offset[0]) if meeting.kind[PLANE] else 0.0
    for k in range(2):
        largest = max(largest, meeting.size[k, RADIUS] + meeting.size[k, REACH])
        for d in range(3):
            largest = max(largest, abs(meeting.vector[CENTRE + k, d]))
    return UNITS * largest


@inner_kernel
def gap_noise(meeting: Any) -> float:
    """Gap up to which two bodies touch [m], as wherever contacts are detected."""
    largest = 0.0
    for d in range(3):
        largest = max(largest, abs(meeting.vector[CENTRE + 1, d]))
    extent = min(meeting.size[0, EXTENT], meeting.size[1, EXTENT])
    return ROUND_OFF * extent + COORDINATE_NOISE * (largest + meeting.size[1, REACH])


@inner_kernel
def corner_rate(meeting: Any, c: int, d: int) -> tuple[float, float]:
    """Rate of the separation of corner c of the first from corner d of the second body along the normal [m/s].

    And how far they are behind the farthest corners, both together [m], from the centres. Seen from a plane, which
    turns its normal along, the other body turns the opposite way about the plane's centre. Else the direction turns
    with the spin `TURN`, that of nothing but for a moment (`safe_step`).
    """
    v = meeting.vector
    x, y, z = v[SPIN + 1, 0], v[SPIN + 1, 1], v[SPIN + 1, 2]
    ax, ay, az = meeting.corner[1, d, 0], meeting.corner[1, d, 1], meeting.corner[1, d, 2]
    fx, fy, fz = meeting.corner[0, c, 0], meeting.corner[0, c, 1], meeting.corner[0, c, 2]
    if meeting.kind[PLANE]:
        fx, fy, fz = (v[CENTRE + 1, 0] - v[CENTRE, 0], v[CENTRE + 1, 1] - v[CENTRE, 1], v[CENTRE + 1, 2] - v[CENTRE, 2])
        x, y, z = x - v[SPIN, 0], y - v[SPIN, 1], z - v[SPIN, 2]
    rate = v[NORMAL, 0] * (v[VELOCITY + 1, 0] - v[VELOCITY, 0] + y * az - z * ay - (v[SPIN, 1] * fz - v[SPIN, 2] * fy))
    rate += v[NORMAL, 1] * (v[VELOCITY + 1, 1] - v[VELOCITY, 1] + z * ax - x * az - (v[SPIN, 2] * fx - v[SPIN, 0] * fz))
    rate += v[NORMAL, 2] * (v[VELOCITY + 1, 2] - v[VELOCITY, 2] + x * ay - y * ax - (v[SPIN, 0] * fy - v[SPIN, 1] * fx))
    if meeting.kind[PLANE] == 0:
        tx, ty, tz = v[TURN, 0], v[TURN, 1], v[TURN, 2]
        rate += (ty * v[NORMAL, 2] - tz * v[NORMAL, 1]) * (v[CENTRE + 1, 0] - v[CENTRE, 0] + ax - fx)
        rate += (tz * v[NORMAL, 0] - tx * v[NORMAL, 2]) * (v[CENTRE + 1, 1] - v[CENTRE, 1] + ay - fy)
        rate += (tx * v[NORMAL, 1] - ty * v[NORMAL, 0]) * (v[CENTRE + 1, 2] - v[CENTRE, 2] + az - fz)
    reach = 0.0 if meeting.kind[PLANE] else height(meeting, 0, c, 1.0)
    return rate, reach + height(meeting, 1, d, -1.0) - meeting.sunk[d]


@inner_kernel
def first_fall(c: float, b: float, a: float) -> float:
    """First t >= 0 at which c + b t + a t^2 / 2, c >= 0, falls through zero; infinite if it never does (O3).

    Of the quadratic's two forms the one that adds numbers of one sign is taken (N. Higham, Accuracy and Stability of
    Numerical Algorithms, 1.8).
    """
    if b < 0.0:
        discriminant = b * b - 2.0 * a * c
        return 2.0 * c / (math.sqrt(discriminant) - b) if discriminant >= 0.0 else math.inf
    if a >= 0.0:
        return math.inf
    return (b + math.sqrt(b * b - 2.0 * a * c)) / -a


@inner_kernel
def safe_time(meeting: Any, clearance: float, acceleration: float) -> float:
    """Time for which no two watched corners close the clearance, their gaps bending by the acceleration or less [s]."""
    first = 1 if meeting.kind[PLANE] else meeting.kind[CORNERS_FIRST]
    far = farthest(meeting, 1, -1.0) + (0.0 if meeting.kind[PLANE] else farthest(meeting, 0, 1.0))
    time = math.inf
    for c in range(first):
        for d in range(meeting.kind[CORNERS_SECOND]):
            if meeting.watched[d] == 0:
                continue
            rate, reach = corner_rate(meeting, c, d)
            free = max(clearance, 0.0) + max(far - reach, 0.0)
            # A parabola open downwards that is above zero at both ends is so in between.
            if acceleration > 0.0 or time == math.inf or free + time * (rate + 0.5 * time * acceleration) <= 0.0:
                time = min(time, first_fall(free, rate, acceleration))
    return time


@inner_kernel
def safe_step(meeting: Any, clearance: float, acceleration: float, now: float, until: float) -> tuple[float, float]:
    """`safe_time`, and the acceleration that it is for; small ones with the direction turning along with what touches.

    A corner over the face of a body that turns: along a fixed direction one end of the face comes up, however clear of
    it the corner is. Two edges that cross likewise.
    """
    step = safe_time(meeting, clearance, acceleration)
    if meeting.kind[PLANE] or step > TURN_ALONG * (until - now):
        return step, acceleration
    first, second, n = meeting.kind[FIRST], meeting.kind[SECOND], meeting.vector[NORMAL]
    nx, ny, nz = n[0], n[1], n[2]
    along, bend = step, acceleration
    if choose_face(meeting, nx, ny, nz, now):
        watch_all(meeting)
        bend = relative_acceleration(meeting, now) - bend_bound(meeting, now, until)
        along = safe_time(meeting, clearance, bend)
        introduce(meeting, first, second)
        watch_all(meeting)
        stand(meeting, now)
        set_normal(meeting, nx, ny, nz)
    elif turn_with_edges(meeting):
        bend = relative_acceleration(meeting, now) - edge_bend_bound(meeting, now, until)
        along = safe_time(meeting, clearance, bend)
        for d in range(3):
            meeting.vector[TURN, d] = 0.0
    return (along, bend) if along > step else (step, acceleration)


@inner_kernel
def turn_with_edges(meeting: Any) -> bool:
    """Let the direction keep at a right angle to the edges that it separates, in space; False if there are none.

    With the rates n.(w x e) of both edges e, ``n' . e`` is to be minus that: n' from the dual basis of the edges.
    """
    v = meeting.vector
    if meeting.paths.coefficient.shape[1] < 6:
        return False
    nx, ny, nz = v[NORMAL, 0], v[NORMAL, 1], v[NORMAL, 2]
    ax, ay, az, has_a = touching_edge(meeting, 0, 1.0)
    bx, by, bz, has_b = touching_edge(meeting, 1, -1.0)
    da = triple(nx, ny, nz, v[SPIN, 0], v[SPIN, 1], v[SPIN, 2], ax, ay, az)
    db = triple(nx, ny, nz, v[SPIN + 1, 0], v[SPIN + 1, 1], v[SPIN + 1, 2], bx, by, bz)
    if has_a and has_b:
        spat = triple(ax, ay, az, bx, by, bz, nx, ny, nz)
        if spat == 0.0:
            return False
        da, db = -da / spat, -db / spat
        x = da * (by * nz - bz * ny) + db * (ny * az - nz * ay)
        y = da * (bz * nx - bx * nz) + db * (nz * ax - nx * az)
        z = da * (bx * ny - by * nx) + db * (nx * ay - ny * ax)
    elif has_a:
        share = -da / (ax * ax + ay * ay + az * az)
        x, y, z = share * ax, share * ay, share * az
    elif has_b:
        share = -db / (bx * bx + by * by + bz * bz)
        x, y, z = share * bx, share * by, share * bz
    else:
        return False
    v[TURN, 0], v[TURN, 1], v[TURN, 2] = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
    spins = 0.0
    for k in range(2):
        spins += math.sqrt(v[SPIN + k, 0] ** 2 + v[SPIN + k, 1] ** 2 + v[SPIN + k, 2] ** 2)
    if not math.sqrt(x * x + y * y + z * z) <= HASTY * spins:
        v[TURN, 0] = v[TURN, 1] = v[TURN, 2] = 0.0
        return False
    return True


@inner_kernel
def triple(ax: float, ay: float, az: float, bx: float, by: float, bz: float, cx: float, cy: float, cz: float) -> float:
    """Return a . (b x c), by components."""
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


@inner_kernel
def touching_edge(meeting: Any, k: int, sign: float) -> tuple[float, float, float, bool]:
    """Edge between the two corners of body k that lie farthest along the normal times ``sign``; whether it is one."""
    far, found, one, other = -math.inf, 0, 0, 0
    for c in range(meeting.kind[CORNERS_FIRST + k]):
        far = max(far, height(meeting, k, c, sign))
    for c in range(meeting.kind[CORNERS_FIRST + k]):
        if height(meeting, k, c, sign) >= far - ON_FACE * meeting.size[k, REACH]:
            found += 1
            one, other = other, c
    if found != 2:
        return 0.0, 0.0, 0.0, False
    first, last = meeting.corner[k, one], meeting.corner[k, other]
    return last[0] - first[0], last[1] - first[1], last[2] - first[2], True


@inner_kernel
def edge_bend_bound(meeting: Any, now: float, until: float) -> float:
    """`bend_bound` along a direction n that turns with the constant spin `TURN`.

    The gap n . R of two corners, R leading from one to the other, bends by ``n''.R + 2 n'.R' + n.R''``.
    """
    paths, v = meeting.paths, meeting.vector
    f, s = meeting.kind[FIRST], meeting.kind[SECOND]
    spin_f, change_f = turn_bounds(meeting, f, now, until)
    spin_s, change_s = turn_bounds(meeting, s, now, until)
    turn = math.sqrt(v[TURN, 0] ** 2 + v[TURN, 1] ** 2 + v[TURN, 2] ** 2)
    reach_f, reach_s = meeting.size[0, REACH], meeting.size[1, REACH]
    speed = derivative_bound(paths, f, False, 1, now, until) + derivative_bound(paths, s, False, 1, now, until)
    pull = derivative_bound(paths, f, False, 2, now, until) + derivative_bound(paths, s, False, 2, now, until)
    jerk = derivative_bound(paths, f, False, 3, now, until) + derivative_bound(paths, s, False, 3, now, until)
    wide = 0.0
    for d in range(3):
        wide += (v[CENTRE + 1, d] - v[CENTRE, d]) ** 2
    wide = math.sqrt(wide) + (until - now) * speed + reach_f + reach_s
    bend = reach_f * (spin_f * spin_f + change_f) + reach_s * (spin_s * spin_s + change_s) + (until - now) * jerk
    bend += 2.0 * pull  # the present acceleration is taken along the present normal
    return bend + turn * turn * wide + 2.0 * turn * (speed + spin_f * reach_f + spin_s * reach_s)


@inner_kernel
def watch_all(meeting: Any) -> None:
    """Let no corner of the second body come down unseen."""
    for c in range(meeting.kind[CORNERS_SECOND]):
        meeting.watched[c], meeting.sunk[c] = 1, 0.0


@operation
def turn_bounds(meeting: Any, i: int, now: float, until: float) -> tuple[float, float]:
    """Bounds of the spin [rad/s] of body i, and of its change [rad/s^2], over the time (see `bend_bound`)."""
    raise NotImplementedError


@inner_kernel
def bend_bound(meeting: Any, now: float, until: float) -> float:
    """Bound of what turning and changing accelerations take from the second derivative of a gap [m/s^2].

    A corner at the arm r moves with ``dw/dt x r + w x (w x r)`` about its centre. With the turn exp(psi), |w| is at
    most |psi'| and |dw/dt| at most |psi''| + |psi'|^2 / 2, as ``w = integral of exp(u psi) psi' du`` over u from 0 to
    1. A plane turns its normal along: seen from it all else turns back about its centre, with Coriolis terms.
    """
    paths = meeting.paths
    f, s = meeting.kind[FIRST], meeting.kind[SECOND]
    spin_f, change_f = turn_bounds(meeting, f, now, until)
    spin_s, change_s = turn_bounds(meeting, s, now, until)
    jerk = derivative_bound(paths, f, False, 3, now, until) + derivative_bound(paths, s, False, 3, now, until)
    bend = meeting.size[1, REACH] * (spin_s * spin_s + change_s) + (until - now) * jerk
    if meeting.kind[PLANE] == 0:
        return bend + meeting.size[0, REACH] * (spin_f * spin_f + change_f)
    if spin_f == 0.0:
        return bend
    speed = derivative_bound(paths, f, False, 1, now, until) + derivative_bound(paths, s, False, 1, now, until)
    wide = 0.0
    for d in range(3):
        wide += (meeting.vector[CENTRE + 1, d] - meeting.vector[CENTRE, d]) ** 2
    wide = math.sqrt(wide) + (until - now) * speed + meeting.size[1, REACH]
    pull = derivative_bound(paths, f, False, 2, now, until) + derivative_bound(paths, s, False, 2, now, until)
    bend += 2.0 * pull  # the present acceleration is taken along the present normal
    return bend + wide * (spin_f * spin_f + change_f) + 2.0 * spin_f * (speed + spin_s * meeting.size[1, REACH])


@inner_kernel
def relative_acceleration(meeting: Any, t: float) -> float:
    """Acceleration of the second centre seen from the first along the normal at time t [m/s^2]."""
    paths, value = meeting.paths, 0.0
    for d in range(paths.coefficient.shape[1] // 2 + paths.coefficient.shape[1] % 2):
        first = derivative(paths, meeting.kind[FIRST], d, 2, t)
        value += meeting.vector[NORMAL, d] * (derivative(paths, meeting.kind[SECOND], d, 2, t) - first)
    return value


@inner_kernel
def advance(meeting: Any, now: float, until: float) -> float:
    """Advance from safe time to safe time until the separation is round-off (E26); inf if that is after ``until``.

    What overlaps now touches when it overlaps more: of a plane, each corner by itself, for bodies that rock come down
    on one corner while another is still in the plane by round-off.

    A pair that touches now has to part before it can meet. While it is within noise, and no corner parts for certain,
    steps are as long as a fall by that noise takes.
    """
    stand(meeting, now)
    if meeting.kind[PLANE]:
        sink(meeting)
    t, value = now, gap(meeting)
    bend = bend_bound(meeting, now, until)
    noise, least = gap_noise(meeting), round_off(meeting)
    floor, left = min(value, 0.0), value > noise
    for k in range(STEPS):
        fixed = relative_acceleration(meeting, t) - bend
        step, acceleration = safe_step(meeting, value - floor, fixed, t, until)
        if not left:
            # The parabola that ends first rises to more than the noise: -a (step / 2)^2 / 2 at half its time.
            left = 0.0 < step < math.inf and -0.125 * acceleration * step * step > noise
            if step < math.inf and not left:
                step, _ = safe_step(meeting, value - floor + noise, fixed, t, until)
        if step >= until - t:
            return math.inf
        later = t + step
        if later <= t:
            return t
        stand(meeting, later)
        value = gap(meeting)
        if left and value - floor <= least:
            return crossing(meeting, floor, t, later) if value - floor < -least else later
        if not left and value - floor < -noise:
            return later
        left = left or value - floor > noise
        t = later
        if not left and k == CREEPS:
            return t
    return t


@inner_kernel
def crossing(meeting: Any, floor: float, early: float, late: float) -> float:
    """Last double at which the gap is above the floor between `early` (above) and `late` (below), by halving."""
    while True:
        middle = 0.5 * (early + late)
        if middle <= early or middle >= late:
            return early
        stand(meeting, middle)
        if gap(meeting) >= floor:
            early = middle
        else:
            late = middle
