"""Designed deviations of Chipmunk from the textbook, predicted from scene and step only: it has no swept detection."""

from __future__ import annotations

from adapters.chipmunk.profiles import PROFILES
from adapters.chipmunk.shipped import CHECKED_ON
from adapters.law import Deviation, exactly
from adapters.law.unswept import Push, passing_law, shoved_law
from adapters.needs import needs
from adapters.scene import Scene


def _pushed(profile: str) -> Push:
    """Correction of overlaps beyond the slop, in the next step; ``collision_bias`` is the share left after a second."""

    def push(scene: Scene, dt: float, overlap: float) -> float:
        chosen = {s.name: s.value for s in PROFILES[profile](needs(scene), dt)}
        share, slop = 1.0 - chosen["collision_bias"] ** dt, chosen["collision_slop"]
        speed: float = share * max(0.0, overlap - slop) / dt
        return speed

    return push


DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation("chipmunk", (profile,), "thin_wall", exactly(metric), law, because, source, CHECKED_ON)
    for profile in PROFILES
    for metric in ("rebound_ratio", "beyond")
    for law, because, source in (
        (
            passing_law(metric),
            "there is no swept collision detection: no step ends with the ball in the plate, so the contact is "
            "never found",
            "cpSpaceStep.c:400 (positions, then overlaps)",
        ),
        (
            shoved_law(metric, _pushed(profile)),
            "there is no swept collision detection: the step that finds the ball in the plate finds it beyond the "
            "middle, and pushes it out on the far side",
            "cpSpaceStep.c:400 (positions, then overlaps), cpCollision.c (normal of the least overlap)",
        ),
    )
)
