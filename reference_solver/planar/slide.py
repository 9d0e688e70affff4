"""The force phase of a sub-step, and the instant inside it at which a slide ends (E23)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.planar.certificate import certify, open_solve, row_work
from reference_solver.planar.columns import (
    APPROACH,
    FORCE_N,
    FORCE_T,
    FRICTION,
    GAP,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    MOTION,
    PN,
    PT,
    SLIP,
    SPEED,
    TANGENT_MASS,
    TARGET,
)
from reference_solver.planar.impact import doubt, flies, gap_noise
from reference_solver.planar.iteration import solve_velocities
from reference_solver.planar.kinematics import copy_vectors, normal_velocity, tangent_velocity
from reference_solver.planar.midpoint import reach_end, turn_rows
from reference_solver.planar.rows import measure_speed, warm_start
from reference_solver.planar.state import CONTACTS, FREE, Bodies, Rows, SubStep
from reference_solver.stepping.clock import HELD
from reference_solver.stepping.noise import NOISE
from reference_solver.stepping.options import Options
from reference_solver.stepping.slides import CLOSE, SAME_TIME, SHORTER, STICK_SOLVES
from reference_solver.tally import CONTACT_WORK, LOAD_WORK, SURFACE_WORK, SWEEPS

#: Target of a row that parts, in multiples of its reference speed: nothing in a sub-step closes it that fast, so that
#: it carries no impulse.
FAR = 1e3


@inner_kernel
def press(
    bodies: Bodies,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    options: Options,
    tally: Array,
    length: float,
) -> None:
    """Velocities at the end of a sub-step of ``length``: from ``sub.start`` to ``bodies.twist`` (E19, E20).

    By the impulse-level scheme the solve is one for mean velocities, in which none parts beforehand (E28).
    """
    held = sub.clock[HELD] > 0.0
    copy_vectors(sub.start, bodies.twist)
    time = 0.5 * length if held else length
    if held:
        turn_rows(bodies, rows, sub, options, length)
    for c in range(rows.counts[CONTACTS]):
        u = rows.real[c, APPROACH] = normal_velocity(bodies.twist, rows, c)
        measure_speed(bodies, rows, c, options.dt)
        speed = rows.real[c, SPEED]
        rows.real[c, SLIP] = tangent_velocity(bodies.twist, rows, c)
        rows.real[c, PN], rows.real[c, PT] = time * rows.real[c, FORCE_N], time * rows.real[c, FORCE_T]
        leaves = not held and u > NOISE * speed
        if leaves and flies(bodies, rows, c, u, length):
            rows.real[c, TARGET] = -FAR * (speed + u)
            rows.real[c, PN] = rows.real[c, PT] = 0.0
        else:
            gap = rows.real[c, GAP] if rows.real[c, GAP] > gap_noise(bodies, rows, c) else 0.0
            rows.real[c, TARGET] = -gap / length
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FREE:
            for k in range(3):
                bodies.twist[i, k] += time * bodies.real[i, LOAD + k]
    open_solve(bodies, time, tally)
    if rows.counts[CONTACTS] > 0:
        warm_start(bodies, rows, options)
        solve_velocities(bodies, rows, problem, options, tally)
        certify(bodies, rows, options, tally)
        doubt(bodies, rows, tally)
    if held:
        reach_end(bodies, rows, sub)
        cut_work(bodies, rows, sub, tally, length, 1.0)


@inner_kernel
def cut_work(bodies: Bodies, rows: Rows, sub: SubStep, tally: Array, end: float, share: float) -> None:
    """Impulses times ``share``, and work in the tally, of a sub-step up to ``end`` with the present velocities."""
    for entry in range(CONTACT_WORK, LOAD_WORK + 1):
        tally[entry] = sub.tally[1, entry]
    for i in range(len(bodies.kind)):
        for k in range(3):
            bodies.start[i, k] = sub.start[i, k] + end * bodies.real[i, LOAD + k]
            inverse = bodies.real[i, INVERSE_MASS if k < 2 else INVERSE_INERTIA]
            if bodies.kind[i, MOTION] == FREE and inverse > 0.0:
                mean = 0.5 * (bodies.start[i, k] + sub.start[i, k])
                tally[LOAD_WORK] += end * bodies.real[i, LOAD + k] / inverse * mean
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN], rows.real[c, PT] = share * rows.real[c, PN], share * rows.real[c, PT]
        done, moved, _ = row_work(bodies, rows, c)
        tally[CONTACT_WORK], tally[SURFACE_WORK] = tally[CONTACT_WORK] + done, tally[SURFACE_WORK] + moved


@inner_kernel
def slip_end(bodies: Bodies, rows: Rows, length: float) -> float:
    """First time at which a slide of the solved sub-step comes to its end, inf if none does (E23).

    A row that still slips the same way goes on linearly. One that stuck or turned would, with its whole friction,
    have gone on past zero; how far, is told by its own effective mass.
    """
    first = math.inf
    for c in range(rows.counts[CONTACTS]):
        slip, pressed = rows.real[c, SLIP], rows.real[c, PN]
        if pressed <= 0.0 or rows.real[c, FRICTION] == 0.0 or abs(slip) <= NOISE * rows.real[c, SPEED]:
            continue
        whole = -math.copysign(rows.real[c, FRICTION] * pressed, slip)
        after = tangent_velocity(bodies.twist, rows, c) + (whole - rows.real[c, PT]) / rows.real[c, TANGENT_MASS]
        lost = slip - after
        if abs(after) <= NOISE * rows.real[c, SPEED]:
            first = min(first, length)
        elif lost * slip > 0.0:
            end = length * (slip / lost)
            if abs(slip) * end > gap_noise(bodies, rows, c):  # else it ends at once: a sticking contact that turned
                first = min(first, end)
    return first


@inner_kernel
def keep(tally: Array, kept: Array) -> None:
    """Remember a tally."""
    for k in range(len(tally)):
        kept[k] = tally[k]


@inner_kernel
def go_back(tally: Array, kept: Array) -> None:
    """Forget what solves that are made again entered since `keep`, but for the sweeps they cost."""
    sweeps = tally[SWEEPS]
    for k in range(len(tally)):
        tally[k] = kept[k]
    tally[SWEEPS] = sweeps


@inner_kernel
def press_until_stick(
    bodies: Bodies,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    options: Options,
    tally: Array,
    left: float,
) -> float:
    """Solve the sub-step up to the first end of a slide, or the whole of what is left; return its length."""
    keep(tally, sub.tally[1])
    press(bodies, rows, problem, sub, options, tally, left)
    if not options.friction or sub.clock[HELD] > 0.0:
        return left
    length, slipped = left, 0.0
    for _ in range(STICK_SOLVES):
        end = slip_end(bodies, rows, length)
        if end >= left * (1.0 - SAME_TIME) or abs(end - length) <= SAME_TIME * length:
            break
        if end < length and length - slipped <= CLOSE * length:
            break
        slipped = max(slipped, length) if end > length else slipped
        # What a row that stuck tells of its end ignores its neighbours; what one that slips tells is exact.
        length = end if end > length else SHORTER * end
        go_back(tally, sub.tally[1])
        press(bodies, rows, problem, sub, options, tally, length)
    return length
