"""Designed deviations of Box2D from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping

from adapters.box2d.profiles import PROFILES
from adapters.box2d.shipped import CHECKED_ON, VELOCITY_THRESHOLD
from adapters.law import Deviation, Law, Measure, Prediction, deviations, settings_of
from adapters.law.single_motions import Chosen, corner_law, rounded_motions, standstills
from adapters.law.single_precision import Method, Threshold, rounded_law
from adapters.scene import Scene

#: Metrics of blows in free space, by scene.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "impulse", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "spin", "impulse", "energy_lost", "momentum_defect"),
    "flat_box": ("rebound_ratio", "impulse"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "galperin": ("small_speed", "large_speed", "energy_defect"),
    "rod_gas": ("wrong_speed", "energy_defect", "misplaced"),
    "oblique": ("rebound_ratio", "forward_speed", "spin_speed"),
    "closing_wall": ("speed[1]", "speed[2]", "speed[3]"),
    "pair_matrix": tuple(f"{name}[{k}]" for name in ("restitution", "friction") for k in range(1, 5)),
}


def blow_law(profile: str, metric: str) -> Law:
    """Blows in single precision, without restitution at up to one unit per second."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        chosen = settings_of(PROFILES[profile], scene, dt)
        method = Method(Threshold(VELOCITY_THRESHOLD / chosen["units_per_metre"]), chosen["iterations"])
        return rounded_law(metric, method)(scene, dt, measure)

    return law


DEVIATIONS: tuple[Deviation, ...] = deviations(
    "box2d",
    PROFILES,
    BLOWS,
    lambda metric, profile: blow_law(profile, metric),
    "single precision, 2^-24 relative; restitution is 0 up to an approach of one unit a second",
    "b2Settings.h, float32 and b2_velocityThreshold; motion in adapters/law/single_precision.py",
    CHECKED_ON,
)


def _chosen(profile: str) -> Chosen:
    """Unit and skin of a profile."""

    def of(scene: Scene, dt: float) -> tuple[float, float]:
        chosen = settings_of(PROFILES[profile], scene, dt)
        return chosen["units_per_metre"], chosen["skin"]

    return of


DEVIATIONS += standstills(
    "box2d",
    PROFILES,
    {"far_origin": ("stopping_distance",)},
    "b2Math.h, b2Sweep: c is a pair of float32",
    CHECKED_ON,
    _chosen,
)
DEVIATIONS += deviations(
    "box2d",
    PROFILES,
    {"edge_drop": ("rise", "spin", "impulse")},
    lambda metric, profile: corner_law(metric, _chosen(profile), VELOCITY_THRESHOLD),
    "single precision, 2^-24 relative; restitution is 0 up to an approach of one unit a second",
    "b2Settings.h, float32 and b2_velocityThreshold; motion in adapters/law/single_motions.py",
    CHECKED_ON,
)

DEVIATIONS += rounded_motions(
    "box2d",
    PROFILES,
    {
        "kept": {"rack": ("momentum_defect", "asymmetry")},
        "booked": {"off_centre": ("momentum_defect",)},
        "flown": {"flight": ("fall", "fall_speed", "throw_speed", "throw_way", "heading_spread", "drift_across")},
    },
    "b2Settings.h, float32",
    CHECKED_ON,
)
# The threshold's loss of energy as shipped is no round-off, but a finding.
DEVIATIONS += rounded_motions(
    "box2d",
    ("tuned",),
    {"kept": {"rack": ("energy_defect",)}},
    "b2Settings.h, float32",
    CHECKED_ON,
)
