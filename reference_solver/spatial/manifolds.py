"""Detection: from poses to manifolds in canonical order, with the impulses remembered from the step before."""

from __future__ import annotations

from reference_solver.compilation import kernel
from reference_solver.planar.state import Options
from reference_solver.spatial.broadphase import find_candidates
from reference_solver.spatial.narrowphase import collide
from reference_solver.spatial.state import CANDIDATES, MANIFOLDS, REMEMBERED, Bodies, Manifolds, Pairs
from reference_solver.spatial.vector import dot, row, tangents


@kernel
def detect(bodies: Bodies, pairs: Pairs, manifolds: Manifolds, options: Options) -> bool:
    """Fill the geometry of all manifolds; False if an array is too small (nothing else has changed then).

    Candidates come in ascending order and the points of a pair are sorted by feature, so that contacts are
    sorted by (body_a, body_b, feature): the same order in every run, whatever happened before.
    """
    if not find_candidates(bodies, pairs, manifolds, options):
        return False
    n = len(bodies.shape)
    m = 0
    for k in range(manifolds.count[CANDIDATES]):
        if m == len(manifolds.body_a):
            return False
        found = collide(
            bodies, pairs, pairs.candidate[k] // n, pairs.candidate[k] % n, options.margin, manifolds, m
        )
        if found > 0:
            sort_points(manifolds, m)
            set_frame(manifolds, m)
            set_world_points(bodies, manifolds, m)
            m += 1
    manifolds.count[MANIFOLDS] = m
    recall(bodies, manifolds, options)
    return True


@kernel
def sort_points(manifolds: Manifolds, m: int) -> None:
    """Sort the points of manifold m by feature (insertion sort of at most four)."""
    for i in range(1, manifolds.points[m]):
        j = i
        while j > 0 and manifolds.feature[m, j] < manifolds.feature[m, j - 1]:
            swap(manifolds.feature[m], j)
            swap(manifolds.gap[m], j)
            for d in range(3):
                swap(manifolds.arm_a[m, :, d], j)
                swap(manifolds.arm_b[m, :, d], j)
            j -= 1


@kernel
def swap(values, j):  # type: ignore[no-untyped-def]
    """Exchange entries j and j - 1."""
    values[j], values[j - 1] = values[j - 1], values[j]


@kernel
def set_frame(manifolds: Manifolds, m: int) -> None:
    """Tangents, levers of the manifold's centre, and the points' offsets from it in the contact frame.

    All velocities and impulses of a manifold act through the relative twist and the wrench at its centre.
    """
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


@kernel
def set_world_points(bodies: Bodies, manifolds: Manifolds, m: int) -> None:
    """Contact points in world axes, from B's centre: B is the one that moves where A is the ground."""
    b = manifolds.body_b[m]
    for p in range(manifolds.points[m]):
        for d in range(3):
            manifolds.point[m, p, d] = bodies.pose[b, d] + manifolds.arm_b[m, p, d]


@kernel
def recall(bodies: Bodies, manifolds: Manifolds, options: Options) -> None:
    """Give each point the impulse of the same feature one step before: a merge of two sorted lists of pairs."""
    n = len(bodies.shape)
    old = 0
    for m in range(manifolds.count[MANIFOLDS]):
        manifolds.impulse[m] = 0.0
        pair = manifolds.body_a[m] * n + manifolds.body_b[m]
        while old < manifolds.count[REMEMBERED] and manifolds.old_pair[old] < pair:
            old += 1
        if options.warm_starting and old < manifolds.count[REMEMBERED] and manifolds.old_pair[old] == pair:
            recall_points(manifolds, m, old)


@kernel
def recall_points(manifolds: Manifolds, m: int, old: int) -> None:
    """Match the points of manifold m with those of remembered manifold `old`; impulses turn into the new frame."""
    for p in range(manifolds.points[m]):
        for o in range(manifolds.old_points[old]):
            if manifolds.old_feature[old, o] == manifolds.feature[m, p]:
                for k in range(3):
                    manifolds.impulse[m, p, k] = dot(
                        row(manifolds.frame[m], k, 0), row(manifolds.old_impulse[old], o, 0)
                    )
                manifolds.impulse[m, p, 2] = max(manifolds.impulse[m, p, 2], 0.0)


@kernel
def remember(bodies: Bodies, manifolds: Manifolds) -> None:
    """Keep the impulses for the next step, but not those of an impact: it will not repeat."""
    n = len(bodies.shape)
    count = manifolds.count[MANIFOLDS]
    for m in range(count):
        manifolds.old_pair[m] = manifolds.body_a[m] * n + manifolds.body_b[m]
        manifolds.old_points[m] = manifolds.points[m]
        for p in range(manifolds.points[m]):
            manifolds.old_feature[m, p] = manifolds.feature[m, p]
            kept = 0.0 if manifolds.bounce[m, p] else 1.0
            for d in range(3):
                manifolds.old_impulse[m, p, d] = kept * world_component(manifolds, m, p, d)
    manifolds.count[REMEMBERED] = count


@kernel
def world_component(manifolds: Manifolds, m: int, p: int, d: int) -> float:
    """World component d of the impulse on B at point p of manifold m [N s]."""
    return (
        manifolds.impulse[m, p, 0] * manifolds.frame[m, 0, d]
        + manifolds.impulse[m, p, 1] * manifolds.frame[m, 1, d]
        + manifolds.impulse[m, p, 2] * manifolds.frame[m, 2, d]
    )
