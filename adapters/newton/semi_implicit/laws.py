"""Designed deviations of Newton's semi-implicit solver from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping

from adapters.law import Deviation, deviations, settings_of
from adapters.law.moved_starts import law_of_motions
from adapters.law.single_motions import standstills
from adapters.newton.semi_implicit.motion import motions
from adapters.newton.semi_implicit.profiles import PROFILES

#: Metrics by scene: balls and boxes on planes, where round-off does not decide on the motion.
ROWS: Mapping[str, str] = {
    "impact": "rebound_ratio rebound_speed velocity_change",
    "bounce": "apex[1] apex[2] apex[3] apex[4] apex[5] apex_interval_ratio rest_time",
    "head_on": "rebound_ratio first_speed second_speed momentum_defect",
    "off_centre": "ball_speed bar_speed spin energy_lost angular_defect",
    "flat_box": "rebound_ratio",
    "stacked_balls": "small_speed large_speed energy_lost",
    "cradle": "momentum_defect energy_defect speed[1] speed[2] speed[3] speed[4] speed[5]",
    "v_groove": "displacement",
    "slide_to_roll": "final_speed slip hop rolling_time rolling_place",
    "oblique": "rebound_ratio spin_speed forward_speed sideways",
    "roll_incline": "acceleration turning hop",
    "rolling_spin": "hop",
    "masse": "final_vx final_vy end_x end_y turned hop",
    "pivot": "passing_time edge_moved",
    "tumble": "flip_time momentum_drift energy_drift",
    "flight": "fall fall_speed throw_speed throw_way heading_spread drift_across ball_spin momentum_drift flip_time "
    "energy_drift",
    "rocker": "swing_time amplitude slip",
    "hilltop": "level_speed leaving_angle leaving_time",
    "thin_wall": "rebound_ratio beyond",
    "ladder": "passing_time let_go",
    "overlap": "thrown centre_moved",
    "position_correction": "launched",
    "closing_wall": "speed[1] speed[2] speed[3] time[1]",
    "rod_gas": "misplaced wrong_speed energy_defect astray",
    "rack": "momentum_defect energy_defect asymmetry",
    "edge_drop": "rise spin",
    "kane": "rise ahead spin gain",
    "painleve": "edge_moved lifted",
    "starved": "displacement penetration kinetic_energy",
}


DEVIATIONS: tuple[Deviation, ...] = deviations(
    "newton_semi_implicit",
    PROFILES,
    {scene: metrics.split() for scene, metrics in ROWS.items()},
    law_of_motions(lambda scene, dt, profile: motions(scene, dt, settings_of(PROFILES[profile], scene, dt))),
    "contacts are springs of 2.5 kN/m with dampers of 100 N s/m, in explicit steps, whatever the mass and e; friction "
    "is a damper of 1 kN s/m up to its cone; spins are damped; places are in single precision",
    "semi_implicit/kernels_contact.py, _eval_body_contact; motion in adapters/newton/semi_implicit/motion.py",
    ("1.8.",),
)
DEVIATIONS += standstills(
    "newton_semi_implicit", PROFILES, {"far_origin": ("stopping_distance",)}, "warp arrays of floats", ("1.8.",)
)
