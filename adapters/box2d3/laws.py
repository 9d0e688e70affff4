"""Designed deviations of Box2D 3.1 from the textbook, predicted from scene and step only."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial

from adapters.box2d3.ball_on_plane import Chosen, ball_law
from adapters.box2d3.profiles import PROFILES, TUNED_SUBSTEPS
from adapters.box2d3.shipped import CHECKED_ON, RESTITUTION_THRESHOLD, SUBSTEPS
from adapters.law import Deviation, deviations, settings_of
from adapters.law.single_motions import corner_law, rounded_motions, standstills
from adapters.law.single_precision import late_rebound_law
from adapters.scene import Scene

#: Metrics of blows in free space, by scene.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "spin", "energy_lost", "momentum_defect"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "galperin": ("small_speed", "large_speed", "energy_defect"),
    "rod_gas": ("wrong_speed", "energy_defect", "misplaced"),
    "closing_wall": ("speed[1]", "speed[2]", "speed[3]"),
    "pair_matrix": tuple(f"{name}[{k}]" for name in ("restitution", "friction") for k in range(1, 5)),
}


#: Metrics of a ball on a plane, by scene.
ON_A_PLANE: Mapping[str, tuple[str, ...]] = {
    "bounce": ("rest_time",),
    "oblique": ("rebound_ratio", "forward_speed", "spin_speed"),
}


def _chosen(profile: str) -> Chosen:
    """Settings of a profile by name."""
    return partial(settings_of, PROFILES[profile])


def _lengths(profile: str) -> Callable[[Scene, float], tuple[float, float]]:
    """Units per metre of a profile, and its skin around polygons."""
    return lambda scene, dt: (_chosen(profile)(scene, dt)["units_per_metre"], 0.0)


DEVIATIONS: tuple[Deviation, ...] = deviations(
    "box2d3",
    PROFILES,
    BLOWS,
    lambda metric, profile: late_rebound_law(metric, _chosen(profile)),
    "single precision, 2^-24 relative; restitution is 0 below the threshold; friction is limited by the impulse "
    "of compression only, as restitution is applied last",
    "contact_solver.c, b2ApplyRestitutionTask; types.h, restitutionThreshold; adapters/law/single_precision.py",
    CHECKED_ON,
)
DEVIATIONS += deviations(
    "box2d3",
    PROFILES,
    ON_A_PLANE,
    lambda metric, profile: ball_law(metric, _chosen(profile), sampled=metric == "rest_time"),
    "restitution uses the velocity at the start of the step, is applied after friction and above the threshold "
    "only, and the rest of the step is lost; the contact point is fixed to the ball within a step, turns with "
    "it and lifts it",
    "contact_solver.c, b2SolveContact and b2ApplyRestitutionTask; motion in adapters/box2d3/ball_on_plane.py",
    CHECKED_ON,
)
DEVIATIONS += standstills(
    "box2d3",
    PROFILES,
    {"far_origin": ("stopping_distance",)},
    "math_functions.h, b2Vec2: a pair of floats",
    CHECKED_ON,
    _lengths,
)
DEVIATIONS += tuple(
    Deviation(
        "box2d3",
        (profile,),
        "edge_drop",
        metric,
        # An impact exactly at the threshold rebounds here.
        corner_law(
            metric, _lengths(profile), math.nextafter(RESTITUTION_THRESHOLD, 0.0) if profile == "default" else 0.0
        ),
        "single precision, 2^-24 relative; restitution is 0 up to the threshold",
        "types.h, restitutionThreshold; motion in adapters/law/single_motions.py",
        CHECKED_ON,
    )
    for profile in PROFILES
    for metric in ("rise", "spin")
)

DEVIATIONS += rounded_motions(
    "box2d3",
    PROFILES,
    {
        "kept": {"rack": ("momentum_defect",)},
        "booked": {"off_centre": ("momentum_defect",)},
        "flown": {"flight": ("fall", "fall_speed", "throw_speed", "throw_way", "heading_spread", "drift_across")},
    },
    "math_functions.h, b2Vec2: a pair of floats",
    CHECKED_ON,
    parts={"default": SUBSTEPS, "tuned": TUNED_SUBSTEPS},
)
