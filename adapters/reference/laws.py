"""What the textbook profile of our own solver does by design instead of the textbook's physics."""

from __future__ import annotations

from adapters.law import Deviation
from adapters.unswept import passing_law, shoved_law

DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation(
        "reference",
        ("classical",),
        "thin_wall",
        metric,
        passing_law(metric),
        "nothing is swept: no step ends with the ball in the plate, so that it is never found",
        "docs/solver/step.md: contacts are looked for at the start of a step",
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
        "nothing is swept: where the first step that ends in the plate ends beyond its middle, it leaves on the "
        "far side as fast as it came",
        "docs/solver/step.md: contacts are looked for at the start of a step",
        ("0.1.",),
    )
    for metric in ("rebound_ratio", "beyond")
)
