"""Designed deviations of Box3D from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from adapters.box3d.profiles import PROFILES, TUNED_SUBSTEPS
from adapters.box3d.shipped import CHECKED_ON, SUBSTEPS
from adapters.law import Deviation, deviations, settings_of
from adapters.law.single_motions import rounded_motions, standstills
from adapters.law.single_precision import late_rebound_law, plane_law

#: Metrics of blows in free space, by scene, which neither friction nor rotation within the step changes.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "spin", "energy_lost", "momentum_defect"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "rod_gas": ("wrong_speed", "energy_defect", "misplaced"),
    "thin_wall": ("rebound_ratio",),
    "oblique": ("rebound_ratio",),
    "closing_wall": ("speed[1]", "speed[2]", "speed[3]"),
}


DEVIATIONS: tuple[Deviation, ...] = deviations(
    "box3d",
    PROFILES,
    BLOWS,
    lambda metric, profile: late_rebound_law(metric, partial(settings_of, PROFILES[profile])),
    "single precision, 2^-24 relative; restitution is 0 below the threshold; friction is limited by the impulse "
    "of compression only, as restitution is applied last",
    "contact_solver.c, b3ApplyRestitution_Mesh; types.h, restitutionThreshold; adapters/law/single_precision.py",
    CHECKED_ON,
)
#: The same without blows at the threshold itself, which rounding decides, and where no ball turns within many substeps.
for _profile, _scene, _metrics in (
    ("default", "pair_matrix", tuple(f"restitution[{k}]" for k in range(1, 5))),
    ("tuned", "galperin", ("small_speed", "large_speed", "energy_defect")),
):
    DEVIATIONS += deviations(
        "box3d",
        (_profile,),
        {_scene: _metrics},
        lambda metric, profile: late_rebound_law(metric, partial(settings_of, PROFILES[profile])),
        "single precision, 2^-24 relative",
        "math_functions.h, b3Vec3: three floats; motion in adapters/law/single_precision.py",
        CHECKED_ON,
    )
DEVIATIONS += standstills(
    "box3d",
    PROFILES,
    {"far_origin": ("stopping_distance",)},
    "math_functions.h, b3Pos: three floats",
    CHECKED_ON,
    lambda profile: lambda scene, dt: (settings_of(PROFILES[profile], scene, dt)["units_per_metre"], 0.0),
)
#: Blows in free space, after which the motion is planar to round-off.
DEVIATIONS += deviations(
    "box3d",
    PROFILES,
    {scene: ("out_of_plane",) for scene in ("off_centre", "oblique", "pair_matrix")},
    lambda metric, profile: plane_law,
    "single precision rounds differently on both sides of a plane",
    "math_functions.h, b3Vec3: three floats; band in adapters/law/single_precision.py",
    CHECKED_ON,
)
DEVIATIONS += rounded_motions(
    "box3d",
    PROFILES,
    {
        "kept": {"cradle": ("momentum_defect",), "rack": ("momentum_defect",)},
        "booked": {"off_centre": ("momentum_defect",)},
        "flown": {"flight": ("fall_speed", "throw_speed", "throw_way", "heading_spread", "drift_across")},
    },
    "math_functions.h, b3Vec3: three floats",
    CHECKED_ON,
    parts={"default": SUBSTEPS, "tuned": TUNED_SUBSTEPS},
)
