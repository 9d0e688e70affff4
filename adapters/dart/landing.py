"""A box that lands on several of its corners at once, in free space and without friction, as in DART.

    (A + c diag A) j = (1 + e) v        A: speeds of the corners per impulse at the corners, c = 1e-5

Each corner yields by a share of its own response, so several corners that share a blow yield more than a single one.
"""

from __future__ import annotations

import numpy as np

from adapters.dart.profiles import solved
from adapters.dart.shipped import FASTEST, MIXING, THRESHOLD
from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.scene import Body, Box, HalfSpace, Scene
from adapters.scene.lift import lift

#: Height above the lowest corner within which corners count as lowest [m].
LEVEL = 1e-9


def landing_law(metric: str, profile: str) -> Law:
    """``metric`` after the blow: *rise* [m/s], *impulse* [N s] or *spin* [rad/s], back towards level.

    Corners are several contacts, with the residual of sweeps over several.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        spatial = scene if scene.dimension == 3 else lift(scene)
        found = _blow(spatial)
        return None if found is None else (found[metric], solved(profile, True) * (1.0 + abs(found[metric])))

    return law


def _blow(scene: Scene) -> dict[str, float] | None:
    """Speed of rise, impulse and spin after the first blow; None if the box does not fall vertically."""
    if any(scene.gravity) or len(scene.bodies) != 2 or scene.bodies[0].shape != HalfSpace((0.0, 0.0, 1.0), 0.0):
        return None
    floor, box = scene.bodies
    material = scene.material(floor.name, box.name)
    speed = -box.twist[2]
    moved = (*box.twist[:2], *box.twist[3:], *box.force, *box.torque)
    if not isinstance(box.shape, Box) or material.friction > 0.0 or any(moved):
        return None
    if not THRESHOLD < material.restitution * speed <= FASTEST:
        return None
    arms, mobility = _lowest(box)
    turns = np.cross(arms, (0.0, 0.0, 1.0))
    response = 1.0 / box.mass + turns @ mobility @ turns.T
    wanted = np.full(len(arms), (1.0 + material.restitution) * speed)
    given = np.linalg.solve(response + MIXING * np.diag(np.diag(response)), wanted)
    if given.min() < 0.0:
        return None
    spin = mobility @ (turns.T @ given)
    return {"rise": float(given.sum()) / box.mass - speed, "impulse": float(given.sum()), "spin": -float(spin[1])}


def _lowest(box: Body) -> tuple[Array, Array]:
    """Arms of the lowest corners (k, 3) [m], and the inverse of the moments in the world's axes (3, 3)."""
    assert isinstance(box.shape, Box) and isinstance(box.inertia, tuple)
    w, x, y, z = box.pose[3:]
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    signs = 2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1.0
    corners = (signs * np.array(box.shape.half_extents)) @ turn.T
    lowest = corners[:, 2] < corners[:, 2].min() + LEVEL
    return corners[lowest], turn @ np.diag(1.0 / np.array(box.inertia)) @ turn.T
