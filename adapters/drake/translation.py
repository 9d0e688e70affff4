"""Friction of pairs as one number per body: Drake takes the harmonic mean of two, 2 a b/(a + b)."""

from __future__ import annotations

from collections.abc import Sequence

from adapters.meeting import Meeting, representable
from adapters.scene import Scene

#: What a quotient may miss of a number.
ROUNDING = 1e-15


def pair_of(a: float, b: float) -> float:
    """Friction of a pair of two bodies' numbers."""
    return 2.0 * a * b / (a + b) if a + b > 0.0 else 0.0


def frictions(scene: Scene) -> list[float] | None:
    """Numbers whose harmonic means are the pairs' friction: the largest of each body's pairs; None if those are not."""
    return representable(scene, lambda pairs: _frictions(scene, pairs))


def _frictions(scene: Scene, meetings: Sequence[Meeting]) -> list[float] | None:
    pairs = [(i, j, material.friction) for i, j, material in meetings]
    found = [0.0] * len(scene.bodies)
    for i, j, friction in pairs:
        found[i], found[j] = max(found[i], friction), max(found[j], friction)
    fits = all(abs(pair_of(found[i], found[j]) - friction) <= ROUNDING * (1.0 + friction) for i, j, friction in pairs)
    return found if fits else None
