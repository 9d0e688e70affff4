"""What a scene must not ask of a profile that promises a solution: bodies that share space, or lie too far away."""

from __future__ import annotations

import numpy as np

from adapters.near import near_pairs
from adapters.scene import HalfSpace, Scene


def too_far_at_the_start(scene: Scene) -> str | None:
    """Say which body lies where numbers are too coarse for its size; None if there is none.

    A place of 1e8 m is told in steps of 1.5e-8 m: a gap, an arm or a depth is known no better there. The certificate
    has a limit for it, a share of the smallest half width; it is asked here, before a run that could only be INVALID.
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
                f"{body.name} lies {place:.3g} m from the origin, where numbers are {last:.2g} m apart: too coarse "
                "for its size to certify a solution"
            )
    return None


def overlap_at_the_start(scene: Scene) -> str | None:
    """Say which two bodies overlap at the start, by more than a rounded input explains; None if there are none.

    Rigid bodies that share space have no motion that a law would give. The solver's certificate has a limit for it,
    a share of the smaller half width; it is asked here, before a run that could only be INVALID.
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
