"""Designed deviations of Newton's XPBD from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping

from adapters.law import Deviation, Law, Measure, Prediction, deviations, settings_of
from adapters.law.single_motions import rounded_motions, standstills
from adapters.law.single_precision import PLACES, Method, plane_law, rounded_law
from adapters.law.unswept import passing_law
from adapters.newton.profiles import PROFILES
from adapters.newton.shipped import ITERATIONS
from adapters.scene import Scene

CHECKED_ON = ("1.8.",)
#: Metrics of blows in free space, by scene, that a restitution after all sweeps decides alone.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "momentum_defect"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "closing_wall": ("speed[1]", "speed[2]", "speed[3]"),
    "flat_box": ("rebound_ratio",),
}


def _blow_law(metric: str, profile: str) -> Law:
    """`rounded_law`; none where two sweeps leave a fifth squared of an overlap as a velocity, without a rebound."""
    rounded = rounded_law(metric, Method(lambda e, speed: e, rebound_after_friction=True))

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        chosen = settings_of(PROFILES[profile], scene, dt)
        left = not chosen["rebounds"] and chosen["iterations"] <= ITERATIONS
        return None if left else rounded(scene, dt, measure)

    return law


DEVIATIONS: tuple[Deviation, ...] = deviations(
    "newton",
    PROFILES,
    BLOWS,
    _blow_law,
    "single precision, 2^-24 relative",
    "xpbd/restitution_kernels.py, built for floats; motion in adapters/law/single_precision.py",
    CHECKED_ON,
)
DEVIATIONS += deviations(
    "newton",
    ("default",),
    {"thin_wall": ("rebound_ratio", "beyond")},
    lambda metric, profile: passing_law(metric, PLACES),
    "there is no swept collision detection: a body farther than two gaps from a thin body at the start of a "
    "step, and beyond it at the end, passes through",
    "ModelBuilder.rigid_gap; motion in adapters/law/unswept.py",
    CHECKED_ON,
)
DEVIATIONS += standstills(
    "newton", PROFILES, {"far_origin": ("stopping_distance",)}, "xpbd/kernels.py, built for floats", CHECKED_ON
)
DEVIATIONS += rounded_motions(
    "newton",
    PROFILES,
    {
        "flown": {
            "flight": (
                *("fall", "fall_speed", "throw_speed", "throw_way", "heading_spread"),
                *("drift_across", "ball_spin", "momentum_drift"),
            )
        }
    },
    "xpbd/kernels.py, built for floats",
    CHECKED_ON,
)
#: A blow of a face in free space, after which the motion is planar to round-off.
DEVIATIONS += deviations(
    "newton",
    PROFILES,
    {"flat_box": ("out_of_plane",)},
    lambda metric, profile: plane_law,
    "single precision rounds differently on both sides of a plane",
    "xpbd/kernels.py, built for floats; band in adapters/law/single_precision.py",
    CHECKED_ON,
)
