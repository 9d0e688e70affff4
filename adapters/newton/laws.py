"""Designed deviations of Newton's XPBD from the textbook, predicted from scene and step only.

The recurrence of its iterations is ten times as long as a usual law, but it explains 1 097 rows of the standard suite,
of 32 scenes: 643 of balls and boxes among planes and 454 of columns. As known failures they would need as many lines,
in some forty families, valid only at one step and for these parameters. It is also the proof of five families
(trembling, sinking through, late rest, creep): the same recurrence in double precision shows none of these.
"""

from __future__ import annotations

from collections.abc import Mapping

from adapters.law import Deviation, exactly
from adapters.law.single_precision import UNIT, Method, plane_law, rounded_law
from adapters.law.unswept import passing_law
from adapters.newton.hanging import hanging_law
from adapters.newton.motion import motion_law, swept_law
from adapters.newton.profiles import PROFILES

_SWEPT = "each iteration corrects a share of overlaps and slips, and its residual becomes a velocity"
_REBOUNDS = (
    "rebounds are solved after the iterations, from approach speeds before them, without friction, in single precision"
)
_WALLS = (
    "a wall along x is tilted by one rounding of its quaternion, 2^-24 rad, and each blow turns bodies in a line "
    "further from it; single precision"
)
_ROLLS = (
    "contacts with friction also resist rolling and spinning as shipped, by 0.1 mm and 5 mm times the load; "
    "single precision"
)
_ROCKS = f"{_SWEPT}; as shipped contacts with friction also resist rolling"
_SPINS = _ROLLS + ", and rounding of the quaternion's length changes a spin"
_DIGITS = "single precision resolves an overlap of 0.1 mm to three digits, and the load follows from it"
_PAIRS = (
    "a body moves by the mean of its contacts' corrections, which differs between the two bodies of a contact: "
    "momentum is not conserved"
)
_COLUMNS = (
    "an iteration moves a box by the mean of its contacts' corrections, and the reported impulse of a face is the "
    "mean of two boxes; the rest of an overlap becomes a velocity"
)
_STANDING = ("settle_time", "penetration", "kinetic_energy", "impulse_scatter")

#: Metrics by scene predicted by the solver's recurrence, and why they differ from the textbook. Scenes and metrics were
#: chosen at 1/240 s.
MOTIONS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "impact": (_SWEPT, ("rebound_ratio", "rebound_speed", "velocity_change", "impulse")),
    "bounce": (_REBOUNDS, (*(f"apex[{n}]" for n in range(1, 6)), "rest_time")),
    "head_on": (_REBOUNDS, ("rebound_ratio", "first_speed", "second_speed", "impulse")),
    "stacked_balls": (_REBOUNDS, ("small_speed", "large_speed", "energy_lost")),
    "cradle": (_PAIRS, ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6)))),
    "rack": (_PAIRS, ("momentum_defect", "energy_defect")),
    "flat_box": (_REBOUNDS, ("rebound_ratio", "edge_speed")),
    "edge_drop": (_REBOUNDS, ("rise", "spin")),
    "off_centre": (_REBOUNDS, ("ball_speed", "bar_speed", "spin", "energy_lost", "angular_defect")),
    "kane": (_REBOUNDS, ("rise", "ahead", "spin", "gain")),
    "galperin": (_WALLS, ("small_speed", "large_speed", "energy_defect")),
    "rod_gas": (_WALLS, ("astray", "energy_defect", "wrong_speed")),
    "oblique": (_REBOUNDS, ("rebound_ratio", "forward_speed", "spin_speed")),
    "incline": (_SWEPT, ("creep", "acceleration")),
    "slide": (_SWEPT, ("hop", "turned", "braking", "stopping_distance", "end_speed")),
    "rolling_spin": (_SPINS, ("spin", "speed", "astray")),
    "roll_incline": (_ROLLS, ("acceleration", "turning")),
    "masse": (_ROLLS, ("final_vx", "final_vy")),
    "slide_to_roll": (_ROLLS, ("final_speed",)),
    "tilt_table": (_SWEPT, ("moved", "edge_moved", "passing_spin", "passing_time", "turned")),
    "painleve": (_SWEPT, ("edge_moved", "lifted", "passing_spin", "passing_time")),
    "ladder": (_SWEPT, ("let_go", "passing_time", "moved", "wall_load", "floor_load")),
    "rocker": (_ROCKS, ("amplitude", "swing_time")),
    "rocking_block": (_SWEPT, tuple(f"{metric}[{n}]" for metric in ("amplitude", "landing") for n in range(1, 4))),
    "starved": (_SWEPT, ("displacement", "load_error", "penetration", "kinetic_energy")),
    "pivot": (_SWEPT, ("edge_moved", "passing_time")),
    "position_correction": (_SWEPT, ("launched",)),
    "overlap": (_SWEPT, ("thrown",)),
    "pressed_box": (_SWEPT, ("creep", "acceleration")),
    "v_groove": (_DIGITS, ("load[left]", "load[right]")),
    "stack": (_COLUMNS, (*_STANDING, *(f"interface_impulse[{k}]" for k in range(1, 21)))),
    "heavy_on_light": (_COLUMNS, (*_STANDING, "interface_impulse[1]", "interface_impulse[2]")),
}

_ROUNDED = "single precision rounds differently on both sides of a balance"
#: Balances by scene: in double precision the recurrence gives 0, or less than the round-off of single precision.
BALANCES: Mapping[str, tuple[str, ...]] = {
    "impact": ("momentum_defect",),
    "head_on": ("momentum_defect",),
    "stacked_balls": ("energy_lost",),
    "rack": ("asymmetry",),
    "edge_drop": ("twisted",),
    "off_centre": ("momentum_defect", "energy_lost"),
    "galperin": ("energy_defect",),
    "rod_gas": ("energy_defect", "wrong_speed"),
    "oblique": ("sideways",),
    "overlap": ("centre_moved",),
}
_STOPS = (
    "single precision; velocities below 0.1 mm/s are set to 0 without a reported impulse, which later overlap "
    "corrections make up for, except for rounding of positions"
)
#: Reasons by scene and metric; a metric that is a balance in some cells only has the reason of the others.
_DECIDED = {(scene, metric): _ROUNDED for scene, metrics in BALANCES.items() for metric in metrics}
_DECIDED[("impact", "momentum_defect")] = _STOPS
_DECIDED |= {(scene, metric): because for scene, (because, metrics) in MOTIONS.items() for metric in metrics}

DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation(
        "newton",
        (profile,),
        scene,
        exactly(metric),
        motion_law(metric, profile, metric in BALANCES.get(scene, ())),
        because,
        "xpbd/kernels.py, xpbd/restitution_kernels.py; recurrence in adapters/newton/motion.py"
        + (", column.py" if because is _COLUMNS else ""),
        ("1.8.",),
        swept_law(metric, profile, metric in BALANCES.get(scene, ())),
    )
    for profile in PROFILES
    for (scene, metric), because in _DECIDED.items()
)

#: Round-off of a place after a thousand steps, as a share of the distance.
PLACES = 1000.0 * UNIT
DEVIATIONS += tuple(
    Deviation(
        "newton",
        ("default",),
        "thin_wall",
        metric,
        passing_law(metric, PLACES),
        "there is no swept collision detection: a body farther than two gaps from a thin body at the start of a "
        "step, and beyond it at the end, passes through",
        "ModelBuilder.rigid_gap; motion in adapters/law/unswept.py",
        ("1.8.",),
    )
    for metric in ("rebound_ratio", "beyond")
)
DEVIATIONS += tuple(
    Deviation(
        "newton",
        tuple(PROFILES),
        scene,
        exactly(metric),
        rounded_law(metric, Method(lambda e, speed: e)),
        "single precision, 2^-24 relative",
        "xpbd/restitution_kernels.py, built for floats; motion in adapters/law/single_precision.py",
        ("1.8.",),
    )
    for scene, metrics in (("closing_wall", ("speed[1]", "speed[2]", "speed[3]")),)
    for metric in metrics
)
_PLACES = (
    "positions are in single precision: motion of a step below half their spacing (6 cm at 1e6 m) is lost, so no "
    "overlap or slip is found while speeds grow"
)
DEVIATIONS += tuple(
    Deviation(
        "newton",
        tuple(PROFILES),
        "far_origin",
        metric,
        hanging_law(metric),
        _PLACES,
        "xpbd/kernels.py, built for floats; motion in adapters/newton/hanging.py",
        ("1.8.",),
    )
    for metric in ("stopping_distance", "braking", "end_speed")
)
#: Blows of edges and faces in free space, after which the motion is planar to round-off.
DEVIATIONS += tuple(
    Deviation(
        "newton",
        tuple(PROFILES),
        scene,
        "out_of_plane",
        plane_law,
        "single precision rounds differently on both sides of a plane",
        "xpbd/kernels.py, built for floats; band in adapters/law/single_precision.py",
        ("1.8.",),
    )
    for scene in ("edge_drop", "flat_box", "kane")
)
