"""A semicircular arch of voussoirs, a little thicker and a little thinner than the least it needs to stand."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from reference_solver.model import Array, Body, Model, Polygon
from reference_solver.settings import Settings
from reference_solver.shapes import area_centroid_moment
from reference_solver.verification.hard_cases.case import HardCase, Run
from reference_solver.verification.hard_cases.parts import DOWN, FLOOR
from reference_solver.verification.hard_cases.stacks import stands_or_falls

#: Voussoirs, and friction of all joints: Heyman's assumption that none slides, which needs far less.
VOUSSOIRS, FRICTION = 20, 1.0
#: A condition is met if it is missed by no more than this part of half an arch's weight (times radius).
BALANCED = 1e-9

Point = tuple[float, float]


def voussoir(k: int, thickness: float, count: int = VOUSSOIRS) -> tuple[Point, ...]:
    """Corners of voussoir k, from the right foot, of an arch of mean radius 1 m: joints are radial, faces straight."""
    inner, outer = 1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness
    a, b = math.pi * k / count, math.pi * (k + 1) / count
    # the feet stand on y = 0 exactly, both ends of the arch are mirror images to the last bit
    return tuple(
        (r * _cosine(t, k + j, count), r * math.sin(min(t, math.pi - t)))
        for r, t, j in ((inner, a, 0), (outer, a, 0), (outer, b, 1), (inner, b, 1))
    )


def _cosine(angle: float, k: int, count: int) -> float:
    return math.cos(angle) if 2 * k <= count else -math.cos(math.pi * (count - k) / count)


def thrust_conditions(thickness: float, count: int = VOUSSOIRS, friction: float = FRICTION) -> tuple[Array, Array]:
    """Conditions A (H, m) <= b that a symmetric state of forces must satisfy at all joints of one half (E57).

    Parameters
    ----------
    thickness
        Of the mean radius.

    Returns
    -------
    A, b
        (4 (count / 2 + 1), 2) and (4 (count / 2 + 1),): thrust H at the crown and its moment m about the origin, in
        weights of half an arch (times radius). At a joint the force must press, within the joint's width, inside
        the friction cone.

    Raises
    ------
    ValueError
        For an odd count: the crown must be a joint.
    """
    if count % 2:
        raise ValueError(f"count: {count} must be even")
    pieces = [area_centroid_moment(voussoir(k, thickness, count)) for k in range(count // 2)]
    whole = sum(area for area, _, _ in pieces)
    rows, right = [], []
    for joint in range(count // 2 + 1):
        above = pieces[joint:]
        weight = sum(area for area, _, _ in above) / whole
        moment = sum(area * centre[0] for area, centre, _ in above) / whole
        t = math.pi * joint / count
        # normal force N = H sin t + W cos t, shear T = W sin t - H cos t, moment about the origin m + moment = r N
        for lever, shear, turn in (
            (1.0 - 0.5 * thickness, 0.0, -1.0),
            (-1.0 - 0.5 * thickness, 0.0, 1.0),
            (-friction, 1.0, 0.0),
            (-friction, -1.0, 0.0),
        ):
            rows.append([lever * math.sin(t) - shear * math.cos(t), turn])
            right.append(-lever * weight * math.cos(t) - shear * weight * math.sin(t) - turn * moment)
    return np.array(rows), np.array(right)


def stands(thickness: float, count: int = VOUSSOIRS) -> bool:
    """Whether forces that the joints can carry balance the weights: then the arch stands (static theorem).

    What satisfies all conditions is a convex set, mirrored into itself, so that a symmetric state exists if any
    does; and a bounded one, so that it has a corner, where two conditions are met exactly.
    """
    a, b = thrust_conditions(thickness, count)
    i, j = np.triu_indices(len(b), 1)
    determinant = a[i, 0] * a[j, 1] - a[i, 1] * a[j, 0]
    crossing = np.abs(determinant) > 1e-12
    i, j, determinant = i[crossing], j[crossing], determinant[crossing]
    corners = np.array([b[i] * a[j, 1] - b[j] * a[i, 1], a[i, 0] * b[j] - a[j, 0] * b[i]]) / determinant
    return bool(((a @ corners - b[:, None]).max(axis=0) < BALANCED).any())


@cache
def least_thickness(count: int = VOUSSOIRS) -> float:
    """Least t/R of an arch that stands, by halving [0.05, 0.2] down to 1e-6 (a linear program in H and m for each)."""
    low, high = 0.05, 0.2
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if stands(middle, count) else (middle, high)
    return high


def arch_bodies(thickness: float, count: int = VOUSSOIRS) -> list[Body]:
    """Floor and voussoirs of density 1 kg/m^2."""
    bodies = [FLOOR]
    for k in range(count):
        corners = voussoir(k, thickness, count)
        area, centre, moment = area_centroid_moment(corners)
        bodies.append(Body(Polygon.about_centroid(corners), area, moment, (*centre, 0.0)))
    return bodies


def arch(share: float) -> HardCase:
    """Arch of ``share`` times the least thickness."""

    def model() -> Model:
        return Model(2, arch_bodies(share * least_thickness()), DOWN, 0.0, FRICTION)

    def moved(run: Run) -> float:
        return float(np.abs(run.record.pose[-1, 1:, :2] - run.record.pose[0, 1:, :2]).max())

    return HardCase(
        f"arch of {VOUSSOIRS}, t/R {100.0 * (share - 1.0):+.0f} %",
        "A line of thrust fits into the arch or not; unfinished solves let it sag until four joints open",
        model,
        Settings.reference(1.0 / 240.0),
        0.25,  # by then it has come down by millimetres, and its joints do not yet shut again
        stands_or_falls(moved, 1e-9, 1e-3, "largest motion [m]"),
        {"falls": float(share < 1.0)},
        stride=12,
    )
