"""Designed deviations of Rapier from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping

from adapters.law import Deviation, exactly
from adapters.law.single_motions import rounded_motions, standstills
from adapters.law.single_precision import Method, rounded_law
from adapters.rapier.profiles import SUBSTEPS, TUNED_SUBSTEPS

#: Metrics of blows in free space, by scene, which neither friction nor rotation within the step changes.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "impulse", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "impulse", "momentum_defect"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "galperin": ("small_speed", "large_speed", "energy_defect"),
    "rod_gas": ("wrong_speed", "energy_defect"),
    "thin_wall": ("rebound_ratio",),
    "oblique": ("rebound_ratio", "sideways"),
    "closing_wall": ("speed[1]", "speed[2]", "speed[3]"),
    "pair_matrix": tuple(f"restitution[{k}]" for k in range(1, 5)),
}


def newton(e: float, speed: float) -> float:
    """Restitution at any speed of approach."""
    return e


DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation(
        "rapier",
        ("default", "tuned"),
        scene,
        exactly(metric),
        rounded_law(metric, Method(newton, rebound_after_friction=True)),
        "single precision, 2^-24 relative",
        "rapier3d, built for f32; motion in adapters/law/single_precision.py",
        ("0.36.",),
    )
    for scene, metrics in BLOWS.items()
    for metric in metrics
)
DEVIATIONS += standstills(
    "rapier", ("default", "tuned"), {"far_origin": ("stopping_distance",)}, "rapier3d, built for f32", ("0.36.",)
)
DEVIATIONS += rounded_motions(
    "rapier",
    ("default", "tuned"),
    {
        "kept": {"cradle": ("momentum_defect",), "rack": ("momentum_defect",)},
        "booked": {"off_centre": ("momentum_defect",)},
        "flown": {
            "flight": (
                *("fall", "fall_speed", "throw_speed", "throw_way", "heading_spread", "drift_across"),
                *("ball_spin", "momentum_drift"),
            )
        },
    },
    "rapier3d, built for f32",
    ("0.36.",),
    parts={"default": SUBSTEPS, "tuned": TUNED_SUBSTEPS},
)
