"""The next instant of a sub-step at which bodies meet (E25 to E27)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.planar.broadphase import find_overlaps
from reference_solver.planar.columns import EXTENT, GAP, NX, NY, OTHER, PN, TARGET, A, B
from reference_solver.planar.flight import bound_flight, place, put_back
from reference_solver.planar.impact import describe, gap_noise, soft_speed
from reference_solver.planar.kinematics import normal_velocity
from reference_solver.planar.narrowphase import collide
from reference_solver.planar.state import CANDIDATES, MANIFOLDS, Bodies, Pairs, Rows, SubStep
from reference_solver.stepping.broadphase import bodies_of, pair_of
from reference_solver.stepping.clock import HELD
from reference_solver.stepping.options import Options
from reference_solver.stepping.paths import COEFFICIENTS
from reference_solver.stepping.time_of_impact import (
    DEEP,
    TOO_DEEP,
    UNLIMITED,
    first_contact,
    next_contact_of_held,
    overlap_time,
)


@inner_kernel
def begin_paths(bodies: Bodies, sub: SubStep, end: float) -> None:
    """Paths of all bodies over the sub-step up to ``end`` (E24)."""
    paths = sub.meeting.paths
    for i in range(len(bodies.kind)):
        paths.begin[i], paths.end[i] = 0.0, end
        for k in range(3):
            paths.pose[i, k] = sub.pose[i, k]
            for j in range(1, COEFFICIENTS):
                paths.coefficient[i, k, j] = sub.path[i, k, j]


@inner_kernel
def min_extent(sub: SubStep, a: int, b: int) -> float:
    """Smaller half width of two bodies [m]."""
    return min(sub.meeting.bodies.real[a, EXTENT], sub.meeting.bodies.real[b, EXTENT])


@inner_kernel
def pair_impact(rows: Rows, sub: SubStep, a: int, b: int, m: int, end: float) -> float:
    """Next impact of one pair, whose manifold is m (-1: none)."""
    pressed, normal = 0, -1
    for c in range(0 if m < 0 else rows.manifold[m], 0 if m < 0 else rows.manifold[m + 1]):
        if rows.real[c, TARGET] >= 0.0 or rows.real[c, PN] != 0.0:  # others were left
            pressed, normal = pressed + 1, c
    if pressed > 0 and sub.clock[HELD] > 0.0:
        t = overlap_time(sub.meeting, a, b, end, DEEP * min_extent(sub, a, b))
        if t < end:
            return t
    if pressed == 2:
        return math.inf
    if pressed == 1:  # its normal at the start, where the rows are those of mid-drift as well
        first = OTHER if sub.clock[HELD] > 0.0 else NX
        nx, ny = rows.real[normal, first], rows.real[normal, first + 1]
        return next_contact_of_held(sub.meeting, a, b, nx, ny, 0.0, 0.0, end)
    return first_contact(sub.meeting, a, b, 0.0, end)


@inner_kernel
def strikes_hard(bodies: Bodies, sub: SubStep, options: Options, a: int, b: int, t: float) -> bool:
    """Whether a pair that meets at time t does so faster than what loads do in a step (E28).

    Anywhere: a corner may land softly beside one that has, and another one hard.
    """
    place(bodies, sub, a, t)
    place(bodies, sub, b, t)
    nearest, hard = math.inf, False
    count = collide(bodies, a, b, UNLIMITED, options.dt, sub.probe, 0)
    for c in range(count):
        describe(bodies, sub.probe, c)
        nearest = min(nearest, sub.probe.real[c, GAP])
    for c in range(count):
        if sub.probe.real[c, GAP] <= max(nearest, gap_noise(bodies, sub.probe, c)):
            approach = normal_velocity(sub.start, sub.probe, c) + t * normal_velocity(sub.gain, sub.probe, c)
            hard = hard or approach < -soft_speed(bodies, sub.probe, c, options.dt)
    put_back(bodies, sub, a)
    put_back(bodies, sub, b)
    return hard


@inner_kernel
def hard_impact(bodies: Bodies, sub: SubStep, options: Options, a: int, b: int, t: float, end: float) -> float:
    """Time of the hard impact of a pair that meets at time t: then, or elsewhere after that; inf if none is.

    A pair that overlaps too deep in the end is told when it begins to: another feature of it touches.
    """
    if strikes_hard(bodies, sub, options, a, b, t):
        return t
    nx, ny, extent = sub.probe.real[0, NX], sub.probe.real[0, NY], min_extent(sub, a, b)
    deep = max(overlap_time(sub.meeting, a, b, end, DEEP * extent), t)
    if overlap_time(sub.meeting, a, b, end, TOO_DEEP * extent) < end:
        return deep
    t = min(next_contact_of_held(sub.meeting, a, b, nx, ny, 0.0, t, end), deep)
    return t if t < end and strikes_hard(bodies, sub, options, a, b, t) else math.inf


@inner_kernel
def next_impact(bodies: Bodies, pairs: Pairs, rows: Rows, sub: SubStep, options: Options, end: float) -> float:
    """First time before ``end`` at which any two bodies meet, ``end`` if none do; -1 if there is no room (E27)."""
    if not bound_flight(bodies, pairs, sub, options, end):
        return end
    if not find_overlaps(bodies, pairs, rows, options):
        return -1.0
    begin_paths(bodies, sub, end)
    m = 0
    for k in range(rows.counts[CANDIDATES]):
        pair = pairs.boxes.candidate[k]
        a, b = bodies_of(pair)
        while m < rows.counts[MANIFOLDS] and pair_of_manifold(rows, m) < pair:
            m += 1
        own = m if m < rows.counts[MANIFOLDS] and pair_of_manifold(rows, m) == pair else -1
        t = pair_impact(rows, sub, a, b, own, end)
        if t < end and sub.clock[HELD] > 0.0:
            t = hard_impact(bodies, sub, options, a, b, t, end)
        end = min(end, t)
    return end


@inner_kernel
def pair_of_manifold(rows: Rows, m: int) -> int:
    """Pair of manifold m as one integer, like candidates."""
    return pair_of(rows.integer[rows.manifold[m], A], rows.integer[rows.manifold[m], B])
