"""Experiments on Box2D 3.1."""

from __future__ import annotations

from typing import Any

from adapters.experiment import Experiment

CANDIDATES: dict[str, tuple[Any, ...]] = {
    "substeps": (4, 8, 16, 32),
    "hertz": (30.0, 120.0, 240.0, 480.0, 1920.0),
    "damping_ratio": (1.0, 2.0, 10.0, 50.0),
    "push_speed": (0.3, 3.0),
    "restitution_threshold": (0.0, 0.01, 1.0),
    "continuous": (False, True),
    "units_per_metre": (1.0, 16.0, 64.0),
}

#: As stiff as eight small steps of 1/240 s resolve, and so damped that single roundings are not thrown back.
_STIFF: dict[str, Any] = {"substeps": 8, "hertz": 480.0, "damping_ratio": 2000.0}
_MORE_STEPS: dict[str, Any] = {"substeps": 8}

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    Experiment(
        f"{scene.replace('_', '-')}-soft-contact",
        "with stiff contacts the row passes; more small steps and a faster push do not help",
        "default",
        scene,
        metric,
        off,
        params,
        idle=({"substeps": off["substeps"]}, {"push_speed": 30.0}),
    )
    for scene, metric, params, off in (
        ("stack", "penetration", {"n": 2.0}, _STIFF),
        ("stack", "settle_time", {"n": 2.0}, _STIFF),
        ("overhang", "penetration", {}, _STIFF),
        ("overhang", "drift", {}, _STIFF),
        ("pyramid", "penetration", {"rows": 5.0}, _STIFF),
        ("pyramid", "settle_time", {"rows": 5.0}, _STIFF),
        ("heavy_on_light", "penetration", {}, {"substeps": 64, "hertz": 3840.0}),
    )
)

EXPERIMENTS += tuple(
    Experiment(
        f"{scene.replace('_', '-')}-turning-point",
        "with one small step a step, which finds its contacts anew, it passes; stiffer contacts do not help",
        profile,
        scene,
        metric,
        {"substeps": 1},
        params,
        idle=({"hertz": 240.0}, {"damping_ratio": 1.0}),
    )
    for profile, scene, metric, params in (
        ("default", "rocker", "amplitude", {}),
        ("tuned", "rocker", "amplitude", {"tilt": 5.0}),
        ("default", "roll_incline", "turning", {}),
        ("default", "roll_incline", "acceleration", {}),
    )
)

EXPERIMENTS += (
    *(
        Experiment(
            "seam-seen-ahead",
            "in a finer unit the length of 2 cm is 0.3 mm, and the box slides over the seam; more small steps, stiffer "
            "contacts and no sweeping do not help",
            "default",
            "seam",
            metric,
            {"units_per_metre": 64.0, **_STIFF},
            idle=(_STIFF, {"continuous": False}),
        )
        for metric in ("stopping_distance", "hop")
    ),
    Experiment(
        "stack-singles-in-stiff-contact",
        "with another damping this column rests; a faster push does nothing",
        "tuned",
        "stack",
        "settle_time",
        {"damping_ratio": 200.0},
        idle=({"push_speed": 30.0}, {"restitution_threshold": 1.0}),
    ),
    *(
        Experiment(
            "cradle-stopped-in-small-steps",
            "with one small step a step the balls rebound before anything else is stopped; stiffer contacts do nothing",
            profile,
            "cradle",
            "energy_defect",
            {"substeps": 1},
            {"n": 3.0, "apart": 0.0},
            idle=({"hertz": 3840.0, "substeps": 64}, {"damping_ratio": 1.0}),
        )
        for profile in ("default", "tuned")
    ),
    Experiment(
        "cradle-singles",
        "with one small step there is one impulse to round, and it is exact; the energy that is lost is another matter",
        "tuned",
        "cradle",
        "momentum_defect",
        {"substeps": 1},
        {"n": 3.0, "apart": 0.0},
        idle=({"substeps": 2},),
    ),
    Experiment(
        "flat-box-rebound-by-points",
        "where nothing rebounds the box is turned by a hundredth as much; more small steps do not help",
        "tuned",
        "flat_box",
        "edge_speed",
        {"restitution_threshold": 1000.0},
        idle=({"substeps": 64, "hertz": 3840.0}, {"damping_ratio": 10.0}),
        within=1e-2,
    ),
    *(
        Experiment(
            "overlap-pushed-in-singles",
            "where nothing is pushed out, nothing moves, to the last bit; more small steps do nothing",
            "tuned",
            "overlap",
            metric,
            {"push_speed": 0.0},
            idle=({"substeps": 64}, {"damping_ratio": 10.0}),
        )
        for metric in ("thrown", "centre_moved")
    ),
    Experiment(
        "position-correction-damped",
        "with less damping the box comes out evenly; a slower push does nothing",
        "tuned",
        "position_correction",
        "drift",
        {"damping_ratio": 50.0},
        idle=({"push_speed": 0.3},),
    ),
)

EXPERIMENTS += tuple(
    Experiment(
        "rack-rebound-once",
        "where nothing rebounds left and right differ by less than a hundredth; other springs or no sweeping ahead do "
        "not help. 64 small steps move it to either side: to 0.005 as shipped, to 0.13 in tuned",
        profile,
        "rack",
        "asymmetry",
        {"restitution_threshold": 1000.0},
        idle=({"hertz": 240.0}, {"continuous": False}),
        within=1e-2,
    )
    for profile in ("default", "tuned")
)

EXPERIMENTS += (
    *(
        Experiment(
            "rod-gas-threshold",
            "without a threshold every blow rebounds; other springs or no sweeping ahead do not help",
            "default",
            "rod_gas",
            metric,
            {"restitution_threshold": 0.0},
            idle=({"hertz": 240.0}, {"continuous": False}),
            within=1e-6,
        )
        for metric in ("misplaced", "wrong_speed", "energy_defect")
    ),
    *(
        Experiment(
            "starved-soft-contact",
            "with stiff contacts the row stays where it is; more small steps or a finer unit do not help",
            "default",
            "starved",
            metric,
            _STIFF,
            idle=(_MORE_STEPS, {"units_per_metre": 64.0}),
            dt=dt,
        )
        for metric, dt in (("displacement", None), ("penetration", None), ("kinetic_energy", 1.0 / 960.0))
    ),
    *(
        Experiment(
            "off-centre-seen-ahead",
            "at a finer unit, where 2 cm are .3 mm, the blow is found within a step; stiffer contacts do not help",
            "default",
            "off_centre",
            metric,
            {"units_per_metre": 64.0},
            {"whirl": -2.0},
            idle=({"hertz": 480.0}, {"continuous": False}),
            dt=1.0 / 480.0,
        )
        for metric in ("ball_speed", "bar_speed", "spin", "energy_lost", "sideways")
    ),
    Experiment(
        "starved-few-small-steps",
        "with 64 small steps no ball overlaps; a finer unit or a faster push do not help, one small step is worse",
        "tuned",
        "starved",
        "penetration",
        {"substeps": 64},
        {"n": 30.0},
        idle=({"units_per_metre": 64.0}, {"push_speed": 30.0}, {"substeps": 1}),
        dt=1.0 / 960.0,
    ),
)
