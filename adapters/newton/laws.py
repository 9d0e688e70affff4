"""What Newton's XPBD does by design instead of the textbook, predicted from scene and step alone.

The recurrence of its sweeps is ten times as long as a law is meant to be, and stays: it explains 1 097 rows of the
standard suite, of 32 scenes, 643 of balls and boxes among planes and 454 of columns. As findings they would be as many
lines, in some forty families, and hold at one step and for these parameters alone. And five families of what trembles,
sinks through, settles late or creeps have their proof from it: the same recurrence in doubles does not.
"""

from __future__ import annotations

from collections.abc import Mapping

from adapters.law import Deviation, exactly
from adapters.newton.hanging import hanging_law
from adapters.newton.motion import motion_law, swept_law
from adapters.newton.profiles import PROFILES
from adapters.single_precision import UNIT, Method, plane_law, rounded_law
from adapters.unswept import passing_law

_SWEPT = "overlaps and slips are taken back by a share in each sweep, and what a sweep leaves or adds is a velocity"
_REBOUNDS = "rebounds come after the sweeps, from approaches before them, without friction, and numbers are singles"
_WALLS = (
    "a wall along x leans by one rounding of its quaternion, 2^-24 rad, and each blow turns what meets in a line "
    "further from it; numbers are singles"
)
_ROLLS = "what rubs resists rolling and spinning as shipped, by 0.1 mm and 5 mm of its load; numbers are singles"
_ROCKS = f"{_SWEPT}; as shipped what rubs resists rolling as well"
_SPINS = _ROLLS + ", and a spin gains or loses what rounding leaves of its quaternion's size"
_DIGITS = "numbers are singles: an overlap of 0.1 mm has three digits, and a load is made of it"
_PAIRS = "a body gets the mean of what its contacts ask for, each of two another one: momentum is not kept"
_COLUMNS = (
    "a sweep gives a box the mean of what its contacts ask for, and tells of a face the mean of two boxes; what it "
    "leaves of an overlap is a velocity"
)
_STANDING = ("settle_time", "penetration", "kinetic_energy", "impulse_scatter")

#: Metrics by scene that the recurrence of the solver decides, and why they differ from the textbook. Scenes and metrics
#: were chosen at 1/240 s.
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

_ROUNDED = "numbers are singles: what they round is not the same on both sides of a balance"
#: Balances by scene: in doubles the recurrence makes nothing of them, or less than singles round.
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
    "numbers are singles; what sweeps leave below 0.1 mm/s is stopped, which no impulse tells: what overlaps ask for "
    "after it makes up for it, but for roundings of places"
)
#: Why by scene and metric; what is a balance in some cells alone keeps the reason of the others.
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

#: Round-off of a place after a thousand steps, as a share of the way.
PLACES = 1000.0 * UNIT
DEVIATIONS += tuple(
    Deviation(
        "newton",
        ("default",),
        "thin_wall",
        metric,
        passing_law(metric, PLACES),
        "nothing is swept: what is farther than two gaps from a thin body where a step begins, and beyond it where the "
        "step ends, passes",
        "ModelBuilder.rigid_gap; motion in adapters/unswept.py",
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
        "numbers are singles, 2^-24 of their size",
        "xpbd/restitution_kernels.py, built for floats; motion in adapters/single_precision.py",
        ("1.8.",),
    )
    for scene, metrics in (("closing_wall", ("speed[1]", "speed[2]", "speed[3]")),)
    for metric in metrics
)
_PLACES = (
    "places are singles: a step's way below half their spacing (6 cm at 1e6 m) is lost, so that nothing is found to "
    "overlap or to slip, while speeds go on growing"
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
#: Blows of edges and faces in free space, after which no more than roundings leave the plane.
DEVIATIONS += tuple(
    Deviation(
        "newton",
        tuple(PROFILES),
        scene,
        "out_of_plane",
        plane_law,
        "numbers are singles: what they round is not the same on both sides of a plane",
        "xpbd/kernels.py, built for floats; band in adapters/single_precision.py",
        ("1.8.",),
    )
    for scene in ("edge_drop", "flat_box", "kane")
)
