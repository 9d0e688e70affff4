"""Numbers of single bodies whose arithmetic means are what a scene asks of its pairs, for engines that mix so."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from adapters.meeting import Meeting, representable
from adapters.scene import Scene

#: What a solution of linear equations in doubles may miss of a number of order 1.
ROUNDING = 1e-12


def mean(a: float, b: float) -> float:
    """What such an engine makes of two bodies' numbers, in their precision."""
    return 0.5 * float(a + b)


def means(scene: Scene, coefficient: str) -> list[float] | None:
    """Numbers of bodies of which each pair's ``coefficient`` is the mean; None if there are none that are allowed.

    A restitution lies in [0, 1], a friction is not negative: a number outside would be another material to the engine.
    """
    return representable(scene, lambda pairs: _means(scene, pairs, coefficient))


def no_means(scene: Scene) -> str | None:
    """Why an engine that mixes so refuses a scene: a table of pairs that no numbers of bodies give; None if some do."""
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
