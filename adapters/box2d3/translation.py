"""Materials of pairs from one value per body: Box2D takes the larger restitution and the root of the friction product.

Values are in single precision, so a pair's value is exact to its round-off.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from adapters.scene import Scene
from adapters.scene.meeting import Meeting, representable

#: Relative round-off of a logarithm, an exponential, a root and a product in double precision.
ROUNDING = 1e-14


def restitutions(scene: Scene) -> list[float] | None:
    """Values of which the larger one is each pair's restitution; None if there are none."""
    return representable(scene, lambda pairs: _restitutions(scene, pairs))


def _restitutions(scene: Scene, meetings: Sequence[Meeting]) -> list[float] | None:
    pairs = [(i, j, material.restitution) for i, j, material in meetings]
    found = [1.0] * len(scene.bodies)
    for i, j, e in pairs:
        found[i], found[j] = min(found[i], e), min(found[j], e)
    return found if all(max(found[i], found[j]) == e for i, j, e in pairs) else None


def frictions(scene: Scene) -> list[float] | None:
    """Values of which the root of the product is each pair's friction; None if there are none."""
    return representable(scene, lambda pairs: _frictions(scene, pairs))


def _frictions(scene: Scene, meetings: Sequence[Meeting]) -> list[float] | None:
    pairs = [(i, j, material.friction) for i, j, material in meetings]
    values = {friction for _, _, friction in pairs}
    if len(values) == 1:
        return [values.pop()] * len(scene.bodies)
    positive = [(i, j, friction) for i, j, friction in pairs if friction > 0.0]
    rows = np.zeros((len(positive), len(scene.bodies)))
    for row, (i, j, _) in enumerate(positive):
        rows[row, [i, j]] = 1.0
    logs = np.linalg.lstsq(rows, 2.0 * np.log([friction for _, _, friction in positive]), rcond=None)[0]
    used = {k for i, j, _ in positive for k in (i, j)}
    found = [float(np.exp(logs[k])) if k in used else 0.0 for k in range(len(scene.bodies))]
    fits = all(
        abs((found[i] * found[j]) ** 0.5 - friction) <= ROUNDING * max(friction, 1e-300) for i, j, friction in pairs
    )
    return found if fits else None
