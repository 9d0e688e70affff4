"""Newton's step as compiled loops, in the precision of its arrays: single or double.

    contacts where the step begins  ->  v += dt g, x += dt v  ->  sweeps  ->  what is slow stops  ->  rebounds

`adapters.newton.motion` describes the formulas and prepares the arrays. Constants are arrays of the same precision,
because a literal would convert single to double precision. All kernels are in this file: numba caches machine code by
the file of the outermost one.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from adapters.law.compiled import inner_kernel, kernel

Numbers = np.ndarray[Any, np.dtype[Any]]


class Bodies(NamedTuple):
    """State and inertia of free bodies, then of fixed balls and boxes, last of the world.

    ``q`` is w, x, y, z, spins and inertias as in `motion`.
    """

    x: Numbers
    q: Numbers
    v: Numbers
    w: Numbers
    lightness: Numbers
    inertia: Numbers
    softness: Numbers
    force: Numbers
    torque: Numbers
    turn: Numbers
    old_turn: Numbers
    old_v: Numbers
    old_w: Numbers
    push: Numbers
    twist: Numbers
    #: Number of contacts with a correction.
    many: Numbers


class Candidates(NamedTuple):
    """Possible contacts: a corner (or centre) ``at`` of body ``b`` and a plane, a ball ``b`` and a ball or box ``a``.

    For a box ``at`` is half its size.
    """

    a: Numbers
    b: Numbers
    #: Index of the pair of bodies, in rising order of both; all fixed bodies count as one.
    pair: Numbers
    #: Index of the pair of the scene's bodies with recorded impulses: fixed bodies count separately.
    told: Numbers
    at: Numbers
    #: Normal and offset of the plane.
    normal: Numbers
    offset: Numbers
    #: Radii of both, 0 of planes, boxes and corners.
    radii: Numbers
    friction: Numbers
    restitution: Numbers


class Touching(NamedTuple):
    """Contacts of a step: candidate, normal, points and lever arms in body axes, and results of an iteration."""

    of: Numbers
    normal: Numbers
    points: Numbers
    arms: Numbers
    deep: Numbers
    share: Numbers
    came: Numbers
    total: Numbers
    least: Numbers


class Chosen(NamedTuple):
    """Settings: constants in the precision of all numbers, and counts."""

    dt: Numbers
    gravity: Numbers
    relaxation: Numbers
    #: Friction about the normal and against rolling [m].
    resists: Numbers
    reach: Numbers
    #: Square of the speed below which bodies stop, and threshold speed of restitution.
    stopped: Numbers
    least: Numbers
    #: Shift between the two points of a contact as shares of their place, along three axes.
    blur: Numbers
    #: 0, 1/2, 1, 2.
    plain: Numbers
    iterations: int
    weighted: int
    rebounds: int
    rebound_iterations: int
    inner: int
    #: Number of moving bodies: the first ones.
    moving: int


class Told(NamedTuple):
    """Records of each step: places and orientations, velocities, impulses by pair and whether there were any."""

    pose: Numbers
    twist: Numbers
    impulse: Numbers
    pressed: Numbers


@inner_kernel
def _set_turns(turn: Numbers, q: Numbers, plain: Numbers) -> None:
    """Current quaternions, each followed by 2 w^2 - 1."""
    for k in range(len(q)):
        for d in range(4):
            turn[k, d] = q[k, d]
        turn[k, 4] = plain[3] * q[k, 0] * q[k, 0] - plain[2]


@inner_kernel
def _copy(to: Numbers, given: Numbers) -> None:
    for d in range(3):
        to[d] = given[d]


@inner_kernel
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inner_kernel
def _turned(
    w: float, a: float, b: float, c: float, share: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """A vector turned by quaternion (w, u): x (2 w^2 - 1) + 2 u (u . x) + 2 w u x x.

    In this form a quaternion of a size different from 1, by round-off of its last step, changes the length of a vector
    along its axis by twice as much: a spin about one axis changes in its last digits in every step, always in the same
    direction. A matrix, with 1 for that axis, would not show it. [warp, quat_rotate]
    """
    along = a * x + b * y + c * z
    along += along
    ex, ey, ez = _cross(a, b, c, x, y, z)
    ex, ey, ez = ex * w, ey * w, ez * w
    return x * share + a * along + (ex + ex), y * share + b * along + (ey + ey), z * share + c * along + (ez + ez)


@inner_kernel
def _out(t: Numbers, x: float, y: float, z: float) -> tuple[float, float, float]:
    return _turned(t[0], t[1], t[2], t[3], t[4], x, y, z)


@inner_kernel
def _into(t: Numbers, x: float, y: float, z: float) -> tuple[float, float, float]:
    return _turned(t[0], -t[1], -t[2], -t[3], t[4], x, y, z)


@inner_kernel
def _rotate(q: Numbers, k: int, dt: float, half: float, x: float, y: float, z: float) -> None:
    """Rotate body ``k`` by ``dt`` times a spin, to first order."""
    a, b, c = half * dt * x, half * dt * y, half * dt * z
    w, x, y, z = q[k, 0], q[k, 1], q[k, 2], q[k, 3]
    w, x, y, z = (
        w + (-a * x - b * y - c * z),
        x + (a * w + b * z - c * y),
        y + (b * w + c * x - a * z),
        z + (c * w + a * y - b * x),
    )
    inverse = (half + half) / math.sqrt(w * w + x * x + y * y + z * z)
    q[k, 0], q[k, 1], q[k, 2], q[k, 3] = w * inverse, x * inverse, y * inverse, z * inverse


@inner_kernel
def _stop(bodies: Bodies, stopped: float, zero: float) -> None:
    """Stop slow bodies."""
    for v in (bodies.v, bodies.w):
        for k in range(len(v)):
            if v[k, 0] * v[k, 0] + v[k, 1] * v[k, 1] + v[k, 2] * v[k, 2] < stopped:
                v[k, 0], v[k, 1], v[k, 2] = zero, zero, zero


@inner_kernel
def _felt(bodies: Bodies, k: int, x: float, y: float, z: float) -> float:
    """Inverse mass at a point of body ``k`` by rotation, for a lever of an impulse of 1."""
    a, b, c = _into(bodies.turn[k], x, y, z)
    soft = bodies.softness[k]
    felt: float = a * a * soft[0] + b * b * soft[1] + c * c * soft[2]
    return felt


@inner_kernel
def _clipped(value: float, most: float) -> float:
    return max(-most, min(most, value))


@inner_kernel
def _on_box(
    bodies: Bodies, may: Candidates, c: int, n: Numbers, points: Numbers, arms: Numbers, zero: float
) -> float:  # fmt: skip
    """Distance of a ball from the nearest point of a box, and its contact; the centre must be outside."""
    x, y, t, radius = bodies.x[may.b[c]], bodies.x[may.a[c]], bodies.turn[may.b[c]], may.radii[c, 1]
    s, half = bodies.turn[may.a[c]], may.at[c]
    at = arms[0]
    at[0], at[1], at[2] = _into(s, x[0] - y[0], x[1] - y[1], x[2] - y[2])
    far = zero
    for d in range(3):
        points[0, d] = _clipped(at[d], half[d])
        at[d] -= points[0, d]
        far += at[d] * at[d]
    far = math.sqrt(far)
    n[0], n[1], n[2] = _out(s, at[0] / far, at[1] / far, at[2] / far)
    _copy(arms[0], points[0])
    points[1, 0], points[1, 1], points[1, 2] = zero, zero, zero
    ux, uy, uz = _into(t, n[0], n[1], n[2])
    arms[1, 0], arms[1, 1], arms[1, 2] = -radius * ux, -radius * uy, -radius * uz
    gap: float = far - radius
    return gap


@inner_kernel
def _found(bodies: Bodies, may: Candidates, touching: Touching, chosen: Chosen) -> int:
    """Contacts at the start of the step; their number."""
    count, zero = 0, chosen.plain[0]
    for c in range(len(may.a)):
        a, b = may.a[c], may.b[c]
        t, x = bodies.turn[b], bodies.x[b]
        n, points, arms = touching.normal[count], touching.points[count], touching.arms[count]
        if a == len(bodies.x) - 1:
            px, py, pz = _out(t, may.at[c, 0], may.at[c, 1], may.at[c, 2])
            px, py, pz = x[0] + px, x[1] + py, x[2] + pz
            _copy(n, may.normal[c])
            height = px * n[0] + py * n[1] + pz * n[2] - may.offset[c]
            radius = may.radii[c, 1]
            if not height - radius < chosen.reach[0]:
                continue
            # Points are relative to the middle between corner and foot, in body axes, which loses digits in single
            # precision.
            half = chosen.plain[1] * height
            mx, my, mz = px - half * n[0], py - half * n[1], pz - half * n[2]
            points[0, 0], points[0, 1], points[0, 2] = mx - half * n[0], my - half * n[1], mz - half * n[2]
            _copy(arms[0], points[0])
            ux, uy, uz = _into(t, mx + half * n[0] - x[0], my + half * n[1] - x[1], mz + half * n[2] - x[2])
            points[1, 0], points[1, 1], points[1, 2] = ux, uy, uz
            if radius > zero:
                ux, uy, uz = _into(t, n[0], n[1], n[2])
                arms[1, 0], arms[1, 1], arms[1, 2] = -radius * ux, -radius * uy, -radius * uz
            else:
                _copy(arms[1], points[1])
        elif not may.radii[c, 0] > zero:
            if not _on_box(bodies, may, c, n, points, arms, zero) < chosen.reach[0]:
                continue
        else:
            y = bodies.x[a]
            dx, dy, dz = x[0] - y[0], x[1] - y[1], x[2] - y[2]
            far = math.sqrt(dx * dx + dy * dy + dz * dz)
            if not far - (may.radii[c, 0] + may.radii[c, 1]) < chosen.reach[0]:
                continue
            n[0], n[1], n[2] = dx / far, dy / far, dz / far
            points[:] = zero
            ux, uy, uz = _into(bodies.turn[a], n[0], n[1], n[2])
            r = may.radii[c, 0]
            arms[0, 0], arms[0, 1], arms[0, 2] = r * ux, r * uy, r * uz
            ux, uy, uz = _into(t, n[0], n[1], n[2])
            r = -may.radii[c, 1]
            arms[1, 0], arms[1, 1], arms[1, 2] = r * ux, r * uy, r * uz
        touching.of[count] = c
        touching.deep[count] = 0
        count += 1
    return count


@inner_kernel
def _asks(bodies: Bodies, body: int, sign: float, push: Numbers, x: float, y: float, z: float) -> None:
    """Add a contact's correction of a body: an impulse and a moment about it."""
    for d in range(3):
        bodies.push[body, d] += sign * push[d]
    bodies.twist[body, 0] += x
    bodies.twist[body, 1] += y
    bodies.twist[body, 2] += z


@inner_kernel
def _press(bodies: Bodies, may: Candidates, touching: Touching, k: int, chosen: Chosen) -> bool:
    """Correction of one contact in an iteration; whether it overlaps."""
    zero, one = chosen.plain[0], chosen.plain[2]
    c = touching.of[k]
    a, b, n = may.a[c], may.b[c], touching.normal[k]
    points, arms = touching.points[k], touching.arms[k]
    ox, oy, oz = _out(bodies.turn[a], points[0, 0], points[0, 1], points[0, 2])
    px, py, pz = _out(bodies.turn[b], points[1, 0], points[1, 1], points[1, 2])
    xa, xb = bodies.x[a], bodies.x[b]
    ux, uy, uz = xa[0] + ox, xa[1] + oy, xa[2] + oz
    tx, ty, tz = xb[0] + px, xb[1] + py, xb[2] + pz
    thick = may.radii[c, 0] + may.radii[c, 1]
    place = abs(tx) + abs(ty) + abs(tz)
    lx, ly, lz = place * chosen.blur[0], place * chosen.blur[1], place * chosen.blur[2]
    depth = n[0] * (tx - ux + lx) + n[1] * (ty - uy + ly) + n[2] * (tz - uz + lz) - thick
    if not depth < zero:
        return False
    share = chosen.relaxation[0] / chosen.dt[0]
    light = bodies.lightness[a] + bodies.lightness[b]
    ax, ay, az = _cross(ux - xa[0], uy - xa[1], uz - xa[2], n[0], n[1], n[2])
    ax, ay, az = -ax, -ay, -az
    bx, by, bz = _cross(tx - xb[0], ty - xb[1], tz - xb[2], n[0], n[1], n[2])
    load = -depth * share / (light + _felt(bodies, a, ax, ay, az) + _felt(bodies, b, bx, by, bz))
    push = touching.share[k]
    push[0], push[1], push[2] = load * n[0], load * n[1], load * n[2]
    ax, ay, az, bx, by, bz = load * ax, load * ay, load * az, load * bx, load * by, load * bz
    friction = may.friction[c]
    if friction > zero:
        ex, ey, ez = _out(bodies.turn[a], arms[0, 0], arms[0, 1], arms[0, 2])
        fx, fy, fz = _out(bodies.turn[b], arms[1, 0], arms[1, 1], arms[1, 2])
        sx, sy, sz = xb[0] + fx - xa[0] - ex + lx, xb[1] + fy - xa[1] - ey + ly, xb[2] + fz - xa[2] - ez + lz
        along = sx * n[0] + sy * n[1] + sz * n[2]
        sx, sy, sz = sx - along * n[0], sy - along * n[1], sz - along * n[2]
        size = math.sqrt(sx * sx + sy * sy + sz * sz)
        if size > zero:
            sx, sy, sz = sx / size, sy / size, sz / size
            cx, cy, cz = _cross(ex, ey, ez, sx, sy, sz)
            gx, gy, gz = _cross(fx, fy, fz, sx, sy, sz)
            felt = light + _felt(bodies, a, cx, cy, cz) + _felt(bodies, b, gx, gy, gz)
            grip = -min(size * share / felt, friction * load)
            push[0], push[1], push[2] = push[0] + grip * sx, push[1] + grip * sy, push[2] + grip * sz
            ax, ay, az = ax - grip * cx, ay - grip * cy, az - grip * cz
            bx, by, bz = bx + grip * gx, by + grip * gy, bz + grip * gz
        wa, wb = bodies.w[a], bodies.w[b]
        wx, wy, wz = wb[0] - wa[0], wb[1] - wa[1], wb[2] - wa[2]
        about = wx * n[0] + wy * n[1] + wz * n[2]
        rx, ry, rz = wx - about * n[0], wy - about * n[1], wz - about * n[2]
        speed = math.sqrt(rx * rx + ry * ry + rz * rz)
        by_size = speed if speed > zero else one
        rx, ry, rz = rx / by_size, ry / by_size, rz / by_size
        for kind in range(2):
            turning = about if kind == 0 else speed
            hx, hy, hz = (n[0], n[1], n[2]) if kind == 0 else (rx, ry, rz)
            felt = _felt(bodies, a, hx, hy, hz) + _felt(bodies, b, hx, hy, hz)
            felt = felt if felt > zero else one  # no rotation
            resisted = _clipped(chosen.relaxation[0] * turning / felt, load * chosen.resists[kind])
            ax, ay, az = ax + resisted * hx, ay + resisted * hy, az + resisted * hz
            bx, by, bz = bx - resisted * hx, by - resisted * hy, bz - resisted * hz
    _asks(bodies, a, -one, push, ax, ay, az)
    _asks(bodies, b, one, push, bx, by, bz)
    bodies.many[a] += one
    bodies.many[b] += one
    return True


@inner_kernel
def _take(bodies: Bodies, chosen: Chosen) -> None:
    """Change velocities and places by the mean of the contacts' corrections, and stop slow bodies."""
    one, dt = chosen.plain[2], chosen.dt[0]
    for k in range(chosen.moving):
        many = bodies.many[k] if chosen.weighted and bodies.many[k] > one else one
        light = bodies.lightness[k] / many
        for d in range(3):
            change = bodies.push[k, d] * light
            bodies.x[k, d] += dt * change
            bodies.v[k, d] += change
        t, inertia, soft = bodies.turn[k], bodies.inertia[k], bodies.softness[k]
        sx, sy, sz = _into(t, bodies.w[k, 0], bodies.w[k, 1], bodies.w[k, 2])
        gx, gy, gz = _into(t, bodies.twist[k, 0] / many, bodies.twist[k, 1] / many, bodies.twist[k, 2] / many)
        gx, gy, gz = gx * soft[0], gy * soft[1], gz * soft[2]
        ax, ay, az = _cross(gx, gy, gz, inertia[0] * (sx + gx), inertia[1] * (sy + gy), inertia[2] * (sz + gz))
        bx, by, bz = _cross(sx, sy, sz, inertia[0] * gx, inertia[1] * gy, inertia[2] * gz)
        ax, ay, az = ax + bx, ay + by, az + bz
        wx, wy, wz = _out(t, gx - dt * ax * soft[0], gy - dt * ay * soft[1], gz - dt * az * soft[2])
        _rotate(bodies.q, k, dt, chosen.plain[1], wx, wy, wz)
        bodies.w[k, 0] += wx
        bodies.w[k, 1] += wy
        bodies.w[k, 2] += wz
    _stop(bodies, chosen.stopped[0], chosen.plain[0])


@inner_kernel
def _sweep(
    bodies: Bodies, may: Candidates, touching: Touching, count: int, chosen: Chosen, impulse: Numbers, pressed: Numbers
) -> int:
    """One iteration over all contacts; the number of overlapping ones."""
    zero, one = chosen.plain[0], chosen.plain[2]
    _set_turns(bodies.turn, bodies.q, chosen.plain)
    bodies.push[:], bodies.twist[:], bodies.many[:] = zero, zero, zero
    found = 0
    for k in range(count):
        touching.least[k] = zero
        if _press(bodies, may, touching, k, chosen):
            touching.deep[k] = 1
            touching.least[k] = one
            found += 1
    for k in range(count):
        if touching.least[k] > zero:
            # Recorded is the impulse on a body, the mean of its contacts; between two bodies, by the mean count.
            c = touching.of[k]
            free, total = zero, zero
            for body in (may.a[c], may.b[c]):
                if body < chosen.moving:
                    free, total = free + one, total + bodies.many[body]
            share = free / total if chosen.weighted else one
            pressed[may.told[c]] = 1
            for d in range(3):
                impulse[may.told[c], d] += touching.share[k, d] * share
    _take(bodies, chosen)
    return found


@inner_kernel
def _part(bodies: Bodies, a: int, b: int, n: Numbers, levers: Numbers, v: Numbers, w: Numbers) -> float:
    """Separation speed of a contact, from velocities and spins of its two bodies."""
    normal = n[0] * (v[1, 0] - v[0, 0]) + n[1] * (v[1, 1] - v[0, 1]) + n[2] * (v[1, 2] - v[0, 2])
    right = levers[1, 0] * w[1, 0] + levers[1, 1] * w[1, 1] + levers[1, 2] * w[1, 2]
    left = levers[0, 0] * w[0, 0] + levers[0, 1] * w[0, 1] + levers[0, 2] * w[0, 2]
    speed: float = normal + right - left
    return speed


@inner_kernel
def _rebound(
    bodies: Bodies, may: Candidates, touching: Touching, count: int, chosen: Chosen, levers: Numbers, soft: Numbers,
    felt: Numbers, both: Numbers, gained: Numbers, fired: Numbers,
) -> None:  # fmt: skip
    """Set separation speeds of contacts from their approach speeds before the iterations; pair by pair."""
    zero, one, least = chosen.plain[0], chosen.plain[2], chosen.least[0]
    for k in range(count):
        if not touching.deep[k]:
            continue
        c = touching.of[k]
        a, b, n = may.a[c], may.b[c], touching.normal[k]
        felt[k] = bodies.lightness[a] + bodies.lightness[b]
        for side in range(2):
            body = a if side == 0 else b
            t, arm = bodies.old_turn[body], touching.arms[k, side]
            x, y, z = _out(t, arm[0], arm[1], arm[2])
            x, y, z = _cross(x, y, z, n[0], n[1], n[2])
            levers[k, side, 0], levers[k, side, 1], levers[k, side, 2] = x, y, z
            x, y, z = _into(t, x, y, z)
            s = bodies.softness[body]
            felt[k] += x * x * s[0] + y * y * s[1] + z * z * s[2]
            x, y, z = _out(t, x * s[0], y * s[1], z * s[2])
            soft[k, side, 0], soft[k, side, 1], soft[k, side, 2] = x, y, z
            _copy(both[0, side], bodies.old_v[body])
            _copy(both[1, side], bodies.old_w[body])
        came = _part(bodies, a, b, n, levers[k], both[0], both[1])
        if came < -least:
            touching.came[k] = -may.restitution[c] * came
        else:
            touching.came[k] = came if came > least else zero
    pairs = 0
    for c in range(len(may.pair)):
        pairs = max(pairs, may.pair[c] + 1)
    for outer in range(chosen.rebound_iterations):
        gained[:], fired[:] = zero, zero
        for pair in range(pairs):
            a, b, some = 0, 0, False
            for k in range(count):
                c = touching.of[k]
                if not touching.deep[k] or may.pair[c] != pair:
                    continue
                if not some:
                    a, b, some = may.a[c], may.b[c], True
                    for side in range(2):
                        _copy(both[0, side], bodies.v[a if side == 0 else b])
                        _copy(both[1, side], bodies.w[a if side == 0 else b])
                touching.total[k], touching.least[k] = zero, zero
            if not some:
                continue
            for k in range(count):
                if touching.deep[k] and may.pair[touching.of[k]] == pair and outer == 0:
                    speed = _part(bodies, a, b, touching.normal[k], levers[k], both[0], both[1])
                    touching.least[k] = min((touching.came[k] - speed) / felt[k], zero)
            acted = False
            for _ in range(chosen.inner):
                for k in range(count):
                    if not touching.deep[k] or may.pair[touching.of[k]] != pair:
                        continue
                    n = touching.normal[k]
                    speed = _part(bodies, a, b, n, levers[k], both[0], both[1])
                    if touching.came[k] == zero and abs(speed) <= least:
                        continue
                    new = max(touching.total[k] + (touching.came[k] - speed) / felt[k], touching.least[k])
                    change = new - touching.total[k]
                    touching.total[k] = new
                    acted = acted or change != zero
                    for d in range(3):
                        both[0, 0, d] -= change * bodies.lightness[a] * n[d]
                        both[1, 0, d] -= change * soft[k, 0, d]
                        both[0, 1, d] += change * bodies.lightness[b] * n[d]
                        both[1, 1, d] += change * soft[k, 1, d]
            if acted:
                for side in range(2):
                    body = a if side == 0 else b
                    for d in range(3):
                        gained[body, 0, d] += both[0, side, d] - bodies.v[body, d]
                        gained[body, 1, d] += both[1, side, d] - bodies.w[body, d]
                    fired[body] += one
        for body in range(chosen.moving):
            if fired[body] > zero:
                for d in range(3):
                    bodies.v[body, d] += gained[body, 0, d] / fired[body]
                    bodies.w[body, d] += gained[body, 1, d] / fired[body]


@kernel
def run(
    bodies: Bodies, may: Candidates, touching: Touching, chosen: Chosen, told: Told, levers: Numbers, soft: Numbers,
    felt: Numbers, both: Numbers, gained: Numbers, fired: Numbers,
) -> None:  # fmt: skip
    """Make all steps that ``told`` can record; the other arrays are work space."""
    dt, half = chosen.dt[0], chosen.plain[1]
    for step in range(len(told.pose)):
        _set_turns(bodies.turn, bodies.q, chosen.plain)
        count = _found(bodies, may, touching, chosen)
        for k in range(chosen.moving):
            t, inertia, give = bodies.turn[k], bodies.inertia[k], bodies.softness[k]
            sx, sy, sz = _into(t, bodies.w[k, 0], bodies.w[k, 1], bodies.w[k, 2])
            for d in range(3):
                bodies.v[k, d] += dt * (bodies.force[k, d] * bodies.lightness[k] + chosen.gravity[d])
                bodies.x[k, d] += dt * bodies.v[k, d]
            px, py, pz = _into(t, bodies.torque[k, 0], bodies.torque[k, 1], bodies.torque[k, 2])
            cx, cy, cz = _cross(sx, sy, sz, inertia[0] * sx, inertia[1] * sy, inertia[2] * sz)
            px, py, pz = (px - cx) * give[0] * dt, (py - cy) * give[1] * dt, (pz - cz) * give[2] * dt
            x, y, z = _out(t, sx + px, sy + py, sz + pz)
            bodies.w[k, 0], bodies.w[k, 1], bodies.w[k, 2] = x, y, z
            _rotate(bodies.q, k, dt, half, x, y, z)
        _set_turns(bodies.old_turn, bodies.q, chosen.plain)
        for k in range(len(bodies.x)):
            _copy(bodies.old_v[k], bodies.v[k])
            _copy(bodies.old_w[k], bodies.w[k])
        any_deep, idle = 0, 0
        if count:
            for _ in range(chosen.iterations):
                found = _sweep(bodies, may, touching, count, chosen, told.impulse[step], told.pressed[step])
                any_deep += found
                idle = 0 if found else idle + 1
                if idle == 2:  # no input of an iteration has changed
                    break
        _stop(bodies, chosen.stopped[0], chosen.plain[0])
        if chosen.rebounds and any_deep:
            _rebound(bodies, may, touching, count, chosen, levers, soft, felt, both, gained, fired)
        for k in range(chosen.moving):
            _copy(told.pose[step, k], bodies.x[k])
            _copy(told.twist[step, k], bodies.v[k])
            _copy(told.twist[step, k, 3:], bodies.w[k])
            for d in range(4):
                told.pose[step, k, 3 + d] = bodies.q[k, d]
