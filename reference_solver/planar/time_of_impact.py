"""The next instant of a sub-step at which bodies meet (E25 to E27)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.planar.box_box import axis_separation
from reference_solver.planar.broadphase import pair_bodies
from reference_solver.planar.columns import FEATURE, GAP, NX, NY, PN, REACH, ROUNDING, SHAPE, TARGET, A, B
from reference_solver.planar.flight import bending, bound_flight, fastest, place, put_back
from reference_solver.planar.impact import gap_noise
from reference_solver.planar.kinematics import load_speed, normal_velocity
from reference_solver.planar.narrowphase import collide
from reference_solver.planar.rows import prepare_masses
from reference_solver.planar.separating_axis import distance
from reference_solver.planar.state import (
    BOX,
    CANDIDATES,
    CAPSULE,
    HALF_SPACE,
    HELD,
    MANIFOLDS,
    Bodies,
    Options,
    Pairs,
    Rows,
    SubStep,
)

#: In place of a feature: no contact point is held.
NONE = -1
#: Margin with which every pair of shapes answers with its points, however far apart they are.
UNLIMITED = 1e300
#: Safe advances before bodies count as staying close.
ADVANCES = 32
#: Looks at a gap: the first ones each at twice the time of the one before, the others evenly spread.
LOOKS_NEAR, LOOKS_EVEN = 16, 16
#: Halvings of a bracket: enough to bring any two doubles of one sign together.
HALVINGS = 200


@inner_kernel
def first_fall(gap: float, rate: float, acceleration: float) -> float:
    """First t >= 0 at which gap + rate t + acceleration t^2 / 2 falls through zero; inf if never (E25).

    ``gap`` is not negative. Of the quadratic's two forms the one that adds numbers of one sign is taken (N. Higham,
    Accuracy and Stability of Numerical Algorithms, 1.8).
    """
    square = rate * rate - 2.0 * acceleration * gap
    if rate >= 0.0:
        return (rate + math.sqrt(square)) / -acceleration if acceleration < 0.0 else math.inf
    return 2.0 * gap / (-rate + math.sqrt(square)) if square >= 0.0 else math.inf


@inner_kernel
def pair_gap(bodies: Bodies, sub: SubStep, a: int, b: int, held: int) -> float:
    """Least gap of a pair, of all its contact points but the one with the feature ``held``.

    For boxes apart it is the separation along the best axis, a lower bound of their distance.
    """
    if held == NONE and bodies.kind[a, SHAPE] == BOX and bodies.kind[b, SHAPE] == BOX:
        dx, dy = bodies.pose[b, 0] - bodies.pose[a, 0], bodies.pose[b, 1] - bodies.pose[a, 1]
        best = -math.inf
        for axis in range(2):
            best = max(best, axis_separation(bodies, a, b, dx, dy, axis)[0])
            best = max(best, axis_separation(bodies, b, a, -dx, -dy, axis)[0])
        return best
    if held == NONE and max(bodies.kind[a, SHAPE], bodies.kind[b, SHAPE]) >= CAPSULE:
        if bodies.kind[a, SHAPE] != HALF_SPACE and bodies.kind[b, SHAPE] != HALF_SPACE:
            return distance(bodies, a, b)
    gap = math.inf
    for c in range(collide(bodies, a, b, UNLIMITED, sub.probe, 0)):
        if held == NONE or sub.probe.integer[c, FEATURE] != held:
            gap = min(gap, sub.probe.real[c, GAP])
    return gap


@inner_kernel
def gap_at(bodies: Bodies, sub: SubStep, a: int, b: int, held: int, t: float) -> float:
    """`pair_gap` at time t of the sub-step; bodies are back where they were afterwards."""
    place(bodies, sub, a, t)
    place(bodies, sub, b, t)
    gap = pair_gap(bodies, sub, a, b, held)
    put_back(bodies, sub, a)
    put_back(bodies, sub, b)
    return gap


@inner_kernel
def spins(bodies: Bodies, sub: SubStep, i: int) -> bool:
    """Whether turning moves any point of body i's surface."""
    moves = sub.path[i, 2, 1] != 0.0 or sub.path[i, 2, 2] != 0.0 or bending(sub, i, 2, 1.0) > 0.0
    return bodies.real[i, REACH] > bodies.real[i, ROUNDING] and moves


@inner_kernel
def is_parabola(sub: SubStep, i: int) -> bool:
    """Whether accelerations of body i are constant."""
    return bending(sub, i, 0, 1.0) + bending(sub, i, 1, 1.0) == 0.0


@inner_kernel
def closing_bound(bodies: Bodies, sub: SubStep, a: int, b: int, t: float) -> float:
    """Bound of the speed at which two surfaces can approach each other until t [m/s] (E26)."""
    bound = 0.0
    for end in range(2):
        s = t * end
        x = sub.path[b, 0, 1] - sub.path[a, 0, 1] + s * (2.0 * (sub.path[b, 0, 2] - sub.path[a, 0, 2]))
        y = sub.path[b, 1, 1] - sub.path[a, 1, 1] + s * (2.0 * (sub.path[b, 1, 2] - sub.path[a, 1, 2]))
        bound = max(bound, math.sqrt(x * x + y * y))
    for k in range(2):
        bound += bending(sub, a, k, t) + bending(sub, b, k, t)
    return bound + spin_bound(bodies, sub, a, b, t) + spin_bound(bodies, sub, b, a, t)


@inner_kernel
def spin_bound(bodies: Bodies, sub: SubStep, i: int, other: int, t: float) -> float:
    """Bound of the speed that body i's turning gives its surface where the other body is [m/s]."""
    if not spins(bodies, sub, i):
        return 0.0
    reach = bodies.real[i, REACH] - bodies.real[i, ROUNDING]  # a round edge about a vertex looks the same turned
    if not math.isfinite(reach):  # a turning half-space: as far out as the other body gets
        way = 0.0
        for k in range(2):
            way += t * (fastest(sub, other, k, t) + fastest(sub, i, k, t))
        dx, dy = bodies.pose[other, 0] - bodies.pose[i, 0], bodies.pose[other, 1] - bodies.pose[i, 1]
        reach = math.sqrt(dx * dx + dy * dy) + way + bodies.real[other, REACH]
    return fastest(sub, i, 2, t) * reach


@inner_kernel
def straight_impact(bodies: Bodies, sub: SubStep, a: int, b: int) -> float:
    """Impact with a half-space that does not turn, of a body whose turning does not matter (E25)."""
    collide(bodies, a, b, UNLIMITED, sub.probe, 0)
    nx, ny = sub.probe.real[0, NX], sub.probe.real[0, NY]
    closing = nx * (sub.path[b, 0, 1] - sub.path[a, 0, 1]) + ny * (sub.path[b, 1, 1] - sub.path[a, 1, 1])
    gain = nx * (sub.path[b, 0, 2] - sub.path[a, 0, 2]) + ny * (sub.path[b, 1, 2] - sub.path[a, 1, 2])
    gap = pair_gap(bodies, sub, a, b, NONE)
    if gap <= 0.0 and closing <= 0.0:
        return math.inf  # it touches: rows, not the time of impact, keep it from sinking
    return first_fall(max(gap, 0.0), closing, 2.0 * gain)


@inner_kernel
def narrow(bodies: Bodies, sub: SubStep, a: int, b: int, held: int, floor: float, low: float, high: float) -> float:
    """Last time before the gap, above ``floor`` at low and not at high, falls to it: halved to neighbouring doubles."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if gap_at(bodies, sub, a, b, held, middle) > floor:
            low = middle
        else:
            high = middle
    return low


@inner_kernel
def look_ahead(bodies: Bodies, sub: SubStep, a: int, b: int, held: int, floor: float, t: float, end: float) -> float:
    """First time after t at which a look finds the gap fallen to ``floor``, made exact; inf if none does (E27).

    Looks are close together first, for a contact that was just left, and evenly spread later. Bodies that come and
    part between two looks were closer than the gap they have now, not through each other.
    """
    low = t if gap_at(bodies, sub, a, b, held, t) > floor else -1.0
    for k in range(1, LOOKS_NEAR + LOOKS_EVEN):
        share = 0.5 ** (LOOKS_NEAR - k) if k < LOOKS_NEAR else float(k - LOOKS_NEAR + 1)
        s = t + (end - t) * min(share / LOOKS_EVEN, 1.0)
        if gap_at(bodies, sub, a, b, held, s) > floor:
            low = s
        elif low >= 0.0:
            return narrow(bodies, sub, a, b, held, floor, low, s)
    return math.inf


@inner_kernel
def advance_to_impact(bodies: Bodies, sub: SubStep, a: int, b: int, held: int, end: float) -> float:
    """First impact of bodies apart until ``end``, inf if there is none (E26).

    Conservative advancement: t + gap / bound cannot lie behind the impact (B. Mirtich, thesis, Berkeley 1996). A
    secant that lands behind it only serves to bracket it. Bodies that stay close without closing in are looked at
    instead: their safe advances would be short without end.
    """
    t, gap = 0.0, gap_at(bodies, sub, a, b, held, 0.0)
    bound = closing_bound(bodies, sub, a, b, end)
    if gap <= 0.0 or bound == 0.0:
        return math.inf
    for _ in range(ADVANCES):
        following = t + gap / bound
        if following >= end:
            return math.inf
        later = gap_at(bodies, sub, a, b, held, following)
        if later <= 0.0:
            return narrow(bodies, sub, a, b, held, 0.0, t, following)
        if later < gap:
            guess = min(following + 1.01 * later * (following - t) / (gap - later), end)
            if gap_at(bodies, sub, a, b, held, guess) <= 0.0:
                return narrow(bodies, sub, a, b, held, 0.0, following, guess)
        t, gap = following, later
    return look_ahead(bodies, sub, a, b, held, 0.0, t, end)


@inner_kernel
def pair_impact(bodies: Bodies, rows: Rows, sub: SubStep, a: int, b: int, m: int, end: float) -> float:
    """Next impact of one pair, whose manifold is m (-1: none)."""
    held, pressed, left = NONE, 0, 0
    points = 0 if m < 0 else rows.manifold[m + 1] - rows.manifold[m]
    for p in range(points):
        c = rows.manifold[m] + p
        if rows.real[c, TARGET] < 0.0 and rows.real[c, PN] == 0.0:
            left += 1
        else:
            held = rows.integer[c, FEATURE]
            pressed += 1
    # One of them is a box where a pair has two points.
    boxes = bodies.kind[a, SHAPE] >= BOX or bodies.kind[b, SHAPE] >= BOX
    if pressed == 2 or (pressed == 1 and not boxes):
        return math.inf
    plane = a if bodies.kind[a, SHAPE] == HALF_SPACE else b
    other = b if plane == a else a
    if pressed == 0 and bodies.kind[plane, SHAPE] == HALF_SPACE:
        straight = is_parabola(sub, plane) and is_parabola(sub, other)
        if straight and not spins(bodies, sub, plane) and not spins(bodies, sub, other):
            return straight_impact(bodies, sub, a, b)
    if pressed == 1 and not spins(bodies, sub, a) and not spins(bodies, sub, b):
        return math.inf
    if left == 0:
        return advance_to_impact(bodies, sub, a, b, held, end)
    # It left an overlap, if any, and is back when it overlaps more than that: round-off is no return.
    floor = min(gap_at(bodies, sub, a, b, held, 0.0), 0.0) - gap_noise(bodies, rows, rows.manifold[m])
    return look_ahead(bodies, sub, a, b, held, floor, 0.0, end)


@inner_kernel
def strikes_hard(bodies: Bodies, sub: SubStep, options: Options, a: int, b: int, t: float) -> bool:
    """Whether a pair that meets at time t does so faster than what loads do in a step (E28)."""
    place(bodies, sub, a, t)
    place(bodies, sub, b, t)
    nearest, approach, push = math.inf, 0.0, 0.0
    for c in range(collide(bodies, a, b, UNLIMITED, sub.probe, 0)):
        if sub.probe.real[c, GAP] < nearest:
            prepare_masses(bodies, sub.probe, c)
            nearest = sub.probe.real[c, GAP]
            approach = normal_velocity(sub.start, sub.probe, c) + t * normal_velocity(sub.gain, sub.probe, c)
            push = load_speed(bodies, sub.probe, c, options.dt)
    put_back(bodies, sub, a)
    put_back(bodies, sub, b)
    return approach < -push


@inner_kernel
def next_impact(bodies: Bodies, pairs: Pairs, rows: Rows, sub: SubStep, options: Options, end: float) -> float:
    """First time before ``end`` at which any two bodies meet, ``end`` if none do; -1 if there is no room (E27)."""
    if not bound_flight(bodies, pairs, sub, options, end):
        return end
    if not pair_bodies(bodies, pairs, rows, options):
        return -1.0
    n = len(bodies.kind)
    m = 0
    for k in range(rows.counts[CANDIDATES]):
        key = pairs.candidate[k]
        while m < rows.counts[MANIFOLDS] and manifold_key(rows, m, n) < key:
            m += 1
        own = m if m < rows.counts[MANIFOLDS] and manifold_key(rows, m, n) == key else -1
        t = pair_impact(bodies, rows, sub, key // n, key % n, own, end)
        if t < end and (sub.clock[HELD] == 0.0 or strikes_hard(bodies, sub, options, key // n, key % n, t)):
            end = t
    return end


@inner_kernel
def manifold_key(rows: Rows, m: int, n: int) -> int:
    """Pair of manifold m as one integer, like candidates."""
    return rows.integer[rows.manifold[m], A] * n + rows.integer[rows.manifold[m], B]
