"""Detection: from poses to manifolds in canonical order, with the impulses remembered from the step before."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.textbook.broadphase import bodies_of, pair_of
from reference_solver.textbook.noise import TOUCHING
from reference_solver.textbook.options import BLOCK, Options
from reference_solver.textbook3.broadphase import find_candidates
from reference_solver.textbook3.narrowphase import collide
from reference_solver.textbook3.state import (
    CANDIDATES,
    MANIFOLDS,
    REMEMBERED,
    Bodies,
    Detection,
    Manifolds,
    Memory,
)
from reference_solver.textbook3.vector import dot, row, sub, tangents

#: Heights of a manifold's points over their centre below this fraction of the smaller half width count as none.
#: Points at different height cannot all stick while the bodies turn about a tangent: they would slip at that fraction
#: of the other speeds, with a friction that hardly determines itself (condition 1 / height^2). Where a contact point
#: lies between two overlapping surfaces is uncertain by more, g dt^2 at least.
FLAT = 1e-4
#: Points of two steps are the same if they are nearer than this share of the smaller half width. Bodies at rest move
#: much less in a step. The next corner of a face is two half widths away: an impulse given to it would tilt the body.
SAME_PLACE = 0.1


@inner_kernel
def detect(bodies: Bodies, detection: Detection, manifolds: Manifolds, options: Options) -> int:
    """Fill the geometry of all manifolds and return how many; -1 if an array is too small.

    Candidates come in ascending order and the points of a pair are sorted by feature, so that contacts are
    sorted by (body_a, body_b, feature): the same order in every run, whatever happened before.
    """
    if not find_candidates(bodies, detection, options):
        return -1
    m = 0
    for k in range(detection.found[CANDIDATES]):
        if m == len(manifolds):
            return -1
        a, b = bodies_of(detection.boxes.candidate[k])
        # What flies towards a rebound must not be slowed down before it gets there (E8).
        bounces = options.restitution and detection.restitution[a, b] > 0.0
        # The textbook asks for gaps alone; it keeps its bits.
        ahead = options.dt if options.solver == BLOCK else 0.0
        found = collide(bodies, detection, a, b, TOUCHING if bounces else options.margin, ahead, manifolds, m)
        if found > 0:
            sort_points(manifolds, m)
            set_frame(bodies, manifolds, m)
            set_world_points(bodies, manifolds, m)
            m += 1
    detection.found[MANIFOLDS] = m
    return m


@inner_kernel
def sort_points(manifolds: Manifolds, m: int) -> None:
    """Sort the points of manifold m by feature (insertion sort of at most eight)."""
    for i in range(1, manifolds.points[m]):
        j = i
        while j > 0 and manifolds.feature[m, j] < manifolds.feature[m, j - 1]:
            swap(manifolds.feature[m], j)
            swap(manifolds.gap[m], j)
            for d in range(3):
                swap(manifolds.arm_a[m, :, d], j)
                swap(manifolds.arm_b[m, :, d], j)
            j -= 1


@inner_kernel
def swap(values, j):
    """Exchange entries j and j - 1."""
    values[j], values[j - 1] = values[j - 1], values[j]


@inner_kernel
def set_frame(bodies: Bodies, manifolds: Manifolds, m: int) -> None:
    """Tangents, levers of the manifold's centre, and the points' offsets from it in the contact frame.

    All velocities and impulses of a manifold act through the relative twist and the wrench at its centre.
    """
    extent = min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
    count = manifolds.points[m]
    t1, t2 = tangents(row(manifolds.frame[m], 2, 0))
    for d in range(3):
        manifolds.frame[m, 0, d] = t1[d]
        manifolds.frame[m, 1, d] = t2[d]
        lever_a, lever_b = 0.0, 0.0
        for p in range(count):
            lever_a += manifolds.arm_a[m, p, d]
            lever_b += manifolds.arm_b[m, p, d]
        manifolds.lever_a[m, d] = lever_a / count
        manifolds.lever_b[m, d] = lever_b / count
    for p in range(count):
        for k in range(3):
            offset = 0.0
            for d in range(3):
                offset += manifolds.frame[m, k, d] * (manifolds.arm_b[m, p, d] - manifolds.lever_b[m, d])
            manifolds.offset[m, p, k] = offset
        height = manifolds.offset[m, p, 2]
        if abs(height) <= FLAT * extent:
            manifolds.offset[m, p, 2] = 0.0
            for d in range(3):
                manifolds.arm_a[m, p, d] -= height * manifolds.frame[m, 2, d]
                manifolds.arm_b[m, p, d] -= height * manifolds.frame[m, 2, d]


@inner_kernel
def set_world_points(bodies: Bodies, manifolds: Manifolds, m: int) -> None:
    """Contact points in world axes, from B's centre: B is the one that moves where A is the ground."""
    b = manifolds.body_b[m]
    for p in range(manifolds.points[m]):
        for d in range(3):
            manifolds.point[m, p, d] = bodies.pose[b, d] + manifolds.arm_b[m, p, d]


@inner_kernel
def recall(bodies: Bodies, detection: Detection, manifolds: Manifolds, memory: Memory, options: Options) -> None:
    """Give each point an impulse of its pair one step before: a merge of two sorted lists of detection."""
    old = 0
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            for k in range(3):
                manifolds.impulse[m, p, k] = 0.0
        pair = pair_of(manifolds.body_a[m], manifolds.body_b[m])
        while old < detection.found[REMEMBERED] and memory.pair[old] < pair:
            old += 1
        if options.warm_starting and old < detection.found[REMEMBERED] and memory.pair[old] == pair:
            recall_points(bodies, manifolds, m, memory, old)


@inner_kernel
def recall_points(bodies: Bodies, manifolds: Manifolds, m: int, memory: Memory, old: int) -> None:
    """Match the points of manifold m with those of remembered manifold `old`: by their features, then by their places.

    Corners of two faces that lie on each other come and go as points of another feature at nearly the same place.
    """
    matched, taken = 0, 0
    for p in range(manifolds.points[m]):
        for o in range(memory.points[old]):
            if memory.feature[old, o] == manifolds.feature[m, p]:
                recall_impulse(manifolds, m, p, memory, old, o)
                matched, taken = matched | 1 << p, taken | 1 << o
    reach = SAME_PLACE * min(bodies.extent[manifolds.body_a[m]], bodies.extent[manifolds.body_b[m]])
    for p in range(manifolds.points[m]):
        nearest, least = -1, reach * reach
        for o in range(memory.points[old]):
            if not (matched >> p & 1 or taken >> o & 1):
                way = sub(row(manifolds.arm_b[m], p, 0), row(memory.arm[old], o, 0))
                if dot(way, way) < least:
                    nearest, least = o, dot(way, way)
        if nearest >= 0:
            recall_impulse(manifolds, m, p, memory, old, nearest)
            taken |= 1 << nearest


@inner_kernel
def recall_impulse(manifolds: Manifolds, m: int, p: int, memory: Memory, old: int, o: int) -> None:
    """Give point p the impulse of remembered point o, turned into the new frame."""
    for k in range(3):
        manifolds.impulse[m, p, k] = dot(row(manifolds.frame[m], k, 0), row(memory.impulse[old], o, 0))
    manifolds.impulse[m, p, 2] = max(manifolds.impulse[m, p, 2], 0.0)


@inner_kernel
def remember(detection: Detection, manifolds: Manifolds, memory: Memory) -> None:
    """Keep the impulses for the next step, but not those of an impact: it will not repeat."""
    for m in range(len(manifolds)):
        memory.pair[m] = pair_of(manifolds.body_a[m], manifolds.body_b[m])
        memory.points[m] = manifolds.points[m]
        for p in range(manifolds.points[m]):
            memory.feature[m, p] = manifolds.feature[m, p]
            kept = 0.0 if manifolds.impact[m, p] else 1.0
            for d in range(3):
                memory.impulse[m, p, d] = kept * world_component(manifolds, m, p, d)
                memory.arm[m, p, d] = manifolds.arm_b[m, p, d]
    detection.found[REMEMBERED] = len(manifolds)


@inner_kernel
def world_component(manifolds: Manifolds, m: int, p: int, d: int) -> float:
    """World component d of the impulse on B at point p of manifold m [N s]."""
    return (
        manifolds.impulse[m, p, 0] * manifolds.frame[m, 0, d]
        + manifolds.impulse[m, p, 1] * manifolds.frame[m, 1, d]
        + manifolds.impulse[m, p, 2] * manifolds.frame[m, 2, d]
    )
