"""Detection for located steps: the points that touch, and those that carried load a moment ago (E20)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.spatial.box_box import EDGE_ADVANTAGE, EXACT_ADVANTAGE
from reference_solver.spatial.broadphase import find_candidates
from reference_solver.spatial.impact import gap_noise, soft_speed
from reference_solver.spatial.kinematics import point_velocity
from reference_solver.spatial.manifolds import (
    friction_of,
    pair_key,
    restitution_of,
    set_frame,
    set_world_points,
    sort_points,
)
from reference_solver.spatial.narrowphase import collide
from reference_solver.spatial.prepare import set_response
from reference_solver.spatial.state import CANDIDATES, MANIFOLDS, PAST, REMEMBERED, Bodies, Detection, Manifolds, Memory
from reference_solver.spatial.vector import dot, row, sub, times
from reference_solver.stepping.broadphase import bodies_of
from reference_solver.stepping.clock import HELD, LEFT, UNSETTLED
from reference_solver.stepping.noise import LATE, NEARLY, NO_GAP
from reference_solver.stepping.options import Options


@inner_kernel
def detect_touching(
    bodies: Bodies,
    detection: Detection,
    manifolds: Manifolds,
    own: Memory,
    past: Memory,
    options: Options,
    clock: Array,
) -> int:
    """Fill the manifolds of all points that touch or last, in canonical order; their number, -1 if there is no room.

    Where what is left goes at impulse level, gaps with e = 0 that close softly may be closed; at the end of such a
    sub-step those that carried load in it are wanted, and overlaps (E28). ``own``: memory of the sub-step before;
    ``past``: of the step before; ``clock``: of the sub-step.
    """
    if not find_candidates(bodies, detection, options):
        return -1
    m, old = 0, 0
    memory = own[: max(detection.found[REMEMBERED], 0)]
    if detection.found[REMEMBERED] < 0:  # the first sub-step: the step before counts
        memory = past[: detection.found[PAST]]
    advantage = EDGE_ADVANTAGE if clock[HELD] > 0.0 else EXACT_ADVANTAGE
    for k in range(detection.found[CANDIDATES]):
        if m == len(manifolds):
            return -1
        a, b = bodies_of(detection.boxes.candidate[k])
        pair = pair_key(bodies, a, b)
        while old < len(memory) and memory.pair[old] < pair:
            old += 1
        known = old if old < len(memory) and memory.pair[old] == pair else -1
        if collide(bodies, detection, a, b, options.margin, options.dt, advantage, manifolds, m) == 0:
            continue
        sort_points(manifolds, m)
        set_world_points(bodies, manifolds, m)
        if clock[UNSETTLED] > 0.0:
            keep_loaded(bodies, manifolds, m, memory, known)
        else:
            may_close = clock[HELD] > 0.0 and restitution_of(bodies, detection, a, b) == 0.0
            late = NEARLY * options.dt if clock[HELD] > 0.0 else LATE * clock[LEFT]
            keep_points(bodies, manifolds, m, memory, known, late, options.dt if may_close else 0.0)
        if manifolds.points[m] > 0:
            describe(bodies, detection, manifolds, m, options)
            m += 1
    detection.found[MANIFOLDS] = m
    return m


@inner_kernel
def closed_gap(bodies: Bodies, manifolds: Manifolds, m: int, p: int) -> float:
    """Gap of a point that counts as none at impulse level [m]."""
    extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
    return max(gap_noise(bodies, manifolds, m, p), NO_GAP * extent)


@inner_kernel
def keep_points(
    bodies: Bodies, manifolds: Manifolds, m: int, memory: Memory, known: int, late: float, ahead: float
) -> None:
    """Keep the points that touch, and those that `memory` knows to carry load: they may close their gap.

    ``late``: time [s] within which what touches may close its gap; ``ahead``: the step, where others may be closed as
    well if their approach is soft (E28), else 0.
    """
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    kept = 0
    for p in range(manifolds.points[m]):
        at_a = point_velocity(bodies, a, row(manifolds.arm_a[m], p, 0))
        at_b = point_velocity(bodies, b, row(manifolds.arm_b[m], p, 0))
        approach = dot(row(manifolds.frame[m], 2, 0), sub(at_b, at_a))
        lasts = recall_force(manifolds, m, p, memory, known)
        meets = manifolds.gap[m, p] <= gap_noise(bodies, manifolds, m, p) + late * abs(approach)
        if lasts or meets or (ahead > 0.0 and -approach <= soft_speed(bodies, manifolds, m, p, ahead)):
            move_point(manifolds, m, p, kept)
            manifolds.lasts[m, kept] = 1 if lasts else 0
            manifolds.meets[m, kept] = 1 if meets else 0
            kept += 1
    manifolds.points[m] = kept


@inner_kernel
def keep_loaded(bodies: Bodies, manifolds: Manifolds, m: int, memory: Memory, known: int) -> None:
    """Keep the points that carried load in the sub-step that has ended, or overlap."""
    kept = 0
    for p in range(manifolds.points[m]):
        lasts = recall_force(manifolds, m, p, memory, known)
        if lasts or manifolds.gap[m, p] < -gap_noise(bodies, manifolds, m, p):
            move_point(manifolds, m, p, kept)
            manifolds.lasts[m, kept] = manifolds.meets[m, kept] = 1
            kept += 1
    manifolds.points[m] = kept


@inner_kernel
def move_point(manifolds: Manifolds, m: int, p: int, kept: int) -> None:
    """Give point p of manifold m the place ``kept``."""
    for d in range(3):
        manifolds.arm_a[m, kept, d] = manifolds.arm_a[m, p, d]
        manifolds.arm_b[m, kept, d] = manifolds.arm_b[m, p, d]
        manifolds.point[m, kept, d] = manifolds.point[m, p, d]
        manifolds.force[m, kept, d] = manifolds.force[m, p, d]
    manifolds.gap[m, kept] = manifolds.gap[m, p]
    manifolds.feature[m, kept] = manifolds.feature[m, p]


@inner_kernel
def recall_force(manifolds: Manifolds, m: int, p: int, memory: Memory, known: int) -> bool:
    """Give point p the force of the same feature in the sub-step before (world axes); whether there was any."""
    for d in range(3):
        manifolds.force[m, p, d] = 0.0
    if known < 0:
        return False
    for o in range(memory.points[known]):
        if memory.feature[known, o] == manifolds.feature[m, p]:
            for d in range(3):
                manifolds.force[m, p, d] = memory.impulse[known, o, d]
            return dot(row(manifolds.force[m], p, 0), row(manifolds.frame[m], 2, 0)) > 0.0
    return False


@inner_kernel
def describe(bodies: Bodies, detection: Detection, manifolds: Manifolds, m: int, options: Options) -> None:
    """Frame, responses and laws of manifold m, forces turned into its frame."""
    set_frame(bodies, manifolds, m)
    a, b = manifolds.body_a[m], manifolds.body_b[m]
    manifolds.friction[m] = friction_of(bodies, detection, a, b) if options.friction else 0.0
    manifolds.restitution[m] = restitution_of(bodies, detection, a, b)
    for p in range(manifolds.points[m]):
        set_response(bodies, manifolds, m, p, options)
        force = times(manifolds.frame, m, row(manifolds.force[m], p, 0))
        for d in range(3):
            manifolds.force[m, p, d] = force[d]
        manifolds.ending[m, p] = 0
