"""The next instant of a sub-step at which bodies meet (E25 to E27)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.spatial.box_box import EXACT_ADVANTAGE
from reference_solver.spatial.broadphase import find_overlaps
from reference_solver.spatial.flight import axis_drift, bound_flight, copy_body, curvature, place_at
from reference_solver.spatial.impact import gap_noise, soft_speed
from reference_solver.spatial.kinematics import point_velocity
from reference_solver.spatial.manifolds import set_world_points
from reference_solver.spatial.narrowphase import collide
from reference_solver.spatial.state import CANDIDATES, Bodies, Detection, Manifolds, SubStep
from reference_solver.spatial.vector import Vector, dot, row, sub
from reference_solver.stepping.broadphase import bodies_of, pair_of
from reference_solver.stepping.clock import HELD
from reference_solver.stepping.options import Options
from reference_solver.stepping.paths import COEFFICIENTS, Paths
from reference_solver.stepping.time_of_impact import (
    DEEP,
    TOO_DEEP,
    UNLIMITED,
    first_contact,
    next_contact_of_held,
    overlap_time,
)

#: Overlap of bodies held in a phase, as a share of the smaller half width, at which their contact is another one: less
#: than what a contact that is held may have (`phase.CLOSED`).
SLIGHT = 2e-10
#: As many corners of a convex polygon are never in line: where they are pressed faces lie on each other, and nothing is
#: left to come down.
CORNERS_OF_FACE = 4


@kernel
def begin_paths(bodies: Bodies, paths: Paths, end: float) -> None:
    """Paths of all bodies over the sub-step up to ``end`` (E24); those of bodies that turn by momentum do not turn."""
    for i in range(len(bodies)):
        paths.begin[i], paths.end[i] = 0.0, end
        for k in range(7):
            paths.pose[i, k] = bodies.pose[i, k]
        for k in range(6):
            for j in range(COEFFICIENTS):
                paths.coefficient[i, k, j] = bodies.path[i, k, j] if bodies.curved[i] else 0.0
        for start in range(0 if bodies.curved[i] else 2):
            if start == 1 and (bodies.gyroscopic[i] or not bodies.turning[i]):
                continue
            bend = curvature(bodies, i, 3 * start)
            for d in range(3):
                paths.coefficient[i, 3 * start + d, 1] = bodies.twist[i, 3 * start + d]
                paths.coefficient[i, 3 * start + d, 2] = 0.5 * bend[d]
            if start == 1:
                drift = axis_drift(row(bodies.twist, i, 3), bend)
                for d in range(3):
                    paths.coefficient[i, 3 + d, 3] = drift[d]


@inner_kernel
def is_pressed(manifolds: Manifolds, m: int, p: int, held: bool) -> bool:
    """Whether a point is held in the sub-step; at impulse level others were left to go (E28)."""
    if held:
        return bool(manifolds.target[m, p] >= 0.0 or manifolds.impulse[m, p, 2] != 0.0)
    return bool(manifolds.open[m, p] == 0)


@inner_kernel
def pair_impact(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, a: int, b: int, m: int, end: float) -> float:
    """Next impact of one pair, whose manifold is m (-1: none)."""
    held, pressed = sub_step.clock[HELD] > 0.0, 0
    for p in range(manifolds.points[m] if m >= 0 else 0):
        pressed += 1 if is_pressed(manifolds, m, p, held) else 0
    if pressed == 0:
        return first_contact(sub_step.meeting, a, b, 0.0, end)
    # What holds them may let go, and edges that cross end where one comes to lie along a face: nobody else looks there.
    depth = (DEEP if held else SLIGHT) * min(bodies.extent[a], bodies.extent[b])
    t = overlap_time(sub_step.meeting, a, b, end, depth)
    if pressed >= CORNERS_OF_FACE or (held and t < end):
        return t
    # The normal at the start, where the rows may be those of mid-drift.
    n = row(sub_step.kept.frame[m], 2, 0) if held else row(manifolds.frame[m], 2, 0)
    return min(t, next_contact_of_held(sub_step.meeting, a, b, n[0], n[1], n[2], 0.0, end))


@inner_kernel
def strikes_hard(
    bodies: Bodies, detection: Detection, sub_step: SubStep, options: Options, a: int, b: int, t: float
) -> bool:
    """Whether a pair that meets at time t does so faster than what loads do in a step (E28).

    Anywhere: a corner may land softly beside one that has, and another one hard.
    """
    trial, probe = sub_step.trial, sub_step.probe
    copy_body(bodies, a, trial, 0)
    copy_body(bodies, b, trial, 1)
    place_at(bodies, a, t, trial, 0)
    place_at(bodies, b, t, trial, 1)
    nearest, hard = math.inf, False
    count = collide(trial, detection, 0, 1, UNLIMITED, options.dt, EXACT_ADVANTAGE, probe, 0)
    set_world_points(trial, probe, 0)
    for p in range(count):
        nearest = min(nearest, probe.gap[0, p])
    noise = gap_noise(trial, probe, 0, 0)
    probe.body_a[0], probe.body_b[0] = a, b
    for p in range(count):
        if probe.gap[0, p] <= max(nearest, noise):
            at_a = point_velocity(trial, 0, row(probe.arm_a[0], p, 0))
            at_b = point_velocity(trial, 1, row(probe.arm_b[0], p, 0))
            approach = dot(row(probe.frame[0], 2, 0), sub(at_b, at_a))
            hard = hard or approach < -soft_speed(bodies, probe, 0, p, options.dt)
    return hard


@inner_kernel
def hard_impact(
    bodies: Bodies, detection: Detection, sub_step: SubStep, options: Options, a: int, b: int, t: float, end: float
) -> float:
    """Time of the hard impact of a pair that meets at time t: then, or elsewhere after that; inf if none is.

    A pair that overlaps too deep in the end is told when it begins to: another feature of it touches.
    """
    if strikes_hard(bodies, detection, sub_step, options, a, b, t):
        return t
    n: Vector = row(sub_step.probe.frame[0], 2, 0)
    extent = min(bodies.extent[a], bodies.extent[b])
    deep = max(overlap_time(sub_step.meeting, a, b, end, DEEP * extent), t)
    if overlap_time(sub_step.meeting, a, b, end, TOO_DEEP * extent) < end:
        return deep
    t = min(next_contact_of_held(sub_step.meeting, a, b, n[0], n[1], n[2], t, end), deep)
    return t if t < end and strikes_hard(bodies, detection, sub_step, options, a, b, t) else math.inf


@inner_kernel
def next_impact(
    bodies: Bodies, detection: Detection, manifolds: Manifolds, sub_step: SubStep, options: Options, end: float
) -> float:
    """First time before ``end`` at which any two bodies meet, ``end`` if none do; -1 if there is no room (E27)."""
    if not bound_flight(bodies, detection.boxes, options, end):
        return end
    if not find_overlaps(bodies, detection, options):
        return -1.0
    begin_paths(bodies, sub_step.meeting.paths, end)
    m = 0
    for k in range(detection.found[CANDIDATES]):
        pair = detection.boxes.candidate[k]
        a, b = bodies_of(pair)
        while m < len(manifolds) and pair_of(manifolds.body_a[m], manifolds.body_b[m]) < pair:
            m += 1
        own = m if m < len(manifolds) and pair_of(manifolds.body_a[m], manifolds.body_b[m]) == pair else -1
        t = pair_impact(bodies, manifolds, sub_step, a, b, own, end)
        if t < end and sub_step.clock[HELD] > 0.0:
            t = hard_impact(bodies, detection, sub_step, options, a, b, t, end)
        end = min(end, t)
    return end
