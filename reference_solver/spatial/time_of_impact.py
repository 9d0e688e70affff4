"""First contact of two moving bodies within a time, never passed (E32, E33).

Spheres and half-spaces that do not turn have closed forms. All others advance: along the direction n of the present
separation every corner c of one body keeps clear of every corner of the other at least as long as the parabola

    g + g' s + (n.a - B) s^2 / 2 > 0,      B = bound of |w|^2 r + |dw/dt| r of both bodies

says (conservative advancement: B. Mirtich, thesis, Berkeley 1996). Such a step ends on the safe side of the contact and
its defect is of second order, so that steps converge like Newton's. Should one pass, because the turn of a body with
unequal moments is of second order itself, the crossing is halved down to neighbouring doubles.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.model import Array
from reference_solver.spatial.flight import (
    bend_of_path,
    copy_body,
    curvature,
    first_fall,
    place_at,
    reach_of,
    turning_bounds,
)
from reference_solver.spatial.separation import core_width, separation
from reference_solver.spatial.state import BOX, CAPSULE, HALF_SPACE, SPHERE, Bodies
from reference_solver.spatial.vector import ZERO, Vector, axis, cross, dot, length, row, scale, sub, times

#: A gap below this many units in the last place of what it is the difference of is zero.
UNITS = 16.0 * 2.0**-52
#: Steps of one advancement. Usual are 3 to 10; grazing passes need a few dozen.
STEPS = 500
#: Bodies that touch at the start and part are looked for again no earlier than this share of the time.
FIRST_LOOK = 1.0 / 64.0
#: A safe step shorter than this share of the time is none.
SOON = 1e-11
#: The moment before an impact over which its speed is measured, as a share of a step.
MOMENT = 1e-3


@kernel
def time_of_impact(bodies: Bodies, trial: Bodies, a: int, b: int, duration: float) -> float:
    """First time in [0, duration] at which bodies a and b come into contact; infinite if there is none [s].

    ``bodies.twist`` holds the velocities at the start and ``bodies.rate`` what changes them. ``trial`` has room for two
    bodies. Bodies that touch at the start and part are met at their return.
    """
    f, s = (a, b) if bodies.kind[a] <= bodies.kind[b] else (b, a)
    if bodies.kind[s] == HALF_SPACE:
        return math.inf
    if bodies.kind[f] == HALF_SPACE and bodies.kind[s] == SPHERE and not (bodies.turning[f] or bodies.curved[s]):
        time = plane_sphere_time(bodies, f, s)
    elif bodies.kind[f] == SPHERE and bodies.kind[s] == SPHERE and same_acceleration(bodies, f, s):
        time = sphere_sphere_time(bodies, f, s)
    else:
        time = advance(bodies, trial, f, s, 0, duration)
    return time if time <= duration else math.inf


@inner_kernel
def return_of_corners(bodies: Bodies, trial: Bodies, a: int, b: int, held: int, duration: float) -> float:
    """First time at which a corner that is not held comes down on the half-space on which others are held (E33)."""
    f, s = (a, b) if bodies.kind[a] == HALF_SPACE else (b, a)
    if bodies.kind[s] == SPHERE or not (bodies.turning[f] or bodies.turning[s]):
        return math.inf
    time = advance(bodies, trial, f, s, held, duration)
    return time if time <= duration else math.inf


@kernel
def strikes_hard(bodies: Bodies, trial: Bodies, a: int, b: int, held: int, dt: float, t: float) -> bool:
    """Whether a pair that meets at time t does so faster than what loads do in a step (E28).

    The speed is the separation a moment before the impact, less that at it, over that moment.
    """
    f, s = (a, b) if bodies.kind[a] <= bodies.kind[b] else (b, a)
    moment = min(MOMENT * dt, t)
    if moment <= 0.0:
        return False
    copy_body(bodies, f, trial, 0)
    copy_body(bodies, s, trial, 1)
    closed = separation_at(bodies, trial, f, s, held, t - moment)[0] - separation_at(bodies, trial, f, s, held, t)[0]
    return closed > moment * dt * (length(row(bodies.acceleration, f, 0)) + length(row(bodies.acceleration, s, 0)))


@inner_kernel
def relative(array: Array, f: int, s: int) -> Vector:
    """First three numbers of row s less those of row f."""
    return sub(row(array, s, 0), row(array, f, 0))


@inner_kernel
def relative_curvature(bodies: Bodies, f: int, s: int) -> Vector:
    """Second derivative of s's centre seen from f's [m/s^2]."""
    return sub(curvature(bodies, s, 0), curvature(bodies, f, 0))


@inner_kernel
def same_acceleration(bodies: Bodies, f: int, s: int) -> bool:
    """Whether the centres have no relative acceleration at all."""
    a = relative_curvature(bodies, f, s)
    curved = bodies.curved[f] or bodies.curved[s]
    return bool(not curved and a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0)


@inner_kernel
def plane_sphere_time(bodies: Bodies, f: int, s: int) -> float:
    """Half-space that does not turn, and sphere: a quadratic (E32, O3)."""
    n = times(bodies.axes, f, row(bodies.geometry, f, 0))
    height, offset, radius = dot(n, relative(bodies.pose, f, s)), bodies.geometry[f, 3], bodies.geometry[s, 0]
    gap = height - offset - radius
    if gap <= UNITS * (abs(height) + abs(offset) + radius):
        gap = 0.0
    rate = dot(n, relative(bodies.twist, f, s))
    if gap == 0.0 and rate <= 0.0:
        return math.inf  # it touches: contact points, not the time of impact, keep it from sinking
    return first_fall(gap, rate, dot(n, relative_curvature(bodies, f, s)))


@inner_kernel
def sphere_sphere_time(bodies: Bodies, f: int, s: int) -> float:
    """Spheres under equal accelerations: a quadratic without differences of nearly equal numbers (E32, O4)."""
    x, v = relative(bodies.pose, f, s), relative(bodies.twist, f, s)
    radius = bodies.geometry[f, 0] + bodies.geometry[s, 0]
    closing = -dot(x, v)
    across = cross(x, v)
    reach = radius * radius * dot(v, v)
    discriminant = reach - dot(across, across)
    if closing <= UNITS * length(x) * length(v) or discriminant <= UNITS * reach:
        return math.inf
    gap = (length(x) - radius) * (length(x) + radius)
    return gap / (closing + math.sqrt(discriminant)) if gap > 0.0 else math.inf


@inner_kernel
def advance(bodies: Bodies, trial: Bodies, f: int, s: int, held: int, duration: float) -> float:
    """Advance from safe time to safe time until the separation is round-off (E33).

    ``held``: corners of s, a bit each, that do not count. A pair that parts from an overlap is back when it overlaps
    as much.
    """
    copy_body(bodies, f, trial, 0)
    copy_body(bodies, s, trial, 1)
    bend = bend_bound(bodies, f, s, duration)
    gap, n = free_separation(trial, held)
    floor = min(gap, 0.0)
    t, left = 0.0, gap > rounding(trial)
    for _ in range(STEPS):
        step = safe_step(trial, gap - floor, n, dot(n, relative_curvature(bodies, f, s)), bend, held)
        if not left and step >= duration - t:
            return math.inf
        if not left and step > SOON * duration:
            left = True  # every corner parts faster than it is turned back
        elif not left:
            step = FIRST_LOOK * duration
        later = min(t + step, duration)
        if later == t:
            return t
        before = gap
        gap, n = separation_at(bodies, trial, f, s, held, later)
        if gap - floor <= rounding(trial):
            if left:
                passed = gap - floor < -rounding(trial)
                return crossing(bodies, trial, f, s, held, floor, t, later) if passed else later
            if gap < before - rounding(trial):
                return later
        left = left or gap - floor > rounding(trial)
        if later == duration:
            return math.inf
        t = later
    return t


@inner_kernel
def separation_at(bodies: Bodies, trial: Bodies, f: int, s: int, held: int, t: float) -> tuple[float, Vector]:
    """Separation at time t; the trial records keep the state there."""
    place_at(bodies, f, t, trial, 0)
    place_at(bodies, s, t, trial, 1)
    return free_separation(trial, held)


@inner_kernel
def free_separation(trial: Bodies, held: int) -> tuple[float, Vector]:
    """Separation of the two trial bodies, of the corners that are not held."""
    gap, n = separation(trial, 0, 1)
    return (gap + core_width(trial, 1, n) - free_width(trial, n, held) if held else gap), n


@inner_kernel
def free_width(trial: Bodies, n: Vector, held: int) -> float:
    """How far the corners of the second body that are not held reach against n from its centre [m]."""
    far = -math.inf
    for i in range(corners(trial, 1)):
        if (held >> i) & 1 == 0:
            far = max(far, -dot(n, corner(trial, 1, i)))
    return far


@inner_kernel
def rounding(trial: Bodies) -> float:
    """Round-off of the separation: some units in the last place of the coordinates and sizes it comes from [m]."""
    largest = 0.0
    for k in range(2):
        for d in range(3):
            largest = max(largest, abs(trial.pose[k, d]))
            if trial.kind[k] != HALF_SPACE:
                largest = max(largest, trial.geometry[k, d])
    return 0.25 * UNITS * largest


@inner_kernel
def bend_bound(bodies: Bodies, f: int, s: int, duration: float) -> float:
    """Bound B of what turning adds to the second derivative of a gap along a fixed direction [m/s^2].

    The normal of a turning half-space turns with it: to it all that moves is a body of the size of the distance.
    """
    spin_f, change_f = turning_bounds(bodies, f, duration)
    spin_s, change_s = turning_bounds(bodies, s, duration)
    bend = reach_of(bodies, s) * (spin_s * spin_s + change_s)
    bend += bend_of_path(bodies, f, duration) + bend_of_path(bodies, s, duration)
    if bodies.kind[f] != HALF_SPACE:
        return bend + reach_of(bodies, f) * (spin_f * spin_f + change_f)
    acceleration = length(relative_curvature(bodies, f, s))
    acceleration += bend_of_path(bodies, f, duration) + bend_of_path(bodies, s, duration)
    speed = length(relative(bodies.twist, f, s)) + duration * acceleration
    wide = length(relative(bodies.pose, f, s)) + duration * speed + reach_of(bodies, s)
    # Relative to the half-space the distance to its axis turns at spin_f, and so do its own changes, twice (Coriolis).
    return bend + wide * (spin_f * spin_f + change_f) + 2.0 * spin_f * (speed + spin_s * reach_of(bodies, s))


@inner_kernel
def safe_step(trial: Bodies, gap: float, n: Vector, acceleration: float, bend: float, held: int) -> float:
    """Time for which no corner can close the gap along n (E33)."""
    gap = max(gap, 0.0)
    far_f, far_s = core_width(trial, 0, n), free_width(trial, n, held) if held else core_width(trial, 1, n)
    spin_f, spin_s = row(trial.twist, 0, 3), row(trial.twist, 1, 3)
    along = dot(n, relative(trial.twist, 0, 1))
    if trial.kind[0] == HALF_SPACE:  # its normal turns with it: seen from there, the other body turns as well
        along -= dot(n, cross(spin_f, relative(trial.pose, 0, 1)))
        spin_s = sub(spin_s, spin_f)
    step = math.inf
    for i in range(corners(trial, 0)):
        arm_f = corner(trial, 0, i)
        above_f = max(far_f - dot(n, arm_f), 0.0)
        rate_f = along - dot(n, cross(spin_f, arm_f))
        for j in range(corners(trial, 1)):
            if (held >> j) & 1:
                continue
            arm_s = corner(trial, 1, j)
            above = above_f + max(far_s + dot(n, arm_s), 0.0)
            step = min(step, first_fall(gap + above, rate_f + dot(n, cross(spin_s, arm_s)), acceleration - bend))
    return step


@inner_kernel
def corners(trial: Bodies, k: int) -> int:
    """Number of corners of the core: 8 of a box, 2 of a capsule, the centre of other shapes."""
    if trial.kind[k] == BOX:
        return 8
    return 2 if trial.kind[k] == CAPSULE else 1


@inner_kernel
def corner(trial: Bodies, k: int, i: int) -> Vector:
    """Corner i of the core from the centre, numbered as in the narrowphase [m]."""
    x, y, z = trial.geometry[k, 0], trial.geometry[k, 1], trial.geometry[k, 2]
    if trial.kind[k] == BOX:
        return times(trial.axes, k, (x if i & 1 else -x, y if i & 2 else -y, z if i & 4 else -z))
    return scale(-x if i else x, axis(trial.axes, k, 0)) if trial.kind[k] == CAPSULE else ZERO


@inner_kernel
def crossing(
    bodies: Bodies, trial: Bodies, f: int, s: int, held: int, floor: float, early: float, late: float
) -> float:
    """Last double at which the gap is above the floor between `early` (above) and `late` (below), by halving (E33)."""
    while True:
        middle = 0.5 * (early + late)
        if middle <= early or middle >= late:
            return early
        gap, _ = separation_at(bodies, trial, f, s, held, middle)
        if gap >= floor:
            early = middle
        else:
            late = middle
