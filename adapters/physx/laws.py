"""Designed deviations of PhysX from the textbook, predicted from scene and step only."""

from __future__ import annotations

import math
from collections.abc import Mapping

from adapters.law import Deviation, Law, Measure, Prediction, deviations, exactly
from adapters.law.single_motions import rounded_motions, standstills
from adapters.law.single_precision import PLACES, Method, Threshold, plane_law, rounded_law
from adapters.law.unswept import passing_law, wall_law
from adapters.needs import needs
from adapters.physx.profiles import PROFILES, least_rebound
from adapters.physx.shipped import BOUNCE_THRESHOLD, CONTACT_OFFSET
from adapters.scene import Scene

#: Metrics of blows in free space, by scene, which neither friction nor rotation within the step changes.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "impulse", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "impulse", "momentum_defect"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "galperin": ("small_speed", "large_speed", "energy_defect"),
    "oblique": ("rebound_ratio",),
    "pair_matrix": tuple(f"restitution[{k}]" for k in range(1, 5)),
}
#: Blows that `tuned` finds so early that they overlap with the blow before.
CROWDED = ("galperin",)
_RELEASES = ("3.0.",)


def blow_law(metric: str, profile: str) -> Law:
    """Blows in free space; no restitution up to a threshold speed."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        least = least_rebound(needs(scene), dt) if profile == "tuned" else BOUNCE_THRESHOLD
        # TGS solves a blow found in an overlap only in part; contacts exist from two offsets ahead.
        ahead = math.inf if profile == "pgs" else 2.0 * CONTACT_OFFSET
        return rounded_law(metric, Method(Threshold(least), ahead=ahead))(scene, dt, measure)

    return law


def _wall_law(metric: str, profile: str) -> Law:
    passing = passing_law(metric, PLACES)
    return wall_law(passing, blow_law(metric, profile)) if metric == "rebound_ratio" else passing


DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation(
        "physx",
        (profile,),
        scene,
        exactly(metric),
        blow_law(metric, profile),
        "restitution is 0 up to 2 m/s as shipped; single precision, 2^-24 relative",
        "PxSceneDesc, bounceThresholdVelocity; motion in adapters/law/single_precision.py",
        _RELEASES,
    )
    for profile in PROFILES
    for scene, metrics in BLOWS.items()
    if profile != "tuned" or scene not in CROWDED
    for metric in metrics
)
DEVIATIONS += deviations(
    "physx",
    PROFILES,
    {"thin_wall": ("rebound_ratio", "beyond")},
    _wall_law,
    "there is no swept collision detection: a body on one side of a thin body at the end of a step, and on the "
    "other at the end of the next, passes through",
    "measured with 3.0.3; motion in adapters/law/unswept.py and adapters/law/single_precision.py",
    _RELEASES,
)
DEVIATIONS += standstills(
    "physx", PROFILES, {"far_origin": ("stopping_distance",)}, "PxTransform, built of floats", _RELEASES
)
DEVIATIONS += rounded_motions(
    "physx",
    PROFILES,
    {
        "kept": {"cradle": ("momentum_defect",), "rack": ("momentum_defect",)},
        "booked": {"off_centre": ("momentum_defect",)},
        "flown": {"flight": ("fall", "fall_speed", "throw_speed", "throw_way", "heading_spread", "drift_across")},
    },
    "PxVec3, built of floats",
    _RELEASES,
)
DEVIATIONS += rounded_motions(
    "physx",
    ("tuned",),
    {"flown": {"flight": ("ball_spin", "momentum_drift")}},
    "PxVec3, built of floats",
    _RELEASES,
)

#: Blows of edges and faces in free space after which the motion is planar to round-off, by profile; not in small steps,
#: or with too few iterations.
PLANES: Mapping[str, tuple[str, ...]] = {
    "pgs": ("edge_drop", "flat_box"),
    "tuned": ("edge_drop",),
}
DEVIATIONS += tuple(
    Deviation(
        "physx",
        (profile,),
        scene,
        "out_of_plane",
        plane_law,
        "single precision rounds differently on both sides of a plane",
        "PxVec3, built of floats; band in adapters/law/single_precision.py",
        _RELEASES,
    )
    for profile, scenes in PLANES.items()
    for scene in scenes
)
