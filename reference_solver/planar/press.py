"""The force phase of a sub-step at one length: velocities at its end, impulses of its rows, and its work (E19, E20)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.planar.certificate import certify, open_solve, row_work
from reference_solver.planar.columns import (
    APPROACH,
    FORCE_N,
    FORCE_T,
    GAP,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    MOTION,
    PN,
    PT,
    SLIP,
    SPEED,
    TARGET,
)
from reference_solver.planar.impact import FAR, closed_gap, doubt, flies, gap_noise
from reference_solver.planar.kinematics import normal_velocity, tangent_velocity
from reference_solver.planar.midpoint import reach_end, turn_rows
from reference_solver.planar.rows import measure_speed, still_speed, warm_start
from reference_solver.planar.state import CONTACTS, FREE, Bodies, Rows, SubStep
from reference_solver.stepping.clock import HELD
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.noise import NOISE
from reference_solver.stepping.options import Options
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTACT_WORK, LOAD_WORK, SURFACE_WORK


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
        leaves = not held and u > max(NOISE * speed, still_speed(bodies, rows, c, options.dt))
        if leaves and flies(bodies, rows, c, u, length):
            rows.real[c, TARGET] = -FAR * (speed + u)
            rows.real[c, PN] = rows.real[c, PT] = 0.0
        else:
            none = closed_gap(bodies, rows, c) if held else gap_noise(bodies, rows, c)
            gap = rows.real[c, GAP] if rows.real[c, GAP] > none else 0.0
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
        tally[entry] = sub.struck[entry]
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
