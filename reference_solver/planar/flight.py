"""Motion within one sub-step: constant accelerations, poses at any time of it, and how far bodies get (E19, E24)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.planar.broadphase import bound_bodies
from reference_solver.planar.columns import COS, EXTENT, GAP, MOTION, PN, REACH, SIN, SPEED, A, B
from reference_solver.planar.kinematics import normal_velocity
from reference_solver.planar.state import CONTACTS, FIXED, Bodies, Pairs, Rows, SubStep
from reference_solver.stepping.clock import HELD
from reference_solver.stepping.noise import DRIFT
from reference_solver.stepping.options import Options

#: A body that gets no farther than this fraction of its smallest half width in a sub-step is at rest.
AT_REST = 1e-14


@inner_kernel
def keep_start(bodies: Bodies, sub: SubStep) -> None:
    """Keep the poses that the sub-step begins with."""
    for i in range(len(bodies.kind)):
        for k in range(3):
            sub.pose[i, k] = bodies.pose[i, k]
        sub.turn[i, 0], sub.turn[i, 1] = bodies.real[i, COS], bodies.real[i, SIN]


@inner_kernel
def begin_flight(bodies: Bodies, rows: Rows, sub: SubStep, length: float) -> None:
    """Accelerations of a sub-step of ``length`` from its first and last velocities, and its start poses (E19)."""
    for i in range(len(bodies.kind)):
        sub.closing[i] = 0
        for k in range(3):
            sub.gain[i, k] = (bodies.twist[i, k] - sub.start[i, k]) / length
            sub.after[i, k] = bodies.twist[i, k]
    keep_start(bodies, sub)
    for c in range(rows.counts[CONTACTS] if sub.clock[HELD] == 0.0 else 0):
        drift = max(abs(normal_velocity(sub.start, rows, c)), rows.real[c, GAP] / length)
        if rows.real[c, PN] > 0.0 and drift > DRIFT * rows.real[c, SPEED]:
            sub.closing[rows.integer[c, A]] = sub.closing[rows.integer[c, B]] = 1
    for i in range(len(bodies.kind)):
        for k in range(3):
            sub.path[i, k, 1] = sub.start[i, k]
            sub.path[i, k, 2] = sub.gain[i, k] if sub.closing[i] else 0.5 * sub.gain[i, k]
            sub.path[i, k, 3] = sub.path[i, k, 4] = sub.path[i, k, 5] = 0.0


@inner_kernel
def place(bodies: Bodies, sub: SubStep, i: int, t: float) -> None:
    """Put body i where it is at time t of the sub-step."""
    if bodies.kind[i, MOTION] == FIXED:
        return
    for k in range(3):
        c = sub.path[i, k]
        bodies.pose[i, k] = sub.pose[i, k] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))
    if bodies.pose[i, 2] != sub.pose[i, 2]:
        bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])


@inner_kernel
def bending(sub: SubStep, i: int, k: int, t: float) -> float:
    """Bound of what the higher terms of a path add to a speed until t; 0 where accelerations are constant."""
    c = sub.path[i, k]
    return t * t * (3.0 * abs(c[3]) + t * (4.0 * abs(c[4]) + t * (5.0 * abs(c[5]))))


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
    """Bound of the speed along coordinate k on body i's path until t: where it changes linearly that at an end."""
    c = sub.path[i, k]
    return max(abs(c[1]), abs(c[1] + t * (2.0 * c[2]))) + bending(sub, i, k, t)


@inner_kernel
def bound_flight(bodies: Bodies, pairs: Pairs, sub: SubStep, options: Options, t: float) -> bool:
    """Bounds of all bodies over the sub-step up to t; False if nothing moves."""
    bound_bodies(bodies, pairs, options)
    boxes, moves = pairs.boxes, False
    for i in range(len(bodies.kind)):
        spin = t * fastest(sub, i, 2, t)
        for k in range(2):
            way = t * fastest(sub, i, k, t)
            if way > AT_REST * bodies.real[i, EXTENT] or spin > AT_REST:
                moves = True
            if spin > 0.0:
                boxes.low[i, k] = min(boxes.low[i, k], bodies.pose[i, k] - bodies.real[i, REACH])
                boxes.high[i, k] = max(boxes.high[i, k], bodies.pose[i, k] + bodies.real[i, REACH])
            boxes.low[i, k] -= way
            boxes.high[i, k] += way
    return moves


@inner_kernel
def push_bodies(bodies: Bodies, dt: float) -> None:
    """Advance x += h pseudo-velocity for everything that is not fixed (E16)."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] != FIXED:
            for k in range(3):
                bodies.pose[i, k] += dt * bodies.pseudo[i, k]
            if bodies.pseudo[i, 2] != 0.0:
                bodies.real[i, COS] = math.cos(bodies.pose[i, 2])
                bodies.real[i, SIN] = math.sin(bodies.pose[i, 2])
