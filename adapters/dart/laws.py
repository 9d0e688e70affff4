"""What DART does by design instead of the textbook, predicted from scene and step alone."""

from __future__ import annotations

from collections.abc import Mapping

from adapters.dart.profiles import PROFILES, solved
from adapters.dart.shipped import PUSH_OUT, Rebound
from adapters.law import Deviation, Law, Measure, Prediction, exactly
from adapters.scene import Scene
from adapters.single_precision import ROUNDINGS, Method, rounded_law
from adapters.unswept import passing_law

#: Metrics of blows in free space, by scene, that friction does not change.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "impulse", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "impulse", "momentum_defect"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "galperin": ("small_speed", "large_speed", "energy_defect"),
    "oblique": ("rebound_ratio",),
}


#: Speeds at which an overlap may be pushed out [m/s].
_PUSHES = (0.0, PUSH_OUT)


def blow_law(metric: str, profile: str) -> Law:
    """Blows in free space; what does not rebound is pushed out as far as it overlaps, at a speed of up to 1 mm/s."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        rough = any(friction > 0.0 for _, friction in scene.materials())
        unit = solved(profile, rough) / ROUNDINGS
        low, high = (rounded_law(metric, Method(Rebound(push), unit=unit))(scene, dt, measure) for push in _PUSHES)
        if low is None or high is None:
            return None
        return 0.5 * (low[0] + high[0]), 0.5 * abs(high[0] - low[0]) + low[1] + high[1]

    return law


DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation(
        "dart",
        (profile,),
        scene,
        exactly(metric),
        blow_law(metric, profile),
        "a contact gives way by 1e-5 of the speed that it is to change; no rebound is slower than 0.1 m/s or faster "
        "than 100 m/s; what overlaps is pushed out at up to 1 mm/s",
        "ContactConstraint, constraint force mixing; motion in adapters/single_precision.py",
        ("6.20.",),
    )
    for profile in PROFILES
    for scene, metrics in BLOWS.items()
    for metric in metrics
)


def wall_law(metric: str, profile: str) -> Law:
    """What no step finds in a thin wall passes it; what one finds rebounds as any other blow."""
    passing, blow = passing_law(metric), blow_law(metric, profile)

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        passed = passing(scene, dt, measure)
        return blow(scene, dt, measure) if passed is None else passed

    return law


DEVIATIONS += tuple(
    Deviation(
        "dart",
        (profile,),
        "thin_wall",
        metric,
        wall_law(metric, profile) if metric == "rebound_ratio" else passing_law(metric),
        "nothing is swept: what is on one side of a thin body where a step ends, and on the other where the next one "
        "does, passes; other blows give way by 1e-5",
        "measured with 6.20.0; motion in adapters/unswept.py and adapters/single_precision.py",
        ("6.20.",),
    )
    for profile in PROFILES
    for metric in ("rebound_ratio", "beyond")
)
