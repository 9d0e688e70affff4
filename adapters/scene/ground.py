"""Width and depth of the body that replaces a half-space in engines without one."""

from __future__ import annotations

import math

from adapters.needs import needs
from adapters.scene import HalfSpace, Scene

#: Least half width and depth of the ground [m].
GROUND = 100.0


def reach(scene: Scene) -> float:
    """Half width and depth of the ground [m]: twice the reach of the scene."""
    farthest = 0.0
    for body in scene.bodies:
        if not isinstance(body.shape, HalfSpace):
            farthest = max(farthest, math.hypot(*body.pose[: scene.dimension]))
    return max(GROUND, 2.0 * (farthest + needs(scene).top_speed * scene.duration))
