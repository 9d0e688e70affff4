"""What a scene must not ask of a profile that promises a solution: bodies that share space, or jam, at the start."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np

from adapters.scene import Body, Box, Disc, HalfSpace, Scene, Sphere


def overlap_at_the_start(scene: Scene) -> str | None:
    """Say which two bodies overlap at the start, by more than a rounded input explains; None if there are none.

    Rigid bodies that share space have no motion that a law would give. The solver's certificate has a limit for it,
    a share of the smaller half width; it is asked here, before a run that could only be INVALID.
    """
    from reference_solver.certificate import GATES
    from reference_solver.certification.geometry import gap

    limit = next(gate.limit for gate in GATES if gate.name == "start_overlap")
    reach = [_reach(body) for body in scene.bodies]
    place = np.array([body.pose[: scene.dimension] for body in scene.bodies])
    for i, j in combinations(range(len(scene.bodies)), 2):
        first, second = scene.bodies[i], scene.bodies[j]
        if "free" not in (first.motion, second.motion):
            continue
        if float(np.linalg.norm(place[i] - place[j])) > reach[i] + reach[j]:
            continue
        poses = (np.array([first.pose]), np.array([second.pose]))
        depth = -float(np.atleast_1d(gap(first.shape, poses[0], second.shape, poses[1]))[0])
        if depth > limit * 0.5 * min(first.shape.smallest_size, second.shape.smallest_size):
            return (
                f"{first.name} and {second.name} overlap by {depth:.3g} m at the start: rigid bodies have no solution"
            )
    return None


def _reach(body: Body) -> float:
    """Distance of the outermost point from the centre [m]."""
    if isinstance(body.shape, Box):
        return float(np.linalg.norm(body.shape.half_extents))
    return body.shape.radius if isinstance(body.shape, Disc | Sphere) else np.inf


def jam_at_the_start(scene: Scene) -> str | None:
    """Say which body starts on one corner that slides and cannot go on sliding; None if there is none. Planar only.

    Painleve: with friction beyond ``W_nn/W_nt`` no force of a slide keeps the corner up, and it has to stop at
    once, by an impact without a collision. The solver's steps are cut at collisions; this one it would find by a step
    of its fixed scheme, which its certificate refuses.
    """
    if scene.dimension != 2:
        return None
    for floor, body in product(scene.bodies, scene.bodies):
        if not isinstance(floor.shape, HalfSpace) or not isinstance(body.shape, Box) or body.motion != "free":
            continue
        normal = np.array(floor.shape.normal) / np.linalg.norm(floor.shape.normal)
        tangent = np.array([normal[1], -normal[0]])
        c, s = np.cos(body.pose[2]), np.sin(body.pose[2])
        arms = np.array(list(product((-1.0, 1.0), repeat=2))) * body.shape.half_extents @ np.array([[c, s], [-s, c]])
        gaps = (arms + body.pose[:2]) @ normal - floor.shape.offset
        touching = np.flatnonzero(np.abs(gaps) <= 1e-9 * body.shape.smallest_size)
        if len(touching) != 1:
            continue
        arm = arms[touching[0]]
        velocity = np.array(body.twist[:2]) + body.twist[2] * np.array([-arm[1], arm[0]])
        slip, turning = (
            float(velocity @ tangent),
            [float(arm[0] * way[1] - arm[1] * way[0]) for way in (normal, tangent)],
        )
        own = 1.0 / body.mass + turning[0] ** 2 / float(np.sum(body.inertia))
        coupled = turning[0] * turning[1] / float(np.sum(body.inertia))
        friction = scene.material(floor.name, body.name).friction
        if slip != 0.0 and own - friction * np.sign(slip) * coupled <= 0.0:
            return (
                f"{body.name} jams on {floor.name} at the start: an impact without a collision, which is no event here"
            )
    return None
