"""Friction of pairs from one value per body: Drake uses the harmonic mean of two, 2 a b/(a + b)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from adapters.scene import Scene
from adapters.scene.meeting import Meeting, representable

#: Round-off of a quotient, and of the solution of a linear system in such numbers.
ROUNDING, SOLVED = 1e-15, 1e-13
#: Largest number of bodies of the linear system, which has a row for each pair.
MOST_BODIES = 64


def pair_of(a: float, b: float) -> float:
    """Friction of a pair from two bodies' values."""
    return 2.0 * a * b / (a + b) if a + b > 0.0 else 0.0


def frictions(scene: Scene) -> list[float] | None:
    """Values whose harmonic means are the pairs' friction; None if there are none.

    The largest of each body's pairs, if that suffices; else reciprocals solve a linear system, ``1/a + 1/b = 2/f``.
    """
    return representable(scene, lambda pairs: _largest(scene, pairs) or _solved(scene, pairs))


def _largest(scene: Scene, meetings: Sequence[Meeting]) -> list[float] | None:
    found = [0.0] * len(scene.bodies)
    for i, j, material in meetings:
        found[i], found[j] = max(found[i], material.friction), max(found[j], material.friction)
    return found if _fits(found, meetings, ROUNDING) else None


def _solved(scene: Scene, meetings: Sequence[Meeting]) -> list[float] | None:
    rough = [(i, j, material.friction) for i, j, material in meetings if material.friction > 0.0]
    if not rough or len(scene.bodies) > MOST_BODIES:
        return None
    system = np.zeros((len(rough), len(scene.bodies)))
    for row, (i, j, _) in enumerate(rough):
        system[row, [i, j]] = 1.0
    found = np.linalg.lstsq(system, np.array([2.0 / friction for *_, friction in rough]), rcond=None)[0]
    used = {k for i, j, _ in rough for k in (i, j)}
    own = [1.0 / x if x > 0.0 and k in used else 0.0 for k, x in enumerate(found.tolist())]
    return own if _fits(own, meetings, SOLVED) else None


def _fits(found: Sequence[float], meetings: Sequence[Meeting], within: float) -> bool:
    return all(
        abs(pair_of(found[i], found[j]) - material.friction) <= within * (1.0 + material.friction)
        for i, j, material in meetings
    )
