"""How wide and deep the body that stands for a half-space must be, for engines that have no half-space of their own."""

from __future__ import annotations

import math

from adapters.needs import needs
from adapters.scene import HalfSpace, Scene

#: Least half width and depth of the ground [m].
GROUND = 100.0


def reach(scene: Scene) -> float:
    """Half width and depth of the ground [m]: twice as far as anything of the scene gets."""
    farthest = 0.0
    for body in scene.bodies:
        if not isinstance(body.shape, HalfSpace):
            farthest = max(farthest, math.hypot(*body.pose[: scene.dimension]))
    return max(GROUND, 2.0 * (farthest + needs(scene).top_speed * scene.duration))
