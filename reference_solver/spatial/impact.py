"""Impacts at one instant, before forces act, and how series of rebounds end (E20 to E22)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.spatial.certificate import certify, open_solve
from reference_solver.spatial.features import set_rows
from reference_solver.spatial.kinematics import load_speed, relative_twist, velocity_at
from reference_solver.spatial.prepare import measure_speed, still_speed
from reference_solver.spatial.separation import radius_of
from reference_solver.spatial.state import BOX, HALF_SPACE, POINTS, SPHERE, Bodies, Manifolds, SubStep
from reference_solver.spatial.vector import Vector, axis, dot, length, row, sub
from reference_solver.stepping.clock import BLOWS, LEFT, MEETING, SERIES, is_patient
from reference_solver.stepping.impacts import (
    CREEP,
    LANDED,
    NO_IMPACT,
    OPEN_ENDED,
    PARTS,
    REBOUNDED,
    SERIES_DRIFT,
    SERIES_ENDS,
    STRUCK,
    TURNED,
    drifts_aside,
    is_lowest,
    turns_aside,
)
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.noise import COORDINATE_NOISE, NOISE, PASSED_ON, ROUND_OFF, SPEED_SHARE, UNSOLVED
from reference_solver.stepping.options import Options
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTRADICTED_A, CONTRADICTED_B

#: A normal whose cosine with a box's axis is short of one by this is that of the face: 1e-6 rad.
FLUSH = 5e-13


@inner_kernel
def carries(manifolds: Manifolds, m: int, p: int, share: float) -> bool:
    """Whether a point carried more than round-off in a force phase of this share of a step.

    Bodies that fall together still touch, with impulses of a few units in the last place of their speeds.
    """
    speed = manifolds.impulse[m, p, 2] * manifolds.matrix[m, p, 5]
    return bool(speed > NOISE * share * manifolds.speed[m, p])


@inner_kernel
def clear_point(manifolds: Manifolds, m: int, p: int) -> None:
    """No impulse and no target."""
    manifolds.target[m, p] = 0.0
    manifolds.open[m, p] = 0
    for k in range(3):
        manifolds.impulse[m, p, k] = 0.0


@inner_kernel
def set_reference_speed(bodies: Bodies, manifolds: Manifolds, m: int, p: int, u: Vector, dt: float) -> None:
    """Speed that the residual of a point in a sub-step is measured against (E14), with the loads of a whole step.

    A body that rolls over the point has a large velocity and a large spin there whose difference is none: their
    round-off is of the size of the parts. Against loads of a short sub-step it could never be small.
    """
    measure_speed(bodies, manifolds, m, p, u, dt)
    manifolds.speed[m, p] = max(manifolds.speed[m, p], SPEED_SHARE * speed_of_parts(bodies, manifolds, m, p))


@inner_kernel
def speed_of_parts(bodies: Bodies, manifolds: Manifolds, m: int, p: int) -> float:
    """Size of the velocities that the relative one of a point is the sum of [m/s]."""
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    parts = length(row(bodies.twist, a, 0)) + length(row(bodies.twist, b, 0))
    parts += length(row(bodies.twist, a, 3)) * length(row(manifolds.arm_a[m], p, 0))
    parts += length(row(bodies.twist, b, 3)) * length(row(manifolds.arm_b[m], p, 0))
    return parts


@inner_kernel
def gap_noise(bodies: Bodies, manifolds: Manifolds, m: int, p: int) -> float:
    """Gap of a point that is round-off, not geometry [m]."""
    point = row(manifolds.point[m], p, 0)
    place = max(abs(point[0]), abs(point[1]), abs(point[2]))
    extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
    return ROUND_OFF * extent + COORDINATE_NOISE * place


@inner_kernel
def soft_speed(bodies: Bodies, manifolds: Manifolds, m: int, p: int, dt: float) -> float:
    """Speed up to which an impact is soft: what loads do in a step, or what closes next to nothing of a body in one."""
    extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
    return load_speed(bodies, manifolds, m, p, dt) + CREEP * extent / dt


@inner_kernel
def least_speed(bodies: Bodies, manifolds: Manifolds, m: int, p: int, dt: float) -> float:
    """Speed [m/s] below which the bodies of a point, whose reference speed is known, neither meet nor part."""
    return max(NOISE * manifolds.speed[m, p], still_speed(bodies, manifolds, m, dt))


@inner_kernel
def note_touching(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options) -> int:
    """Note the points that touch in the room of a phase (`operations.note_touching`).

    A lasting contact neither meets nor parts in the first impact of an instant: its normal has turned.
    """
    k, lasting, first = 0, sub_step.lasting, sub_step.clock[BLOWS] == 0.0
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            if manifolds.meets[m, p] == 0:
                continue
            if k == len(lasting.row):
                return -1
            lasting.row[k] = POINTS * m + p
            lasting.body[k, 0], lasting.body[k, 1] = manifolds.body_a[m], manifolds.body_b[m]
            for d in range(3):
                lasting.frame[k, 0, d] = manifolds.frame[m, 2, d]
                lasting.frame[k, 1, d], lasting.frame[k, 2, d] = manifolds.frame[m, 0, d], manifolds.frame[m, 1, d]
            set_rows(bodies, lasting, k, row(manifolds.arm_a[m], p, 0), row(manifolds.arm_b[m], p, 0))
            u = velocity_at(v, w, manifolds, m, p)
            set_reference_speed(bodies, manifolds, m, p, u, options.dt)
            lasting.speed[k, 0] = u[2]
            lasts = first and manifolds.lasts[m, p] == 1
            lasting.speeds[k] = math.inf if lasts else least_speed(bodies, manifolds, m, p, options.dt)
            lasting.friction[k] = manifolds.friction[m]
            lasting.usual[k, 0] = manifolds.restitution[m] if options.restitution else 0.0
            k += 1
    return k


@inner_kernel
def set_impact_targets(bodies: Bodies, manifolds: Manifolds, options: Options, first: bool) -> int:
    """Targets -e u- of points that meet (E21), 0 of all others that take part; returns what there is to solve.

    A lasting contact approaches because its normal turned, or closes the gap that opened so: it does not rebound,
    but what it approaches with goes at once, and is no force. That is so in the ``first`` impact of an instant.
    """
    found = NO_IMPACT
    for m in range(len(manifolds)):
        restitution = manifolds.restitution[m]
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            clear_point(manifolds, m, p)
            for k in range(3):
                manifolds.hit[m, p, k] = 0.0
            u = velocity_at(v, w, manifolds, m, p)
            set_reference_speed(bodies, manifolds, m, p, u, options.dt)
            manifolds.impact[m, p] = 0
            manifolds.open[m, p] = 1 if manifolds.ending[m, p] == PARTS else 0
            if u[2] >= -least_speed(bodies, manifolds, m, p, options.dt):
                continue
            if first and manifolds.lasts[m, p]:
                found = max(found, TURNED)
                continue
            if manifolds.meets[m, p] == 0:
                continue
            soft = REBOUNDED if options.restitution and restitution > 0.0 else LANDED
            found = max(found, soft if -u[2] <= soft_speed(bodies, manifolds, m, p, options.dt) else STRUCK)
            manifolds.impact[m, p] = 1
            if options.restitution and manifolds.ending[m, p] == OPEN_ENDED:
                manifolds.target[m, p] = -restitution * u[2]
    return found


@spliced_kernel
def collide_now(
    bodies: Bodies, manifolds: Manifolds, problem: Problem, sub_step: SubStep, options: Options, tally: Array
) -> int:
    """Impacts of all touching points together, from ``before`` to ``first`` (E21); what they were."""
    copy_vectors(bodies.before, bodies.twist)
    found = set_impact_targets(bodies, manifolds, options, sub_step.clock[BLOWS] == 0.0)
    if found != NO_IMPACT:
        open_solve(bodies, 0.0, tally)
        solve_velocities(bodies, manifolds, problem, options, tally)
        certify(bodies, manifolds, options, tally)
        doubt(bodies, manifolds, options, tally)
        for m in range(len(manifolds)):
            for p in range(manifolds.points[m]):
                for k in range(3):
                    manifolds.hit[m, p, k] = manifolds.impulse[m, p, k]
    copy_vectors(bodies.twist, bodies.first)
    return found


@inner_kernel
def doubt(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array) -> None:
    """Note the first pair that still approaches after a solve: no impulses keep it apart, however large they are.

    Measured by velocities alone, those after the solve as well, of what was at rest: the residual is measured against
    the impulse, which grows without bound.
    """
    fastest = 0.0
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            fastest = max(fastest, manifolds.speed[m, p])
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            missing = manifolds.target[m, p] - velocity_at(v, w, manifolds, m, p)[2]
            speed = max(manifolds.speed[m, p], SPEED_SHARE * speed_of_parts(bodies, manifolds, m, p))
            least = max(UNSOLVED * speed, PASSED_ON * fastest)
            if manifolds.open[m, p] == 0 and tally[CONTRADICTED_A] == 0.0 and missing > least:
                tally[CONTRADICTED_A] = 1.0 + bodies.number[manifolds.body_a[m]]
                tally[CONTRADICTED_B] = 1.0 + bodies.number[manifolds.body_b[m]]


@inner_kernel
def row_turn(bodies: Bodies, manifolds: Manifolds, m: int, slip: float, share: float) -> float:
    """Rate at which the rows of manifold m turn [rad/s]: spins of bodies with edges, and of round ones their passing.

    ``share``: of the change of velocities in the sub-step that is added.
    """
    rate, passing, radius, round_ones = 0.0, slip, 0.0, True
    n = row(manifolds.frame[m], 2, 0)
    for side in range(2):
        i = manifolds.body_a[m] if side == 0 else manifolds.body_b[m]
        spin = length(row(bodies.first, i, 3))
        spin += share * length(sub(row(bodies.twist, i, 3), row(bodies.first, i, 3)))
        if bodies.kind[i] != SPHERE:
            rate += spin
        round_ones = round_ones and bodies.kind[i] != HALF_SPACE
        if bodies.kind[i] == BOX:
            for k in range(3):
                round_ones = round_ones and abs(dot(axis(bodies.axes, i, k), n)) < 1.0 - FLUSH
        else:
            radius += radius_of(bodies, i)
        passing += radius_of(bodies, i) * spin
    if round_ones and radius > 0.0:
        rate += passing / radius
    return rate


@inner_kernel
def end_series(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options, time: float) -> bool:
    """Mark rebounds whose series ends in this sub-step (E22); True if any is new.

    ``bodies.twist`` are the velocities after ``time`` of it.
    """
    left = sub_step.clock[LEFT]
    new = False
    for m in range(len(manifolds)):
        e = manifolds.restitution[m]
        v, w = relative_twist(bodies.first, manifolds, m, options.rotation)
        v_last, w_last = relative_twist(bodies.twist, manifolds, m, options.rotation)
        v_before, w_before = relative_twist(bodies.before, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            if manifolds.impact[m, p] == 0 or manifolds.ending[m, p] != OPEN_ENDED or e == 0.0:
                continue
            u, u_last = velocity_at(v, w, manifolds, m, p), velocity_at(v_last, w_last, manifolds, m, p)
            leaves = u[2]
            pull = (leaves - u_last[2]) / time
            if leaves <= 0.0 or pull <= 0.0:
                continue
            if 2.0 * leaves <= pull * left * (1.0 - e):
                slip, gain = math.hypot(u[0], u[1]), math.hypot(u_last[0] - u[0], u_last[1] - u[1]) / time
                was = velocity_at(v_before, w_before, manifolds, m, p)
                slip = max(slip, math.hypot(was[0], was[1]))  # one that the impact ends as well
                slip = slip if slip > NOISE * manifolds.speed[m, p] else 0.0
                k = manifolds.matrix[m, p]
                rubs = manifolds.friction[m] * max(k[0], k[3]) / k[5]
                aside = drifts_aside(slip, gain, rubs, pull, 2.0 * leaves / pull, e)
                lasts = 2.0 * leaves / (pull * (1.0 - e))
                rate = row_turn(bodies, manifolds, m, math.hypot(u[0], u[1]), min(lasts / time, 1.0))
                aside += turns_aside(leaves, lasts, rate, options.dt)
                extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
                lowest = is_lowest(leaves, pull, gap_noise(bodies, manifolds, m, p), e)
                if aside > SERIES_DRIFT * extent and not lowest and is_patient(sub_step.clock):
                    continue
                if is_patient(sub_step.clock):
                    if lasts > sub_step.clock[MEETING]:
                        continue
                    sub_step.clock[SERIES] = max(sub_step.clock[SERIES], lasts)
                manifolds.ending[m, p] = SERIES_ENDS
                new = True
    return new
