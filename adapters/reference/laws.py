"""Designed deviations of the classical profile of our own solver from the textbook's physics."""

from __future__ import annotations

from adapters.law import Deviation
from adapters.law.unswept import passing_law, shoved_law

DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation(
        "reference",
        ("classical",),
        "thin_wall",
        metric,
        passing_law(metric),
        "there is no swept collision detection: no step ends with the ball in the plate, so the contact is never found",
        "docs/solver/step.md: contacts are detected at the start of a step",
        ("0.1.",),
    )
    for metric in ("rebound_ratio", "beyond")
) + tuple(
    Deviation(
        "reference",
        ("classical",),
        "thin_wall",
        metric,
        shoved_law(metric),
        "there is no swept collision detection: where the first step that ends in the plate ends beyond its middle, "
        "the ball leaves on the far side at its speed",
        "docs/solver/step.md: contacts are detected at the start of a step",
        ("0.1.",),
    )
    for metric in ("rebound_ratio", "beyond")
)
