"""The motion of a sub-step, its bounds, and the next instant at which bodies meet (E24, E27)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.spatial.broadphase import bound_bodies, pair_bodies
from reference_solver.spatial.flight import path_bound, place_at, reach_of
from reference_solver.spatial.impact import carries
from reference_solver.spatial.kinematics import relative_twist, velocity_at
from reference_solver.spatial.motion import momentum_of, spin_of
from reference_solver.spatial.separation import radius_of
from reference_solver.spatial.state import CANDIDATES, FIXED, FREE, HALF_SPACE, Bodies, Detection, Manifolds, SubStep
from reference_solver.spatial.time_of_impact import return_of_corners, strikes_hard, time_of_impact
from reference_solver.spatial.vector import add_scaled, row, sub
from reference_solver.stepping.clock import HELD
from reference_solver.stepping.noise import DRIFT
from reference_solver.stepping.options import Options

#: A body that gets no farther than this fraction of its smallest half width in a sub-step is at rest.
AT_REST = 1e-14


@inner_kernel
def begin_flight(bodies: Bodies, manifolds: Manifolds, options: Options, length: float) -> None:
    """Rates of a sub-step of ``length`` from its first and last velocities; ``twist`` is then the first (E24).

    What only its loads accelerate has exactly their rates, so that bodies which fall alike move straight to each other.
    """
    mark_closing(bodies, manifolds, options, length)
    for i in range(len(bodies)):
        loaded = bodies.motion[i] == FREE
        for k in range(6):
            bodies.last[i, k] = bodies.twist[i, k]
        for k in range(3):
            loaded = loaded and bodies.last[i, k] == bodies.first[i, k] + length * bodies.acceleration[i, k]
            bodies.momentum_before[i, k] = bodies.angular_momentum[i, k]
        for k in range(6):
            bodies.rate[i, k] = (bodies.last[i, k] - bodies.first[i, k]) / length
            bodies.twist[i, k] = bodies.first[i, k]
        if loaded:
            for k in range(3):
                bodies.rate[i, k] = bodies.acceleration[i, k]
        if bodies.gyroscopic[i]:
            begin_turn(bodies, i)


@inner_kernel
def begin_turn(bodies: Bodies, i: int) -> None:
    """Angular momentum after the impacts of a body with unequal moments, and the torque that acts from there on."""
    hit = momentum_of(bodies, i, sub(row(bodies.first, i, 3), row(bodies.before, i, 3)))
    torque = momentum_of(bodies, i, row(bodies.rate, i, 3))
    for k in range(3):
        bodies.angular_momentum[i, k] += hit[k]
        bodies.rate[i, 3 + k] = torque[k]


@inner_kernel
def undo(bodies: Bodies) -> None:
    """Back to where the sub-step began."""
    for i in range(len(bodies)):
        for k in range(6):
            bodies.twist[i, k] = bodies.before[i, k]
        for k in range(3):
            bodies.angular_momentum[i, k] = bodies.momentum_before[i, k]


@inner_kernel
def mark_closing(bodies: Bodies, manifolds: Manifolds, options: Options, length: float) -> None:
    """Bodies of loaded contacts whose normals turn or whose gaps close follow the velocity at the end (E24)."""
    for i in range(len(bodies)):
        bodies.closing[i] = 0
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.first, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            if not carries(manifolds, m, p, length / options.dt):
                continue
            drift = max(abs(velocity_at(v, w, manifolds, m, p)[2]), manifolds.gap[m, p] / length)
            if drift > DRIFT * manifolds.speed[m, p]:
                bodies.closing[manifolds.body_a[m]] = bodies.closing[manifolds.body_b[m]] = 1


@inner_kernel
def move_along(bodies: Bodies, t: float, whole: bool) -> None:
    """Go to time t of the sub-step (E24); ``whole``: its end, where velocities are what the solve found, to the bit."""
    for i in range(len(bodies)):
        if bodies.motion[i] == FIXED:
            continue
        place_at(bodies, i, t, bodies, i)
        for k in range(6):
            bodies.twist[i, k] = bodies.last[i, k] if whole else bodies.first[i, k] + t * bodies.rate[i, k]
        if bodies.gyroscopic[i]:
            momentum = add_scaled(row(bodies.angular_momentum, i, 0), t, row(bodies.rate, i, 3))
            w = spin_of(bodies, i, momentum)
            for k in range(3):
                bodies.angular_momentum[i, k] = momentum[k]
                bodies.twist[i, 3 + k] = w[k]


@inner_kernel
def bound_flight(bodies: Bodies, options: Options, t: float) -> bool:
    """Bounds of all bodies over the sub-step up to t; False if nothing moves."""
    bound_bodies(bodies, options)
    moves = False
    for i in range(len(bodies)):
        share = 2.0 if bodies.closing[i] else 1.0
        turns = bodies.turning[i] and (
            bodies.twist[i, 3] != 0.0
            or bodies.twist[i, 4] != 0.0
            or bodies.twist[i, 5] != 0.0
            or bodies.rate[i, 3] != 0.0
            or bodies.rate[i, 4] != 0.0
            or bodies.rate[i, 5] != 0.0
        )
        moves = moves or turns
        for k in range(3):
            v = bodies.twist[i, k]
            way = t * max(abs(v), abs(v + t * share * bodies.rate[i, k]))
            if bodies.curved[i]:
                way = path_bound(bodies, i, 0, 1, t) * t
            moves = moves or way > AT_REST * bodies.extent[i]
            if turns and bodies.kind[i] != HALF_SPACE:
                far = reach_of(bodies, i) + radius_of(bodies, i)
                bodies.low[i, k] = min(bodies.low[i, k], bodies.pose[i, k] - far)
                bodies.high[i, k] = max(bodies.high[i, k], bodies.pose[i, k] + far)
            bodies.low[i, k] -= way
            bodies.high[i, k] += way
    return moves


@inner_kernel
def pair_impact(
    bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options, a: int, b: int, m: int, end: float
) -> float:
    """Next impact of one pair, whose manifold is m (-1: none); only hard ones where the step is held (E28).

    A pair that is held by some points is not looked at again before the next sub-step, but for the free corners of a
    body that turns on a half-space.
    """
    held, corners = 0, 0
    for p in range(manifolds.points[m] if m >= 0 else 0):
        if manifolds.open[m, p] == 0:
            held += 1
            corners |= 1 << manifolds.feature[m, p]
    time = math.inf
    if held == 0:
        time = time_of_impact(bodies, sub_step.trial, a, b, end)
    elif bodies.kind[a] == HALF_SPACE or bodies.kind[b] == HALF_SPACE:
        time = return_of_corners(bodies, sub_step.trial, a, b, corners, end)
    if time < end and sub_step.clock[HELD] > 0.0:
        return time if strikes_hard(bodies, sub_step.trial, a, b, corners, options.dt, time) else math.inf
    return time


@inner_kernel
def next_impact(
    bodies: Bodies, detection: Detection, manifolds: Manifolds, sub_step: SubStep, options: Options, end: float
) -> float:
    """First time before ``end`` at which any two bodies meet, ``end`` if none do; -1 if there is no room (E27)."""
    if not bound_flight(bodies, options, end):
        return end
    if not pair_bodies(bodies, detection, options):
        return -1.0
    n = len(bodies)
    m = 0
    for k in range(detection.found[CANDIDATES]):
        key = detection.candidate[k]
        while m < len(manifolds) and manifolds.body_a[m] * n + manifolds.body_b[m] < key:
            m += 1
        own = m if m < len(manifolds) and manifolds.body_a[m] * n + manifolds.body_b[m] == key else -1
        end = min(end, pair_impact(bodies, manifolds, sub_step, options, key // n, key % n, own, end))
    return end
