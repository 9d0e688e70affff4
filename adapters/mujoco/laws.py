"""Contact laws of MuJoCo, as data: rows covered by each law of `adapters.mujoco.predictions`, and reasons."""

from __future__ import annotations

from adapters.law import AskedLaw, Deviation, Law, deviations, exactly
from adapters.law.unswept import passing_law, shoved_law
from adapters.mujoco.ball_on_face import rolling_law
from adapters.mujoco.belts import on_a_belt
from adapters.mujoco.plates import on_a_plate
from adapters.mujoco.predictions import ball_law, blow_law, column_asked, column_law, incline_law, stopping_law
from adapters.mujoco.profiles import PROFILES
from adapters.mujoco.shipped import CHECKED_ON

#: Profiles whose contacts are MuJoCo's own law.
SOFT = ("default", "tuned")
_BALL_METRICS = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "bounce": (
        *(f"apex[{n}]" for n in range(1, 6)),
        "apex_interval_ratio",
        "apex_growth",
        "rest_time",
        "force_in_flight",
    ),
}
_BECAUSE = {
    ("default", "ball"): "contact is a critically damped spring (0.02 s) that never pulls, and e is none of its "
    "parameters",
    ("default", "stack"): "contact is a soft spring (0.02 s): boxes sink in until it carries the weight above",
    ("default", "incline"): "friction is viscous and couples to the normal: boxes at rest creep, sliding boxes hop",
    ("tuned", "ball"): "the velocity is reversed in the step after contact: exact in speed, late by up to a step",
    ("tuned", "stack"): "impedance is relative to the mass of the light body: 1e-4 of the load above yields",
    ("tuned", "incline"): "friction couples to the normal: a sliding box hops, and the time window contains part of "
    "a hop",
    (
        "default",
        "slide",
    ): "friction is viscous and couples to the normal: a sliding box is thrown up and brakes unevenly",
    ("tuned", "slide"): "friction couples to the normal: a sliding box hops, and friction follows the load of its hops",
    ("default", "rolling"): "contact is a soft spring (0.02 s), and friction is viscous and couples to the normal: "
    "a ball sinks in, and a sliding one is thrown up",
    ("tuned", "rolling"): "the convex contact model couples friction and normal force: stopping the slip lifts the "
    "ball",
    ("default", "blow"): "contact is a critically damped spring (0.02 s) that never pulls, and e is none of its "
    "parameters",
    ("tuned", "blow"): "impedance ends at 0.9999 of an estimated inverse mass: off the centre, or at four corners, "
    "a blow is wrong by 1e-4",
}
#: Speeds and spins after bounces, accelerations and hops of balls.
_ROLLING = {
    "oblique": ("rebound_ratio", "forward_speed", "spin_speed"),
    "slide_to_roll": ("final_speed", "slip", "rolling_time", "rolling_place", "hop"),
    "roll_incline": ("acceleration", "turning", "hop"),
}
#: Beside the centre the shipped contact lasts so long that the bar turns under it, which is not predicted.
_BLOWS = (
    ("default", "head_on", ("rebound_ratio", "first_speed", "second_speed", "impulse")),
    ("default", "flat_box", ("rebound_ratio", "impulse")),
    ("tuned", "flat_box", ("rebound_ratio", "impulse")),
    ("tuned", "edge_drop", ("rise", "spin", "impulse")),
    ("tuned", "off_centre", ("ball_speed", "bar_speed", "spin", "impulse", "energy_lost")),
)
_SOURCE = "MuJoCo documentation, computation: constraint model; modeling: solver parameters, slow slippage"


def _deviation(
    profile: str, scene: str, metric: str, law: Law, because: str, asked: AskedLaw | None = None
) -> Deviation:
    return Deviation(
        "mujoco", (profile,), scene, exactly(metric), law, _BECAUSE[profile, because], _SOURCE, CHECKED_ON, asked
    )


DEVIATIONS: tuple[Deviation, ...] = (
    *(
        _deviation(profile, scene, metric, ball_law(profile, metric), "ball")
        for profile in SOFT
        for scene, metrics in _BALL_METRICS.items()
        for metric in metrics
    ),
    *(
        _deviation("default", "stack", metric, column_law("default", metric), "stack")
        for metric in ("penetration", "settle_time")
    ),
    *(
        _deviation(
            profile, "heavy_on_light", metric, column_law(profile, metric), "stack", column_asked(profile, metric)
        )
        for profile, metric in (("default", "penetration"), ("default", "settle_time"), ("tuned", "penetration"))
    ),
    *(
        _deviation(profile, scene, metric, blow_law(profile, metric), "blow")
        for profile, scene, metrics in _BLOWS
        for metric in metrics
    ),
    *(
        _deviation(profile, "slide", metric, stopping_law(profile, metric), "slide")
        for profile in SOFT
        for metric in ("stopping_distance", "braking", "hop", "turned")
    ),
    *(
        _deviation(profile, scene, metric, rolling_law(profile, metric), "rolling")
        for profile in SOFT
        for scene, metrics in _ROLLING.items()
        for metric in metrics
    ),
    *(
        _deviation(profile, "far_origin", metric, on_a_plate(stopping_law(profile, metric), metric), "slide")
        for profile in SOFT
        for metric in ("stopping_distance", "braking", "hop", "turned")
    ),
    *(
        _deviation(profile, "conveyor", metric, on_a_belt(profile, metric), "slide")
        for profile in SOFT
        for metric in ("slipped", "pull", "hop", "turned")
    ),
    *(
        _deviation(profile, "pressed_box", metric, incline_law(profile, metric), "incline")
        for profile in SOFT
        for metric in ("creep", "acceleration")
    ),
    *(
        _deviation(profile, "tilt_table", "acceleration", incline_law(profile, "acceleration"), "incline")
        for profile in SOFT
    ),
    _deviation("default", "incline", "creep", incline_law("default", "creep"), "incline"),
    *(
        _deviation(profile, "incline", "acceleration", incline_law(profile, "acceleration"), "incline")
        for profile in SOFT
    ),
)

DEVIATIONS += deviations(
    "mujoco",
    PROFILES,
    {"thin_wall": ("rebound_ratio", "beyond")},
    lambda metric, profile: passing_law(metric),
    "there is no swept collision detection: no step ends with the ball in the plate, so the contact is never found",
    "MuJoCo documentation, computation: collision detection at the start of a step",
    CHECKED_ON,
)

DEVIATIONS += tuple(
    Deviation(
        "mujoco",
        ("tuned", "matched"),
        "thin_wall",
        metric,
        shoved_law(metric),
        "there is no swept collision detection: the step that finds the ball in the plate finds it beyond the "
        "middle, and pushes it out on the far side",
        "MuJoCo documentation, computation: collision detection at the start of a step",
        CHECKED_ON,
    )
    for metric in ("rebound_ratio", "beyond")
)
