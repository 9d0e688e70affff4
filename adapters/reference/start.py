"""Scenes that a certified profile refuses: bodies that overlap, or are too far away, at the start."""

from __future__ import annotations

import numpy as np

from adapters.scene import HalfSpace, Scene
from adapters.scene.near import near_pairs


def too_far_at_the_start(scene: Scene) -> str | None:
    """Reason for a body so far away that double precision is too coarse for its size; None if there is none.

    At 1e8 m double precision has a spacing of 1.5e-8 m, and gaps, lever arms and depths are no more accurate. The
    certificate limits it to a share of the smallest half width; this check comes before a run that would be refused.
    """
    from reference_solver.tally_summary import GATES

    limit = next(gate.limit for gate in GATES if gate.name == "resolution")
    for body in scene.bodies:
        if isinstance(body.shape, HalfSpace):
            continue
        place = max(abs(x) for x in body.pose[: scene.dimension])
        last = float(np.finfo(float).eps) * place
        if last > limit * 0.5 * body.shape.smallest_size:
            return (
                f"{body.name} lies {place:.3g} m from the origin, where double precision has a spacing of {last:.2g} "
                "m: too coarse for its size to certify a solution"
            )
    return None


def overlap_at_the_start(scene: Scene) -> str | None:
    """Reason for two bodies that overlap at the start by more than round-off of the input; None if there are none.

    The laws define no motion of overlapping rigid bodies. The solver's certificate limits the overlap to a share of the
    smaller half width; this check comes before a run that would be refused.
    """
    from reference_solver.geometry import gap
    from reference_solver.tally_summary import GATES

    limit = next(gate.limit for gate in GATES if gate.name == "start_overlap")
    for i, j in near_pairs(scene, np.array([[body.pose for body in scene.bodies]])):
        first, second = scene.bodies[i], scene.bodies[j]
        poses = (np.array([first.pose]), np.array([second.pose]))
        depth = -float(np.atleast_1d(gap(first.shape, poses[0], second.shape, poses[1]))[0])
        if depth > limit * 0.5 * min(first.shape.smallest_size, second.shape.smallest_size):
            return (
                f"{first.name} and {second.name} overlap by {depth:.3g} m at the start: rigid-body dynamics has no "
                "solution"
            )
    return None
