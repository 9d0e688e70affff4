"""Materials of pairs from one value per body: DART takes the product of restitutions and the smaller friction."""

from __future__ import annotations

import math
from collections.abc import Sequence

from adapters.scene import Scene
from adapters.scene.meeting import Meeting, representable

#: Relative round-off of a root and a product.
ROUNDING = 1e-15


def restitutions(scene: Scene) -> list[float] | None:
    """Factors whose products are the pairs' restitutions: those with fixed bodies, or roots; None if neither works."""
    return representable(scene, lambda pairs: _restitutions(scene, pairs))


def _restitutions(scene: Scene, meetings: Sequence[Meeting]) -> list[float] | None:
    pairs = [(i, j, material.restitution) for i, j, material in meetings]
    against, roots = [1.0] * len(scene.bodies), [0.0] * len(scene.bodies)
    for i, j, e in pairs:
        for body, other in ((i, j), (j, i)):
            roots[body] = math.sqrt(e)
            if scene.bodies[other].motion != "free":
                against[body] = e
    for found in (against, roots):
        if all(abs(found[i] * found[j] - e) <= ROUNDING for i, j, e in pairs):
            return found
    return None


def frictions(scene: Scene) -> list[float] | None:
    """Values of which the smaller one is each pair's friction; None if there are none."""
    return representable(scene, lambda pairs: _frictions(scene, pairs))


def _frictions(scene: Scene, meetings: Sequence[Meeting]) -> list[float] | None:
    pairs = [(i, j, material.friction) for i, j, material in meetings]
    found = [0.0] * len(scene.bodies)
    for i, j, friction in pairs:
        found[i], found[j] = max(found[i], friction), max(found[j], friction)
    return found if all(min(found[i], found[j]) == friction for i, j, friction in pairs) else None
