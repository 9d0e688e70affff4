"""Values per body whose arithmetic means are those of the pairs, for engines that combine materials by the mean."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from adapters.scene import Scene
from adapters.scene.meeting import Meeting, representable

#: Error of a solution of linear equations in doubles, for numbers of order 1.
ROUNDING = 1e-12


def mean(a: float, b: float) -> float:
    """Mean of two bodies' values, in their precision."""
    return 0.5 * float(a + b)


def means(scene: Scene, coefficient: str) -> list[float] | None:
    """Values per body of which each pair's ``coefficient`` is the mean; None if there are no valid ones.

    Restitution must lie in [0, 1], and friction must not be negative.
    """
    return representable(scene, lambda pairs: _means(scene, pairs, coefficient))


def no_means(scene: Scene) -> str | None:
    """Why such an engine refuses a scene: no values per body give the table of pairs; None if some do."""
    for coefficient in ("restitution", "friction"):
        if means(scene, coefficient) is None:
            return f"pairs: {coefficient} of a pair is the mean of two values here; no values per body give this table"
    return None


def _means(scene: Scene, meetings: Sequence[Meeting], coefficient: str) -> list[float] | None:
    pairs = [(i, j, float(getattr(material, coefficient))) for i, j, material in meetings]
    values = {value for _, _, value in pairs}
    if len(values) == 1:
        return [values.pop()] * len(scene.bodies)
    rows = np.zeros((len(pairs), len(scene.bodies)))
    for row, (i, j, _) in enumerate(pairs):
        rows[row, [i, j]] = 0.5
    from scipy.optimize import lsq_linear

    wanted = np.array([value for _, _, value in pairs])
    most = 1.0 if coefficient == "restitution" else np.inf
    found = lsq_linear(rows, wanted, (0.0, most), method="bvls", tol=1e-15).x
    return None if np.abs(rows @ found - wanted).max(initial=0.0) > ROUNDING else [float(x) for x in found]
