"""Motion within one sub-step: constant accelerations, poses at any time of it, and how far bodies get (E19, E24)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.planar.broadphase import bound_bodies
from reference_solver.planar.columns import COS, EXTENT, GAP, MOTION, PN, REACH, SIN, SPEED, A, B
from reference_solver.planar.kinematics import normal_velocity
from reference_solver.planar.state import CONTACTS, FIXED, Bodies, Options, Pairs, Rows, SubStep

#: A body that gets no farther than this fraction of its smallest half width in a sub-step is at rest.
AT_REST = 1e-14
#: A gap drifts if its rate is more than this share of the contact's reference speed. What drifts less, by round-off or
#: the least disturbance, leaves a gap that the next sub-step closes.
DRIFT = 1e-6


@inner_kernel
def begin_flight(bodies: Bodies, rows: Rows, sub: SubStep, length: float) -> None:
    """Accelerations of a sub-step of ``length`` from its first and last velocities, and its start poses (E19)."""
    for i in range(len(bodies.kind)):
        sub.closing[i] = 0
        for k in range(3):
            sub.gain[i, k] = (bodies.twist[i, k] - sub.start[i, k]) / length
            sub.pose[i, k] = bodies.pose[i, k]
        sub.turn[i, 0], sub.turn[i, 1] = bodies.real[i, COS], bodies.real[i, SIN]
    for c in range(rows.counts[CONTACTS]):
        drift = max(abs(normal_velocity(sub.start, rows, c)), rows.real[c, GAP] / length)
        if rows.real[c, PN] > 0.0 and drift > DRIFT * rows.real[c, SPEED]:
            sub.closing[rows.integer[c, A]] = sub.closing[rows.integer[c, B]] = 1


@inner_kernel
def curvature(sub: SubStep, i: int, k: int) -> float:
    """Second derivative of body i's path in coordinate k (E24): a, twice a where `closing`."""
    return 2.0 * sub.gain[i, k] if sub.closing[i] else sub.gain[i, k]


@inner_kernel
def place(bodies: Bodies, sub: SubStep, i: int, t: float) -> None:
    """Put body i where it is at time t of the sub-step."""
    if bodies.kind[i, MOTION] == FIXED:
        return
    for k in range(3):
        bodies.pose[i, k] = sub.pose[i, k] + t * (sub.start[i, k] + 0.5 * t * curvature(sub, i, k))
    if bodies.pose[i, 2] != sub.pose[i, 2]:
        bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])


@inner_kernel
def put_back(bodies: Bodies, sub: SubStep, i: int) -> None:
    """Put body i where the sub-step began."""
    for k in range(3):
        bodies.pose[i, k] = sub.pose[i, k]
    bodies.real[i, COS], bodies.real[i, SIN] = sub.turn[i, 0], sub.turn[i, 1]


@inner_kernel
def move_along(bodies: Bodies, sub: SubStep, t: float, whole: bool) -> None:
    """Go to time t of the sub-step (E24); ``whole``: its end, where velocities are what the solve found, to the bit."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FIXED:
            continue
        for k in range(3):
            if not whole:
                bodies.twist[i, k] = sub.start[i, k] + t * sub.gain[i, k]
            first = bodies.twist[i, k] if sub.closing[i] else sub.start[i, k]
            bodies.pose[i, k] = sub.pose[i, k] + t * (0.5 * (first + bodies.twist[i, k]))
        if bodies.pose[i, 2] != sub.pose[i, 2]:
            bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])


@inner_kernel
def fastest(sub: SubStep, i: int, k: int, t: float) -> float:
    """Largest speed along coordinate k on body i's path until t: at an end, since it changes linearly."""
    return max(abs(sub.start[i, k]), abs(sub.start[i, k] + t * curvature(sub, i, k)))


@inner_kernel
def bound_flight(bodies: Bodies, pairs: Pairs, sub: SubStep, options: Options, t: float) -> bool:
    """Bounds of all bodies over the sub-step up to t; False if nothing moves."""
    bound_bodies(bodies, pairs, options)
    moves = False
    for i in range(len(bodies.kind)):
        spin = t * fastest(sub, i, 2, t)
        for k in range(2):
            way = t * fastest(sub, i, k, t)
            if way > AT_REST * bodies.real[i, EXTENT] or spin > AT_REST:
                moves = True
            if spin > 0.0:
                pairs.bounds[i, k] = min(pairs.bounds[i, k], bodies.pose[i, k] - bodies.real[i, REACH])
                pairs.bounds[i, 2 + k] = max(pairs.bounds[i, 2 + k], bodies.pose[i, k] + bodies.real[i, REACH])
            pairs.bounds[i, k] -= way
            pairs.bounds[i, 2 + k] += way
    return moves
