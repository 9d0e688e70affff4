"""What happens at one instant: which rows touch, impacts before forces act, ends of bounce series (E20 to E22)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.planar.certificate import certify, open_solve
from reference_solver.planar.columns import (
    APPROACH,
    ARM_A,
    ARM_B,
    ENDING,
    EXTENT,
    FORCE_N,
    FORCE_T,
    FRICTION,
    GAP,
    IMPACT,
    IMPACT_N,
    IMPACT_T,
    MEETS,
    NORMAL_MASS,
    NUMBER,
    NX,
    NY,
    PN,
    POINT,
    PT,
    RESTITUTION,
    ROUNDING,
    ROW_INTEGERS,
    ROW_REALS,
    SHAPE,
    SPEED,
    TANGENT_MASS,
    TARGET,
    VERTICES,
    A,
    B,
)
from reference_solver.planar.kinematics import load_speed, normal_velocity, speed_at, tangent_velocity
from reference_solver.planar.lasting import edge_along, write_rows
from reference_solver.planar.manifolds import row_key
from reference_solver.planar.rows import measure_speed, prepare_masses, still_speed
from reference_solver.planar.state import CONTACTS, HALF_SPACE, MANIFOLDS, REMEMBERED, Bodies, Pairs, Rows, SubStep
from reference_solver.stepping.clock import BLOWS, HELD, LEFT, MEETING, SERIES, is_patient
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
    drifts_aside,
    is_lowest,
    turns_aside,
)
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.noise import (
    COORDINATE_NOISE,
    LATE,
    NEARLY,
    NO_GAP,
    NOISE,
    PASSED_ON,
    ROUND_OFF,
    SPEED_SHARE,
    UNSOLVED,
)
from reference_solver.stepping.options import Options
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTRADICTED_A, CONTRADICTED_B

#: Target of a row that parts, in multiples of its reference speed, or in an impact of the largest of all rows: nothing
#: closes it that fast, so that it carries no impulse.
FAR = 1e3


@inner_kernel
def gap_noise(bodies: Bodies, rows: Rows, c: int) -> float:
    """Gap of row c that is round-off, not geometry [m]."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    place = max(abs(rows.real[c, POINT]), abs(rows.real[c, POINT + 1]))
    return ROUND_OFF * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT]) + COORDINATE_NOISE * place


@inner_kernel
def closed_gap(bodies: Bodies, rows: Rows, c: int) -> float:
    """Gap of row c that counts as none at impulse level [m]."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    return max(gap_noise(bodies, rows, c), NO_GAP * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT]))


@inner_kernel
def restitution(bodies: Bodies, pairs: Pairs, rows: Rows, c: int) -> float:
    """E of row c; tables go by numbers in the world."""
    return pairs.restitution[bodies.kind[rows.integer[c, A], NUMBER], bodies.kind[rows.integer[c, B], NUMBER]]


@inner_kernel
def friction(bodies: Bodies, pairs: Pairs, rows: Rows, c: int) -> float:
    """Coefficient mu of row c."""
    return pairs.friction[bodies.kind[rows.integer[c, A], NUMBER], bodies.kind[rows.integer[c, B], NUMBER]]


@inner_kernel
def describe(bodies: Bodies, rows: Rows, c: int) -> None:
    """Levers, masses, place and approach of row c at the start of a sub-step."""
    prepare_masses(bodies, rows, c)
    a = rows.integer[c, A]
    for k in range(2):
        rows.real[c, POINT + k] = bodies.pose[a, k] + rows.real[c, ARM_A + k]
    rows.real[c, APPROACH] = normal_velocity(bodies.twist, rows, c)


@inner_kernel
def keep_touching(bodies: Bodies, pairs: Pairs, rows: Rows, sub: SubStep, dt: float) -> None:
    """Drop all rows but those that touch (E20).

    Where what is left goes at impulse level, gaps with e = 0 that close softly may be closed (E28).
    """
    left = sub.clock[LEFT]
    kept, manifolds = 0, 0
    for m in range(rows.counts[MANIFOLDS]):
        first = kept
        for c in range(rows.manifold[m], rows.manifold[m + 1]):
            describe(bodies, rows, c)
            rows.real[c, RESTITUTION] = restitution(bodies, pairs, rows, c)
            late = NEARLY * dt if sub.clock[HELD] > 0.0 else LATE * left
            reach = gap_noise(bodies, rows, c) + late * abs(rows.real[c, APPROACH])
            may_close = sub.clock[HELD] > 0.0 and rows.real[c, RESTITUTION] == 0.0
            if may_close and rows.real[c, GAP] > reach:
                may_close = -rows.real[c, APPROACH] <= soft_speed(bodies, rows, c, dt)
            if may_close or rows.real[c, GAP] <= reach:
                copy_row(rows, c, kept)
                rows.real[kept, FRICTION] = friction(bodies, pairs, rows, kept)
                rows.integer[kept, MEETS] = 1 if rows.real[kept, GAP] <= reach else 0
                rows.integer[kept, ENDING] = OPEN_ENDED
                rows.real[kept, FORCE_N], rows.real[kept, FORCE_T] = rows.real[kept, PN], rows.real[kept, PT]
                kept += 1
        if kept > first:
            rows.manifold[manifolds] = first
            manifolds += 1
    rows.manifold[manifolds] = kept
    rows.counts[CONTACTS], rows.counts[MANIFOLDS] = kept, manifolds


@inner_kernel
def keep_loaded(bodies: Bodies, pairs: Pairs, rows: Rows) -> bool:
    """Drop all rows but those that carried load in the sub-step that has ended, or overlap; False if none is left."""
    kept, manifolds, old = 0, 0, 0
    for m in range(rows.counts[MANIFOLDS]):
        first = kept
        for c in range(rows.manifold[m], rows.manifold[m + 1]):
            key = row_key(bodies, rows, c)
            while old < rows.counts[REMEMBERED] and rows.old_key[old] < key:
                old += 1
            known = old < rows.counts[REMEMBERED] and rows.old_key[old] == key
            loaded = known and rows.old_impulse[old, 0] > 0.0
            describe(bodies, rows, c)
            if loaded or rows.real[c, GAP] < -gap_noise(bodies, rows, c):
                copy_row(rows, c, kept)
                rows.real[kept, FRICTION] = friction(bodies, pairs, rows, kept)
                rows.real[kept, RESTITUTION] = 0.0
                rows.real[kept, FORCE_N] = rows.old_impulse[old, 0] if loaded else 0.0
                rows.real[kept, FORCE_T] = rows.old_impulse[old, 1] if loaded else 0.0
                kept += 1
        if kept > first:
            rows.manifold[manifolds] = first
            manifolds += 1
    rows.manifold[manifolds] = kept
    rows.counts[CONTACTS], rows.counts[MANIFOLDS] = kept, manifolds
    return kept > 0


@inner_kernel
def copy_row(rows: Rows, source: int, target: int) -> None:
    """Move a row up the list."""
    if source != target:
        for k in range(ROW_INTEGERS):
            rows.integer[target, k] = rows.integer[source, k]
        for k in range(ROW_REALS):
            rows.real[target, k] = rows.real[source, k]


@inner_kernel
def soft_speed(bodies: Bodies, rows: Rows, c: int, dt: float) -> float:
    """Speed up to which an impact is soft: what loads do in a step, or what closes next to nothing of a body in one."""
    a, b = rows.integer[c, A], rows.integer[c, B]
    return load_speed(bodies, rows, c, dt) + CREEP * min(bodies.real[a, EXTENT], bodies.real[b, EXTENT]) / dt


@inner_kernel
def least_speed(bodies: Bodies, rows: Rows, c: int, dt: float) -> float:
    """Speed [m/s] below which the bodies of row c, whose reference speed is known, neither meet nor part."""
    return max(NOISE * rows.real[c, SPEED], still_speed(bodies, rows, c, dt))


@inner_kernel
def note_touching(bodies: Bodies, rows: Rows, sub: SubStep, options: Options) -> int:
    """Note the rows that touch in the room of a phase (`operations.note_touching`).

    One that carried load does not part in the first impact of an instant: its normal has turned.
    """
    k, lasting, first = 0, sub.lasting, sub.clock[BLOWS] == 0.0
    for c in range(rows.counts[CONTACTS]):
        if rows.integer[c, MEETS] == 0:
            continue
        if k == len(lasting.row):
            return -1
        lasting.row[k] = c
        lasting.body[k, 0], lasting.body[k, 1] = rows.integer[c, A], rows.integer[c, B]
        arms = (rows.real[c, ARM_A], rows.real[c, ARM_A + 1], rows.real[c, ARM_B], rows.real[c, ARM_B + 1])
        write_rows(bodies, lasting, k, (rows.real[c, NX], rows.real[c, NY]), arms)
        measure_speed(bodies, rows, c, options.dt)
        lasts = first and rows.real[c, FORCE_N] > 0.0 and rows.real[c, APPROACH] > 0.0
        lasting.speeds[k] = math.inf if lasts else least_speed(bodies, rows, c, options.dt)
        lasting.friction[k] = rows.real[c, FRICTION] if options.friction else 0.0
        lasting.usual[k, 0] = rows.real[c, RESTITUTION] if options.restitution else 0.0
        k += 1
    return k


@inner_kernel
def set_impact_targets(bodies: Bodies, rows: Rows, options: Options) -> int:
    """Targets -e u- of rows that meet (E21), 0 of all others that take part; returns what there is to solve."""
    found, fastest = NO_IMPACT, 0.0
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN] = rows.real[c, PT] = 0.0
        rows.real[c, IMPACT_N] = rows.real[c, IMPACT_T] = 0.0
        rows.real[c, TARGET] = 0.0
        u = rows.real[c, APPROACH] = normal_velocity(bodies.twist, rows, c)
        measure_speed(bodies, rows, c, options.dt)
        fastest = max(fastest, rows.real[c, SPEED])
        rows.integer[c, IMPACT] = 0
        if u >= -least_speed(bodies, rows, c, options.dt):
            continue
        if rows.integer[c, MEETS] == 0:
            continue
        soft = REBOUNDED if options.restitution and rows.real[c, RESTITUTION] > 0.0 else LANDED
        found = max(found, soft if -u <= soft_speed(bodies, rows, c, options.dt) else STRUCK)
        rows.integer[c, IMPACT] = 1
        if options.restitution and rows.integer[c, ENDING] == OPEN_ENDED:
            rows.real[c, TARGET] = -rows.real[c, RESTITUTION] * u
    for c in range(rows.counts[CONTACTS]):
        if rows.integer[c, ENDING] == PARTS:
            rows.real[c, TARGET] = -FAR * fastest
    return found


@inner_kernel
def collide_now(bodies: Bodies, rows: Rows, problem: Problem, sub: SubStep, options: Options, tally: Array) -> int:
    """Impacts of all touching rows together, from ``sub.before`` to ``sub.start`` (E21); what they were."""
    copy_vectors(sub.before, bodies.twist)
    found = set_impact_targets(bodies, rows, options)
    if found != NO_IMPACT:
        open_solve(bodies, 0.0, tally)
        solve_velocities(bodies, rows, problem, options, tally)
        certify(bodies, rows, options, tally)
        doubt(bodies, rows, tally)
        for c in range(rows.counts[CONTACTS]):
            rows.real[c, IMPACT_N], rows.real[c, IMPACT_T] = rows.real[c, PN], rows.real[c, PT]
    copy_vectors(bodies.twist, sub.start)
    return found


@inner_kernel
def doubt(bodies: Bodies, rows: Rows, tally: Array) -> None:
    """Note the first pair that still approaches after a solve: no impulses keep it apart, however large they are.

    Measured by velocities alone, those after the solve as well, of what was at rest: the residual is measured against
    the impulse, which grows without bound.
    """
    fastest = 0.0
    for c in range(rows.counts[CONTACTS]):
        fastest = max(fastest, rows.real[c, SPEED])
    for c in range(rows.counts[CONTACTS]):
        missing = rows.real[c, TARGET] - normal_velocity(bodies.twist, rows, c)
        speed = speed_at(bodies, rows.integer[c, A], rows.real[c, ARM_A], rows.real[c, ARM_A + 1])
        speed += speed_at(bodies, rows.integer[c, B], rows.real[c, ARM_B], rows.real[c, ARM_B + 1])
        least = max(UNSOLVED * max(rows.real[c, SPEED], SPEED_SHARE * speed), PASSED_ON * fastest)
        if tally[CONTRADICTED_A] == 0.0 and missing > least:
            tally[CONTRADICTED_A] = 1.0 + bodies.kind[rows.integer[c, A], NUMBER]
            tally[CONTRADICTED_B] = 1.0 + bodies.kind[rows.integer[c, B], NUMBER]


@inner_kernel
def row_turn(bodies: Bodies, rows: Rows, sub: SubStep, c: int, share: float) -> float:
    """Rate at which row c turns [rad/s]: spins of bodies with edges, and of round ones how fast they pass each other.

    ``share``: of the change of velocities in the sub-step that is added.
    """
    a, b = rows.integer[c, A], rows.integer[c, B]
    rate, passing, radius, round_ones = 0.0, abs(tangent_velocity(sub.start, rows, c)), 0.0, True
    for side in range(2):
        i = a if side == 0 else b
        spin = abs(sub.start[i, 2]) + share * abs(bodies.twist[i, 2] - sub.start[i, 2])
        if bodies.kind[i, SHAPE] == HALF_SPACE or bodies.kind[i, VERTICES] > 1:
            rate += spin
        radius += bodies.real[i, ROUNDING]
        passing += bodies.real[i, ROUNDING] * spin
        along = edge_along(bodies, i, rows.real[c, NX] * (1.0 - 2.0 * side), rows.real[c, NY] * (1.0 - 2.0 * side))
        round_ones = round_ones and bodies.kind[i, SHAPE] != HALF_SPACE and along < 0
    if round_ones and radius > 0.0:
        rate += passing / radius
    return rate


@inner_kernel
def end_series(bodies: Bodies, rows: Rows, sub: SubStep, options: Options, length: float) -> bool:
    """Mark rebounds whose series ends in this sub-step (E22); True if any is new.

    ``bodies.twist`` are the velocities after ``length`` of it.
    """
    left = sub.clock[LEFT]
    new = False
    for c in range(rows.counts[CONTACTS]):
        if rows.integer[c, IMPACT] == 0 or rows.integer[c, ENDING] != OPEN_ENDED:
            continue
        e = rows.real[c, RESTITUTION]
        leaves = normal_velocity(sub.start, rows, c)
        pull = (leaves - normal_velocity(bodies.twist, rows, c)) / length
        if e == 0.0 or leaves <= 0.0 or pull <= 0.0:
            continue
        returns = 2.0 * leaves / pull
        if returns <= left * (1.0 - e):
            slip = tangent_velocity(sub.start, rows, c)
            gain = (tangent_velocity(bodies.twist, rows, c) - slip) / length
            slip = max(abs(slip), abs(tangent_velocity(sub.before, rows, c)))  # one that the impact ends as well
            slip = slip if slip > NOISE * rows.real[c, SPEED] else 0.0
            rubs = rows.real[c, FRICTION] * rows.real[c, NORMAL_MASS] / rows.real[c, TANGENT_MASS]
            aside = drifts_aside(slip, gain, rubs, pull, returns, e)
            lasts = returns / (1.0 - e)
            rate = row_turn(bodies, rows, sub, c, min(lasts / length, 1.0))
            aside += turns_aside(leaves, lasts, rate, options.dt)
            extent = min(bodies.real[rows.integer[c, A], EXTENT], bodies.real[rows.integer[c, B], EXTENT])
            lowest = is_lowest(leaves, pull, gap_noise(bodies, rows, c), e)
            if aside > SERIES_DRIFT * extent and not lowest and is_patient(sub.clock):
                continue
            if is_patient(sub.clock):
                if lasts > sub.clock[MEETING]:
                    continue
                sub.clock[SERIES] = max(sub.clock[SERIES], lasts)
            rows.integer[c, ENDING] = SERIES_ENDS
            new = True
    return new


@inner_kernel
def flies(bodies: Bodies, rows: Rows, c: int, u: float, length: float) -> bool:
    """Whether a contact that parts with u leaves, and loads do not bring it back within ``length`` from mere noise.

    A rebound with e > 0 always does, however low: its series ends when it ends; rocking that ends does not (E22).
    """
    if rows.integer[c, IMPACT] and rows.real[c, RESTITUTION] > 0.0:
        return True
    if rows.integer[c, ENDING] == SERIES_ENDS:
        return False
    pull = load_speed(bodies, rows, c, 1.0)
    return u * u > 2.0 * pull * gap_noise(bodies, rows, c) or 2.0 * u > pull * length
